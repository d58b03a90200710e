//! `faircurve fit --max-curvature K`, `--min-radius R`, `--preserve-shape` and a column `kmax` as their users meet them.

use std::fs;

use super::ran::{self, run};
use predicates::prelude::PredicateBooleanExt;
use predicates::str::{contains, is_empty};
use serde_json::Value;
use tempfile::TempDir;

/// A wave, and a hairpin that no short wide turn goes through.
const CURVES: &str = "curve,x,y\na,0,0\na,1,0.8\na,2,0\na,3,0.6\nb,0,5\nb,1,5\nb,1,5.2\nb,0,5.2\n";

fn folder(text: &str) -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("in.csv"), text).unwrap();
    folder
}

/// The lines of the report of a run that ends with this code.
fn reports(folder: &TempDir, arguments: &str, code: i32) -> Vec<Value> {
    run(folder, &format!("fit in.csv -o out.csv --device cpu --report report.json --force {arguments}")).code(code);
    let text = fs::read_to_string(folder.path().join("report.json")).unwrap();
    serde_json::from_str::<Value>(&text).unwrap()["curves"].as_array().unwrap().clone()
}

#[test]
fn curves_keep_a_radius_or_say_why_not() {
    let folder = folder(CURVES);
    let free = reports(&folder, "--method fair", 0);
    assert_eq!(free[0].get("limits"), None);
    let largest = free[0]["max_curvature"].as_f64().unwrap();
    let bound = 0.9 * largest;
    // A wide turn back takes a way round.
    let round = reports(&folder, &format!("--max-curvature {bound}"), 0);
    assert!(round[1]["limits"]["violation"] == 0.0 && round[1]["loops"].as_f64().unwrap() > 2.0, "{}", round[1]);
    let by_curvature = reports(&folder, &format!("--max-curvature {bound} --max-stretch 1.5"), 1);
    assert_eq!((&by_curvature[0]["status"], &by_curvature[1]["status"]), (&"converged".into(), &"infeasible".into()));
    assert_eq!(by_curvature[0]["limits"]["violation"].as_f64(), Some(0.0));
    assert!(
        by_curvature[0]["limits"]["cost"].as_f64().unwrap() > 0.0
            && by_curvature[1]["limits"]["violation"].as_f64().unwrap() > 0.0
    );
    let by_radius = reports(&folder, &format!("--min-radius {} --max-stretch 1.5", 1.0 / bound), 1);
    let energies = [&by_curvature, &by_radius].map(|lines| lines[0]["energy"].as_f64().unwrap());
    assert!((energies[0] / energies[1] - 1.0).abs() < 1e-9, "{energies:?}");
    let message = by_curvature[1]["message"].as_str().unwrap();
    assert!(
        message.contains("in.csv") && message.contains("curve b") && message.contains("no curve near keeps its limits"),
        "{message}"
    );
}

#[test]
fn a_curve_that_loops_to_keep_its_limits_is_infeasible_and_stays_as_it_is() {
    let heights = [-0.7073, -0.6889, 0.4017, -1.3763, -0.086, -1.3536, 0.6606, 0.1217];
    let rows = heights.iter().enumerate().map(|(x, y)| format!("{x},{y}\n"));
    let folder = folder(&format!("x,y\n{}", rows.collect::<String>()));
    let points = || fs::read_to_string(folder.path().join("out.csv")).unwrap();
    reports(&folder, "--method fair", 0);
    let free = points();
    let lines = reports(&folder, "--min-radius 0.8", 1);
    assert_eq!(lines[0]["status"], "infeasible");
    assert!(
        lines[0]["message"].as_str().unwrap().contains("loops alone were found to keep its limits"),
        "{}",
        lines[0]
    );
    let marked =
        free.lines().enumerate().map(|(k, line)| format!("{line},{}\n", if k == 0 { "status" } else { "infeasible" }));
    assert_eq!(points(), marked.collect::<String>());
    let within = reports(&folder, "--min-radius 0.9 --deviation 0.2", 1);
    assert_eq!(within[0]["status"], "infeasible");
    assert!(
        within[0]["message"].as_str().unwrap().contains("no curve near keeps its limits and the deviation of 0.2"),
        "{}",
        within[0]
    );
}

