//! `faircurve fit --surface` and `--method geodesic` as their users meet them.

use std::fs;

use super::ran::run;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use serde_json::Value;
use tempfile::TempDir;

/// A track over the north pole, and one over the date line.
const TRACKS: &str = "curve,lon,lat\npole,100,70\npole,60,82\npole,-80,85\npole,-120,70\ndate,170,-10\ndate,178,-14\ndate,-172,-12\ndate,-165,-20\n";

fn folder(text: &str) -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("in.csv"), text).unwrap();
    folder
}

fn reports(folder: &TempDir, arguments: &str, code: i32) -> Vec<Value> {
    run(folder, &format!("fit in.csv -o out.csv --device cpu --report report.json --force {arguments}")).code(code);
    let text = fs::read_to_string(folder.path().join("report.json")).unwrap();
    serde_json::from_str::<Value>(&text).unwrap()["curves"].as_array().unwrap().clone()
}

#[test]
fn tracks_on_the_globe_go_over_the_pole_and_the_date_line_in_metres() {
    let folder = folder(TRACKS);
    for surface in ["wgs84", "sphere"] {
        let lines = reports(&folder, &format!("--surface {surface}"), 0);
        assert!(lines.iter().all(|line| line["status"] == "converged"), "{lines:?}");
        // From 70° to 70° over the pole some 40° of 111 km, and a detour.
        let length = lines[0]["length"].as_f64().unwrap();
        assert!((4.5e6..5.5e6).contains(&length), "{length}");
    }
    let text = fs::read_to_string(folder.path().join("out.csv")).unwrap();
    let rows: Vec<[f64; 2]> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').skip(1).take(2).map(|field| field.parse().unwrap()).collect::<Vec<f64>>())
        .map(|fields| [fields[0], fields[1]])
        .collect();
    assert_eq!(rows.len(), 2 * 49);
    assert!(rows.iter().all(|[lon, _]| lon.abs() <= 180.0), "longitudes come back to ±180");
    assert!(rows[..49].iter().any(|[_, lat]| *lat > 86.0) && rows[..49].iter().all(|[_, lat]| *lat >= 70.0 - 1e-9));
    // Data points keep their digits.
    assert!(text.contains("pole,-80,85\n") || text.contains("pole,-80,85,"), "{text}");
}

#[test]
fn rings_of_one_height_are_fitted_on_the_globe_with_others() {
    let folder = folder(
        "curve,x,y,z,closed\nflat,0,40,7,1\nflat,9,41,7,1\nflat,20,40,7,1\nsloped,0,50,1,1\nsloped,9,51,2,1\nsloped,20,50,3,1\n",
    );
    for method in
        ["--surface wgs84", "--surface wgs84 --method natural", "--surface sphere --method smoothing --smoothing 1"]
    {
        let lines = reports(&folder, method, 0);
        assert!(lines.iter().all(|line| line["status"] == "converged"), "{method} {lines:?}");
        let text = fs::read_to_string(folder.path().join("out.csv")).unwrap();
        let height = |line: &str| line.split(',').nth(3).unwrap().parse::<f64>().unwrap();
        let flat: Vec<f64> = text.lines().filter(|line| line.starts_with("flat")).map(height).collect();
        assert!(flat.len() > 3 && flat.iter().all(|z| (z - 7.0).abs() < 1e-9), "{method} {flat:?}");
    }
}

#[test]
fn borders_of_geojson_stay_geojson_on_the_globe() {
    let folder = folder("");
    let text = r#"{"type":"FeatureCollection","features":[{"type":"Feature","properties":{"n":1},"geometry":{"type":"LineString","coordinates":[[170,0],[178,6],[-172,2],[-165,8]]}}]}"#;
    fs::write(folder.path().join("in.geojson"), text).unwrap();
    run(&folder, "fit in.geojson -o out.geojson --surface wgs84 --device cpu").code(0);
    let out: Value = serde_json::from_str(&fs::read_to_string(folder.path().join("out.geojson")).unwrap()).unwrap();
    let geometry = &out["features"][0]["geometry"];
    assert_eq!(geometry["type"], "MultiLineString", "the line is cut at the antimeridian");
}

