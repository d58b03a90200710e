//! Computes the sparse Laplacian rules of all supports: solves their linear programmes, takes of
//! all solutions the one nearest to the exact rule, and prints unknowns and optima.
//!
//! usage: `sparse_rules [FOLDER]`: with a folder, writes the masks there, as
//! `src/laplacian/rule/{constants,linear}.rs` have them

#[path = "../tests/papers/programmes.rs"]
mod programmes;

use std::fmt::Write;
use std::path::Path;

use faircurve::laplacian::Reproduces;
use faircurve_papers::programmes::Class;
use programmes::{programme, solved};

const HEAD: &str = "\
//! The masks of the sparse rules that reproduce REPRODUCED, computed by
//! `cargo run --release -p faircurve-papers --example sparse_rules -- src/laplacian/rule`.
//!
//! The masks are found class after class. An interior-point method (Clarabel) solves the linear
//! programme of `papers/src/programmes`. Many masks leave ‖E₂ₙS − UEₙ‖∞ within 1e-8 of the least so
//! far. Those nearest to the exact rule in least squares are taken, and moved onto the constraints
//! to rounding. Entries stand in the order of `Unknowns::of_class`.

use super::Table;
";

fn written(support: usize, reproduces: Reproduces, entries: &[f64]) -> String {
    let programme = programme(support, reproduces);
    let mut text = format!("\n#[rustfmt::skip]\npub(super) const SUPPORT_{support}: Table = Table {{\n");
    writeln!(text, "    residual: {:?},", Class::ALL.map(|class| programme.maximum(class, entries))).unwrap();
    writeln!(text, "    entries: &[").unwrap();
    let mut first = 0;
    for class in Class::ALL {
        let last = programme.known_after(class);
        for line in entries[first..last].chunks(5) {
            let line: Vec<String> = line.iter().map(|x| format!("{x:?}")).collect();
            writeln!(text, "        {},", line.join(", ")).unwrap();
        }
        first = last;
    }
    text + "    ],\n};\n"
}

fn main() {
    println!("| support | reproduces | unknowns | interior | and border | and corner |\n|---|---|---|---|---|---|");
    for (reproduces, file, words) in
        [(Reproduces::Constants, "constants.rs", "constants"), (Reproduces::Linear, "linear.rs", "linear functions")]
    {
        let mut tables = HEAD.replace("REPRODUCED", words);
        for support in [3, 5, 7, 9, 11] {
            let programme = programme(support, reproduces);
            let entries = solved(&programme);
            let [interior, border, corner] = Class::ALL.map(|class| programme.maximum(class, &entries));
            let unknowns = entries.len();
            println!("| {support} | {reproduces:?} | {unknowns} | {interior:.9} | {border:.9} | {corner:.9} |");
            tables += &written(support, reproduces, &entries);
        }
        if let Some(folder) = std::env::args().nth(1) {
            let file = Path::new(&folder).join(file);
            std::fs::write(&file, tables).unwrap_or_else(|error| panic!("cannot write {}: {error}", file.display()));
            println!("written to {}", file.display());
        }
    }
}
