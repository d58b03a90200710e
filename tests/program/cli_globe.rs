//! What `faircurve fit` writes of maps and tracks of longitudes and latitudes.

use std::fs;

use super::ran::{folder, run};
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use serde_json::{Value, json};
use tempfile::TempDir;

/// The mean radius of the Earth, in metres.
const EARTH: f64 = 6_371_008.771_4;

type Ring = Vec<[f64; 2]>;

fn read(folder: &TempDir, name: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(folder.path().join(name)).unwrap()).unwrap()
}

/// A collection of a polygon each.
fn polygons(rings: &[&Ring]) -> String {
    let feature = |ring: &&Ring| json!({"type": "Feature", "geometry": {"type": "Polygon", "coordinates": [ring]}});
    json!({"type": "FeatureCollection", "features": rings.iter().map(feature).collect::<Vec<_>>()}).to_string()
}

/// All lists of positions in some coordinates.
fn rings(coordinates: &Value) -> Vec<Ring> {
    match coordinates.as_array() {
        Some(list) if list.first().is_some_and(|first| first[0].is_number()) => {
            vec![list.iter().map(|p| [p[0].as_f64().unwrap(), p[1].as_f64().unwrap()]).collect()]
        }
        Some(list) => list.iter().flat_map(rings).collect(),
        None => vec![],
    }
}

/// The area of a ring on the unit sphere, as it is drawn.
fn area(ring: &Ring) -> f64 {
    let strip = |pair: &[[f64; 2]]| {
        let [a, b] = [pair[0], pair[1]];
        (b[0] - a[0]).to_radians() * 0.5 * (a[1].to_radians().sin() + b[1].to_radians().sin())
    };
    ring.windows(2).map(strip).sum::<f64>().abs()
}

/// A ring about the south pole, 20° apart from this longitude on, that swings about 70° of latitude.
fn round_the_pole(from: f64) -> Ring {
    let mut ring: Ring = (0..18)
        .map(|k| {
            let longitude = (from + 20.0 * f64::from(k) + 540.0) % 360.0 - 180.0;
            [longitude, -70.0 + 3.0 * (3.0 * longitude.to_radians()).cos()]
        })
        .collect();
    ring.push(ring[0]);
    ring
}

#[test]
fn rings_round_a_pole_keep_the_pole() {
    let folder = folder("");
    // The cap within 20°, whose border swings: 2π(1 − cos 20°), and a little more.
    let cap = std::f64::consts::TAU * (1.0 - 20_f64.to_radians().cos());
    let none = || contains("crossing").not().or(contains(": 0 crossings: 0 spans were drawn tighter, 0 left"));
    let said = || contains("1 ring that winds round a pole").and(none());
    for from in [-170.0, -180.0, 5.0] {
        let mut ring = round_the_pole(from);
        for turned in [false, true] {
            let side = if turned { -1.0 } else { 1.0 };
            fs::write(folder.path().join("in.geojson"), polygons(&[&ring])).unwrap();
            for options in
                ["", "--surface wgs84", "--smoothing 0.01", "--topology no", "--antimeridian keep", "--digits 3"]
            {
                let fit = format!("fit in.geojson -o out.geojson --samples 4 --device cpu --force {options}");
                run(&folder, &fit).code(0).stderr(said());
                let geometry = read(&folder, "out.geojson")["features"][0]["geometry"].clone();
                assert_eq!(geometry["type"], "Polygon", "{options}");
                let [out] = &rings(&geometry["coordinates"])[..] else { panic!("{geometry}") };
                assert!((area(out) / cap - 1.0).abs() < 0.05, "{options} {from}: {}", area(out) / cap);
                assert!(out.iter().all(|[x, y]| x.abs() <= 180.0 && y.abs() <= 90.0), "{out:?}");
                for corner in [[180.0, -90.0 * side], [-180.0, -90.0 * side]] {
                    assert!(out.contains(&corner), "{options} {from}: {out:?}");
                }
            }
            run(&folder, "fit in.geojson -o out.topojson --samples 4 --device cpu --force").code(0);
            let arcs = read(&folder, "out.topojson")["arcs"].to_string();
            assert!(arcs.contains(&format!("[180,{}]", -90.0 * side)), "{arcs}");
            // The other pole, and the other way round.
            ring.iter_mut().for_each(|point| point[1] = -point[1]);
            ring.reverse();
        }
    }
}

