//! The jobs `map`, `draw`, `track`, `path` and `tracts`, as their users meet them.

use std::fs;
use std::path::Path;

use super::ran::{self, folder, run};
use faircurve::surface::Globe;
use faircurve::{CurveBatch, io};
use predicates::prelude::*;
use predicates::str::contains;
use tempfile::TempDir;

fn data(name: &str) -> String {
    format!("{}/examples/data/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn text(folder: &TempDir, name: &str) -> String {
    fs::read_to_string(folder.path().join(name)).unwrap()
}

fn read(folder: &TempDir, name: &str) -> CurveBatch {
    io::read(folder.path().join(name)).unwrap()
}

/// What a command says.
fn said(folder: &TempDir, arguments: &str) -> String {
    String::from_utf8(run(folder, arguments).code(0).get_output().stderr.clone()).unwrap()
}

#[test]
fn the_help_of_a_job_fits_a_screen_and_ends_with_examples() {
    let folder = TempDir::new().unwrap();
    for job in ["map", "draw", "track", "path", "tracts"] {
        let help = run(&folder, &format!("{job} --help")).code(0);
        let help = String::from_utf8(help.get_output().stdout.clone()).unwrap();
        assert!(help.lines().count() <= 32, "{job} has {} lines", help.lines().count());
        let examples = help.lines().filter(|line| line.starts_with(&format!("  faircurve {job} "))).count();
        assert_eq!(examples, 2, "{help}");
        // A track needs no distance.
        let said = if job == "track" { "cannot read in.csv" } else { "required" };
        run(&folder, &format!("{job} in.csv -o out.csv")).code(2).stderr(contains(said));
    }
}

#[test]
fn a_job_is_short_for_a_fit_that_it_names() {
    let folder = TempDir::new().unwrap();
    let map = data("world-110m.topojson");
    let words = said(&folder, &format!("map {map} -o a.geojson --within 50km --device cpu -v"));
    let fit = words.lines().next().unwrap().split_once("faircurve fit ").unwrap().1.replace("a.geojson", "b.geojson");
    run(&folder, &format!("fit {fit}")).code(0);
    assert_eq!(text(&folder, "a.geojson"), text(&folder, "b.geojson"));
    // What is given stands in place of a preset.
    let words = said(&folder, &format!("map {map} -o c.geojson --within 50km --corners 45deg --device cpu -v"));
    assert!(!words.contains("straight") && words.contains("--corners 45deg"), "{words}");
    let words = said(&folder, &format!("map {map} -o d.geojson --within 50km --samples 4 --device cpu -v"));
    assert!(!words.contains("--tolerance"), "{words}");
    let words = said(&folder, &format!("draw {} -o e.svg --within 1 --as polyline -v", data("traced.svg")));
    assert!(words.contains("--as polyline") && !words.contains("bezier"), "{words}");
}

#[test]
fn a_smoothed_map_is_within_its_distance_and_not_much_larger() {
    let folder = TempDir::new().unwrap();
    let map = data("world-110m.topojson");
    let words = said(
        &folder,
        &format!("map {map} -o out.topojson --within 50km --antimeridian keep --device cpu --report r.json"),
    );
    assert!(words.contains("fitted within 37.5km, and written within 12.5km"), "{words}");
    let size = |path: &Path| fs::metadata(path).unwrap().len();
    let [before, after] = [size(Path::new(&map)), size(&folder.path().join("out.topojson"))];
    assert!(5 * after < 6 * before, "{before} bytes became {after}");
    let report: serde_json::Value = serde_json::from_str(&text(&folder, "r.json")).unwrap();
    let farthest = report["curves"].as_array().unwrap().iter().filter_map(|own| own["max_deviation"].as_f64());
    let farthest = farthest.fold(0.0, f64::max);
    assert!(farthest > 20_000.0 && farthest <= 37_500.0, "{farthest}");
    // The written lines, not the curves alone: 50 km are less than half a degree of latitude.
    let (given, written) = (io::read(&map).unwrap(), read(&folder, "out.topojson"));
    assert_eq!(given.len(), written.len());
    let is_low = |i: &usize| given.points(*i).chunks_exact(2).all(|point| point[1].abs() < 60.0);
    let low: Vec<usize> = (0..given.len()).filter(is_low).collect();
    assert!(low.len() > 250);
    for i in low {
        assert!(ran::from_lines(&given, &written, i) < 0.46 / 60_f64.to_radians().cos(), "curve {i}");
    }
}

#[test]
fn a_length_with_a_unit_is_the_length_in_units_of_the_file() {
    let folder = TempDir::new().unwrap();
    let (traced, tracts) = (data("traced.svg"), data("tracts.trk"));
    let rows = (0..12).map(|k| format!("a,{},{},{k}\n", 10 + k, 50 + (k * k) % 5));
    fs::write(folder.path().join("in.csv"), format!("curve,lon,lat,t\n{}", rows.collect::<String>())).unwrap();
    let in_metres = "--method natural --surface wgs84";
    for (fit, given, own) in [
        // 360 units are 1,080 pixels wide.
        (format!("draw {traced} -o %.svg"), "--within 3px", "--within 1"),
        (format!("draw {traced} -o %.svg"), "--within 0.03125in --tolerance 0.3px", "--within 1 --tolerance 0.1"),
        (format!("tracts {tracts} -o %.trk"), "--deviation 0.1cm", "--deviation 1"),
        (
            format!("fit {tracts} -o %.tck"),
            "--method fair --deviation 3mm --corridor 9mm",
            "--method fair --deviation 3 --corridor 9",
        ),
        (format!("fit in.csv -o %.csv {in_metres}"), "--spacing 50km", "--spacing 50000"),
    ] {
        let words = said(&folder, &format!("{} {given} --device cpu --force", fit.replace('%', "given")));
        assert!(words.contains("in units of the input"), "{words}");
        run(&folder, &format!("{} {own} --device cpu --force", fit.replace('%', "own"))).code(0);
        let extension = fit.split_once("%.").unwrap().1.split(' ').next().unwrap();
        let [given, own] = ["given", "own"].map(|name| fs::read(folder.path().join(format!("{name}.{extension}"))));
        assert!(given.unwrap() == own.unwrap(), "{fit}");
    }
    let refuse = |arguments: &str, sentence: &str| ran::refused(&folder, arguments, sentence);
    refuse(
        "fit in.csv -o a.csv --method fair --deviation 2km",
        "longitudes and latitudes are in degrees: give degrees, 1.79e-2",
    );
    fs::write(folder.path().join("plane.csv"), "x,y\n0,0\n1,1\n2,0\n").unwrap();
    refuse("fit plane.csv -o a.csv --within 2mm", "--within is 2mm, and the file does not say the unit");
}

/// Two squares with a side in common, the second one of which is a lake of the name b.
const SQUARES: &str = r#"{"type":"FeatureCollection","features":[
{"type":"Feature","properties":{"name":"a","level":2},"geometry":{"type":"Polygon","coordinates":[[[0,0],[10,0],[10.123456789,5],[10,10],[0,10],[0.5,5],[0,0]]]}},
{"type":"Feature","properties":{"name":"b"},"geometry":{"type":"Polygon","coordinates":[[[10,0],[20,0],[20.123456789,5],[20,10],[10,10],[10.123456789,5],[10,0]]]}}]}"#;

