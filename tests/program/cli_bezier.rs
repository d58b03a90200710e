//! `faircurve bezier` as its users meet it.

use std::fs;
use std::path::Path;

use super::ran::{self, folder, run};
use assert_cmd::assert::Assert;
use predicates::prelude::*;
use predicates::str::{contains, is_empty};
use serde_json::Value;
use tempfile::TempDir;

/// A cubic without its third control point, and a quartic of which only the ends are known.
const TWO: &str = "curve,x,y,known\na,0,0,1\na,1,2,1\na,,,0\na,3,0,1\nb,0,5,1\nb,,,0\nb,,,0\nb,,,0\nb,8,9,1\n";

fn drawing(elements: &str) -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("in.svg"), format!("<svg>{elements}</svg>")).unwrap();
    folder
}

/// Runs `bezier` on the CPU and expects every curve to be usable.
fn completed(folder: &TempDir, arguments: &str) -> Assert {
    run(folder, &format!("bezier {arguments} --device cpu --force")).code(0).stdout(is_empty())
}

/// Runs with an error expected: exit code 2, nothing on stdout, and this in the one sentence on
/// stderr.
fn refused(folder: &TempDir, arguments: &str, sentence: &str) {
    ran::refused(folder, &format!("bezier {arguments}"), sentence);
}

fn read(folder: &TempDir, name: &str) -> String {
    fs::read_to_string(folder.path().join(name)).unwrap()
}

/// The points of a curve in a CSV file.
fn points(folder: &TempDir, file: &str, curve: &str) -> Vec<[f64; 2]> {
    let text = read(folder, file);
    let of_curve = text.lines().filter(|line| line.split(',').next() == Some(curve));
    of_curve
        .map(|line| {
            let cells: Vec<f64> = line.split(',').skip(1).take(2).map(|cell| cell.parse().unwrap()).collect();
            [cells[0], cells[1]]
        })
        .collect()
}

/// The numbers of the one path in an SVG file.
fn path(folder: &TempDir, file: &str) -> Vec<f64> {
    let text = read(folder, file);
    let (_, path) = text.split_once(" d=\"").unwrap();
    let (path, _) = path.split_once('"').unwrap();
    path.split(|c: char| "MC, Z".contains(c))
        .filter(|cell| !cell.is_empty())
        .map(|cell| cell.parse().unwrap())
        .collect()
}

fn report(folder: &TempDir, file: &str) -> Value {
    serde_json::from_str(&read(folder, file)).unwrap()
}

fn assert_near(found: &[[f64; 2]], wanted: &[[f64; 2]], tolerance: f64) {
    assert_eq!(found.len(), wanted.len(), "{found:?} instead of {wanted:?}");
    for (p, q) in found.iter().zip(wanted) {
        assert!((p[0] - q[0]).hypot(p[1] - q[1]) <= tolerance, "{found:?} instead of {wanted:?}");
    }
}

/// The control points of the same curve one degree higher, by the textbook's formula.
fn elevated(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let n = points.len();
    let at = |i: usize| {
        let t = i as f64 / n as f64;
        let (before, here) = (points[i.saturating_sub(1)], points[i.min(n - 1)]);
        [0, 1].map(|c| t * before[c] + (1.0 - t) * here[c])
    };
    (0..=n).map(at).collect()
}

fn line(from: [f64; 2], to: [f64; 2], segments: usize) -> Vec<[f64; 2]> {
    (0..=segments)
        .map(|k| k as f64 / segments as f64)
        .map(|u| [0, 1].map(|c| from[c] + u * (to[c] - from[c])))
        .collect()
}

#[test]
fn unknown_control_points_are_those_of_least_bending_and_one_line_says_which_device_found_them() {
    let folder = folder(TWO);
    completed(&folder, "in.csv -o out.csv").stderr(
        predicate::str::starts_with("faircurve: 2 curves, 9 control points: completed on ")
            .and(contains("CPU"))
            .and(predicate::function(|text: &str| text.lines().count() == 1)),
    );
    // P₂ = (P₁ + P₃)/2; where only the ends are known, the line between them.
    let wanted = "curve,x,y,t\na,0,0,0\na,1,2,1\na,2,1,2\na,3,0,3\nb,0,5,0\nb,2,6,1\nb,4,7,2\nb,6,8,3\nb,8,9,4\n";
    assert_eq!(read(&folder, "out.csv"), wanted);
    run(&folder, "bezier in.csv -o out.csv").code(2).stderr(contains("out.csv exists already: give --force"));
}

