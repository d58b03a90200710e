//! `faircurve fit --method fair` as its users meet it.

use std::fs;

use super::ran::{self, folder, run};
use assert_cmd::assert::Assert;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::{contains, is_empty};
use serde_json::Value;
use tempfile::TempDir;

const TWO: &str = "curve,x,y\na,0,0\na,1,2\na,3,1\nb,0,5\nb,2,6\nb,3,4\nb,5,5\n";

/// A tangent in the middle of the first curve, with a curvature; one at the start of the second.
const HELD: &str = "curve,x,y,tx,ty,kx,ky\na,0,0,,,,\na,1,2,1,0,0,-1.5\na,3,1,,,,\nb,0,5,1,1,,\nb,2,6,,,,\nb,3,4,,,,\n";

/// Runs `fit in.csv --method fair` on the CPU; arguments are separated by blanks.
fn fair(folder: &TempDir, arguments: &str) -> Assert {
    run(folder, &format!("fit in.csv --method fair --device cpu --force {arguments}"))
}

/// Runs with an error expected: exit code 2, nothing on stdout, and this in the one sentence on
/// stderr.
fn refused(arguments: &str, sentence: &str) {
    ran::refused(&folder(TWO), &format!("fit in.csv -o out.csv {arguments}"), sentence);
}

/// Runs with a value that the argument parser refuses: exit code 2, and this among the lines on
/// stderr.
fn misread(arguments: &str, sentence: &str) {
    run(&folder(TWO), &format!("fit in.csv -o out.csv --method fair {arguments}"))
        .code(2)
        .stdout(is_empty())
        .stderr(contains(sentence));
}

/// The points of a curve in `out.csv`.
fn points(folder: &TempDir, curve: &str) -> Vec<[f64; 2]> {
    let text = fs::read_to_string(folder.path().join("out.csv")).unwrap();
    let of_curve = text.lines().filter(|line| line.split(',').next() == Some(curve));
    let number = |cell: Option<&str>| cell.unwrap().parse().unwrap();
    of_curve
        .map(|line| {
            let mut cells = line.split(',').skip(1);
            [number(cells.next()), number(cells.next())]
        })
        .collect()
}

/// The report's line of a curve, after a run that writes it.
fn report(folder: &TempDir, curve: usize, arguments: &str) -> Value {
    fair(folder, &format!("-o out.csv --report report.json {arguments}"));
    let text = fs::read_to_string(folder.path().join("report.json")).unwrap();
    let report: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(report["method"], "fair");
    report["curves"][curve].clone()
}

fn number(line: &Value, field: &str) -> f64 {
    line[field].as_f64().unwrap_or_else(|| panic!("{field} in {line}"))
}

#[test]
fn fair_curves_pass_through_their_points_and_report_what_they_cost() {
    let folder = folder(TWO);
    let line = report(&folder, 1, "--energy bending=1,length=1 --samples 8");
    assert_eq!(line["status"], "converged");
    assert_eq!((&line["points_in"], &line["points_out"]), (&4.into(), &25.into()));
    assert!(number(&line, "energy") > number(&line, "length") && number(&line, "length") > 6.0, "{line}");
    assert!((2.0..40.0).contains(&number(&line, "iterations")), "{line}");
    assert!(number(&line, "gradient_norm") <= 1e-8, "{line}");
    assert_eq!(number(&line, "max_deviation"), 0.0);
    let found = points(&folder, "b");
    assert_eq!([0, 8, 16, 24].map(|k| found[k]), [[0.0, 5.0], [2.0, 6.0], [3.0, 4.0], [5.0, 5.0]]);
}

#[test]
fn tangents_and_curvatures_are_columns_of_the_file() {
    let folder = folder(HELD);
    let line = report(&folder, 0, "--energy variation=1,length=1 --write tangent,curvature");
    assert_eq!(line["status"], "converged", "{line}");
    let text = std::fs::read_to_string(folder.path().join("out.csv")).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let rows: Vec<Vec<&str>> = lines.collect();
    let value = |curve: &str, row: usize, name: &str| -> f64 {
        let column = header.iter().position(|own| *own == name).unwrap();
        rows.iter().filter(|own| own[0] == curve).nth(row).unwrap()[column].parse().unwrap()
    };
    let all = ["tangent_x", "tangent_y", "curvature"].map(|name| value("a", 16, name));
    assert!(all.iter().zip([1.0, 0.0, -1.5]).all(|(x, wanted)| (x - wanted).abs() <= 1e-12), "{all:?}");
    let start = ["tangent_x", "tangent_y"].map(|name| value("b", 0, name));
    assert!((start[0] - start[1]).abs() <= 1e-14 && start[0] > 0.0, "{start:?}");
}

