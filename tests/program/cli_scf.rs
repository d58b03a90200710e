//! `faircurve fit --method scf` as its users meet it.

use std::fs;

use super::ran::{self, folder, run};
use predicates::prelude::*;
use predicates::str::contains;
use serde_json::Value;
use tempfile::TempDir;

/// Open, of reference cost 4.763872659 for ν = 4, 3.60575449971 for ν = 2; then three dots in a
/// line.
const TWO: &str = "curve,x,y\na,0,0\na,1,0.6\na,2.1,0.1\na,3,0.9\nb,0,5\nb,2,5\nb,3,5\n";

/// Another exponent on the middle span, and a tangent at the third dot.
const HELD: &str = "curve,x,y,nu,tx,ty\na,0,0,,,\na,1,0.6,4,,\na,2.1,0.1,,2,0\na,3,0.9,,,\n";

/// Turns back on itself twice: no curve of least bending.
const HAIRPIN: &str = "curve,x,y\na,0,0\na,1,0.6\na,2.1,0.1\na,3,0.9\nc,0,0\nc,1,0\nc,0,0.01\nc,1,0.02\n";

/// Fits on the CPU, and reads the report.
fn fit(folder: &TempDir, arguments: &str) -> Value {
    run(folder, &format!("fit in.csv -o out.csv --method scf --device cpu --force --report report.json {arguments}"));
    serde_json::from_str(&fs::read_to_string(folder.path().join("report.json")).unwrap()).unwrap()
}

fn number(line: &Value, field: &str) -> f64 {
    line[field].as_f64().unwrap_or_else(|| panic!("{field} in {line}"))
}

fn refused(text: &str, arguments: &str, sentence: &str) {
    ran::refused(&folder(text), &format!("fit in.csv -o out.csv {arguments}"), sentence);
}

#[test]
fn the_report_holds_the_cost_in_units_of_the_input_for_the_exponent_asked_for() {
    let folder = folder(TWO);
    let report = fit(&folder, "");
    assert_eq!(report["method"], "scf");
    let [bent, straight] = [&report["curves"][0], &report["curves"][1]];
    assert_eq!((bent["status"].as_str(), straight["status"].as_str()), (Some("converged"), Some("converged")));
    assert!((number(bent, "energy") - 3.605_754_499_7).abs() < 1e-9, "{bent}");
    assert_eq!((number(straight, "energy"), number(straight, "length")), (0.0, 3.0));
    assert_eq!((number(bent, "points_in"), number(bent, "points_out")), (4.0, 49.0));
    let report = fit(&folder, "--exponent 4 --samples 4");
    let bent = &report["curves"][0];
    assert!((number(bent, "energy") - 4.763_872_659).abs() < 1e-8, "{bent}");
    assert_eq!(number(bent, "points_out"), 13.0);
    let text = fs::read_to_string(folder.path().join("out.csv")).unwrap();
    for point in ["a,0,0,0", "a,1,0.6,", "a,2.1,0.1,", "a,3,0.9,", "b,3,5,3"] {
        assert!(text.lines().any(|line| line.starts_with(point)), "{point} in {text}");
    }
}

#[test]
fn a_column_nu_sets_the_exponent_span_by_span_and_tangents_are_kept() {
    let free = number(&fit(&folder(TWO), "")["curves"][0], "energy");
    let report = fit(&folder(HELD), "--as bezier --to csv");
    let held = &report["curves"][0];
    assert_eq!(held["status"], "converged");
    assert!((number(held, "energy") - free).abs() > 0.05, "{held}");
    refused("curve,x,y,nu\na,0,0,1\na,1,1,\na,2,0,\n", "--method natural", "column nu");
    let folder = folder("curve,x,y,nu\na,0,0,0.5\na,1,1,\na,2,0,\n");
    let report = fit(&folder, "");
    assert_eq!(report["curves"][0]["status"], "invalid");
    run(&folder, "fit in.csv -o out.csv --method scf --force")
        .code(1)
        .stderr(contains("the exponent nu is 0.5; it must be above 1"));
}

#[test]
fn what_has_no_minimiser_says_so_and_leaves_its_neighbours_alone() {
    let folder = folder(HAIRPIN);
    let report = fit(&folder, "");
    assert_eq!(report["curves"][0]["status"], "converged");
    assert_eq!(report["curves"][1]["status"], "no_minimiser");
    assert!((number(&report["curves"][0], "energy") - 3.605_754_499_7).abs() < 1e-9);
    run(&folder, "fit in.csv -o out.csv --method scf --force")
        .code(1)
        .stderr(contains("no_minimiser").and(contains("curve c")));
}

#[test]
fn options_that_make_no_sense_are_refused_with_a_sentence() {
    refused(TWO, "--method scf --exponent 1", "the exponent is 1; it must be above 1, such as 2");
    refused(TWO, "--method scf --convergence 0", "--convergence is 0; it must be a positive number, such as 1e-8");
    refused(TWO, "--method scf --starts 0", "0 starts: at least 1 is needed");
    refused(TWO, "--method scf --solver sobolev", "smooth connection functions are found by --solver newton");
    refused(
        TWO,
        "--method scf --deviation 0.1",
        "--deviation 0.1 belongs to --method smoothing; smooth connection functions go through every point",
    );
    refused(
        TWO,
        "--method scf --pin none",
        "--pin none belongs to --method smoothing; smooth connection functions go through every point",
    );
    refused(TWO, "--method scf --energy bending=1", "--energy belongs to --method fair");
    refused(TWO, "--method natural --starts 3", "--starts belongs to --method fair and --method scf");
    refused("curve,x,y,z\na,0,0,0\na,1,1,1\na,2,0,0\n", "--method scf", "smooth connection functions are planar");
}

#[test]
fn more_starts_are_never_worse() {
    let folder = folder(TWO);
    let [one, many] = ["", "--starts 9"]
        .map(|starts| number(&fit(&folder, &format!("--exponent 20 {starts}"))["curves"][0], "energy"));
    assert!(many <= one * (1.0 + 1e-12), "{many} {one}");
}

#[test]
fn compare_finds_the_cpu_to_be_itself() {
    run(&folder(TWO), "compare in.csv --method scf --device cpu")
        .code(0)
        .stdout(contains("pass").and(contains("energies differ by 0")));
}