#[test]
fn a_column_bounds_single_spans() {
    let folder = folder("x,y,kmax\n0,0,\n1,0.8,1.2\n2,0,\n3,0.6,\n");
    let lines = reports(&folder, "--method fair --energy bending=1,length=0.5", 0);
    assert!(lines[0]["limits"]["active"].as_u64().unwrap() > 0, "{}", lines[0]);
    let run = run(&folder, "fit in.csv -o natural.csv --device cpu");
    run.code(2).stderr(contains("know no largest curvatures (column kmax)"));
}

#[test]
fn the_shape_of_points_is_kept() {
    let folder = folder("x,y\n-0.3,1.2\n0,0\n1.5,0\n3,0.15\n3.2,1.4\n");
    let lines = reports(&folder, "--energy bending=1,length=0.01 --preserve-shape", 0);
    assert_eq!((&lines[0]["status"], lines[0]["limits"]["violation"].as_f64()), (&"converged".into(), Some(0.0)));
    assert!(lines[0]["limits"]["active"].as_u64().unwrap() > 0, "{}", lines[0]);
}

#[test]
fn natural_splines_keep_the_shape_of_points_too() {
    let folder = folder("x,y\n-0.3,1.2\n0,0\n1.5,0\n3,0.15\n3.2,1.4\n");
    let lines = reports(&folder, "--method natural --preserve-shape", 0);
    assert_eq!((&lines[0]["status"], lines[0]["limits"]["violation"].as_f64()), (&"converged".into(), Some(0.0)));
    assert!(lines[0]["limits"]["active"].as_u64().unwrap() > 0, "{}", lines[0]);
    fs::write(folder.path().join("in.csv"), "x,y,z\n0,0,0\n1,0,1\n2,1,0\n").unwrap();
    run(&folder, "fit in.csv -o space.csv --method natural --preserve-shape --device cpu")
        .code(2)
        .stderr(contains("natural splines keep the shape of planar curves").and(contains("choose --method fair")));
}

#[test]
fn smooth_connection_functions_keep_the_shape_of_points_too() {
    let folder = folder("x,y\n-0.3,1.2\n0,0\n1.5,0\n3,0.15\n3.2,1.4\n");
    let lines = reports(&folder, "--method scf --preserve-shape", 0);
    assert_eq!((&lines[0]["status"], lines[0]["limits"]["violation"].as_f64()), (&"converged".into(), Some(0.0)));
    assert!(lines[0]["limits"]["active"].as_u64().unwrap() > 0, "{}", lines[0]);
    fs::write(folder.path().join("in.csv"), "x,y\n0,0\n1,0\n2,0.1\n2.1,1.1\n2,2.1\n").unwrap();
    let lines = reports(&folder, "--method scf --preserve-shape", 1);
    let message = lines[0]["message"].as_str().unwrap();
    assert_eq!(lines[0]["status"], "infeasible");
    assert!(message.contains("has to turn left here") && message.contains("choose --method fair"), "{message}");
    run(&folder, "fit in.csv -o taut.csv --method scf --preserve-shape --tension 1 --device cpu")
        .code(2)
        .stderr(contains("keep the shape of their points without a tension, which is 1"));
}

#[test]
fn corridors_regions_directions_and_lengths_are_kept() {
    let folder = folder("x,y,corridor\n0,0,\n1,0.8,0.05\n2,-0.6,\n3,0.9,\n4,0,\n");
    let energy = "--method fair --energy bending=1,length=1";
    let kept = |options: &str| {
        let lines = reports(&folder, &format!("{energy} {options}"), 0);
        assert_eq!((&lines[0]["status"], lines[0]["limits"]["violation"].as_f64()), (&"converged".into(), Some(0.0)));
        lines[0]["limits"]["cost"].as_f64().unwrap()
    };
    // The column bounds the second span in every one of them.
    let cost = kept("");
    assert!(cost > 0.0 && kept("--corridor 0.1") > cost, "{cost}");
    assert!(kept("--keep-out 3.4,0.6,0.1 --keep-in 2,0,3 --half-plane 0,1,0.95") > cost);
    assert!(kept("--max-stretch 1.08") > cost && kept("--monotone x") >= cost);
    let lines = reports(&folder, "--keep-out 1,0.8,0.2", 1);
    let message = lines[0]["message"].as_str().unwrap();
    assert_eq!(lines[0]["status"], "invalid");
    assert!(message.contains("in.csv, line 3") && message.contains("to stay out of, by 0.2"), "{message}");
}