fn squares() -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("in.geojson"), SQUARES).unwrap();
    folder
}

/// Whether a curve of the written map has all the points of a line.
fn has(batch: &CurveBatch, i: usize, line: &[[f64; 2]]) -> bool {
    line.iter().all(|point| batch.points(i).chunks_exact(2).any(|own| own == point))
}

#[test]
fn what_is_not_selected_stays_bit_for_bit() {
    let folder = squares();
    let (coast_a, shared) = ([0.5, 5.0], [10.123456789, 5.0]);
    run(&folder, "map in.geojson -o coast.geojson --within 1 --only coast --device cpu").code(0);
    let coast = read(&folder, "coast.geojson");
    assert!(has(&coast, 0, &[shared]) && has(&coast, 1, &[shared]) && !has(&coast, 0, &[coast_a]));
    run(&folder, "map in.geojson -o shared.geojson --within 1 --only shared --device cpu").code(0);
    let inner = read(&folder, "shared.geojson");
    assert!(!has(&inner, 0, &[shared]) && has(&inner, 0, &[coast_a]));
    // Borders with what is not selected stay, too.
    for value in ["name=a", "level=2"] {
        run(&folder, &format!("map in.geojson -o a.geojson --within 1 --where {value} --force --device cpu")).code(0);
        let (a, given) = (read(&folder, "a.geojson"), read(&folder, "in.geojson"));
        assert!(has(&a, 0, &[shared]) && !has(&a, 0, &[coast_a]));
        assert_eq!(a.points(1), given.points(1));
    }
    ran::refused(&folder, "map in.geojson -o n.geojson --within 1 --where name=c", "nothing with a shape has name=c");
}