/// A continent with the frame of the map round the pole.
fn framed() -> Ring {
    let coast = [[180.0, -84.7], [120.0, -67.0], [60.0, -68.0], [0.0, -71.0], [-60.0, -75.0], [-120.0, -74.0]];
    let ends = [[-180.0, -90.0], [180.0, -90.0]];
    ends.into_iter().chain(coast).chain([[-180.0, -84.7], [-180.0, -90.0]]).collect()
}

#[test]
fn the_frame_of_a_map_stays_straight() {
    let folder = folder("");
    // A country that ends at 180, and what is left of it on the other side.
    let east: Ring = vec![[170.0, 60.0], [180.0, 58.0], [180.0, 64.0], [180.0, 70.0], [170.0, 66.0], [170.0, 60.0]];
    let west: Ring = vec![[-180.0, 58.0], [-170.0, 60.0], [-170.0, 66.0], [-180.0, 70.0], [-180.0, 58.0]];
    fs::write(folder.path().join("in.geojson"), polygons(&[&framed(), &east, &west])).unwrap();
    run(&folder, "fit in.geojson -o in.topojson --samples 1 --device cpu").code(0);
    let methods = [
        "",
        "--topology no",
        "--topology no --method fair",
        "--method fair",
        "--deviation 0.2",
        "--smoothing 1",
        "--surface wgs84 --method natural",
    ];
    for (input, method) in ["in.geojson", "in.topojson"].iter().flat_map(|i| methods.map(|m| (i, m))) {
        run(&folder, &format!("fit {input} -o out.geojson --samples 4 --device cpu --force {method}")).code(0);
        let out = read(&folder, "out.geojson");
        let drawn: Vec<Ring> = (0..3).flat_map(|k| rings(&out["features"][k]["geometry"]["coordinates"])).collect();
        for (ring, given) in drawn.iter().zip([&framed(), &east, &west]) {
            assert!(ring.iter().all(|[x, y]| x.abs() <= 180.0 && y.abs() <= 90.0), "{method}: {ring:?}");
            let share = area(ring) / area(given);
            assert!((0.9..1.3).contains(&share), "{method}: {share}");
            // As many samples as of any other span.
            let corners = given.windows(2).filter(|pair| pair[0][0].abs() == 180.0 && pair[0][0] == pair[1][0]);
            for pair in corners {
                let middle = [pair[0][0], 0.5 * (pair[0][1] + pair[1][1])];
                assert!(
                    ring.iter().any(|p| p[0] == middle[0] && (p[1] - middle[1]).abs() < 1e-9),
                    "{method}: {ring:?}"
                );
            }
        }
        assert_eq!(drawn.len(), 3, "{method}: nothing is cut");
    }
}

#[test]
fn rounding_at_180_decides_for_no_file() {
    let folder = folder("");
    let beyond = 180.000_000_000_000_14;
    let ferry = json!([[177, -18], [178.5, -17.2], [-179.5, -16.8], [-178, -17.5]]);
    let inputs = [180.0, beyond].map(|x| {
        let land = json!([[[170, -70], [175, -71], [x, -70.5], [x, -68], [174, -67.5], [170, -70]]]);
        let feature = |kind: &str, coordinates: &Value| json!({"type": "Feature", "geometry": {"type": kind, "coordinates": coordinates}});
        let features = [feature("Polygon", &land), feature("LineString", &ferry)];
        json!({"type": "FeatureCollection", "features": features}).to_string()
    });
    for options in ["", "--method fair", "--surface sphere"] {
        let written = inputs.clone().map(|input| {
            fs::write(folder.path().join("in.geojson"), input).unwrap();
            run(&folder, &format!("fit in.geojson -o out.geojson --samples 4 --device cpu --force {options}")).code(0);
            read(&folder, "out.geojson")
        });
        assert_eq!(written[0], written[1], "{options}");
        assert_eq!(written[0]["features"][1]["geometry"]["type"], "MultiLineString");
        let all = rings(&written[0]["features"][0]["geometry"]["coordinates"]);
        assert!(all.iter().flatten().all(|[x, _]| x.abs() <= 180.0), "{all:?}");
    }
    // In tables too one row leaves the others as they are.
    fs::write(folder.path().join("in.csv"), format!("curve,lon,lat\na,{beyond},0\na,179,1\nb,179,0\nb,-179,1\n"))
        .unwrap();
    run(&folder, "fit in.csv -o out.csv --samples 2 --device cpu --force").code(0);
    let text = fs::read_to_string(folder.path().join("out.csv")).unwrap();
    assert!(text.contains("b,-179,1,"), "{text}");
}

