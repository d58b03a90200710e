//! `faircurve grid` as its users meet it.

use std::fs;
use std::path::Path;

use super::ran::{self, folder, run};
use assert_cmd::assert::Assert;
use assert_cmd::cargo::cargo_bin_cmd;
use faircurve::io::grids::{self, GridWrite};
use faircurve::laplacian::Grids;
use predicates::prelude::*;
use predicates::str::{contains, is_empty};
use serde_json::Value;
use tempfile::TempDir;

/// A peak, and a grid of another size.
const TWO: &str = "0,0,0\n0,1,0\n0,0,0\n\n1,2,3,4\n2,3,4,6\n";

/// Good grids, and between them one with a hole.
const BAD: &str = "0,1\n2,3\n\n1,2,3\n4,nan,6\n\n5,5\n5,5\n";

/// Runs `grid` on the CPU and expects every grid to be usable.
fn subdivided(folder: &TempDir, arguments: &str) -> Assert {
    run(folder, &format!("grid {arguments} --device cpu --force")).code(0).stdout(is_empty())
}

/// Runs with an error expected: exit code 2, nothing on stdout, and this in the one sentence on
/// stderr.
fn refused(folder: &TempDir, arguments: &str, sentence: &str) {
    ran::refused(folder, &format!("grid {arguments}"), sentence);
}

fn read(folder: &TempDir, name: &str) -> String {
    fs::read_to_string(folder.path().join(name)).unwrap()
}

fn surfaces(folder: &TempDir, name: &str) -> Grids {
    grids::read(folder.path().join(name), None).unwrap()
}

fn report(folder: &TempDir, name: &str) -> Value {
    serde_json::from_str(&read(folder, name)).unwrap()
}