#[test]
fn the_curves_of_the_example_are_completed_and_reported() {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/data/control_points.csv");
    let given = fs::read_to_string(&example).unwrap();
    let folder = folder(&given);
    completed(&folder, "in.csv -o out.csv --report report.json --picture picture.svg -q").stderr(is_empty());
    let found = read(&folder, "out.csv");
    assert_eq!(given.lines().count(), found.lines().count());
    let mut unknown = 0;
    for (given, found) in given.lines().zip(found.lines()).skip(1) {
        let (given, found): (Vec<&str>, Vec<&str>) = (given.split(',').collect(), found.split(',').collect());
        assert_eq!(given[0], found[0]);
        match given[3] {
            "1" => assert_eq!(given[1..3], found[1..3], "a known control point keeps its bits"),
            _ => unknown += 1,
        }
        assert!(found[1..3].iter().all(|cell| cell.parse::<f64>().unwrap().is_finite()), "{found:?}");
    }
    assert!(unknown >= 15, "{unknown} unknown points");
    // The ends and their derivatives make a cubic, of which this is the quartic.
    let cubic = [[0.0, -20.0], [20.0, -10.0], [34.0, -5.0], [44.0, -20.0]];
    assert_near(&points(&folder, "out.csv", "hill"), &elevated(&cubic), 1e-13);
    // The leaf is symmetrical about x = 5.
    let mirrored: Vec<[f64; 2]> = points(&folder, "out.csv", "leaf-left").iter().map(|p| [10.0 - p[0], p[1]]).collect();
    assert_near(&points(&folder, "out.csv", "leaf-right"), &mirrored, 1e-13);
    let report = report(&folder, "report.json");
    assert_eq!((&report["method"], &report["precision"]), (&"bezier".into(), &"f64".into()));
    assert_eq!((&report["totals"]["curves"], &report["totals"]["usable"]), (&9.into(), &9.into()));
    for curve in report["curves"].as_array().unwrap() {
        assert_eq!((&curve["status"], &curve["points_in"]), (&"converged".into(), &curve["points_out"]), "{curve}");
        assert!(curve["energy"].as_f64().unwrap() > 0.0 && curve["length"].as_f64().unwrap() > 2.9, "{curve}");
    }
    let picture = read(&folder, "picture.svg");
    assert!(picture.contains("Bézier curves of least bending") && picture.contains("9 curves"), "{picture}");
}

#[test]
fn a_curve_that_ends_where_it_starts_keeps_both_points() {
    let folder = folder("x,y,known\n0,0,1\n3,3,1\n,,0\n-3,3,1\n0,0,1\n");
    completed(&folder, "in.csv -o out.csv");
    let found = points(&folder, "out.csv", "0");
    assert_eq!((found.len(), found[0], found[4]), (5, [0.0, 0.0], [0.0, 0.0]));
    assert!(found[2][0].abs() < 1e-14 && found[2][1] > 0.0, "{found:?}");
}

#[test]
fn elevation_and_reduction_change_the_degree_and_not_the_curve() {
    let folder = folder(TWO);
    completed(&folder, "in.csv -o cubic.csv");
    completed(&folder, "in.csv -o quartic.csv --elevate 1");
    let cubic = points(&folder, "cubic.csv", "a");
    assert_near(&points(&folder, "quartic.csv", "a"), &elevated(&cubic), 1e-15);
    completed(&folder, "in.csv -o high.csv --elevate 4");
    assert_eq!(points(&folder, "high.csv", "a").len(), 8);
    completed(&folder, "high.csv -o back.csv --reduce 4 --columns x=x,y=y,curve=curve");
    assert_near(&points(&folder, "back.csv", "a"), &cubic, 1e-13);
    for (file, samples) in [("cubic.csv", "a.csv"), ("high.csv", "b.csv")] {
        completed(&folder, &format!("{file} -o {samples} --as polyline --samples 10"));
    }
    let samples = points(&folder, "a.csv", "a");
    assert_eq!(samples.len(), 11);
    assert_near(&points(&folder, "b.csv", "a"), &samples, 1e-14);
}

