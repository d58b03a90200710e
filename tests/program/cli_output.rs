//! What stands in the files that are written, and what is refused before anything is fitted.

use std::fs;

use super::ran::{folder, run};
use assert_cmd::cargo::cargo_bin_cmd;
use faircurve::{CurveBatch, io};
use predicates::prelude::*;
use predicates::str::contains;
use serde_json::Value;
use tempfile::TempDir;

/// A good curve, one with a blank, and a single point.
const UNLIKE: &str = "curve,x,y\ngood,0,0\ngood,1,1\ngood,2,0\nhalf,0,0\nhalf,,1\nhalf,2,0\npoint,5,5\n";

/// Features with properties, without, with none, and with a status of their own.
const FEATURES: &str = r#"{"type":"FeatureCollection","features":[
{"type":"Feature","properties":{"a":1},"geometry":{"type":"LineString","coordinates":[[0,0],[1,1],[2,0]]}},
{"type":"Feature","properties":{},"geometry":{"type":"LineString","coordinates":[[0,0],[1,null],[2,0]]}},
{"bbox":[0,0,2,1],"type":"Feature","properties":null,"geometry":{"type":"MultiLineString","coordinates":[[[0,0],[1,1],[2,0]],[[0,0],[null,1]]]}},
{"bbox":[0,0,2,1],"type":"Feature","geometry":{"type":"LineString","coordinates":[[0,0],[1,1],[2,0]]}},
{"type":"Feature","properties":{"status":"planned"},"geometry":{"type":"LineString","coordinates":[[0,0],[1,1],[2,0]]}},
{"type":"Feature","properties":{"b":2},"geometry":{"type":"Point","coordinates":[0,0]}}]}"#;

fn read(folder: &TempDir, name: &str) -> String {
    fs::read_to_string(folder.path().join(name)).unwrap()
}

#[test]
fn files_have_statuses_where_a_curve_is_not_usable() {
    let folder = folder(UNLIKE);
    run(&folder, "fit in.csv -o out.csv --samples 1").code(1);
    let out = read(&folder, "out.csv");
    assert!(out.starts_with("curve,x,y,t,status\ngood,0,0,0,converged\n"), "{out}");
    assert!(out.contains("\nhalf,NaN,1,1,invalid\n") && out.ends_with("\npoint,5,5,0,degenerate\n"), "{out}");
    run(&folder, "fit in.csv -o out.npz --samples 1").code(1);
    let bytes = fs::read(folder.path().join("out.npz")).unwrap();
    let has = |bytes: &[u8], name: &[u8]| bytes.windows(name.len()).any(|window| window == name);
    assert!(has(&bytes, b"status.npy") && has(&bytes, b"'<U10', 'fortran_order': False, 'shape': (3, )"));
    // Files of usable curves are as they were. Single points are unusable with --strict alone.
    fs::write(folder.path().join("good.csv"), UNLIKE.replace("half,,1\n", "half,1,1\n")).unwrap();
    run(&folder, "fit good.csv -o good_out.csv --samples 1").code(0);
    assert!(read(&folder, "good_out.csv").starts_with("curve,x,y,t\n"));
    run(&folder, "fit good.csv -o strict.csv --samples 1 --strict").code(1);
    assert!(read(&folder, "strict.csv").starts_with("curve,x,y,t,status\n"));
    run(&folder, "fit in.csv -o out.svg --samples 1").code(1).stderr(contains("SVG has no place for a status"));
}

#[test]
fn features_have_the_worst_status_of_their_curves() {
    let folder = folder("");
    fs::write(folder.path().join("in.geojson"), FEATURES).unwrap();
    for name in ["out.geojson", "out.topojson"] {
        run(&folder, &format!("fit in.geojson -o {name} --samples 1")).code(1);
        let document: Value = serde_json::from_str(&read(&folder, name)).unwrap();
        let features = match &document["features"] {
            Value::Array(features) => features,
            _ => document["objects"]["features"]["geometries"].as_array().unwrap(),
        };
        let of = |i: usize, name: &str| features[i]["properties"][name].as_str().unwrap_or_default().to_string();
        let statuses: Vec<String> = (0..6).map(|i| of(i, "status")).collect();
        assert_eq!(statuses, ["converged", "invalid", "invalid", "converged", "planned", ""], "{name}");
        assert_eq!(
            (of(4, "status_").as_str(), &features[0]["properties"]["a"]),
            ("converged", &Value::from(1)),
            "{name}"
        );
        // What was written is read.
        assert_eq!(io::read(folder.path().join(name)).unwrap().len(), 6, "{name}");
    }
}

