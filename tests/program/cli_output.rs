//! What stands in the files that are written, and what is refused before anything is fitted.

use std::fs;

use super::ran::{folder, run};
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

/// Sends a signal to a run that writes, as soon as it does, and tells how it ends. `sh` starts it.
#[cfg(unix)]
fn interrupted(folder: &TempDir, signal: &str, before: &str) -> std::process::ExitStatus {
    use std::process::Command;
    let program = assert_cmd::cargo::cargo_bin!("faircurve");
    let line = format!("{before} exec {} fit in.csv -o out.csv --samples 200000 -q --device cpu", program.display());
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
    for (signal, number) in [("HUP", 1), ("INT", 2), ("TERM", 15)] {
        assert_eq!(interrupted(&folder, signal, "").signal(), Some(number), "{signal}");
        assert!(parts(&folder) == 0 && !folder.path().join("out.csv").exists(), "{signal}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_signal_that_is_to_be_ignored_is_ignored() {
    let folder = folder("curve,x,y\na,0,0\na,1,2\na,3,1\na,4,0\n");
    assert!(interrupted(&folder, "HUP", "trap '' HUP;").success());
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