#[test]
fn what_was_written_can_be_read_and_written_again() {
    let folder = folder(TWO);
    completed(&folder, "in.csv -o once.csv");
    completed(&folder, "once.csv -o twice.csv");
    assert_eq!(read(&folder, "once.csv"), read(&folder, "twice.csv"));
    completed(&folder, "once.csv -o once.npz");
    completed(&folder, "once.npz -o thrice.csv");
    assert_eq!(read(&folder, "once.csv"), read(&folder, "thrice.csv"));
    let piped = run(&folder, "bezier in.csv -o - --to csv --device cpu").code(0);
    assert_eq!(String::from_utf8(piped.get_output().stdout.clone()).unwrap(), read(&folder, "once.csv"));
}

#[test]
fn svg_draws_cubics_as_they_are_and_other_degrees_within_the_tolerance() {
    let folder = folder("x,y\n0.1,0.2\n1,2.5\n2,-1.75\n3,0.3\n");
    completed(&folder, "in.csv -o out.svg");
    assert_eq!(path(&folder, "out.svg"), [0.1, -0.2, 1.0, -2.5, 2.0, 1.75, 3.0, -0.3]);
    fs::write(folder.path().join("in.csv"), "x,y\n0,0\n3,6\n6,0\n").unwrap();
    completed(&folder, "in.csv -o out.svg");
    assert_eq!(path(&folder, "out.svg"), [0.0, 0.0, 2.0, -4.0, 4.0, -4.0, 6.0, 0.0]);
    fs::write(folder.path().join("in.csv"), "x,y\n0,0\n0,9\n9,9\n9,-9\n0,-9\n2,0\n").unwrap();
    let pieces = |tolerance: &str| {
        completed(&folder, &format!("in.csv -o out.svg {tolerance}"));
        (path(&folder, "out.svg").len() - 2) / 6
    };
    let [rough, default, fine] = ["--tolerance 0.1", "", "--tolerance 1e-9"].map(pieces);
    assert!(1 <= rough && rough < default && default < fine && fine < 1000, "{rough} {default} {fine}");
}

#[test]
fn tangents_are_derivatives_or_only_directions() {
    let folder = folder("x,y,known,tx,ty\n0,0,1,6,6\n,,0,,\n,,0,,\n4,0,1,,\n");
    completed(&folder, "in.csv -o out.csv");
    let found = points(&folder, "out.csv", "0");
    assert_near(&found, &[[0.0, 0.0], [2.0, 2.0], [3.0, 1.0], [4.0, 0.0]], 1e-14);
    completed(&folder, "in.csv -o out.csv --tangents directions --report report.json");
    let [_, p, q, _] = points(&folder, "out.csv", "0")[..] else { panic!("four control points") };
    assert!((p[0] - p[1]).abs() < 1e-14 && p[0] > 0.0 && p[0] < 1.9, "{p:?}");
    assert_near(&[q], &[[0.5 * (p[0] + 4.0), 0.5 * p[1]]], 1e-14);
}

#[test]
fn energies_and_known_points_are_heard() {
    let folder = folder("x,y\n0,0\n1,5\n9,5\n4,-4\n8,4\n");
    let found = |arguments: &str| {
        completed(&folder, &format!("in.csv -o out.csv {arguments}"));
        points(&folder, "out.csv", "0")
    };
    let given = found("");
    assert_eq!(given[3], [4.0, -4.0]);
    assert_eq!(found("--known file"), given);
    assert_near(&found("--known ends"), &line([0.0, 0.0], [8.0, 4.0], 4), 1e-14);
    fs::write(folder.path().join("in.csv"), "x,y,known\n0,0,1\n0,4,1\n,,0\n,,0\n8,0,1\n").unwrap();
    let [bending, mixed, tension] =
        ["", "--energy bending=1,tension=10", "--energy tension=2"].map(|energy| found(energy)[2][1]);
    assert!(bending > mixed && mixed > tension, "{bending} {mixed} {tension}");
    let [bending, variation] = ["--energy bending=7", "--energy variation=1"].map(|energy| found(energy)[2][1]);
    assert!(variation != bending && variation.is_finite(), "{variation}");
}

