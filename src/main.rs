//! The program `faircurve`: fits fair curves to files full of points.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
