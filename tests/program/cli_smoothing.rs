//! `faircurve fit --method smoothing` as its users meet it.

use std::fs;

use super::ran::run;
use predicates::str::contains;
use serde_json::Value;
use tempfile::TempDir;

/// A wave with a point far off, and a small island.
fn folder() -> TempDir {
    let folder = TempDir::new().unwrap();
    let mut text = "curve,x,y\n".to_string();
    for k in 0..21 {
        let y = (f64::from(k) * 0.6).sin() + if k == 10 { 0.9 } else { 0.0 };
        text += &format!("track,{},{y}\n", f64::from(k) * 0.5);
    }
    for (x, y) in [(0.0, 9.0), (0.1, 9.0), (0.12, 9.1), (0.0, 9.08), (0.0, 9.0)] {
        text += &format!("isle,{x},{y}\n");
    }
    fs::write(folder.path().join("in.csv"), text).unwrap();
    folder
}

/// The reports of the curves, after a run in which every curve is usable.
fn reports(folder: &TempDir, arguments: &str) -> Vec<Value> {
    let fixed = "fit in.csv -o out.csv --device cpu --report report.json --force --method smoothing";
    run(folder, &format!("{fixed} {arguments}")).code(0);
    let text = fs::read_to_string(folder.path().join("report.json")).unwrap();
    serde_json::from_str::<Value>(&text).unwrap()["curves"].as_array().unwrap().clone()
}

#[test]
fn a_tube_bends_less_than_one_lambda_and_keeps_the_same_distance() {
    let folder = folder();
    let [one, tube] = ["--deviation 0.5", "--tube 0.5"].map(|option| reports(&folder, option)[0].clone());
    assert!(tube["max_deviation"].as_f64().unwrap() <= 0.5, "{tube}");
    assert!(tube["energy"].as_f64().unwrap() < 0.9 * one["energy"].as_f64().unwrap(), "{tube} {one}");
    assert!(tube["smoothing"].is_null(), "{tube}");
}

#[test]
fn an_island_smaller_than_the_deviation_stays_an_island() {
    let folder = folder();
    for (option, share) in [("--deviation 0.5", 0.7), ("--tube 0.5", 0.7), ("--smoothing 1000", 0.01)] {
        let isle = &reports(&folder, option)[1];
        assert_eq!(isle["status"], "converged", "{isle}");
        // Its outline is 0.41 long.
        assert!(isle["length"].as_f64().unwrap() > 0.4 * 0.9 * share, "{option}: {isle}");
        let said = format!("would shrink it to less than {share} of its size");
        assert!(isle["message"].as_str().unwrap().contains(&said), "{isle}");
    }
}

#[test]
fn a_tube_belongs_to_smoothing_alone() {
    let folder = folder();
    let fit = "fit in.csv -o out.csv --device cpu --force";
    for method in ["natural", "fair", "scf"] {
        let said = "--tube 0.5 belongs to --method smoothing";
        run(&folder, &format!("{fit} --method {method} --tube 0.5")).code(2).stderr(contains(said));
    }
    let said = "--tube is -1; it must be a positive number, such as --tube 0.01";
    run(&folder, &format!("{fit} --method smoothing --tube -1")).code(2).stderr(contains(said));
    run(&folder, &format!("{fit} --method smoothing --tube 1 --deviation 1"))
        .code(2)
        .stderr(contains("cannot be used"));
}

#[test]
fn within_a_distance_lines_stay_straight_and_islands_keep_their_area() {
    let folder = folder();
    let [track, isle] = &reports(&folder, "--within 0.2")[..] else { panic!("two curves") };
    assert!(track["max_deviation"].as_f64().unwrap() <= 0.2 && track["message"].is_null(), "{track}");
    let said = "it is smaller than a distance of 0.2: it is kept within";
    assert!(isle["message"].as_str().unwrap().contains(said), "{isle}");
    // An island of this area is not shorter than a circle, and not much longer.
    let area: f64 = 0.0098;
    let circle = 2.0 * (std::f64::consts::PI * area).sqrt();
    let length = isle["length"].as_f64().unwrap();
    assert!(length > 0.99 * circle && length < 1.2 * circle, "{isle}, {circle}");
    fs::write(folder.path().join("side.csv"), "curve,x,y\na,0,0\na,100,0\na,100,30\n").unwrap();
    run(&folder, "fit side.csv -o side_out.csv --within 1 --samples 64 --device cpu --force").code(0);
    let rows = fs::read_to_string(folder.path().join("side_out.csv")).unwrap();
    let points = rows.lines().skip(1).map(|row| {
        let mut cells = row.split(',').skip(1).map(|cell| cell.parse::<f64>().unwrap());
        [cells.next().unwrap(), cells.next().unwrap()]
    });
    let middle: Vec<[f64; 2]> = points.filter(|[x, _]| (30.0..70.0).contains(x)).collect();
    assert!(middle.len() > 5 && middle.iter().all(|[_, y]| y.abs() < 0.02), "{middle:?}");
}

#[test]
fn within_goes_with_neither_a_surface_nor_another_distance() {
    let folder = folder();
    let fit = "fit in.csv -o out.csv --device cpu --force --within 0.5";
    for (options, said) in [
        ("--method fair", "--within 0.5 belongs to --method smoothing"),
        ("--surface wgs84", "--within 0.5 goes with no --surface"),
        ("--parametrisation uniform", "--parametrisation uniform does not go with --within"),
        ("--tube 1", "cannot be used"),
    ] {
        run(&folder, &format!("{fit} {options}")).code(2).stderr(contains(said));
    }
    let fit = "fit in.csv -o out.csv --device cpu --force";
    for option in ["--within", "--deviation", "--tube"] {
        run(&folder, &format!("{fit} {option} 2km")).code(2).stderr(contains("does not say the unit"));
    }
}

#[test]
fn parameters_are_chosen_by_a_word_for_splines_alone() {
    let folder = folder();
    let length = |option: &str| reports(&folder, &format!("--smoothing 0.01 {option}"))[0]["length"].as_f64().unwrap();
    assert_eq!(length(""), length("--parametrisation chord"));
    assert_ne!(length(""), length("--parametrisation uniform"));
    let fit = "fit in.csv -o out.csv --device cpu --force";
    for method in ["fair", "scf"] {
        let said = "--parametrisation chord belongs to --method natural and --method smoothing";
        run(&folder, &format!("{fit} --method {method} --parametrisation chord")).code(2).stderr(contains(said));
    }
    run(&folder, &format!("{fit} --parametrisation given"))
        .code(2)
        .stderr(contains("needs a parameter for every point"));
}