#[test]
fn energies_exponents_solvers_and_limits_are_heard() {
    let folder = folder(TWO);
    let default = report(&folder, 0, "");
    let limits = "--solver newton --convergence 1e-8 --max-iterations 500";
    assert_eq!(default, report(&folder, 0, &format!("--energy bending=1,tautness=1 --exponent 2 {limits}")));
    assert_eq!(report(&folder, 0, "--exponent 2"), report(&folder, 0, "--energy bending=1"));
    let near = report(&folder, 0, "--deviation 0.1");
    assert_eq!(near, report(&folder, 0, "--deviation 0.1 --energy bending=1,tautness=1"));
    let long = number(&report(&folder, 0, "--energy bending=1,length=0.1"), "length");
    let short = number(&report(&folder, 0, "--energy bending=1,length=100"), "length");
    assert!(short < long, "{short} {long}");
    let cubed = report(&folder, 0, "--energy bending=1,length=1 --exponent 3");
    assert_eq!(cubed["status"], "converged", "{cubed}");
    assert_ne!(cubed["energy"], report(&folder, 0, "--energy bending=1,length=1")["energy"]);
    let gradients = report(&folder, 0, "--energy bending=1,length=1 --solver sobolev");
    let newton = report(&folder, 0, "--energy bending=1,length=1");
    assert!((number(&newton, "energy") / number(&gradients, "energy") - 1.0).abs() <= 1e-10, "{gradients} {newton}");
    assert!(number(&gradients, "iterations") > number(&newton, "iterations"), "{gradients} {newton}");
    let loose = report(&folder, 0, "--energy bending=1,length=1 --convergence 0.01");
    assert!(number(&loose, "iterations") < number(&newton, "iterations"), "{loose} {newton}");
    for energy in ["variation=1,length=1", "tension=1", "length=2", "bending=1,variation=0.1,length=1"] {
        assert_eq!(report(&folder, 0, &format!("--energy {energy}"))["status"], "converged", "{energy}");
    }
}

#[test]
fn too_few_iterations_are_exit_code_1_and_a_sentence() {
    let folder = folder(TWO);
    fair(&folder, "-o out.csv --energy bending=1,length=1 --max-iterations 1").code(1).stderr(contains(
        "not_converged: in.csv, line 2, curve a, point 0: 1 iterations were not enough, with a gradient of ",
    ));
    assert_eq!(points(&folder, "a").len(), 33);
}

#[test]
fn attachments_free_the_points_that_are_not_pinned() {
    let folder = folder(TWO);
    let ends = report(&folder, 1, "--energy bending=1,length=1,attachment=10");
    assert_eq!(ends["status"], "converged", "{ends}");
    let found = points(&folder, "b");
    assert_eq!((found[0], found[48]), ([0.0, 5.0], [5.0, 5.0]));
    assert!(number(&ends, "max_deviation") > 0.01, "{ends}");
    let free = report(&folder, 1, "--energy bending=1,length=1,attachment=10 --pin none");
    assert_eq!(free["status"], "converged", "{free}");
    assert_ne!(points(&folder, "b")[0], [0.0, 5.0]);
    assert!(number(&free, "energy") < number(&ends, "energy"), "{free} {ends}");
    assert_eq!(report(&folder, 1, "--energy bending=1,length=1,attachment=10 --pin ends"), ends);
}

#[test]
fn spacing_sets_the_edges_and_beziers_follow_the_curve() {
    let folder = folder(TWO);
    let line = report(&folder, 0, "--energy bending=1,length=1 --spacing 0.25");
    assert_eq!(line["status"], "converged", "{line}");
    let found = points(&folder, "a");
    let steps: Vec<f64> = found.windows(2).map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1])).collect();
    assert!(steps.iter().all(|step| (0.15..=0.25001).contains(step)), "{steps:?}");
    fair(&folder, "-o out.csv --energy bending=1,length=1 --as bezier").code(0);
    let control = points(&folder, "a");
    assert_eq!(control.len() % 3, 1);
    assert_eq!((control[0], control[control.len() - 1]), ([0.0, 0.0], [3.0, 1.0]));
    fair(&folder, "-o out.svg --energy bending=1,length=1 --as bezier").code(0);
    assert!(fs::read_to_string(folder.path().join("out.svg")).unwrap().contains("C"));
}