#[test]
fn geodesics_are_the_straight_ways_between_points() {
    let folder = folder("curve,lon,lat\na,13.4,52.5\na,139.7,35.7\nb,0,0\nb,90,0\nb,90,45\n");
    let lines = reports(&folder, "--surface sphere --radius 1 --method geodesic --samples 64", 0);
    let quarter = std::f64::consts::FRAC_PI_2;
    let [a, b] = [0, 1].map(|i| lines[i]["length"].as_f64().unwrap());
    // cos c = sin φ₁ sin φ₂ + cos φ₁ cos φ₂ cos Δλ
    let [p, q, turn] = [52.5f64, 35.7, 126.3].map(f64::to_radians);
    let arc = (p.sin() * q.sin() + p.cos() * q.cos() * turn.cos()).acos();
    assert!((a / arc - 1.0).abs() < 1e-7, "{a} {arc}");
    assert!((b / (1.5 * quarter) - 1.0).abs() < 1e-7, "{b}");
    assert!(lines.iter().all(|line| line["energy"].as_f64().unwrap() < 1e-12));
}

#[test]
fn timed_tracks_on_the_globe_are_sampled_evenly_in_time() {
    let text = "curve,t,lon,lat,z\na,0,170,-10,5\na,6,178,-14,8\na,12,-172,-12,9\na,24,-165,-20,2\n";
    let folder = folder(text);
    for method in ["natural", "smoothing --smoothing 10"] {
        let lines =
            reports(&folder, &format!("--surface wgs84 --method {method} --columns curve=curve,t=t,z=z --every 1"), 0);
        assert_eq!(lines[0]["status"], "converged");
        let text = fs::read_to_string(folder.path().join("out.csv")).unwrap();
        let (head, rows) = text.split_once('\n').unwrap();
        let at = |name: &str| head.split(',').position(|column| column == name).unwrap_or_else(|| panic!("{head}"));
        let columns = ["x", "y", "t"].map(at);
        let rows: Vec<[f64; 3]> = rows
            .lines()
            .map(|row| {
                let fields: Vec<&str> = row.split(',').collect();
                columns.map(|column| fields[column].parse().unwrap())
            })
            .collect();
        assert_eq!(rows.len(), 25);
        for (hour, row) in rows.iter().enumerate() {
            assert_eq!(row[2], hour as f64);
        }
        // No step is torn at the date line, and the last is shorter than a degree or two.
        for pair in rows.windows(2) {
            let step = (pair[1][0] - pair[0][0] + 540.0).rem_euclid(360.0) - 180.0;
            assert!(step.abs() < 2.5 && (pair[1][1] - pair[0][1]).abs() < 2.0, "{pair:?}");
        }
        if method == "natural" {
            assert_eq!(rows[6][..2], [178.0, -14.0]);
        }
    }
}

#[test]
fn a_ship_turns_no_sharper_than_its_radius_on_the_globe() {
    let folder = folder("curve,lon,lat\na,170,60\na,176,61\na,-178,59.5\na,-172,61\n");
    let free = reports(&folder, "--surface wgs84", 0);
    let lines = reports(&folder, "--surface wgs84 --min-radius 250000", 0);
    assert_eq!(lines[0]["status"], "converged");
    let [cost, active] = ["cost", "active"].map(|name| lines[0]["limits"][name].as_f64().unwrap());
    assert!(cost > 0.0 && active > 0.0, "{lines:?}");
    assert!(lines[0]["energy"].as_f64() > free[0]["energy"].as_f64());
    let lines = reports(&folder, "--surface wgs84 --min-radius 900000", 1);
    assert_eq!(lines[0]["status"], "infeasible");
    let message = lines[0]["message"].as_str().unwrap();
    assert!(message.contains("in.csv, line ") && message.contains("geodesic curvature is "), "{message}");
    assert!(message.contains("where 1.111111e-6 is the largest; allow a curvature of "), "{message}");
}