#[test]
fn too_few_known_points_are_usable_and_said_to_be_so() {
    let folder = folder("curve,x,y,known\na,4,2,1\na,,,0\na,,,0\nb,0,0,1\nb,,,0\nb,2,0,1\n");
    run(&folder, "bezier in.csv -o out.csv --device cpu --report report.json")
        .code(0)
        .stderr(contains("1 of 2 curves is not unique: too few points are known"));
    assert_eq!(report(&folder, "report.json")["curves"][0]["status"], "not_unique");
    assert_eq!(points(&folder, "out.csv", "b")[1], [1.0, 0.0]);
}

#[test]
fn a_curve_that_cannot_be_completed_comes_out_as_it_was_and_is_listed() {
    let many: String = (0..32).map(|k| format!("many,{k},{},1\n", k % 2)).collect();
    let folder = folder(&format!("curve,x,y,known\nnan,0,0,1\nnan,nan,1,1\nnan,2,2,1\n{many}{}", &TWO[16..]));
    let listed = run(&folder, "bezier in.csv -o out.csv --device cpu --report report.json").code(1).stdout(is_empty());
    listed.stderr(
        contains("2 of 4 curves are not usable:")
            .and(contains(
                "  invalid: in.csv, line 3, curve nan, point 1: x is NaN; every coordinate must be a finite number",
            ))
            .and(contains("curve many, point 31: 32 control points make a curve of degree 31; up to 30 is possible")),
    );
    assert_eq!(read(&folder, "out.csv").lines().filter(|line| line.starts_with("many,")).count(), 32);
    assert!(read(&folder, "out.csv").contains("\nnan,NaN,1,1,invalid\n"), "{}", read(&folder, "out.csv"));
    assert_eq!(points(&folder, "out.csv", "a")[2], [2.0, 1.0], "the neighbours are completed");
    let statuses: Vec<Value> = report(&folder, "report.json")["curves"]
        .as_array()
        .unwrap()
        .iter()
        .map(|line| line["status"].clone())
        .collect();
    assert_eq!(statuses, ["invalid", "invalid", "converged", "converged"]);
    run(&folder, "bezier in.csv -o out.svg --device cpu").code(1);
    assert!(read(&folder, "out.svg").contains("<path id=\"nan\" d=\"\"/>"));
}

#[test]
fn geojson_takes_polylines_only() {
    let folder = folder(TWO);
    refused(
        &folder,
        "in.csv -o out.geojson",
        "GeoJSON holds straight lines and no Bézier curves: write CSV, SVG, NPZ or NPY",
    );
    completed(&folder, "in.csv -o out.geojson --as polyline --samples 4");
    let drawn: Value = serde_json::from_str(&read(&folder, "out.geojson")).unwrap();
    assert_eq!(drawn["features"][0]["geometry"]["coordinates"].as_array().unwrap().len(), 5);
}

#[test]
fn options_that_do_not_fit_together_are_refused() {
    let folder = folder(TWO);
    let csv = |arguments: &str, sentence: &str| refused(&folder, &format!("in.csv -o out.csv {arguments}"), sentence);
    csv("--joints c2", "--joints c2 says how the pieces of a chain meet: give --degree D, such as --degree 3");
    csv("--lengths equal", "--lengths says how long the pieces of a chain are: give --degree D, such as --degree 3");
    csv("--known joints", "--known joints keeps the points where the pieces of a chain meet: give --degree D");
    csv("--degree 0", "--degree is 0; degrees from 1 to 30 are possible, such as --degree 3");
    csv("--degree 31", "--degree is 31; degrees from 1 to 30 are possible");
    csv(
        "--degree 3 --tangents directions",
        "--tangents belongs to single Bézier curves; those of chains are directions with --joints g1",
    );
    csv("--elevate 0", "--elevate is 0; degrees change by 1 to 29, and stay between 1 and 30: give --elevate 1");
    csv("--reduce -1", "--reduce is -1; degrees change by 1 to 29");
    csv("--samples 4", "--samples belongs to --as polyline; control points are written as they are: leave it out");
    csv("--as polyline --samples 0", "--samples is 0; 1 to 1,000,000 segments a span are possible");
    csv("--tolerance 0.1", "--tolerance 0.1 is how near cubics come to curves of higher degree in SVG");
    refused(&folder, "in.csv -o out.svg --tolerance 0", "--tolerance is 0; it must be a positive length");
    refused(&folder, "in.csv -o out.csv --picture out.png", "pictures are SVG");
    fs::write(folder.path().join("heavy.csv"), "x,y,weight\n0,0,1\n1,1,2\n2,0,1\n").unwrap();
    refused(
        &folder,
        "heavy.csv -o out.csv",
        "the file gives its points weights, but Bézier curves are polynomial here",
    );
    completed(&folder, "heavy.csv -o out.csv --columns weight=");
    let svg = drawing("<path d='M0 0 C1 1 2 1 3 0'/>");
    refused(&svg, "in.svg -o out.svg --degree 4", "--degree is 4, but paths of SVG are read as chains of cubics");
    completed(&svg, "in.svg -o out.svg --degree 3");
    let ring = drawing("<path d='M0 0 L2 0 L2 2 Z'/>");
    refused(
        &ring,
        "in.svg -o out.svg --known ends",
        "--known ends: curve 0 is closed and has none: give --known joints",
    );
}