#[test]
fn curves_that_would_cross_are_kept_apart() {
    // A bend of few points, a line close above it, and two that cross as their points do.
    let folder = folder(
        "curve,x,y\nbend,0,0\nbend,1,0\nbend,1.2,1\nbend,2.2,1\nline,1,0.2\nline,1.1,1.05\nline,1.6,1.05\nline,2.2,1.05\n\
         a,5,0\na,6,0.2\na,7,0\nb,6,-1\nb,6.1,0\nb,6,1\n",
    );
    let free = reports(&folder, "--method fair", 0);
    assert!(free.iter().all(|line| line.get("limits").is_none()), "{free:?}");
    let lines = reports(&folder, "--method fair --no-crossing", 0);
    let of = |k: usize, name: &str| lines[k]["limits"][name].as_f64().unwrap();
    let counts: Vec<[f64; 2]> = (0..4).map(|k| [of(k, "neighbours"), of(k, "touching")]).collect();
    assert_eq!(counts, [[1.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 1.0]], "{lines:?}");
    assert!(of(0, "active") > 0.0 && of(0, "cost") > 0.0 && of(0, "violation") == 0.0, "{}", lines[0]);
    let message = lines[2]["message"].as_str().unwrap();
    assert!(
        message.contains("curve a, point 1: from here to the next point its polygon meets that of curve b"),
        "{message}"
    );
}

#[test]
fn limits_that_make_no_sense_are_refused() {
    let refused = |arguments: &str, sentence: &str| {
        run(&folder(CURVES), &format!("fit in.csv -o out.csv {arguments}"))
            .code(2)
            .stdout(is_empty())
            .stderr(contains(sentence));
    };
    refused("--max-curvature 0", "--max-curvature is 0; it must be a positive number, in units of 1/length");
    refused("--min-radius=-2", "--min-radius is -2; it must be a positive number, in units of length");
    refused("--min-radius inf", "--min-radius is inf");
    refused("--max-curvature 1 --min-radius 1", "cannot be used with");
    refused(
        "--method smoothing --preserve-shape",
        "--preserve-shape belongs to --method fair, --method natural and --method scf",
    );
    refused("--method natural --preserve-shape --monotone x", "--monotone belongs to --method fair");
    refused("--method scf --keep-out 0,0,1", "--keep-out belongs to --method fair");
    refused("--corridor=-1", "--corridor is -1; it must be a positive number, in units of length");
    refused("--keep-in 0,0", "2 numbers; give 3 in the plane, or 4 in space, with commas between them");
    refused("--half-plane 0,0,1", "a normal of length 0 has no direction");
    refused("--keep-out 0,0,0,1,2", "5 numbers; give 3 in the plane");
    refused("--method smoothing --smoothing 1 --no-crossing", "--no-crossing belongs to --method fair");
    refused("--max-stretch 0.9", "the largest stretch is 0.9; it must be more than 1");
    refused("--monotone w", "invalid value 'w'");
    refused("--method fair --energy length=1 --corridor 1", "ask for an energy that holds bending");
}

#[test]
fn the_shortest_curves_keep_a_turning_radius_exactly() {
    let folder = folder("x,y,tx,ty\n0,0,0,1\n1,0,0,1\n");
    let lines = reports(&folder, "--method fair --energy length=1 --min-radius 0.8", 0);
    let number = |name: &str| lines[0][name].as_f64().unwrap();
    // Two lanes of a road, one beside the other: a whole turn, and the way from lane to lane.
    assert!((number("energy") - (1.0 + std::f64::consts::TAU * 0.8)).abs() < 1e-12, "{}", lines[0]);
    assert!(number("max_curvature") < 1.25 + 1e-9, "{}", lines[0]);
    let run =
        run(&folder, "fit in.csv -o out.csv --force --device cpu --method fair --energy tension=1 --min-radius 0.8");
    run.code(2).stderr(contains("curves of least tension are polygons, which have corners"));
}