#[test]
fn points_are_moved_onto_their_surface_or_refused() {
    let folder = folder(
        "curve,x,y,z\nnear,1,0,0.0001\nnear,0,1.0001,0\nnear,-0.7,0.7,0.14\nfar,1,0,0\nfar,0,1.2,0\nfar,0,0,1\n",
    );
    let lines = reports(&folder, "--surface ellipsoid:1,1,1", 1);
    assert_eq!((&lines[0]["status"], &lines[1]["status"]), (&"converged".into(), &"invalid".into()));
    let [near, far] = [0, 1].map(|i| lines[i]["message"].as_str().unwrap());
    assert!(near.contains("moved onto the ellipsoid"), "{near}");
    assert!(far.contains("in.csv, line 6, curve far, point 1: it lies 2.0000e-1 off the ellipsoid"), "{far}");
    let lines = reports(&folder, "--surface ellipsoid:1,1,1 --off-surface 0.3", 0);
    assert!(lines.iter().all(|line| line["status"] == "converged"));
}

/// A tube of radius 1 around z, of squares.
fn tube() -> String {
    let mut text = String::from("# A tube\n");
    for k in 0..=8 {
        for i in 0..32 {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / 32.0).sin_cos();
            text += &format!("v {cos} {sin} {}\n", 0.25 * f64::from(k));
        }
    }
    for k in 0..8 {
        for i in 0..32 {
            let [from, to] = [32 * k + i + 1, 32 * k + (i + 1) % 32 + 1];
            text += &format!("f {from}//1 {to}//1 {}//1 {}//1\n", to + 32, from + 32);
        }
    }
    text
}

#[test]
fn curves_in_a_mesh_are_those_in_the_surface_that_it_stands_for() {
    let points = [(0.0, 0.5), (0.9, 0.8), (1.7, 0.7), (2.4, 1.5)];
    let rows: String = points.iter().map(|(a, z): &(f64, f64)| format!("a,{},{},{z}\n", a.cos(), a.sin())).collect();
    let folder = folder(&format!("curve,x,y,z\n{rows}"));
    fs::write(folder.path().join("tube.obj"), tube()).unwrap();
    let [exact, mesh] = ["cylinder:1", "mesh:tube.obj"].map(|surface| {
        let line = reports(&folder, &format!("--surface {surface}"), 0)[0].clone();
        assert_eq!(line["status"], "converged", "{surface}: {line}");
        println!("{surface}: {line}");
        ["length", "energy", "iterations"].map(|word| line[word].as_f64().unwrap())
    });
    assert!((mesh[0] / exact[0] - 1.0).abs() < 1e-4 && (mesh[1] / exact[1] - 1.0).abs() < 1e-2, "{mesh:?} {exact:?}");
    assert!((mesh[2] - exact[2]).abs() <= 2.0, "{mesh:?} {exact:?}");
    let refused = |file: &str, text: &str, what: &str| {
        fs::write(folder.path().join(file), text).unwrap();
        let arguments = format!("fit in.csv -o new.csv --surface mesh:{file}");
        run(&folder, &arguments).code(2).stderr(contains(what).and(contains("panicked").not()));
    };
    refused("wrong.obj", "v 0 0\n", "wrong.obj, line 1: the vertex has no z");
    refused("tube.ply", "ply\n", "the mesh tube.ply is no OBJ file");
}

