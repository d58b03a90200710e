//! `faircurve fit --method fair --deviation D --corners ANGLE` as its users meet it.

use std::fs;

use super::ran::run;
use predicates::prelude::*;
use predicates::str::{contains, is_empty};
use serde_json::Value;
use tempfile::TempDir;

/// A wave, an elbow with its corner at point 3, and a line.
const CURVES: &str = "curve,x,y\na,0,0\na,1,1\na,2,0\na,3,1\na,4,0\nb,0,5\nb,1,5.1\nb,2,4.9\nb,3,5\nb,3,6\nb,3.1,7\nb,3,8\nc,0,9\nc,1,9\n";

fn folder() -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("in.csv"), CURVES).unwrap();
    folder
}

/// The lines of the report, after a run in which every curve is usable.
fn reports(folder: &TempDir, arguments: &str) -> Vec<Value> {
    let fixed = "fit in.csv -o out.csv --device cpu --samples 4 --report report.json --force --method";
    run(folder, &format!("{fixed} {arguments}")).code(0);
    let text = fs::read_to_string(folder.path().join("report.json")).unwrap();
    serde_json::from_str::<Value>(&text).unwrap()["curves"].as_array().unwrap().clone()
}

fn number(line: &Value, field: &str) -> f64 {
    line[field].as_f64().unwrap_or_else(|| panic!("{field} in {line}"))
}

/// The points of a curve in `out.csv`.
fn points(folder: &TempDir, curve: &str) -> Vec<[f64; 2]> {
    let text = fs::read_to_string(folder.path().join("out.csv")).unwrap();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        (cells[0] == curve).then(|| [cells[1].parse().unwrap(), cells[2].parse().unwrap()])
    };
    text.lines().skip(1).filter_map(row).collect()
}

/// Runs with an error expected: exit code 2, nothing on stdout, and this among the lines on stderr.
fn refused(command: &str, arguments: &str, sentence: &str) {
    run(&folder(), &format!("{command} {arguments}")).code(2).stdout(is_empty()).stderr(contains(sentence));
}

#[test]
fn curves_keep_the_deviation_and_use_it() {
    let folder = folder();
    let lines = reports(&folder, "fair --energy bending=1,length=0.1 --deviation 0.05");
    for line in &lines {
        assert!(number(line, "max_deviation") <= 0.05, "{line}");
    }
    assert!(number(&lines[0], "max_deviation") >= 0.04998, "{}", lines[0]);
    assert_eq!((lines[2].get("smoothing"), &lines[2]["max_deviation"]), (None, &0.0.into()));
    let found = points(&folder, "a");
    assert_eq!((found[0], found[16]), ([0.0, 0.0], [4.0, 0.0]));
    assert!(found[4] != [1.0, 1.0] && (found[4][0] - 1.0).hypot(found[4][1] - 1.0) <= 0.05, "{:?}", found[4]);
    let farther = reports(&folder, "fair --energy bending=1,length=0.1 --deviation 0.1");
    assert!(number(&farther[0], "energy") < number(&lines[0], "energy"), "{} {}", farther[0], lines[0]);
    let freed = reports(&folder, "fair --energy bending=1,length=0.1 --deviation 0.05 --pin none");
    assert!(number(&freed[0], "max_deviation") <= 0.05, "{}", freed[0]);
    assert_ne!(points(&folder, "a")[0], [0.0, 0.0]);
}

#[test]
fn corners_are_kept_in_degrees_however_they_are_written() {
    let folder = folder();
    let round = reports(&folder, "fair --energy bending=1,length=0.1");
    let sharp = reports(&folder, "fair --energy bending=1,length=0.1 --corners 60deg");
    assert_eq!(points(&folder, "b").len(), 25);
    assert!(number(&sharp[1], "energy") < 0.8 * number(&round[1], "energy"), "{} {}", sharp[1], round[1]);
    assert!(number(&sharp[1], "max_curvature") < number(&round[1], "max_curvature"), "{} {}", sharp[1], round[1]);
    for same in ["60", "60°", "80deg"] {
        let again = reports(&folder, &format!("fair --energy bending=1,length=0.1 --corners {same}"));
        assert_eq!(again[1], sharp[1], "{same}");
    }
    assert_eq!(reports(&folder, "fair --energy bending=1,length=0.1 --corners 180"), round);
    let both = reports(&folder, "fair --energy bending=1,length=0.1 --corners 60 --deviation 0.03");
    assert_eq!(points(&folder, "b")[12], [3.0, 5.0]);
    assert!((0.0297..=0.03).contains(&number(&both[1], "max_deviation")), "{}", both[1]);
}