#[test]
fn a_layer_of_a_topology_is_smoothed_alone() {
    let folder = TempDir::new().unwrap();
    let zigzags = "[[0,0],[10,1],[20,-1],[30,1],[40,0]],[[0,50],[10,51],[20,49],[30,51],[40,50]]";
    let line = |arc: usize| format!(r#"{{"type":"LineString","arcs":[{arc}]}}"#);
    let topology = format!(r#"{{"type":"Topology","objects":{{"a":{},"b":{}}},"arcs":[{zigzags}]}}"#, line(0), line(1));
    fs::write(folder.path().join("in.topojson"), topology).unwrap();
    run(&folder, "map in.topojson -o out.topojson --within 2 --where layer=b --device cpu").code(0);
    let (given, out) = (read(&folder, "in.topojson"), read(&folder, "out.topojson"));
    assert_eq!(given.points(0), out.points(0));
    assert_ne!(given.points(1), out.points(1));
    let single = "fit in.topojson -o o.csv --within 2 --where layer=b --write curvature";
    ran::refused(&folder, single, "--write is of each curve, and --where keeps some as they are");
}

#[test]
fn rings_keep_their_area_in_the_few_points_that_are_written() {
    // Circles of 2 to 20 distances, and a square of 20.
    let folder = TempDir::new().unwrap();
    let mut features = vec![r#"{"type":"Feature","properties":{},"geometry":{"type":"Polygon","coordinates":[[[0,0],[20,0],[20,20],[0,20],[0,0]]]}}"#.to_string()];
    for (k, radius) in [2.0_f64, 5.0, 20.0].into_iter().enumerate() {
        let at = |j: u32| {
            let (sin, cos) = (f64::from(j % 100) * std::f64::consts::TAU / 100.0).sin_cos();
            format!("[{},{}]", 100.0 * (k + 1) as f64 + radius * cos, radius * sin)
        };
        let ring: Vec<String> = (0..=100).map(at).collect();
        let polygon = format!(r#"{{"type":"Polygon","coordinates":[[{}]]}}"#, ring.join(","));
        features.push(format!(r#"{{"type":"Feature","properties":{{}},"geometry":{polygon}}}"#));
    }
    let map = format!(
        r#"{{"type":"FeatureCollection","crs":{{"type":"name","properties":{{"name":"EPSG:3857"}}}},"features":[{}]}}"#,
        features.join(",")
    );
    fs::write(folder.path().join("in.geojson"), map).unwrap();
    for tolerance in ["auto", "0.25"] {
        let map = format!("map in.geojson -o out.geojson --within 1 --tolerance {tolerance} --device cpu --force");
        run(&folder, &map).code(0);
        let (given, out) = (read(&folder, "in.geojson"), read(&folder, "out.geojson"));
        for i in 0..given.len() {
            let [before, after] = [&given, &out].map(|batch| ran::area(batch, i));
            assert!((after / before - 1.0).abs() < 1e-3, "{tolerance}, ring {i}: {before} became {after}");
            assert!(out.count(i) < 60 && ran::from_lines(&out, &given, i) < 1.0, "{tolerance}, ring {i}");
        }
    }
}

#[test]
fn messages_name_features_as_people_do() {
    let folder = TempDir::new().unwrap();
    let gap = SQUARES.replacen("[20,10]", "[null,10]", 1);
    fs::write(folder.path().join("in.geojson"), gap).unwrap();
    run(&folder, "fit in.geojson -o out.geojson --device cpu").code(1).stderr(contains("curve 1 (b), point"));
}

#[test]
fn a_group_of_a_drawing_is_smoothed_alone() {
    let folder = TempDir::new().unwrap();
    let zigzag = "M0,0 10,1 20,-1 30,1 40,-1 50,0";
    let svg = format!("<svg><g class='traced rough'><path id='a' d='{zigzag}'/></g><path id='b' d='{zigzag}'/></svg>");
    fs::write(folder.path().join("in.svg"), &svg).unwrap();
    run(&folder, "draw in.svg -o out.svg --within 2 --where class=traced --device cpu").code(0);
    let out = text(&folder, "out.svg");
    assert!(out.contains(&format!("<path id='b' d='{zigzag}'/>")) && !out.contains(&format!("id='a' d='{zigzag}'")));
    let csv = self::folder("curve,x,y\n0,0,0\n0,1,1\n0,2,0\n");
    ran::refused(&csv, "fit in.csv -o out.csv --where curve=0", "selects features of GeoJSON");
}

#[test]
fn traced_noise_becomes_few_cubics_with_the_shapes_corners() {
    // A square of 60 with noise of up to 0.4 every 0.7.
    let folder = TempDir::new().unwrap();
    let mut word = 7_u64;
    let mut noise = || {
        word = word.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((word >> 40) as f64 / f64::from(1 << 24) - 0.5) * 0.8
    };
    let mut path = String::new();
    for k in 0..344 {
        let (side, along) = (k / 86, f64::from(k % 86) * 60.0 / 86.0);
        let [x, y] = [[along, 0.0], [60.0, along], [60.0 - along, 60.0], [0.0, 60.0 - along]][side as usize];
        path += &format!("{}{:.4},{:.4} ", if k == 0 { "M" } else { "L" }, x + noise(), y + noise());
    }
    fs::write(folder.path().join("in.svg"), format!("<svg><path d='{path}Z'/></svg>")).unwrap();
    run(&folder, "draw in.svg -o out.svg --within 1 --device cpu").code(0);
    let out = text(&folder, "out.svg");
    let cubics = out.matches(['C', 'c']).count();
    assert!(cubics <= 12, "{out}");
    let back = read(&folder, "out.svg");
    for corner in [[0.0, 0.0], [60.0, 0.0], [60.0, -60.0], [0.0, -60.0]] {
        let near = back.points(0).chunks_exact(2).map(|p| (p[0] - corner[0]).hypot(p[1] - corner[1]));
        assert!(near.fold(f64::INFINITY, f64::min) < 1.0, "{corner:?} of {out}");
    }
}

#[test]
fn tracks_paths_and_tracts_do_their_jobs_by_default() {
    let folder = TempDir::new().unwrap();
    let storms = data("storms.csv.gz");
    run(&folder, &format!("track {storms} -o s.csv --columns curve=id,x=lon,y=lat,t=hours --within 0.6 --device cpu"))
        .code(0);
    assert!(text(&folder, "s.csv").lines().next().unwrap().contains("wind"), "other columns travel along");
    run(&folder, &format!("tracts {} -o t.trk --deviation 1 --points 20 --device cpu", data("tracts.trk"))).code(0);
    let path = self::folder("curve,x,y\n0,0,0\n0,10,0\n0,10,10\n0,20,10\n");
    let code = predicate::in_iter([0, 1]);
    run(&path, "path in.csv -o p.csv --min-radius 2 --deviation 2 --report r.json --device cpu").code(code);
    let report: serde_json::Value = serde_json::from_str(&text(&path, "r.json")).unwrap();
    assert!(report["curves"][0]["max_curvature"].as_f64().unwrap() <= 0.5 * (1.0 + 1e-6));
}

#[test]
fn tracks_within_metres_are_smooth_in_time_on_the_ground() {
    // Over the date line and north, a minute apart, 7 m/s with noise.
    let side = |k: i32| 1e-4 * f64::from(k * k % 7 - 3);
    let lon = |k: i32| (179.9 + 0.005 * f64::from(k) + side(3 * k) + 180.0).rem_euclid(360.0) - 180.0;
    let row = |k: i32| {
        format!("a,{},{},2024-03-01T00:{k:02}:00Z,{}\n", lon(k), 60.0 + 0.001 * f64::from(k) + side(k), 90 + k % 3)
    };
    let folder = self::folder(&format!("curve,lon,lat,t,ele\n{}", (0..60).map(row).collect::<String>()));
    let words = said(&folder, "track in.csv -o out.csv --within 40m --every 1min --write speed --device cpu");
    assert!(
        words.contains("40m is on the ground: lengths and speeds are in metres, as with --surface wgs84"),
        "{words}"
    );
    let fit = "fit in.csv -o own.csv --tube 40 --surface wgs84 --pin none --every 60 --write speed --carry all \
               --within-height gcv";
    run(&folder, &format!("{fit} --device cpu")).code(0);
    assert_eq!(text(&folder, "out.csv"), text(&folder, "own.csv"));
    let (given, rows) = (text(&folder, "in.csv"), text(&folder, "out.csv"));
    let number = |line: &str, at: usize| line.split(',').nth(at).unwrap().parse::<f64>().unwrap();
    let place = |line: &str| Globe::WGS84.place(number(line, 1), number(line, 2));
    let mut away: f64 = 0.0;
    for (a, b) in given.lines().zip(rows.lines()).skip(1) {
        away = away.max(place(a).distance(place(b)));
        assert!((4.0..6.0).contains(&number(b, 5)), "a steady speed: {b}");
    }
    assert!(away > 20.0 && away <= 40.0 + 1e-6, "{away}");
    // Heights have their own distance.
    let space = given.replace("ele", "z");
    fs::write(folder.path().join("space.csv"), space).unwrap();
    run(&folder, "track space.csv -o high.csv --within 40m --within-height 2m --every 1min --device cpu").code(0);
    let heights: Vec<f64> = text(&folder, "high.csv").lines().skip(1).map(|line| number(line, 3)).collect();
    let bends = heights.windows(3).map(|own| own[0] - 2.0 * own[1] + own[2]);
    assert!(bends.fold(0.0, |most: f64, bend| most.max(bend.abs())) < 1e-6, "{heights:?}");
    fs::write(folder.path().join("flat.csv"), given.replace("ele", "hr")).unwrap();
    ran::refused(&folder, "track flat.csv -o no.csv --within 40m --within-height 2m", "of heights of longitudes");
}

#[test]
fn paths_have_the_speeds_of_their_fastest_drive() {
    let folder = self::folder("curve,x,y,stop\na,0,0,\na,30,0,\na,30,30,1\na,60,30,\n");
    let vehicle = "--speed 15 --lateral 3 --accelerate 2 --brake 4";
    let path = "path in.csv -o p.csv --min-radius 4 --deviation 3 --spacing 0.5 --device cpu --force";
    run(&folder, &format!("{path} {vehicle}")).code(predicate::in_iter([0, 1]));
    let rows = text(&folder, "p.csv");
    assert_eq!(rows.lines().next().unwrap(), "curve,x,y,t,stop,v,a_long,a_lat");
    let numbers: Vec<Vec<f64>> =
        rows.lines().skip(1).map(|line| line.split(',').skip(1).map(|x| x.parse().unwrap_or(0.0)).collect()).collect();
    assert!(numbers.iter().all(|row| row[4] <= 15.0 && row[6].abs() <= 3.0 + 1e-9), "{rows}");
    assert!(numbers.windows(2).all(|pair| pair[1][2] > pair[0][2]), "time goes on");
    // At rest at both ends, and at the stop, which is a sample.
    let speeds: Vec<f64> = numbers.iter().map(|row| row[4]).collect();
    let stops = speeds.iter().filter(|v| **v == 0.0).count();
    assert!(speeds[0] == 0.0 && speeds[speeds.len() - 1] == 0.0 && stops == 3, "{speeds:?}");
    // The second span has a largest speed, and the acceleration changes by at most the jerk times the time.
    fs::write(folder.path().join("limits.csv"), "curve,point,max_speed\na,1,5\na,0,NA\n").unwrap();
    run(&folder, &format!("{path} {vehicle} --jerk 3 --limits limits.csv")).code(predicate::in_iter([0, 1]));
    let rows = text(&folder, "p.csv");
    let numbers: Vec<Vec<f64>> =
        rows.lines().skip(1).map(|line| line.split(',').skip(1).map(|x| x.parse().unwrap_or(0.0)).collect()).collect();
    assert_eq!(rows.lines().next().unwrap(), "curve,x,y,t,stop,max_speed,v,a_long,a_lat");
    let inner = numbers.iter().filter(|row| row[0] > 28.0 && row[1] > 4.0 && row[0] < 32.0);
    assert!(inner.clone().count() > 20 && inner.clone().all(|row| row[5] <= 5.0 + 1e-6), "{rows}");
    for pair in numbers.windows(2).filter(|pair| pair[1][5] > 2.0 && pair[0][5] > 2.0) {
        assert!((pair[1][6] - pair[0][6]).abs() <= 3.0 * 1.2 * (pair[1][2] - pair[0][2]), "{pair:?}");
    }
    fs::write(folder.path().join("limits.csv"), "curve,point,max_speed\na,1,-5\n").unwrap();
    ran::refused(&folder, &format!("{path} {vehicle} --limits limits.csv"), "point 1: its max_speed is no positive");
    ran::refused(
        &folder,
        "path in.csv -o q.csv --min-radius 4 --speed 15 --lateral 0 --accelerate 2 --brake 4",
        "largest acceleration across is 0",
    );
}

#[test]
fn few_samples_stay_within_their_tolerance_of_every_method() {
    let folder = TempDir::new().unwrap();
    let octopus = data("octopus.csv");
    for method in ["natural", "fair", "scf", "smoothing --within 5%"] {
        let within = method.contains("within");
        let tolerance = if within { "1%" } else { "0.5" };
        let fit = format!("fit {octopus} --method {method} --device cpu --force");
        run(&folder, &format!("{fit} -o few.csv --tolerance {tolerance}")).code(0);
        let fine = if within { fit.replace("5%", "4%") } else { fit };
        run(&folder, &format!("{fine} -o fine.csv --samples 64")).code(0);
        let (few, fine) = (read(&folder, "few.csv"), read(&folder, "fine.csv"));
        let most = if within { 0.01 * ran::diagonal(&io::read(&octopus).unwrap(), 0) } else { 0.5 };
        let far = ran::from_lines(&fine, &few, 0).max(ran::from_lines(&few, &fine, 0));
        assert!(far <= 1.001 * most && far > 0.1 * most, "{method}: {far} of {most}");
        assert!(few.count(0) < fine.count(0) / 8, "{method}: {} of {}", few.count(0), fine.count(0));
    }
}

#[test]
fn exact_shapes_and_joined_strokes_of_a_drawing_stay() {
    let folder = TempDir::new().unwrap();
    let exact = "<circle cx='20' cy='20' r='5'/><rect x='70' y='70' width='10' height='12'/>\
                 <ellipse cx='50' cy='90' rx='5' ry='3'/><line x1='2' y1='90' x2='9' y2='95'/>";
    let long = "M10,50 L20,52 30,55 40,53 50,50 60,47 70,45 80,48 90,50";
    let svg = format!(
        "<svg><path id='long' d='{long}'/><path id='joined' d='M35,54 L33,40 36,30 35,10'/>\
         <path id='side' d='M0,0 L99,0 99,9'/>{exact}</svg>"
    );
    fs::write(folder.path().join("in.svg"), &svg).unwrap();
    let words = said(&folder, "draw in.svg -o out.svg --within 2 --device cpu");
    assert!(words.contains("1 <circle>, 1 <ellipse>, 1 <line>, 1 <rect> left as they are"), "{words}");
    let out = text(&folder, "out.svg");
    assert!(out.contains(exact), "{out}");
    // A side is a line, and no cubic.
    assert!(out.contains("'M0,0l99 0"), "{out}");
    // The long stroke has a joint where another one starts, as without rounding.
    run(&folder, "draw in.svg -o out.csv --within 2 --device cpu").code(0);
    let chains = read(&folder, "out.csv");
    assert!(chains.points(0).chunks(2).any(|point| *point == chains.points(1)[..2]), "{chains:?}");
    run(&folder, "fit in.svg -o all.svg --method smoothing --within 2 --device cpu").code(0);
    assert!(!text(&folder, "all.svg").contains("<circle"));
    run(&folder, "fit in.svg -o paths.svg --method smoothing --within 2 --only paths --device cpu").code(0);
    assert!(text(&folder, "paths.svg").contains(exact));
}