/// The largest distance of the rows of a curve, up to point `to` of 64 segments a span, from the line through 0 at this angle.
fn off_line(folder: &TempDir, angle: f64, to: usize) -> f64 {
    let text = fs::read_to_string(folder.path().join("out.csv")).unwrap();
    let off = |line: &str| {
        let cells: Vec<f64> = line.split(',').skip(1).take(2).map(|cell| cell.parse().unwrap()).collect();
        (cells[1] * angle.cos() - cells[0] * angle.sin()).abs()
    };
    text.lines().skip(1).take(64 * to + 1).map(off).fold(0.0, f64::max)
}

#[test]
fn points_in_a_line_are_joined_by_straight_spans() {
    // A step up, even and uneven, level and sloping; in the end a line between arcs.
    for (steps, angle) in [([1.0; 5], 0.0f64), ([1.0, 3.0, 0.5, 2.0, 0.1], 0.0), ([1.0; 5], 0.7)] {
        let mut x = 0.0;
        let mut text = "x,y\n".to_string();
        for k in 0..6 {
            let y = if k < 3 { 0.0 } else { 5.0 };
            text += &format!("{},{}\n", x * angle.cos() - y * angle.sin(), x * angle.sin() + y * angle.cos());
            x += steps.get(k).unwrap_or(&0.0);
        }
        let folder = folder(&text);
        let splines = ["natural", "natural --parametrisation uniform", "natural --parametrisation chord"];
        let options = splines.into_iter().chain(["scf", "fair"]).map(|method| format!("{method} --preserve-shape"));
        let level = (angle == 0.0).then(|| "fair --monotone y".to_string());
        for method in options.chain(level) {
            let lines = reports(&folder, &format!("--method {method} --samples 64"), 0);
            assert_eq!(lines[0]["status"], "converged", "{method}: {}", lines[0]);
            assert_eq!(lines[0]["limits"]["violation"], 0.0, "{method}: {}", lines[0]);
            let off = off_line(&folder, angle, 2);
            assert!(off < 1e-9, "{method} at {angle}, {steps:?}: {off} off the line");
        }
        // They bend away from the line without.
        reports(&folder, "--method natural --samples 64", 0);
        assert!(off_line(&folder, angle, 2) > 0.01);
    }
    let folder = folder("x,y\n0,0\n1,0\n2,0\n4,0\n5,1\n4,2\n1,2\n0,2\n-1,1\n0,0\n");
    let lines = reports(&folder, "--method natural --preserve-shape --samples 64", 0);
    assert!(lines[0]["limits"]["active"].as_u64().unwrap() > 0, "{}", lines[0]);
    assert!(off_line(&folder, 0.0, 3) == 0.0 && off_line(&folder, 0.0, 4) > 0.9);
}

#[test]
fn lines_of_points_that_meet_have_a_corner_that_is_said() {
    let folder =
        folder("curve,x,y\nroof,-2,2\nroof,-1,1\nroof,0,0\nroof,1,1\nroof,2,2\nplain,0,9\nplain,1,9.5\nplain,2,9\n");
    let lines = reports(&folder, "--method natural --preserve-shape --samples 64 --write tangent", 0);
    let message = lines[0]["message"].as_str().unwrap();
    assert!(message.contains("curve roof, point 2: two lines of points meet here at an angle"), "{message}");
    assert_eq!((&lines[0]["max_curvature"], &lines[1]["message"]), (&0.0.into(), &Value::Null));
    assert!((lines[0]["length"].as_f64().unwrap() - 4.0 * 2.0f64.sqrt()).abs() < 1e-12, "{}", lines[0]);
    let lines = reports(&folder, "--method scf --preserve-shape", 1);
    let message = lines[0]["message"].as_str().unwrap();
    assert!(message.contains("meet here at an angle") && message.contains("choose --method natural"), "{message}");
    assert_eq!(lines[1]["status"], "converged");
}

#[test]
fn a_tangent_that_leads_off_a_line_of_points_is_infeasible() {
    let with = |tx: f64, ty: f64| {
        let folder = folder(&format!("x,y,tx,ty\n0,0,{tx},{ty}\n1,0,,\n2,0,,\n3,0.5,,\n3.8,1.3,,\n"));
        ["natural", "scf"].map(|method| {
            let line = &reports(&folder, &format!("--method {method} --preserve-shape"), i32::from(ty != 0.0))[0];
            (
                line["status"].clone(),
                line["message"].as_str().unwrap_or_default().to_string(),
                off_line(&folder, 0.0, 0),
            )
        })
    };
    for (status, message, _) in with(1.0, 0.5) {
        assert_eq!(status, "infeasible");
        assert!(message.contains("point 0") && message.contains("the tangent leads off it"), "{message}");
    }
    with(1.0, 0.0).iter().for_each(|(status, message, _)| assert_eq!(status, "converged", "{message}"));
}