#[test]
fn unusable_curves_are_left_out_on_demand_and_counted() {
    let folder = folder(UNLIKE);
    fs::write(folder.path().join("in.geojson"), FEATURES).unwrap();
    for name in ["out.csv", "out.npz", "out.svg", "out.topojson", "out.gpx"] {
        run(&folder, &format!("fit in.csv -o {name} --samples 1 --drop-unusable"))
            .code(1)
            .stderr(contains("faircurve: 1 curve left out").and(contains("invalid: in.csv, line 6, curve half")));
        let out = io::read(folder.path().join(name)).unwrap();
        assert!(!read(&folder, "out.csv").contains("half") && out.total_points() == 4, "{name}");
    }
    // Documents keep the places of curves, and all else.
    run(&folder, "fit in.geojson -o out.geojson --samples 1 --drop-unusable").code(1);
    let out = read(&folder, "out.geojson");
    assert!(out.contains(r#""properties":{},"geometry":{"type":"LineString","coordinates":[]}"#), "{out}");
    assert!(out.contains(r#""properties":{"status":"planned"}"#) && !out.contains("invalid"), "{out}");
}

#[test]
fn a_column_status_is_passed_over_or_carried() {
    let folder = folder("curve,x,y,status\na,0,0,invalid\na,1,1,invalid\na,2,0,invalid\nb,0,0,x\nb,,1,x\n");
    run(&folder, "fit in.csv -o out.csv --samples 1").code(1).stderr(contains("column status passed over"));
    assert!(read(&folder, "out.csv").starts_with("curve,x,y,t,status\na,0,0,0,converged\n"));
    run(&folder, "fit in.csv -o carried.csv --samples 1 --carry all").code(1);
    assert!(read(&folder, "carried.csv").starts_with("curve,x,y,t,status,status_\na,0,0,0,converged,invalid\n"));
    run(&folder, "fit out.csv -o again.csv --samples 1").code(1);
}

/// Sends a signal to a run that writes, as soon as it does, and tells how it ends. `start` is the words of a shell that start it.
#[cfg(unix)]
fn interrupted(folder: &TempDir, signal: &str, start: &str) -> std::process::ExitStatus {
    use std::process::Command;
    let program = assert_cmd::cargo::cargo_bin!("faircurve");
    let line = format!("{start} {} fit in.csv -o out.csv --samples 200000 -q --device cpu", program.display());
    let mut child = Command::new("sh").args(["-c", &line]).current_dir(folder).spawn().unwrap();
    while parts(folder) == 0 {
        assert!(child.try_wait().unwrap().is_none(), "the run ended before it was seen to write");
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    let killed = Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    child.wait().unwrap()
}

/// The number of files that are half written.
#[cfg(unix)]
fn parts(folder: &TempDir) -> usize {
    let names = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    names.filter(|name| name.ends_with(".part")).count()
}

#[cfg(unix)]
#[test]
fn signals_leave_nothing_half_written_and_end_as_they_did() {
    use std::os::unix::process::ExitStatusExt;
    let folder = folder("curve,x,y\na,0,0\na,1,2\na,3,1\na,4,0\n");
    // What nohup starts ignores HUP, and so do its children unless told otherwise.
    let start = if cfg!(target_os = "linux") { "exec env --default-signal" } else { "exec" };
    for (signal, number) in [("HUP", 1), ("INT", 2), ("TERM", 15)] {
        assert_eq!(interrupted(&folder, signal, start).signal(), Some(number), "{signal}");
        assert!(parts(&folder) == 0 && !folder.path().join("out.csv").exists(), "{signal}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_signal_that_is_to_be_ignored_is_ignored() {
    let folder = folder("curve,x,y\na,0,0\na,1,2\na,3,1\na,4,0\n");
    assert!(interrupted(&folder, "HUP", "trap '' HUP; exec").success());
    assert!(parts(&folder) == 0 && folder.path().join("out.csv").exists());
}

#[cfg(unix)]
#[test]
fn a_full_disk_is_one_line_whatever_the_format() {
    let folder = folder(&waves(3, 40));
    fs::write(folder.path().join("grid.csv"), "0,1,2\n1,3,1\n2,0,2\n").unwrap();
    let program = assert_cmd::cargo::cargo_bin!("faircurve");
    for name in ["out.csv", "out.npz", "out.npy", "out.svg", "out.geojson", "out.topojson", "out.csv.gz", "grid.npz"] {
        let what = if name == "grid.npz" { "grid grid.csv --rounds 7" } else { "fit in.csv --samples 60" };
        // Files may have 8 KiB.
        let line = format!("ulimit -f 16; exec {} {what} -o {name} -q", program.display());
        let output = std::process::Command::new("sh").args(["-c", &line]).current_dir(&folder).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), said.lines().count()), (Some(2), 1), "{name}: {said}");
        assert!(said.starts_with(&format!("faircurve: cannot write {name}: File too large")), "{said}");
        assert!(parts(&folder) == 0 && !folder.path().join(name).exists(), "{name}");
    }
}

/// So many curves of so many points.
fn waves(curves: usize, points: usize) -> String {
    let row = |i: usize, k: usize| format!("{i},{k},{}\n", ((k * (i + 2)) as f64).sin());
    let rows = (0..curves).flat_map(|i| (0..points).map(move |k| row(i, k)));
    "curve,x,y\n".to_string() + &rows.collect::<String>()
}

#[test]
fn no_format_is_written_in_small_pieces() {
    struct Counted {
        calls: usize,
        bytes: usize,
    }
    impl std::io::Write for Counted {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            (self.calls, self.bytes) = (self.calls + 1, self.bytes + bytes.len());
            Ok(bytes.len())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let points: Vec<[f64; 3]> = (0..50_000).map(|k| [f64::from(k), f64::from(k).sin(), 1.0]).collect();
    let flat: Vec<[f64; 2]> = points.iter().map(|&[x, y, _]| [0.001 * x, y]).collect();
    let (flat, space) = (CurveBatch::from_slices(&[&flat[..]]), CurveBatch::from_slices(&[&points[..]]));
    let (flat, space) = (flat.unwrap(), space.unwrap());
    for &format in io::Format::ALL {
        let batch = if format.check(2, false).is_ok() { &flat } else { &space };
        let mut out = Counted { calls: 0, bytes: 0 };
        let options = io::WriteOptions { format: Some(format), ..Default::default() };
        io::write_to(&mut out, batch, &options).unwrap();
        assert!(out.bytes > 500_000 && out.calls <= 3 + out.bytes / 50_000, "{format}: {} calls", out.calls);
    }
}

/// The shape in the header of an NPY file.
fn shape(folder: &TempDir, name: &str) -> String {
    let bytes = fs::read(folder.path().join(name)).unwrap();
    let header = String::from_utf8_lossy(&bytes[..128]).into_owned();
    header.split_once("'shape': ").unwrap().1.split(", )").next().unwrap().to_string()
}

/// Curves of four points: a good one, a single point, and one with a blank.
const FOUR: &str = "curve,x,y\na,0,0\na,1,2\na,3,1\na,4,4\np,5,5\np,5,5\np,5,5\np,5,5\nb,0,0\nb,1,1\nb,,1\nb,2,2\n";

#[test]
fn a_number_of_points_is_kept_by_curves_that_are_not_fitted() {
    let folder = folder(&(FOUR.to_string() + "d,0,0\nd,1,0\nd,1,1\nd,0,3\n"));
    for method in
        ["natural", "smoothing --smoothing 1", "fair", "scf", "natural --surface sphere", "fair --surface sphere"]
    {
        for write in ["", " --carry all --write arclength"] {
            run(&folder, &format!("fit in.csv -o out.csv --points 6 --force --method {method}{write}")).code(1);
            let text = read(&folder, "out.csv");
            let rows = |curve: &str| text.lines().filter(|line| line.starts_with(curve)).collect::<Vec<_>>();
            assert_eq!(["a,", "b,", "d,"].map(|curve| rows(curve).len()), [6, 6, 6], "{method}: {text}");
            // All points equal close the curve, which meets its first point again.
            assert!(
                rows("p,").len() == 7 && rows("p,").iter().all(|row| row.starts_with("p,5,5,")),
                "{method}: {text}"
            );
            assert!(rows("b,").iter().all(|row| row.starts_with("b,NaN,NaN,")), "{method}: {text}");
        }
    }
}

#[test]
fn npy_is_written_whatever_curves_are_not_usable() {
    let folder = folder(FOUR);
    for (options, wanted) in
        [("--points 8", "(3, 8, 2"), ("--samples 5", "(3, 16, 2"), ("--samples 5 --drop-unusable", "(2, 16, 2")]
    {
        run(&folder, &format!("fit in.csv -o out.npy --force {options}")).code(1);
        assert_eq!(shape(&folder, "out.npy"), wanted, "{options}");
        let out = io::read(folder.path().join("out.npy")).unwrap();
        assert!(out.points(1).iter().all(|x| *x == 5.0) && out.points(0).iter().all(|x| x.is_finite()), "{options}");
        assert!(out.len() == 2 || out.points(2).iter().all(|x| x.is_nan()), "{options}");
    }
}

#[test]
fn what_a_format_cannot_hold_is_refused_before_the_fit() {
    let folder = folder("curve,x,y,t\na,0,0,0\na,1,2,1\na,3,1,2\nb,0,0,0\nb,1,1,1\nb,1,3,2\nb,2,2,3\n");
    fs::write(folder.path().join("terrain.csv"), "0,1,2,3\n1,1,2,4\n0,2,3,3\n0,0,0,2\n").unwrap();
    let twice = io::read(folder.path().join("in.csv")).unwrap().with_names(vec!["a".into(), "a".into()]).unwrap();
    io::write(folder.path().join("twice.npz"), &twice).unwrap();
    for (arguments, sentence) in [
        ("in.csv -o out.npy --samples 2", "NPY holds curves of one length, and these have 5 to 7 points"),
        ("in.csv -o out.npy --every 1", "NPY holds curves of one length, and these have 3 to 4 points"),
        ("in.csv -o out.npy --spacing 0.5", "with --spacing each has its own: give --points N, or write NPZ"),
        ("twice.npz -o out.csv", "curves 0 and 1 are both called \"a\""),
        ("in.csv -o out.svg --surface grid:terrain.csv", "SVG holds points of 2 dimensions, but the curves have 3"),
    ] {
        // The device is asked for after that, and there is none.
        cargo_bin_cmd!("faircurve")
            .current_dir(&folder)
            .env("VK_DRIVER_FILES", "/none")
            .args(["fit", "--device", "gpu"])
            .args(arguments.split_whitespace())
            .assert()
            .code(2)
            .stderr(contains(sentence));
    }
}

#[test]
fn a_curve_that_is_a_point_is_not_divided_to_have_an_area() {
    let folder = folder("curve,x,y,t\na,1,2,0\na,1,2,6\na,1,2,12\n");
    for method in ["natural", "smoothing --smoothing 1", "smoothing --tube 1", "smoothing --within 1", "fair", "scf"] {
        for closed in ["auto", "yes", "no"] {
            run(&folder, &format!("fit in.csv -o out.csv --samples 1 --force --method {method} --closed {closed}"))
                .code(0);
            let text = read(&folder, "out.csv");
            let rows: Vec<&str> = text.lines().skip(1).map(|row| row.trim_end_matches(",1")).collect();
            assert_eq!(rows, ["a,1,2,0", "a,1,2,6", "a,1,2,12"], "{method}, {closed}");
        }
    }
}

#[test]
fn samples_over_terrain_have_heights_however_they_are_taken() {
    let folder = folder("curve,x,y,t\np,5,5,0\np,20,12,5\np,30,30,10\n");
    let row = |i: usize| (0..6).map(|k| (2 * i + k).to_string()).collect::<Vec<_>>().join(",") + "\n";
    fs::write(folder.path().join("grid.csv"), (0..6).map(row).collect::<String>()).unwrap();
    for options in [
        "--samples 2",
        "--every 5",
        "--points 3",
        "--at in.csv",
        "--points 3 --write arclength",
        "--every 5 --write heading",
    ] {
        run(&folder, &format!("fit in.csv -o out.csv --force --surface grid:grid.csv,10 {options}")).code(0);
        let text = read(&folder, "out.csv");
        assert!(text.starts_with("curve,x,y,z,t"), "{options}: {text}");
        let last: Vec<f64> =
            text.lines().last().unwrap().split(',').skip(1).take(3).map(|x| x.parse().unwrap()).collect();
        assert!((last[2] - (0.1 * last[0] + 0.2 * last[1])).abs() < 1e-9, "{options}: {text}");
    }
}

#[test]
fn more_than_fits_is_refused_before_the_fit_with_what_would_fit() {
    let folder = folder("curve,x,y,t\na,0,0,0\na,90,10,1\na,170,-10,1e9\nb,0,5,0\nb,60,9,1\nb,120,0,1e9\n");
    for (options, sentences) in [
        ("--spacing 1 --surface wgs84", ["samples of all curves, which take ", "give a spacing of "]),
        ("--spacing 1e-9", ["of all curves, which take ", " or more"]),
        ("--spacing 1 --surface sphere --method natural --write speed", ["which take ", "give a spacing of "]),
        ("--points 100000000000000", [" of all curves, which take 9.2e9 MiB of memory, but ", " or fewer, or give"]),
        (
            "--points 100000000000000 --write speed",
            [" of all curves, which take 1.2e10 MiB of memory, but ", " or fewer, or give"],
        ),
        ("--every 1", [" of all curves, which take ", ": give "]),
        ("--every 1e-9", [" of all curves, which take ", ": give "]),
    ] {
        // The device is asked for after that, and there is none.
        let sentences = contains(sentences[0].trim_start_matches("samples")).and(contains(sentences[1]));
        cargo_bin_cmd!("faircurve")
            .current_dir(&folder)
            .env("VK_DRIVER_FILES", "/none")
            .args("fit in.csv -o out.csv --device gpu".split_whitespace())
            .args(options.split_whitespace())
            .assert()
            .code(2)
            .stderr(sentences.and(contains(" MiB ")));
    }
}

#[test]
fn a_blank_cell_is_the_trouble_of_its_grid_alone() {
    for blank in ["", " ", "NA", "null", "nan"] {
        let folder = folder(&format!("0,1,2\n1,{blank},3\n2,3,4\n\n0,1,2\n1,1,3\n2,3,4\n"));
        run(&folder, "grid in.csv -o out.csv --rounds 1")
            .code(1)
            .stderr(contains("grid 0: the value in row 1, column 1 (counted from 0) is NaN"));
        let out = io::grids::read(folder.path().join("out.csv"), None).unwrap();
        assert!(out.shapes() == [[5, 5], [5, 5]] && out.grid(1).iter().all(|x| x.is_finite()), "{blank}");
    }
}

#[test]
fn a_hole_of_a_terrain_concerns_what_needs_it_alone() {
    let path =
        "curve,x,y\nnear,5,5\nnear,20,12\nnear,30,30\nin,40,40\nin,90,90\nin,100,115\nover,80,100\nover,120,100\n";
    let folder = folder(path);
    let height = |row: usize, column: usize| (0.4 * row as f64).sin() + (0.3 * column as f64).cos();
    for (name, hole) in [("clean", "0.5"), ("blank", ""), ("nan", "NaN"), ("inf", "-inf")] {
        let cell = |row: usize, column: usize| match (row, column) {
            (9..=11, 10) if name != "clean" => hole.to_string(),
            _ => height(row, column).to_string(),
        };
        let row = |row: usize| (0..16).map(|column| cell(row, column)).collect::<Vec<_>>().join(",") + "\n";
        fs::write(folder.path().join(format!("{name}.csv")), (0..16).map(row).collect::<String>()).unwrap();
    }
    let z = |name: &str| {
        let text = read(&folder, name);
        let rows = text.lines().filter(|row| row.starts_with("near,"));
        rows.map(|row| row.split(',').nth(3).unwrap().parse::<f64>().unwrap()).collect::<Vec<_>>()
    };
    for method in ["fair", "natural", "geodesic"] {
        run(
            &folder,
            &format!("fit in.csv -o out.csv --force --surface grid:clean.csv,10 --samples 2 --method {method}"),
        )
        .code(0);
        let clean = z("out.csv");
        for name in ["blank", "nan", "inf"] {
            run(
                &folder,
                &format!("fit in.csv -o out.csv --force --surface grid:{name}.csv,10 --samples 2 --method {method}"),
            )
            .code(1)
            .stderr(contains("curve in, point 2: it lies in a hole of the grid: row 11 and column 10"))
            .stderr(contains(
                "curve over, point 0: the curve after it lies in a hole of the grid: row 9 and column 10",
            ));
            assert!(clean.iter().zip(z("out.csv")).all(|(a, b)| (a - b).abs() < 1e-3), "{method} {name}");
        }
    }
}
