//! `faircurve exponent`: the exponents of shapes, in a table and in a picture.

use std::fmt::Write;
use std::fs;

use super::ran::{folder, refused, run};
use predicates::str::{contains, is_empty};

/// Half a circle, and a curve that is a quarter of a circle and then a straight line, 61 points each; a chord.
fn shapes() -> String {
    let mut rows = String::from("curve,x,y\n");
    for k in 0..=60 {
        let (y, x) = (f64::from(k) * std::f64::consts::PI / 60.0).sin_cos();
        writeln!(rows, "round,{x},{y}").unwrap();
    }
    for k in 0..=60 {
        let angle = f64::from(k.min(30)) * std::f64::consts::FRAC_PI_2 / 30.0;
        writeln!(rows, "flat,{},{}", angle.sin(), 1.0 - angle.cos() + 0.05 * f64::from((k - 30).max(0))).unwrap();
    }
    rows + "chord,0,0\nchord,1,1\n"
}

#[test]
fn each_curve_and_each_piece_has_a_row_and_what_cannot_be_measured_has_a_sentence() {
    let folder = folder(&shapes());
    run(&folder, "exponent in.csv -o out.csv --picture out.svg")
        .code(1)
        .stdout(is_empty())
        .stderr(contains("curve chord"))
        .stderr(contains("it has 2 points"))
        .stderr(contains("3 curves measured, 1 could not be"));
    let out = fs::read_to_string(folder.path().join("out.csv")).unwrap();
    let rows: Vec<Vec<&str>> = out.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0], ["curve", "piece", "first", "last", "exponent", "rms", "largest"]);
    let of = |curve: &str| rows.iter().filter(|row| row[0] == curve).collect::<Vec<_>>();
    // Ten dots have nine chords, and three make a piece.
    assert_eq!(of("round").iter().map(|row| row[1]).collect::<Vec<_>>(), ["0", "1", "2", "3"]);
    assert_eq!((of("round")[0][2], of("round")[0][3]), ("0", "60"));
    assert_eq!(of("chord"), [&["chord", "0", "", "", "", "", ""]]);
    let number = |cell: &str| cell.parse::<f64>().unwrap();
    // Circles are what exponents lead to that grow without end, and what turns and is straight then has a small one.
    assert!(number(of("round")[0][4]) > 30.0, "{out}");
    assert!(number(of("flat")[0][4]) < 0.5 * number(of("round")[0][4]), "{out}");
    assert!(number(of("round")[0][5]) < 0.01 && number(of("round")[0][6]) < 0.02, "{out}");
    let picture = fs::read_to_string(folder.path().join("out.svg")).unwrap();
    assert_eq!(picture.matches(r#"<path class="s""#).count(), 7, "three pieces of two curves, and the chord");
}

#[test]
fn options_that_make_no_sense_are_refused_before_anything_is_written() {
    let folder = folder(&shapes());
    refused(&folder, "exponent in.csv -o out.csv --most 1", "--most is 1; exponents from 1.1 on are tried");
    refused(&folder, "exponent in.csv -o out.csv --dots 1 --picture out.png", "give a name that ends in .svg");
    run(&folder, "exponent in.csv -o out.csv --dots 1").code(1).stderr(contains("1 dots were asked for"));
    run(&folder, "exponent in.csv -o out.csv").code(2).stderr(contains("--force"));
}