#[test]
fn speeds_and_lengths_are_those_on_the_surface_that_was_given() {
    let of = |input: &str, surface: &str| {
        let folder = folder(input);
        reports(
            &folder,
            &format!("--surface {surface} --method natural --write arclength,speed,heading --samples 8"),
            0,
        );
        let text = fs::read_to_string(folder.path().join("out.csv")).unwrap();
        let column = |name: &str| text.lines().next().unwrap().split(',').position(|own| own == name).unwrap();
        let columns = ["arclength", "speed", "heading"].map(column);
        let last: Vec<&str> = text.lines().last().unwrap().split(',').collect();
        columns.map(|column| last[column].parse::<f64>().unwrap())
    };
    // Around the equator by 10° in a unit of time, and up a meridian from there.
    let [equator, meridian] = ["lon,lat,t\n0,0,0\n10,0,1\n20,0,2\n", "lon,lat,t\n0,0,0\n0,5,1\n0,10,2\n"];
    let [length, speed, heading] = of(equator, "sphere:2");
    let wanted = 2.0 * 20f64.to_radians();
    assert!((length / wanted - 1.0).abs() < 1e-6 && (2.0 * speed / wanted - 1.0).abs() < 1e-3, "{length} {speed}");
    assert!((heading - 90.0).abs() < 1e-9, "{heading}");
    let [length, ..] = of(equator, "wgs84");
    assert!((length / (6_378_137.0 * 20f64.to_radians()) - 1.0).abs() < 1e-6, "{length}");
    // By geographiclib. On the sphere of the Earth's mean radius it would be 0.5 % more.
    let [length, _, heading] = of(meridian, "wgs84");
    assert!((length / 1_105_854.833_2 - 1.0).abs() < 1e-6 && heading.abs() < 1e-9, "{length} {heading}");
}

#[test]
fn splines_on_the_globe_start_and_end_at_the_rates_of_their_tangents() {
    let folder = folder("lon,lat,t,tx,ty\n10,50,0,0,2\n11,52,1,,\n14,53,2,1.5,0\n");
    for method in ["--method natural", "--method smoothing --smoothing 0.1"] {
        let lines = reports(&folder, &format!("--surface sphere {method} --write speed,heading"), 0);
        assert_eq!(lines[0]["status"], "converged", "{lines:?}");
        let text = fs::read_to_string(folder.path().join("out.csv")).unwrap();
        let column = |name: &str| text.lines().next().unwrap().split(',').position(|own| own == name).unwrap();
        let [speed, heading] = ["speed", "heading"].map(column);
        let of = |line: &str, column: usize| line.split(',').nth(column).unwrap().parse::<f64>().unwrap();
        let rows: Vec<&str> = text.lines().skip(1).collect();
        let [first, last] = [rows[0], rows[rows.len() - 1]];
        // 2° of latitude to the north, and 1.5° of longitude at 53° to the east, in a unit of t and in metres.
        let rates = [2f64.to_radians(), 1.5f64.to_radians() * 53f64.to_radians().cos()];
        let radii = [of(first, speed) / rates[0], of(last, speed) / rates[1]];
        assert!(radii.iter().all(|radius| (radius / 6_371_008.771_4 - 1.0).abs() < 1e-8), "{radii:?}");
        let turned = (of(first, heading) + 180.0).rem_euclid(360.0) - 180.0;
        assert!(turned.abs() < 1e-6 && (of(last, heading) - 90.0).abs() < 1e-6, "{text}");
    }
    let lines = reports(&folder, "--surface sphere --smoothing 0.1 --method smoothing --pin none", 1);
    assert!(lines[0]["message"].as_str().unwrap().contains("smoothing moves it: pin the ends"), "{lines:?}");
}