#[test]
fn options_that_cannot_be_read_are_explained() {
    let folder = folder(TWO);
    let misread = |arguments: &str, sentence: &str| {
        run(&folder, &format!("bezier in.csv -o out.csv {arguments}"))
            .code(2)
            .stdout(is_empty())
            .stderr(contains(sentence));
    };
    misread("--energy length=1", "there is no energy 'length': use tension, bending, variation");
    misread("--energy bending=0,tension=0", "every weight is 0, and nothing would be minimised");
    misread("--energy bending=-1", "the weight of bending is -1; weights are 0 or positive numbers");
    misread("--joints c3", "possible values: free, c1, c2, g1");
    misread("--lengths long", "possible values: chords, equal");
    misread("--known some", "possible values: file, joints, ends");
    misread("--elevate 1 --reduce 1", "cannot be used with");
}

/// What a chain is a part of: a drawing of one open path, its joints with y up, and one that is
/// closed.
const PATH: &str = "M0 0 C1 3 2 3 3 0 Q4 -1 6 1 L8 3";
const JOINTS: &str = "x,y\n0,0\n3,0\n6,-1\n8,-3\n";
const RING: &str = "M0 0 C-1 -1 5 -2 4 0 L4 3 Z";
const CORNERS: &str = "x,y\n0,0\n4,0\n4,-3\n";

/// The control points that `fit` gives the natural cubic spline over chord lengths through the points of `in.csv`.
fn spline(folder: &TempDir, arguments: &str) -> Vec<[f64; 2]> {
    run(
        folder,
        &format!("fit in.csv -o spline.csv --as bezier --parametrisation chord --device cpu --force {arguments}"),
    )
    .code(0);
    points(folder, "spline.csv", "0")
}

#[test]
fn the_handles_of_a_drawing_are_laid_anew_as_those_of_the_spline_through_its_joints() {
    for (path, joints, closed) in [(PATH, JOINTS, ""), (RING, CORNERS, "--closed yes")] {
        let folder = drawing(&format!("<path d='{path}'/>"));
        completed(&folder, "in.svg -o out.csv --known joints --joints c2").stderr(contains("1 curve"));
        fs::write(folder.path().join("in.csv"), joints).unwrap();
        let (found, wanted) = (points(&folder, "out.csv", "0"), spline(&folder, closed));
        assert_near(&found, &wanted, 1e-13);
        // A closed chain has its first point at the end again.
        let rows = found.len() - usize::from(!closed.is_empty());
        let kept: Vec<[f64; 2]> = found[..rows].iter().step_by(3).copied().collect();
        let given = joints.lines().skip(1).map(|line| line.split_once(',').unwrap());
        let given: Vec<[f64; 2]> = given.map(|(x, y)| [x.parse().unwrap(), y.parse().unwrap()]).collect();
        assert_eq!(kept, given, "joints keep their bits");
    }
}

