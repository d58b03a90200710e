//! Surfaces from files.

use std::fs;

use faircurve::Grids;
use faircurve::io::grids;
use faircurve::io::surfaces::{is_file, surface_of};
use glam::DVec3;
use tempfile::TempDir;

fn folder() -> TempDir {
    let folder = TempDir::new().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("one.csv", "0,1,2\n3,4,5\n");
    write("two.csv", "0,1\n3,4\n\n5,6\n7,8\n");
    write("gap.csv", "nan,nan\n,nan\n");
    write("row.csv", "0,1,4\n");
    write("words.csv", "a,b\n1,2\n");
    let points = Grids::uniform(3, [2, 2], vec![0.0; 12]).unwrap();
    grids::write(folder.path().join("points.npz"), &points, &grids::GridWrite::default()).unwrap();
    let heights = Grids::uniform(1, [2, 3], (0..6).map(f64::from).collect()).unwrap();
    grids::write(folder.path().join("one.npz"), &heights, &grids::GridWrite::default()).unwrap();
    folder
}

#[test]
fn grids_of_files_stand_where_their_numbers_say() {
    let folder = folder();
    let of = |name: &str| surface_of(&format!("grid:{}/{name}", folder.path().display())).unwrap();
    for (name, x, y) in [
        ("one.csv", 1.0, 1.0),
        ("one.npz", 1.0, 1.0),
        ("one.csv,30", 30.0, 30.0),
        ("one.csv, 30, -20", 30.0, -20.0),
        ("one.csv,30,-20,1e5,2e5", 100_030.0, 199_980.0),
    ] {
        // h = column + 3 row
        assert_eq!(of(name).value(DVec3::new(x, y, 10.0)), 6.0, "{name}");
    }
    assert!(of("one.csv,30").undefined(DVec3::new(61.0, 0.0, 0.0)).is_some());
    assert!(of("one.csv").name().starts_with("the terrain of ") && of("one.csv").name().ends_with("one.csv"));
}

#[test]
fn words_are_passed_on_and_an_unknown_one_is_told_of_files_too() {
    assert_eq!(surface_of("torus:2,1").unwrap().name(), "the torus of radii 2 and 1");
    assert!(is_file("grid:a.csv") && !is_file("torus:2,1"));
    let error = |text: &str| surface_of(text).unwrap_err().to_string();
    assert!(error("ball").starts_with("there is no surface 'ball': use sphere:R"), "{}", error("ball"));
    assert!(error("ball").ends_with(", cone:degrees, grid:FILE, mesh:FILE.obj"), "{}", error("ball"));
    assert!(error("torus:2").ends_with("write torus:R,r"), "{}", error("torus:2"));
}

#[test]
fn files_that_make_no_surface_are_refused_with_their_name() {
    let folder = folder();
    let path = folder.path().display().to_string();
    for (name, what) in [
        ("none.csv", "none.csv: "),
        ("two.csv", "two.csv: it holds 2 grids, and a surface is made of one"),
        ("points.npz", "points.npz: its points have 3 values each, and heights are one value a point"),
        ("gap.csv", "gap.csv: none of the 2 × 2 heights of a height field is a finite number"),
        ("row.csv", "row.csv: a height field of 1 × 3 heights is no surface"),
        ("words.csv", "words.csv, line 1: the row holds \"a\", \"b\" as a header does"),
        ("one.txt", "one.txt"),
        ("one.csv,0", "the spacing of columns is 0"),
        ("one.csv,north", "\"north\" in "),
        ("one.csv,1,2,3", "has 3 numbers after its file"),
    ] {
        let error = surface_of(&format!("grid:{path}/{name}")).unwrap_err().to_string();
        assert!(error.contains(what) && !error.contains("panicked"), "{name}: {error}");
    }
    assert!(surface_of("mesh:").unwrap_err().to_string().contains("names no file: write mesh:FILE.obj"));
    assert!(surface_of("mesh:none.obj").unwrap_err().to_string().contains("none.obj"));
    for text in ["grid", "grid:", "grid:,30"] {
        let error = surface_of(text).unwrap_err().to_string();
        assert!(error.contains("names no file: write grid:FILE"), "{error}");
    }
}