fn example(name: &str) -> TempDir {
    folder(&fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/data").join(name)).unwrap())
}

#[test]
fn every_round_doubles_the_intervals_and_one_line_says_which_device_did_the_work() {
    let folder = folder(TWO);
    subdivided(&folder, "in.csv -o out.csv").stderr(
        predicate::str::is_match(r"^faircurve: 2 grids, 17 points: subdivided to 514 on CPU, .*f64 \(as asked\)\n$")
            .unwrap(),
    );
    assert_eq!(surfaces(&folder, "out.csv").shapes(), [[17, 17], [9, 25]]);
    for rounds in 1..6 {
        subdivided(&folder, &format!("in.csv -o out.csv --rounds {rounds} -q")).stderr(is_empty());
        let after = |count: usize| ((count - 1) << rounds) + 1;
        assert_eq!(surfaces(&folder, "out.csv").shapes(), [[after(3), after(3)], [after(2), after(4)]]);
    }
    run(&folder, "grid in.csv -o auto.csv").code(0).stderr(contains("(auto: done before a GPU would be open)"));
    run(&folder, "grid in.csv -o auto.csv --force -v").stderr(contains("subdivided in "));
}

#[test]
fn the_exact_rule_keeps_means_and_has_no_residual_and_sparse_rules_come_near() {
    let folder = example("heights.csv");
    subdivided(&folder, "in.csv -o exact.csv --report exact.json");
    subdivided(&folder, "in.csv -o default.csv --rule exact --rounds 3");
    assert_eq!(read(&folder, "exact.csv"), read(&folder, "default.csv"));
    let line = &report(&folder, "exact.json")["grids"][0];
    assert!(line["residual"].as_f64().unwrap() < 1e-9, "{line}");
    let (coarse, fine) = (surfaces(&folder, "in.csv"), surfaces(&folder, "exact.csv"));
    let mean = |grids: &Grids| {
        let [rows, columns] = grids.shape(0);
        let weight = |at: usize, count: usize| if at == 0 || at + 1 == count { 0.5 } else { 1.0 };
        let places = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        let sum: f64 = places.map(|(r, c)| weight(r, rows) * weight(c, columns) * grids.point(0, r, c)[0]).sum();
        sum / ((rows - 1) * (columns - 1)) as f64
    };
    assert!((mean(&coarse) - mean(&fine)).abs() < 1e-9 * mean(&coarse));
    let residual = |support: &str| {
        subdivided(&folder, &format!("in.csv -o sparse.csv --rule sparse --rounds 1 --report sparse.json {support}"));
        report(&folder, "sparse.json")["grids"][0]["residual"].as_f64().unwrap()
    };
    let [five, nine, default] = ["--support 5", "--support 9", ""].map(residual);
    assert!(1.0 < five && 1e-3 < nine && nine < five, "{five} {nine}");
    assert_eq!(five, default);
}

#[test]
fn linear_sparse_rules_keep_a_plane() {
    let rows: Vec<String> = (0..10)
        .map(|row| (0..12).map(|column| format!("{}", 2 * row - 3 * column)).collect::<Vec<_>>().join(","))
        .collect();
    let folder = folder(&(rows.join("\n") + "\n"));
    subdivided(&folder, "in.csv -o out.csv --rule sparse --support 5 --linear --rounds 1 --report report.json");
    let fine = surfaces(&folder, "out.csv");
    for (row, column) in (0..19).flat_map(|row| (0..23).map(move |column| (row, column))) {
        let wanted = row as f64 - 1.5 * column as f64;
        assert!((fine.point(0, row, column)[0] - wanted).abs() < 1e-10, "row {row}, column {column}");
    }
    let report = report(&folder, "report.json");
    assert_eq!((&report["support"], &report["reproduces"]), (&5.into(), &"linear".into()));
}

#[test]
fn the_report_says_what_was_done_and_measures_every_grid() {
    let folder = folder(TWO);
    subdivided(&folder, "in.csv -o out.npz --rounds 2 --report report.json");
    let found = report(&folder, "report.json");
    assert_eq!((&found["method"], &found["rule"], &found["rounds"]), (&"grid".into(), &"exact".into(), &2.into()));
    assert_eq!((&found["device"]["kind"], &found["precision"]), (&"cpu".into(), &"f64".into()));
    assert_eq!((&found["faircurve"], found.get("support")), (&env!("CARGO_PKG_VERSION").into(), None));
    let peak = &found["grids"][0];
    let whole = ["grid", "rows_in", "columns_in", "rows_out", "columns_out"].map(|key| peak[key].as_u64().unwrap());
    assert_eq!((whole, &peak["status"]), ([0, 3, 3, 9, 9], &"converged".into()));
    // Four edges of length 1 meet in the peak.
    assert_eq!(peak["energy_in"], 4.0);
    let fine = surfaces(&folder, "out.npz");
    let energy = faircurve::laplacian::energy(1, [9, 9], fine.grid(0));
    assert!((peak["energy"].as_f64().unwrap() - energy).abs() <= 1e-15 * energy);
    let deviation = (0..9)
        .map(|k| (fine.point(0, k / 3 * 4, k % 3 * 4)[0] - f64::from(u8::from(k == 4))).abs())
        .fold(0.0, f64::max);
    assert_eq!(peak["max_deviation"].as_f64().unwrap(), deviation);
    assert!(peak["residual"].as_f64().unwrap() < 1e-13 && deviation > 0.1, "{peak}");
    assert_eq!((&found["totals"]["grids"], &found["totals"]["usable"]), (&2.into(), &2.into()));
    assert!(["read", "fit", "write"].iter().all(|key| found["totals"]["seconds"][key].as_f64().unwrap() >= 0.0));
    subdivided(&folder, "in.csv -o out.npz --rule sparse --report report.json");
    let found = report(&folder, "report.json");
    assert_eq!(
        (&found["rule"], &found["support"], &found["reproduces"]),
        (&"sparse".into(), &5.into(), &"constants".into())
    );
}

#[test]
fn a_grid_that_cannot_be_subdivided_is_listed_and_spoils_no_other() {
    let folder = folder(BAD);
    run(&folder, "grid in.csv -o out.csv --device cpu --rounds 2 --report report.json --picture picture.svg")
        .code(1)
        .stdout(is_empty())
        .stderr(contains("1 of 3 grids is not usable:\n  invalid: ").and(contains("grid 1")));
    let out = surfaces(&folder, "out.csv");
    assert_eq!(out.shapes(), [[5, 5], [5, 9], [5, 5]]);
    assert!(out.grid(1).iter().all(|x| x.is_nan()));
    assert!(out.grid(2).iter().all(|x| (x - 5.0).abs() < 1e-14));
    fs::write(folder.path().join("in.csv"), "0,1\n2,3\n").unwrap();
    subdivided(&folder, "in.csv -o alone.csv --rounds 2");
    assert_eq!(surfaces(&folder, "alone.csv").grid(0), out.grid(0));
    let lines = &report(&folder, "report.json")["grids"];
    assert_eq!(
        (&lines[1]["status"], &lines[1]["energy"], &lines[1]["max_deviation"]),
        (&"invalid".into(), &Value::Null, &Value::Null)
    );
    assert!(lines[1]["message"].as_str().unwrap().contains("grid 1") && lines[0].get("message").is_none());
    fs::write(folder.path().join("in.csv"), BAD).unwrap();
    run(&folder, "grid in.csv -o out.obj --device cpu").code(1);
    assert!(read(&folder, "out.obj").contains("# grid_1 has values that are not finite and is left out\n"));
    assert!(read(&folder, "picture.svg").contains("none of them finite"));
}

#[test]
fn grids_of_one_row_are_interpolated_and_points_stay() {
    let folder = folder("0,2,8\n\n7\n");
    subdivided(&folder, "in.csv -o out.csv --rounds 1");
    let out = surfaces(&folder, "out.csv");
    assert_eq!(out.shapes(), [[1, 5], [1, 1]]);
    assert!(
        out.values().iter().zip([0.0, 1.0, 2.0, 5.0, 8.0, 7.0]).all(|(x, wanted)| (x - wanted).abs() < 1e-14),
        "{out:?}"
    );
}

#[test]
fn meshes_have_all_vertices_and_faces_and_stand_over_the_control_points() {
    let folder = folder(TWO);
    subdivided(&folder, "in.csv -o out.obj --rounds 2");
    let text = read(&folder, "out.obj");
    let lines = |kind: &str| text.lines().filter(|line| line.split(' ').next() == Some(kind)).collect::<Vec<_>>();
    assert_eq!(
        (lines("o"), lines("v").len(), lines("f").len()),
        (vec!["o grid_0", "o grid_1"], 81 + 5 * 13, 64 + 4 * 12)
    );
    let numbers = |line: &str| line.split(' ').skip(1).map(|x| x.parse::<f64>().unwrap()).collect::<Vec<_>>();
    let last = numbers(lines("v")[80]);
    assert_eq!(last[..2], [2.0, 2.0]);
    assert_eq!(numbers(lines("v")[145])[..2], [3.0, 1.0]);
    assert_eq!(lines("f")[64], "f 82 83 96 95");
    let largest = lines("f").iter().flat_map(|line| numbers(line)).fold(0.0, f64::max);
    assert_eq!(largest, 146.0);
}

#[test]
fn points_of_the_plane_and_of_space_come_as_npz_and_leave_as_all_but_csv() {
    let folder = folder(TWO);
    let values: Vec<f64> = (0..2 * 3 * 4).map(f64::from).collect();
    for dimension in [2, 3, 4] {
        let grids = Grids::uniform(dimension, [2, 24 / dimension / 2], values.clone()).unwrap();
        let path = folder.path().join("in.npz");
        grids::write(&path, &grids, &GridWrite { overwrite: true, ..GridWrite::default() }).unwrap();
        subdivided(&folder, "in.npz -o out.npz --rounds 1");
        let out = surfaces(&folder, "out.npz");
        assert_eq!((out.dimension(), out.shapes()), (dimension, &[[3, 24 / dimension - 1]][..]));
        refused(&folder, "in.npz -o new.csv", &format!("one value a point, but these have {dimension}: write NPZ"));
        if dimension < 4 {
            subdivided(&folder, "in.npz -o out.obj --picture out.svg");
        } else {
            refused(
                &folder,
                "in.npz -o new.obj",
                "OBJ shows points of the plane or of space, but these have 4 values each: write NPZ",
            );
            refused(&folder, "in.npz -o new.npz --picture new.svg", "SVG shows points of the plane or of space");
        }
    }
    assert!(!folder.path().join("new.npz").exists());
}

#[test]
fn arrays_out_have_the_shape_of_arrays_in() {
    let folder = folder("0,1\n2,3\n\n4,5\n6,7\n");
    let header = |name: &str| {
        subdivided(&folder, &format!("in.csv -o {name} --rounds 1"));
        String::from_utf8_lossy(&fs::read(folder.path().join(name)).unwrap()).into_owned()
    };
    let alike = header("alike.npz");
    assert!(alike.contains("grids.npy") && alike.contains("'shape': (2, 3, 3, )") && alike.contains("'descr': '<f8'"));
    fs::write(folder.path().join("in.csv"), TWO).unwrap();
    let ragged = header("ragged.npz");
    assert!(ragged.contains("grids_0.npy") && ragged.contains("'shape': (5, 5, )"));
    assert!(ragged.contains("grids_1.npy") && ragged.contains("'shape': (3, 7, )"));
}

#[test]
fn pictures_show_every_surface_with_its_control_points() {
    let folder = example("grids.csv");
    subdivided(&folder, "in.csv -o out.svg --picture picture.svg --rule sparse --support 7 --rounds 2");
    assert_eq!(read(&folder, "out.svg"), read(&folder, "picture.svg"));
    let text = read(&folder, "picture.svg");
    let document = roxmltree::Document::parse(&text).unwrap();
    let all =
        |class: &str| document.descendants().filter(|node| node.attribute("class") == Some(class)).collect::<Vec<_>>();
    let faces: Vec<usize> =
        all("faces").iter().map(|group| group.children().filter(|node| node.is_element()).count()).collect();
    assert_eq!(faces, [16 * 16, 12 * 36, 24 * 24]);
    assert_eq!((all("net").len(), all("dots").len()), (3, 3));
    for words in
        ["grid 0", "grid 2", "17 × 17 points from 5 × 5", "sparse rule of support 7, 2 rounds", "control points"]
    {
        assert!(text.contains(words), "{words}");
    }
}

#[test]
fn standard_input_and_output_can_be_piped_with_a_format() {
    let folder = folder(TWO);
    let piped = cargo_bin_cmd!("faircurve")
        .args(["grid", "-", "--from", "csv", "-o", "-", "--to", "csv", "--rounds", "2", "--device", "cpu"])
        .write_stdin(TWO)
        .assert()
        .code(0)
        .stderr(contains("2 grids"));
    subdivided(&folder, "in.csv -o out.csv --rounds 2");
    assert_eq!(String::from_utf8(piped.get_output().stdout.clone()).unwrap(), read(&folder, "out.csv"));
    subdivided(&folder, "in.csv -o out.csv.gz --rounds 2");
    assert_eq!(surfaces(&folder, "out.csv.gz").values(), surfaces(&folder, "out.csv").values());
    refused(&folder, "- -o new.csv", "- has no extension to tell its format: give --from with csv or npz");
    refused(&folder, "in.csv -o -", "- has no extension to tell its format: give --to with csv, npz, obj or svg");
    refused(&folder, "in.csv -o - --to csv --report -", "--output and --report both write -");
}

#[test]
fn outputs_that_exist_or_cannot_be_written_are_refused_before_anything_is_read() {
    let folder = folder(TWO);
    for (name, options) in [
        ("out.csv", "-o out.csv"),
        ("report.json", "-o new.csv --report report.json"),
        ("picture.svg", "-o new.csv --picture picture.svg"),
    ] {
        fs::write(folder.path().join(name), "precious").unwrap();
        refused(&folder, &format!("gone.csv {options}"), &format!("{name} exists already: give --force to replace it"));
        assert_eq!(read(&folder, name), "precious");
    }
    refused(
        &folder,
        "in.csv -o out.txt",
        "the format of out.txt is not known from its extension: give --to with csv, npz, obj or svg",
    );
    refused(&folder, "in.csv -o no/such/out.csv", "cannot write no/such/out.csv: there is no folder");
    refused(&folder, "in.csv -o new.csv --picture p.png", "pictures are SVG, give a name that ends in .svg");
    refused(&folder, "in.csv -o new.svg --picture ./new.svg", "--output and --picture both write ./new.svg");
    refused(&folder, "gone.csv -o new.csv", "cannot read gone.csv");
    refused(&folder, "in.obj -o new.csv", "OBJ is only written, grids are read from CSV and NPZ");
    assert!(!folder.path().join("new.csv").exists());
}

#[test]
fn files_that_hold_no_grids_are_sentences() {
    let folder = folder("x,y\n1,2\n");
    refused(
        &folder,
        "in.csv -o out.csv",
        "in.csv, line 1: the row holds \"x\", \"y\" as a header does, but grids have none",
    );
    fs::write(folder.path().join("in.csv"), "1,2\n3\n").unwrap();
    refused(
        &folder,
        "in.csv -o out.csv",
        "in.csv, line 2: the row has 1 numbers, but the rows of its grid, which began on line 1, have 2",
    );
    fs::write(folder.path().join("in.csv"), "").unwrap();
    refused(&folder, "in.csv -o out.csv", "in.csv: the file is empty: there is nothing to read");
    assert!(!folder.path().join("out.csv").exists());
}

#[test]
fn options_out_of_range_and_those_that_do_not_fit_together_are_refused() {
    let folder = folder("0,1\n2,3\n");
    let say = |options: &str, sentence: &str| refused(&folder, &format!("in.csv -o out.csv {options}"), sentence);
    let rounds = "every round doubles the intervals, and 1 to 30 rounds are possible, such as --rounds 3";
    for number in [0, -2, 31, 4_000_000_000i64] {
        say(&format!("--rounds {number}"), &format!("--rounds is {number}; {rounds}"));
    }
    // How many are possible depends on the memory.
    say("--rounds 16", "--rounds 16 makes 4,295,098,369 values of the 4 points in in.csv, and ");
    say("--rounds 16", " or fewer, or divide the file");
    let windows = "windows are 3, 5, 7, 9 or 11 new points wide: give one of these, such as --support 5";
    for support in [4, 1, 13, -5] {
        say(&format!("--rule sparse --support {support}"), &format!("--support is {support}; {windows}"));
    }
    say(
        "--support 5",
        "--support 5 is the window of a sparse rule; with --rule exact all points count: give --rule sparse, or leave it out",
    );
    say("--linear", "--linear asks a sparse rule to keep linear functions; the exact rule is the one of least energy");
    say("--device cpu --precision f32", "--precision f32 belongs to a GPU; the CPU computes in f64");
    let misread = |options: &str, sentence: &str| {
        run(&folder, &format!("grid in.csv -o out.csv {options}"))
            .code(2)
            .stdout(is_empty())
            .stderr(contains(sentence));
    };
    misread("--rule best", "possible values: exact, sparse");
    misread("--from geojson", "there is no format \"geojson\" for grids: csv, npz, obj and svg are possible");
    misread("--device tpu", "'tpu' is no device");
    assert!(!folder.path().join("out.csv").exists());
}
