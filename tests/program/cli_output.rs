//! What stands in the files that are written, and what is refused before anything is fitted.

use std::fs;

use super::ran::{folder, run};
use faircurve::io;
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