#[test]
fn obstacles_of_geojson_are_kept_out_and_drawn() {
    let folder = TempDir::new().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("in.csv", "curve,x,y\na,0,0\na,20,0\na,40,5\nb,0,10\nb,20,11\nb,40,10\n");
    let feature = |properties: &str, geometry: &str| {
        format!("{{\"type\":\"Feature\",\"properties\":{{{properties}}},\"geometry\":{geometry}}}")
    };
    let polygon = |ring: &str| format!("{{\"type\":\"Polygon\",\"coordinates\":[[{ring}]]}}");
    let house = feature("\"name\":\"house\"", &polygon("[8,-3],[13,-3],[13,4],[8,4],[8,-3]"));
    let tank = feature("\"radius\":2", "{\"type\":\"Point\",\"coordinates\":[30,3]}");
    let own = feature("\"curve\":\"b\"", &polygon("[30,8],[32,8],[32,12],[30,12],[30,8]"));
    let all = |features: &[&str]| format!("{{\"type\":\"FeatureCollection\",\"features\":[{}]}}", features.join(","));
    write("ob.geojson", &all(&[&house, &tank, &own]));
    run(&folder, "path in.csv -o out.csv --min-radius 2 --obstacles ob.geojson --clearance 0.5 --tolerance 0.01 --picture p.svg --device cpu")
        .code(0);
    let text = std::fs::read_to_string(folder.path().join("out.csv")).unwrap();
    let points: Vec<(String, [f64; 2])> = text
        .lines()
        .skip(1)
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            (cells[0].to_string(), [cells[1].parse().unwrap(), cells[2].parse().unwrap()])
        })
        .collect();
    // Between samples, too.
    for pair in points.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        for step in 0..20 {
            let part = f64::from(step) / 20.0;
            let [x, y] = [0, 1].map(|c| pair[0].1[c] + part * (pair[1].1[c] - pair[0].1[c]));
            let off = |low: f64, high: f64, at: f64| (low - at).max(at - high).max(0.0);
            assert!(off(8.0, 13.0, x).hypot(off(-3.0, 4.0, y)) >= 0.5, "{x} {y}");
            assert!((x - 30.0).hypot(y - 3.0) >= 2.5, "{x} {y}");
            assert!(pair[0].0 == "a" || off(30.0, 32.0, x).hypot(off(8.0, 12.0, y)) >= 0.5, "{x} {y}");
        }
    }
    let picture = std::fs::read_to_string(folder.path().join("p.svg")).unwrap();
    assert!(picture.contains(">obstacles</text>"));
    run(&folder, "path in.csv -o drive.csv --min-radius 2 --spacing 1 --speed 5 --lateral 2 --accelerate 1 --brake 1 --report r.html --device cpu").code(0);
    // Few samples cut corners, and a note names them.
    let few = "path in.csv -o few.csv --min-radius 2 --obstacles ob.geojson --points 4 --device cpu";
    run(&folder, few).code(0).stderr(contains("2 curves, such as a, meet obstacles between samples"));
    let page = std::fs::read_to_string(folder.path().join("r.html")).unwrap();
    assert!(page.contains(">curvature by length: ") && page.contains(">v by t: 0.0000 to "));
    let refuse = |features: &[&str], sentence: &str| {
        write("no.geojson", &all(features));
        ran::refused(&folder, "path in.csv -o no.csv --min-radius 2 --obstacles no.geojson", sentence);
    };
    refuse(
        &[&feature("", "{\"type\":\"Point\",\"coordinates\":[30,3]}")],
        "feature 1 (obstacle 1) is a point: give it a property radius",
    );
    refuse(
        &[&house, &feature("", "{\"type\":\"LineString\",\"coordinates\":[]}")],
        "feature 2 (obstacle 2) is LineString",
    );
    refuse(
        &[&feature("\"name\":\"thin\"", &polygon("[8,-3],[13,-3],[8,-3]"))],
        "obstacle thin needs three corners or more",
    );
    ran::refused(&folder, "path in.csv -o no.csv --min-radius 2 --obstacles in.csv", "it is no GeoJSON of obstacles");
    ran::refused(
        &folder,
        "path in.csv -o no.csv --min-radius 2 --clearance -1",
        "--clearance is -1; it must be a positive number",
    );
}