#[test]
fn pictures_say_what_was_asked_for() {
    let folder = folder();
    reports(&folder, "fair --deviation 0.05 --corners 60deg --picture out.svg --comb 2");
    let text = fs::read_to_string(folder.path().join("out.svg")).unwrap();
    assert!(text.contains("fair curves, bending + tautness, deviation ≤ 0.05, corners over 60°"), "{text}");
}

#[test]
fn a_deviation_may_be_a_part_of_each_curve_s_size() {
    let folder = folder();
    let part = reports(&folder, "fair --deviation 1% --picture out.svg");
    let text = fs::read_to_string(folder.path().join("out.svg")).unwrap();
    assert!(text.contains("deviation ≤ 1%"), "{text}");
    for (method, option) in [("fair", "--deviation"), ("smoothing", "--deviation"), ("smoothing", "--tube")] {
        // The same, in units.
        let part = reports(&folder, &format!("{method} {option} 1%"));
        let allowed = part[0]["max_deviation"].as_f64().unwrap();
        assert!(allowed > 0.0, "{part:?}");
        let units = reports(&folder, &format!("{method} {option} {}", allowed * 1.0005));
        let found = units[0]["max_deviation"].as_f64().unwrap();
        assert!((found - allowed).abs() <= 3e-3 * allowed, "{method} {option}: {found} {allowed}");
    }
    assert_eq!(part[0]["status"], "converged");
    for (wrong, said, remedy) in [
        (
            "2x",
            "\"2x\" is no deviation",
            "give a distance in units of the input, such as 0.01, or a part of each curve's size",
        ),
        ("2m", "the file does not say the unit of its coordinates", "give a number in that unit"),
    ] {
        run(&folder, &format!("fit in.csv -o out.csv --force --method fair --deviation {wrong}"))
            .code(2)
            .stderr(contains(said).and(contains(remedy)));
    }
}

#[test]
fn compare_takes_both_too() {
    let arguments = "compare in.csv --method fair --device cpu --samples 4 --deviation 0.05 --corners 60deg";
    run(&folder(), arguments).code(0).stdout(contains("pass").and(contains("0.00e0")));
}

#[test]
fn wrong_values_are_refused_with_a_sentence() {
    for command in ["fit in.csv -o out.csv", "compare in.csv"] {
        for wrong in ["-1", "0", "NaN", "inf"] {
            refused(
                command,
                &format!("--method fair --deviation {wrong}"),
                &format!("--deviation is {wrong}; it must be a positive number, such as --deviation 0.01"),
            );
        }
        refused(
            command,
            "--method fair --energy bending=1,attachment=3 --deviation 0.1",
            "--deviation 0.1 keeps the curve near its points, and so does the attachment of --energy: leave one of both out",
        );
        for wrong in ["-5", "181deg", "NaN", "inf°"] {
            let sentence = format!("{wrong} is not between 0 and 180 degrees");
            refused(command, &format!("--method fair --corners {wrong}"), &sentence);
        }
        refused(command, "--method fair --corners sharp", "'sharp' is no angle: give degrees, such as 60deg");
        refused(command, "--method natural --corners 60", "--corners belongs to --method fair and --method smoothing");
        refused(
            command,
            "--method smoothing --deviation 1 --corners 60",
            "--corners goes with --within, or with --method fair",
        );
        refused(
            command,
            "--method natural --deviation 1",
            "--deviation 1 belongs to --method smoothing; natural splines go through every point",
        );
    }
}