#[test]
fn a_drawing_without_unknown_points_comes_out_as_it_went_in() {
    let folder = drawing("<path d='M0.1 0.2 C1 3 2 3 3 0 4 -1 6 1 8 3 M1 1 C2 2 3 2 4 1 5 0 0 -1 1 1 Z'/>");
    completed(&folder, "in.svg -o out.svg");
    let drawn = read(&folder, "out.svg");
    assert!(drawn.contains("d='M0.1,0.2C1,3 2,3 3,0 4,-1 6,1 8,3M1,1C2,2 3,2 4,1 5,0 0,-1 1,1Z'"), "{drawn}");
    completed(&folder, "in.svg -o high.npz --elevate 1 --report report.json");
    let report = report(&folder, "report.json");
    assert_eq!((&report["curves"][0]["points_in"], &report["curves"][0]["points_out"]), (&7.into(), &9.into()));
    assert_eq!((&report["curves"][1]["points_in"], &report["curves"][1]["points_out"]), (&6.into(), &8.into()));
    completed(&folder, "high.npz -o back.svg --degree 4");
    completed(&folder, "high.npz -o back.csv --degree 4 --reduce 1");
    assert_near(&points(&folder, "back.csv", "0/1")[..3], &[[1.0, -1.0], [2.0, -2.0], [3.0, -2.0]], 1e-13);
    assert!(read(&folder, "back.svg").matches("<path").count() == 2);
}

#[test]
fn a_path_that_cannot_be_completed_is_drawn_as_it_was() {
    let folder = drawing("<path id='corner' d='M0 0 C1 3 2 3 3 0 4 1 6 1 8 3'/><path id='point' d='M5 5'/>");
    run(&folder, "bezier in.svg -o out.svg --joints c1 --device cpu").code(1).stderr(
        contains("1 of 2 curves is not usable:").and(contains("curve corner, point 4")).and(contains("not C1")),
    );
    assert_eq!(read(&folder, "out.svg"), read(&folder, "in.svg"));
}

#[test]
fn chains_in_csv_say_their_degree_and_how_their_pieces_meet() {
    // Two quintics with a corner at (3, 0), every handle unknown.
    let unknown = ",,0\n".repeat(4);
    let folder = folder(&format!("x,y,known\n0,0,1\n{unknown}3,0,1\n{unknown}4,5,1\n"));
    let energies = ["free", "g1", "c1", "c2"].map(|joints| {
        completed(&folder, &format!("in.csv -o {joints}.csv --degree 5 --joints {joints} --report report.json"));
        report(&folder, "report.json")["curves"][0]["energy"].as_f64().unwrap()
    });
    assert_near(&points(&folder, "free.csv", "0")[..6], &line([0.0, 0.0], [3.0, 0.0], 5), 1e-14);
    let [free, g1, c1, c2] = energies;
    // With bending alone C1 comes to C2.
    assert!(free < 1e-20 && 0.0 < g1 && g1 <= c1 * (1.0 + 1e-12) && (c1 - c2).abs() <= 1e-12 * c2, "{energies:?}");
    let found = points(&folder, "c1.csv", "0");
    let h = [3.0, 26f64.sqrt()];
    for c in 0..2 {
        let [before, after] = [(found[5][c] - found[4][c]) / h[0], (found[6][c] - found[5][c]) / h[1]];
        assert!((before - after).abs() < 1e-13, "{found:?}");
    }
    completed(&folder, "in.csv -o equal.csv --degree 5 --joints c1 --lengths equal");
    let found = points(&folder, "equal.csv", "0");
    assert!((0..2).all(|c| (found[4][c] + found[6][c] - 2.0 * found[5][c]).abs() < 1e-13), "{found:?}");
    completed(&folder, "in.csv -o ends.csv --degree 5 --joints c1 --known ends --lengths equal");
    assert_near(&points(&folder, "ends.csv", "0"), &line([0.0, 0.0], [4.0, 5.0], 10), 1e-12);
}

#[test]
fn a_chain_of_another_number_of_points_is_one_curve_s_trouble() {
    let folder = folder("curve,x,y\na,0,0\na,1,2\na,2,2\na,3,0\na,4,-1\nb,0,0\nb,1,2\nb,2,2\nb,3,0\n");
    run(&folder, "bezier in.csv -o out.csv --degree 3 --device cpu").code(1).stderr(
        contains("curve a, point 4: 5 control points make no chain of degree 3").and(contains("1 of 2 curves is")),
    );
    assert_eq!(points(&folder, "out.csv", "a").len(), 5);
}
