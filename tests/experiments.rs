//! `faircurve experiments`: its files, its exit codes, and that its tables agree with the papers.

use std::fs;

use assert_cmd::assert::Assert;
use assert_cmd::cargo::cargo_bin_cmd;
use predicates::prelude::*;
use predicates::str::{contains, is_empty};
use tempfile::TempDir;

/// Runs the program in the folder; arguments are separated by blanks.
fn run(folder: &TempDir, arguments: &str) -> Assert {
    cargo_bin_cmd!("faircurve").current_dir(folder).args(arguments.split_whitespace()).assert()
}

#[test]
fn toms828_reproduces_all_58_iterations_and_draws_every_data_set() {
    let folder = TempDir::new().unwrap();
    run(&folder, "experiments toms828 -o made/here")
        .code(0)
        .stderr(is_empty())
        .stdout(contains("58 of 58 published iterations compared").and(contains("converged after")))
        .stdout(predicate::function(|text: &str| text.matches("continued: unbounded after").count() == 2));
    let read = |name: &str| fs::read_to_string(folder.path().join("made/here").join(name)).unwrap();
    assert!(read("toms828.txt").contains("58 of 58"));
    let csv = read("toms828.csv");
    let mut rows = csv.lines();
    assert_eq!(
        rows.next().unwrap(),
        "set,iteration,phi,published_phi,phi_difference,step,published_step,step_difference"
    );
    let mut count = 0;
    for row in rows {
        let row: Vec<f64> = row.split(',').map(|field| field.parse().unwrap()).collect();
        let [_, _, ours, published, difference, ..] = row[..] else { panic!("{row:?}") };
        assert!((ours / published - 1.0).abs() < 1e-6 && difference < 1e-6, "{row:?}");
        count += 1;
    }
    assert_eq!(count, 58);
    for set in 1..=5 {
        let svg = read(&format!("toms828-{set}.svg"));
        let picture = roxmltree::Document::parse(&svg).unwrap();
        let curves = picture.descendants().filter(|node| node.attribute("class") == Some("e")).count();
        assert!(curves >= 5 && svg.contains(&format!("TOMS 828, data set {set}")), "{set}: {curves} curves");
    }
    assert_eq!(fs::read_dir(folder.path().join("made/here")).unwrap().count(), 7);
}

#[test]
fn outputs_that_exist_are_kept_unless_forced() {
    let folder = TempDir::new().unwrap();
    let old = folder.path().join("toms828-3.svg");
    fs::write(&old, "precious").unwrap();
    run(&folder, "experiments toms828 -o .")
        .code(2)
        .stdout(is_empty())
        .stderr(contains("toms828-3.svg exists already: give --force to replace it"));
    assert_eq!(fs::read_to_string(&old).unwrap(), "precious");
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "nothing is written before everything is checked");
    // Without a name: all experiments.
    run(&folder, "experiments -o . --force").code(0).stdout(contains("TOMS 828"));
    assert!(fs::read_to_string(&old).unwrap().starts_with("<svg"));
}

#[test]
fn an_unknown_experiment_is_refused_with_the_names_there_are() {
    let folder = TempDir::new().unwrap();
    run(&folder, "experiments toms829 -o .")
        .code(2)
        .stderr(contains("toms829").and(contains("possible values: ")).and(contains("toms828")));
    run(&folder, "experiments").code(2).stderr(contains("--output"));
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
}

#[test]
fn a_folder_that_cannot_be_made_is_an_error() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    run(&folder, "experiments toms828 -o file/deep").code(2).stderr(contains("cannot write file/deep"));
}