/// The numbers of a written table, by the names of their columns.
fn table(folder: &TempDir) -> Vec<std::collections::BTreeMap<String, f64>> {
    let text = fs::read_to_string(folder.path().join("out.csv")).unwrap();
    let mut rows = text.lines().map(|line| line.split(',').map(str::to_string).collect::<Vec<_>>());
    let header = rows.next().unwrap();
    let number = |(name, cell): (&String, &String)| Some((name.clone(), cell.parse().ok()?));
    rows.map(|row| header.iter().zip(&row).filter_map(number).collect()).collect()
}

#[test]
fn all_columns_of_a_row_on_the_globe_have_one_unit() {
    let folder = folder("curve,lon,lat,t\na,0,60,0\na,60,60,1\n");
    let fit = "fit in.csv -o out.csv --write tangent,heading,curvature,arclength --device cpu --force --samples 64";
    let surfaces = ["--surface sphere", "--surface wgs84", "--method geodesic --surface sphere", ""];
    for surface in surfaces {
        run(&folder, &format!("{fit} {surface}")).code(0);
        let rows = table(&folder);
        for row in &rows {
            let heading = row["heading"].to_radians();
            assert!((row["tangent_x"] - heading.sin()).abs() < 1e-9, "{surface}: {row:?}");
            assert!((row["tangent_y"] - heading.cos()).abs() < 1e-9, "{surface}: {row:?}");
        }
        // The course turns by the curvature, and by the meridians that run together: dα = κ ds + sin φ dλ.
        for pair in rows.windows(2) {
            let middle = |name: &str| 0.5 * (pair[0][name] + pair[1][name]);
            let step = |name: &str| pair[1][name] - pair[0][name];
            let turned = -step("heading").to_radians() + middle("y").to_radians().sin() * step("x").to_radians();
            let curved = middle("curvature") * step("arclength");
            assert!((turned - curved).abs() < 1e-5, "{surface}: {turned} {curved}");
        }
        let largest = rows.iter().map(|row| row["curvature"].abs()).fold(0.0, f64::max);
        match surface {
            // A straight line of the drawing is the parallel of 60°.
            "" => assert!((largest * EARTH / 60_f64.to_radians().tan() - 1.0).abs() < 1e-9, "{largest}"),
            _ => assert!(largest < 1e-10, "{surface}: {largest}"),
        }
    }
}

#[test]
fn a_curve_in_a_surface_has_one_length() {
    let folder = folder("curve,lon,lat,t\na,0,0,0\na,40,10,1\na,80,0,2\n");
    fs::write(folder.path().join("torus.csv"), "curve,x,y,z\na,3,0,0\na,0,2,1\na,-2,0,1\n").unwrap();
    let options = [
        "in.csv --method natural --surface sphere",
        "in.csv --method natural --surface wgs84",
        "in.csv --method fair --surface sphere",
        "in.csv --smoothing 1e-9 --surface wgs84",
        "torus.csv --method natural --surface torus:2,1",
        "torus.csv --method fair --surface torus:2,1",
    ];
    for options in options {
        let fit =
            format!("fit {options} -o out.csv --samples 50 --write arclength --report r.json --device cpu --force");
        run(&folder, &fit).code(0);
        let length = read(&folder, "r.json")["curves"][0]["length"].as_f64().unwrap();
        let rows = table(&folder);
        let column = rows[rows.len() - 1]["arclength"];
        assert!((length / column - 1.0).abs() < 2e-9, "{options}: {length} {column}");
    }
    // A border of a map on the globe is measured in metres too: a square of a degree about the equator.
    let square: Ring = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
    let next: Ring = square.iter().map(|[x, y]| [x + 1.0, *y]).collect();
    fs::write(folder.path().join("in.geojson"), polygons(&[&square, &next])).unwrap();
    run(&folder, "fit in.geojson -o out.geojson --surface sphere --report r.json --device cpu --force").code(0);
    let length = read(&folder, "r.json")["curves"][0]["length"].as_f64().unwrap();
    assert!((4.2e5..5.2e5).contains(&length), "{length}");
}

