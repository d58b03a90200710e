//! The program in a folder of its own, as its users run it.

use std::fs;

use assert_cmd::assert::Assert;
use assert_cmd::cargo::cargo_bin_cmd;
use predicates::prelude::*;
use predicates::str::{contains, is_empty, starts_with};
use tempfile::TempDir;

/// A folder with `in.csv`, which holds `text`.
pub fn folder(text: &str) -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("in.csv"), text).unwrap();
    folder
}

/// Runs the program in the folder; arguments are separated by blanks.
pub fn run(folder: &TempDir, arguments: &str) -> Assert {
    cargo_bin_cmd!("faircurve").current_dir(folder).args(arguments.split_whitespace()).assert()
}

/// Runs with an error expected: exit code 2, nothing on stdout, and this in the one sentence on
/// stderr.
pub fn refused(folder: &TempDir, arguments: &str, sentence: &str) {
    let one_line = predicate::function(|text: &str| text.lines().count() == 1);
    run(folder, arguments)
        .code(2)
        .stdout(is_empty())
        .stderr(starts_with("faircurve: ").and(contains(sentence)).and(one_line));
}