#[test]
fn what_makes_no_sense_in_a_surface_is_refused_with_a_sentence() {
    let folder = folder(TRACKS);
    let refused = |arguments: &str, what: &str| {
        run(&folder, &format!("fit in.csv -o out.csv --device cpu {arguments}"))
            .code(2)
            .stderr(contains(what).and(contains("panicked").not()));
    };
    refused("--surface ball", "there is no surface 'ball'");
    refused("--surface torus:1,2", "meets itself");
    refused("--surface wgs84 --radius 2", "--radius 2 is that of --surface sphere");
    refused("--surface torus:2,1", "have points of three coordinates");
    refused("--surface sphere --corridor 1", "keep no other limits than a largest curvature");
    refused("--surface sphere --min-radius 1e5 --max-stretch 2", "keep no other limits than a largest curvature");
    refused("--surface sphere --energy variation=1", "have no variation");
    refused("--method geodesic", "needs a surface");
    refused("--surface sphere --method scf", "smooth connection functions are planar");
    refused("--surface sphere --method natural --preserve-shape", "is that of planar curves");
    refused("--surface sphere --method natural --deviation 9", "--deviation");
    refused("--surface sphere --method smoothing", "needs to know how far");
    refused("--method fair --energy geodesic_bending=1", "is that of curves in a surface");
}

/// The shipped mountain, and its name as an argument.
fn mountain(numbers: &str) -> (Vec<Vec<f64>>, String) {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/data/mountain.csv");
    let text = fs::read_to_string(file).unwrap();
    let rows = text.lines().map(|line| line.split(',').map(|height| height.parse().unwrap()).collect());
    (rows.collect(), format!("grid:{file}{numbers}"))
}

#[test]
fn paths_over_terrain_of_a_file_go_through_their_points_and_lie_on_it() {
    let (heights, surface) = mountain(",74.5,-92.5");
    let nodes = [[12, 38], [28, 30], [39, 28], [62, 24]];
    let mut text = String::from("curve,x,y,z\n");
    for [column, row] in nodes {
        let (x, y) = (74.5 * column as f64, -92.5 * row as f64);
        // A reading of a height that is 2 m off.
        let z = heights[row][column] + 2.0;
        text += &format!("path,{x},{y},{z}\n");
    }
    let folder = folder(&text);
    let lines = reports(&folder, &format!("--surface {surface} --energy geodesic_bending=1,length=1e-6"), 0);
    assert_eq!(lines[0]["status"], "converged", "{lines:?}");
    let message = lines[0]["message"].as_str().unwrap();
    assert!(
        message.contains("moved onto the terrain of ") && message.contains("mountain.csv, by up to 1."),
        "{message}"
    );
    let terrain = faircurve::io::surfaces::surface_of(&surface).unwrap();
    let path = faircurve::io::read(folder.path().join("out.csv")).unwrap();
    assert!(path.count(0) > 40);
    for point in path.points(0).chunks_exact(3) {
        let away = terrain.value(glam::DVec3::from_slice(point));
        assert!(away.abs() < 1e-10, "{away}");
    }
}

#[test]
fn grids_that_make_no_terrain_are_refused_with_a_sentence() {
    let folder = folder("curve,x,y,z\na,0,0,0\na,1,1,0\n");
    fs::write(folder.path().join("two.csv"), "0,1\n2,3\n\n4,5\n6,7\n").unwrap();
    fs::write(folder.path().join("words.csv"), "easting,northing\n1,2\n3,4\n").unwrap();
    let (_, whole) = mountain("");
    let refused = |surface: &str, what: &str| {
        run(&folder, &format!("fit in.csv -o out.csv --device cpu --surface {surface}"))
            .code(2)
            .stderr(contains(what).and(contains("panicked").not()));
    };
    refused("grid:none.csv", "cannot read none.csv: ");
    refused("grid:two.csv,30", "two.csv: it holds 2 grids, and a surface is made of one: keep one of them");
    refused("grid:words.csv", "words.csv, line 1: ");
    refused("grid:in.txt", "in.txt");
    refused("grid:two.csv,x", "is no number: write grid:FILE,DX,DY,X0,Y0");
    refused(&format!("{whole},0"), "the spacing of columns is 0");
    refused(&format!("{whole} --radius 2"), "--radius 2 is that of --surface sphere");
    refused("ball", "cone:degrees, grid:FILE");
    assert!(!folder.path().join("out.csv").exists());
}