#[test]
fn wrong_values_are_refused_with_a_sentence() {
    misread(
        "--energy bend=1",
        "there is no energy 'bend': use bending, length, tension, tautness, variation, torsion, attachment",
    );
    misread("--energy bending", "'bending' is not NAME=WEIGHT");
    misread("--energy bending=much", "the weight of bending is 'much', not a number");
    misread("--energy bending=-1", "the weight of bending is -1; weights are 0 or positive numbers");
    misread("--energy length=1,length=2", "length stands twice: give it one weight");
    misread("--energy bending=inf", "the weight of bending is inf; weights are 0 or positive numbers");
    refused("--method fair --exponent 0.5", "the exponent of bending is 0.5: give a finite number of at least 1");
    refused(
        "--method fair --exponent 3 --energy length=1",
        "--exponent 3 is that of bending, which --energy does not name: add bending=1, or leave it out",
    );
    refused("--method fair --convergence -1", "--convergence is -1; it must be a positive number, such as 1e-8");
    refused("--method fair --samples 0", "--samples is 0; 1 to 1,000,000 segments a span are possible");
    refused("--method fair --spacing 0", "it must be a positive");
    refused("--method fair --energy attachment=1", "the energy has no fairness in it");
    refused("--method fair --pin none", "points that are not pinned need an attachment");
    refused(
        "--method fair --smoothing 0.1",
        "--smoothing 0.1 belongs to --method smoothing; fair curves near their points take --deviation D",
    );
}

#[test]
fn options_of_fair_belong_to_fair() {
    for option in ["--energy bending=1", "--exponent 3", "--solver sobolev", "--max-iterations 9", "--convergence 1e-6"]
    {
        let name = option.split(' ').next().unwrap();
        for method in ["natural", "smoothing --smoothing 1"] {
            refused(&format!("--method {method} {option}"), &format!("{name} belongs to --method fair"));
        }
    }
}

#[test]
fn the_borders_of_177_countries_end_with_honest_statuses() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/data/countries-110m.geojson");
    let folder = TempDir::new().unwrap();
    fs::copy(file, folder.path().join("in.geojson")).unwrap();
    run(
        &folder,
        "fit in.geojson -o out.geojson --method fair --energy bending=1,length=1 --samples 4 --device cpu --report report.json",
    );
    let text = fs::read_to_string(folder.path().join("report.json")).unwrap();
    let report: Value = serde_json::from_str(&text).unwrap();
    let curves = report["curves"].as_array().unwrap();
    assert!(curves.len() > 250, "{} rings", curves.len());
    let mut converged = 0;
    for line in curves {
        let status = line["status"].as_str().unwrap();
        if line["curve"] == "386" {
            assert_eq!(status, "degenerate", "the one arc that is a point: {line}");
            continue;
        }
        converged += usize::from(status == "converged");
        assert!(["converged", "not_converged"].contains(&status), "{line}");
        assert_eq!(status == "converged", number(line, "gradient_norm") <= 1e-8, "{line}");
        assert_eq!(status == "converged" && line["loops"].is_null(), line["message"].is_null(), "{line}");
        assert_eq!(number(line, "max_deviation"), 0.0);
    }
    println!("{converged} of {}", curves.len());
    // 561 of 594 when it was written; the rest are rough coasts, which say so.
    assert!(100 * converged >= 94 * (curves.len() - 1), "{converged} of {}", curves.len());
}

#[test]
fn starts_say_what_they_have_saved() {
    let folder = folder(TWO);
    fair(&folder, "-o out.csv --starts 4 --report out.json")
        .code(0)
        .stderr(contains("4 starts: none of 2 curves found a cheaper minimum"));
    let report: Value = serde_json::from_str(&fs::read_to_string(folder.path().join("out.json")).unwrap()).unwrap();
    assert_eq!(report["curves"][0]["gain"], 0.0, "{report}");
    fair(&folder, "-o out.csv --report out.json").code(0).stderr(contains("starts").not());
    let report = fs::read_to_string(folder.path().join("out.json")).unwrap();
    assert!(!report.contains("gain"), "{report}");
    refused("--method fair --starts 0", "0 starts: each is a descent of its own, and from 1 to 1000 are possible");
    refused("--method fair --starts 3 --deviation 1%", "3 starts and a deviation of 1%");
}