#[test]
fn topologies_are_cut_at_180_as_geojson_is() {
    let folder = folder("");
    // Two neighbours across 180, with a common border.
    let north: Ring = vec![[175.0, 0.0], [-175.0, 2.0], [-174.0, 9.0], [176.0, 8.0], [175.0, 0.0]];
    let south: Ring = vec![[175.0, 0.0], [178.0, -7.0], [-173.0, -6.0], [-175.0, 2.0], [175.0, 0.0]];
    let point: Ring = vec![[1.0, 1.0]; 4];
    fs::write(folder.path().join("in.geojson"), polygons(&[&north, &south, &point])).unwrap();
    for (keep, kind) in [("", "MultiPolygon"), ("--antimeridian keep", "Polygon")] {
        let fit = |options: &str| run(&folder, &format!("fit {options} --device cpu --force {keep}"));
        fit("in.geojson -o out.geojson --samples 5").code(0);
        fit("in.geojson -o out.topojson --samples 5 --digits 12 --strict").code(1);
        fit("out.topojson -o again.geojson --samples 1").code(0);
        let (out, again) = (read(&folder, "out.geojson"), read(&folder, "again.geojson"));
        for k in 0..2 {
            let [geometry, same] = [&out, &again].map(|document| &document["features"][k]["geometry"]);
            assert_eq!((geometry["type"].as_str(), &same["type"]), (Some(kind), &geometry["type"]));
            let [given, drawn] = [geometry, same].map(|geometry| rings(&geometry["coordinates"]));
            let close = |(a, b): (&Ring, &Ring)| (area(a) - area(b)).abs() < 1e-9 && a.len() == b.len();
            assert!(given.len() == drawn.len() && given.iter().zip(&drawn).all(close), "{given:?} {drawn:?}");
        }
        let statuses = [1, 2].map(|k| again["features"][k]["properties"]["status"].clone());
        assert_eq!(statuses, ["converged", "degenerate"]);
    }
}

#[test]
fn topologies_named_json_leave_as_topologies() {
    let folder = folder("");
    let text = r#"{"type":"Topology","arcs":[[[0,0],[1,0],[1,1],[0,1],[0,0]]],"objects":{
        "a":{"type":"GeometryCollection","geometries":[{"type":"Polygon","arcs":[[0]],"id":"1"}]},
        "b":{"type":"GeometryCollection","geometries":[{"type":"Polygon","arcs":[[0]],"id":"1"}]}}}"#;
    fs::write(folder.path().join("in.json"), text).unwrap();
    let objects = |name: &str| {
        let document = read(&folder, name);
        let objects = document["objects"].as_object().map(|objects| objects.keys().cloned().collect::<Vec<_>>());
        (document["type"].as_str().unwrap().to_string(), objects.unwrap_or_default())
    };
    let topology = ("Topology".to_string(), vec!["a".to_string(), "b".to_string()]);
    for name in ["out.json", "out.topojson"] {
        run(&folder, &format!("fit in.json -o {name} --samples 2 --device cpu")).code(0);
        assert_eq!(objects(name), topology);
    }
    assert_eq!(read(&folder, "out.json"), read(&folder, "out.topojson"));
    // GeoJSON is what says so, or what came as GeoJSON.
    run(&folder, "fit in.json -o out.geojson --samples 2 --device cpu").code(0);
    run(&folder, "fit in.json -o asked.json --to geojson --samples 2 --device cpu").code(0);
    run(&folder, "fit out.geojson -o again.json --samples 2 --device cpu").code(0);
    for name in ["out.geojson", "asked.json", "again.json"] {
        assert_eq!(objects(name).0, "FeatureCollection", "{name}");
    }
}

#[test]
fn samples_are_the_same_on_every_border_of_a_map() {
    let folder = folder("");
    let west: Ring = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 6.0], [0.0, 6.0], [0.0, 0.0]];
    let east: Ring = vec![[4.0, 0.0], [9.0, 0.0], [9.0, 6.0], [4.0, 6.0], [4.0, 0.0]];
    fs::write(folder.path().join("in.geojson"), polygons(&[&west, &east])).unwrap();
    for options in ["", "--junctions free", "--topology no", "--surface sphere", "--method fair", "--crossings mend"] {
        for samples in [1, 2, 3] {
            let fit = format!("fit in.geojson -o out.geojson --samples {samples} --device cpu --force {options}");
            run(&folder, &fit).code(0);
            let out = read(&folder, "out.geojson");
            for feature in out["features"].as_array().unwrap() {
                let [ring] = &rings(&feature["geometry"]["coordinates"])[..] else { panic!("{feature}") };
                assert_eq!(ring.len(), 4 * samples + 1, "{options}: {ring:?}");
            }
        }
    }
}
