//! The program `faircurve`: fits fair curves to files full of points.

use std::process::ExitCode;

fn main() -> ExitCode {
    faircurve::cli::run(std::env::args_os()).into()
}
