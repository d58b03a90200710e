//! The program `faircurve`.

fn main() {}