#[test]
fn race_tracks_are_read_with_their_widths() {
    let folder = TempDir::new().unwrap();
    let row = |k: u32| {
        let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 40.0).sin_cos();
        let radius = 60.0 + 5.0 * (3.0 * f64::from(k) * std::f64::consts::TAU / 40.0).cos();
        format!("{},{},4,3.5\n", radius * cos, radius * sin)
    };
    let text = format!("# x_m,y_m,w_tr_right_m,w_tr_left_m\n{}", (0..40).map(row).collect::<String>());
    std::fs::write(folder.path().join("track.csv"), text).unwrap();
    let line = "path track.csv -o line.csv --min-radius 10 --deviation 5 --energy bending=1 --closed yes --device cpu";
    run(&folder, &format!("{line} --report r.json")).code(0);
    let text = fs::read_to_string(folder.path().join("r.json")).unwrap();
    let report = serde_json::from_str::<Value>(&text).unwrap()["curves"].clone();
    assert_eq!(report[0]["status"], "converged");
    // The rounder line: three waves of 5 m become waves of less.
    assert!(report[0]["max_deviation"].as_f64().unwrap() > 3.0, "{}", report[0]);
    assert!(report[0]["max_curvature"].as_f64().unwrap() < 0.03, "{}", report[0]);
    let half = std::fs::read_to_string(folder.path().join("track.csv")).unwrap().replace(",3.5\n", ",\n");
    std::fs::write(folder.path().join("half.csv"), half).unwrap();
    ran::refused(&folder, "path half.csv -o no.csv --min-radius 10", "give all of them, or none");
}

#[test]
fn limits_of_single_curves_and_points_come_from_a_table() {
    let bend = |name: &str| format!("{name},0,0\n{name},10,0\n{name},10,10\n{name},20,10\n");
    let folder = folder(&format!("curve,x,y\n{}{}", bend("a"), bend("b")));
    let limits = |text: &str| fs::write(folder.path().join("limits.csv"), text).unwrap();
    limits("curve,point,min_radius,heading,corridor\na,,4,,\n,0,,45,\nb,-1,,90,\nb,,,,6\n");
    let path = "path in.csv -o out.csv --min-radius 1 --limits limits.csv --deviation 1 --device cpu --force";
    run(&folder, &format!("{path} --report r.json --write tangent")).code(0);
    let text = fs::read_to_string(folder.path().join("r.json")).unwrap();
    let report = serde_json::from_str::<Value>(&text).unwrap()["curves"].clone();
    let largest = |k: usize| report[k]["max_curvature"].as_f64().unwrap();
    assert!(largest(0) <= 0.25 * (1.0 + 1e-6) && largest(1) > 0.25, "{report}");
    let text = fs::read_to_string(folder.path().join("out.csv")).unwrap();
    let tangent = |line: &str| {
        let cells: Vec<f64> = line.split(',').skip(4).map(|cell| cell.parse().unwrap()).collect();
        cells[0].atan2(cells[1]).to_degrees()
    };
    let of = |name: &str| -> Vec<f64> { text.lines().filter(|line| line.starts_with(name)).map(tangent).collect() };
    for own in [of("a,"), of("b,")] {
        assert!((own[0] - 45.0).abs() < 1.0, "{own:?}");
    }
    assert!((of("b,").last().unwrap() - 90.0).abs() < 1.0);
    let refuse = |text: &str, sentence: &str| {
        limits(text);
        ran::refused(&folder, "path in.csv -o no.csv --min-radius 1 --limits limits.csv", sentence);
    };
    refuse(
        "curve,radius\na,4\n",
        "limits.csv, line 1: there is no limit \"radius\": known are curve, point, min_radius",
    );
    refuse("curve,min_radius\na,4\nz,4\n", "limits.csv, line 3: there is no curve \"z\"");
    refuse("curve,point,kmax\na,4,1\n", "line 2: curve a has 4 points, and no point \"4\"");
    refuse("curve,kmax\na,much\n", "column kmax holds \"much\", which is no number");
    refuse("curve,heading\na,90\n", "a heading needs a point");
}
