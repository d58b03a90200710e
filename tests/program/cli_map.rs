//! `faircurve fit` on maps, as its users meet it.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use super::ran::{self, run};
use faircurve::io;
use predicates::prelude::*;
use predicates::str::contains;
use serde_json::Value;
use tempfile::TempDir;

/// Two countries with a common border, and a lake that is both hole and land, as TopoJSON.
const MAP: &str = r#"{"type":"Topology","transform":{"scale":[0.01,0.01],"translate":[10,50]},
"objects":{"lands":{"type":"GeometryCollection","geometries":[
  {"type":"Polygon","id":"L","properties":{"name":"left"},"arcs":[[0,1],[3]]},
  {"type":"Polygon","id":"R","properties":{"name":"right"},"arcs":[[2,-1]]},
  {"type":"MultiPolygon","properties":{"name":"lake"},"arcs":[[[-4]]]},
  {"type":"Point","properties":{"name":"town"},"coordinates":[50,60]},
  {"type":null,"properties":{"name":"nowhere"}}]}},
"arcs":[[[100,0],[10,50],[-10,50]],[[100,100],[-100,0],[-10,-50],[10,-50],[100,0]],
  [[100,0],[100,0],[5,60],[-5,40],[-100,0]],[[30,30],[10,0],[5,10],[-15,10],[0,-20]]]}"#;

fn map() -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("map.topojson"), MAP).unwrap();
    fs::write(folder.path().join("map.json"), MAP).unwrap();
    folder
}

fn json(folder: &TempDir, name: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(folder.path().join(name)).unwrap()).unwrap()
}

/// The positions of a ring, as text.
fn ring(document: &Value, feature: usize, path: &str) -> BTreeSet<String> {
    let ring = document["features"][feature]["geometry"].pointer(path).unwrap();
    ring.as_array().unwrap().iter().map(Value::to_string).collect()
}

#[test]
fn contours_of_a_table_keep_the_columns_of_their_lines() {
    let line = |name: &str, level: f64| -> String {
        (0..40).map(|k| format!("{name},{k},{},{level}\n", level + f64::from(k * k % 5) * 0.1)).collect()
    };
    let folder = ran::folder(&format!("curve,x,y,level\n{}{}", line("a", 10.0), line("b", 12.0)));
    let map = "map in.csv --within 0.3 --carry level --device cpu";
    run(&folder, &format!("{map} -o out.csv")).code(0);
    let rows = fs::read_to_string(folder.path().join("out.csv")).unwrap();
    assert_eq!(rows.lines().next().unwrap(), "curve,x,y,t,level");
    assert!(rows.lines().skip(1).all(|row| row.ends_with(if row.starts_with("a,") { ",10" } else { ",12" })), "{rows}");
    run(&folder, &format!("{map} -o out.geojson")).code(0);
    let document = fs::read_to_string(folder.path().join("out.geojson")).unwrap();
    assert!(document.contains("\"level\":10") && document.contains("\"level\":12"), "{document}");
    // What changes along a line cannot be shared.
    fs::write(folder.path().join("in.csv"), "curve,x,y,level\na,0,0,1\na,1,1,2\na,2,0,3\n").unwrap();
    run(&folder, &format!("{map} -o no.csv")).code(2);
}

#[test]
fn mended_lines_of_very_uneven_points_do_not_overshoot() {
    // Two lines that cross once they are smooth, with points as close as a thousandth.
    let folder = TempDir::new().unwrap();
    let mut word = 1_u64;
    let mut random = || {
        word = word.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (word >> 40) as f64 / f64::from(1 << 24)
    };
    let mut lines = [String::new(), String::new()];
    for k in 0..60 {
        let (x, low) = (10.0 * f64::from(k), 8.0 * random() - 4.0);
        let high = low + 0.5 + if k % 2 > 0 { 9.0 * random() } else { 0.0 };
        for (name, (line, y)) in lines.iter_mut().zip([low, high]).enumerate() {
            *line += &format!("{name},{x},{y}\n{name},{},{}\n", x + 1e-3, y + 2e-4);
        }
    }
    let rows = format!("curve,x,y\n{}", lines.concat());
    fs::write(folder.path().join("in.csv"), rows).unwrap();
    for within in [5.0, 8.0] {
        let map = format!("map in.csv -o out.csv --within {within} --device cpu --force");
        run(&folder, &map).code(0).stderr(contains(" 0 crossings").not().and(contains(" 0 left")));
        let (given, written) =
            (io::read(folder.path().join("in.csv")).unwrap(), io::read(folder.path().join("out.csv")).unwrap());
        for i in 0..2 {
            let far = ran::from_lines(&written, &given, i);
            assert!(far <= within, "{far} of {within}, curve {i}");
        }
    }
}

#[test]
fn maps_keep_their_borders_shared_and_everything_else() {
    let folder = map();
    let said = contains("2 borders that curves share stay shared, and 2 junctions stay in place: 3 curves were fitted");
    run(&folder, "fit map.json -o out.geojson --device cpu --samples 4 --report r.json").code(0).stderr(said);
    let out = json(&folder, "out.geojson");
    let shared = |a: BTreeSet<String>, b: BTreeSet<String>| a.intersection(&b).count();
    // Two spans of four segments, and a lake of four.
    assert_eq!(shared(ring(&out, 0, "/coordinates/0"), ring(&out, 1, "/coordinates/0")), 9);
    assert_eq!(shared(ring(&out, 0, "/coordinates/1"), ring(&out, 2, "/coordinates/0/0")), 16);
    let names: Vec<&Value> = (0..5).map(|k| &out["features"][k]["properties"]["name"]).collect();
    assert_eq!(names, ["left", "right", "lake", "town", "nowhere"]);
    assert_eq!(
        (&out["features"][0]["id"], &out["features"][3]["geometry"]["coordinates"][0]),
        (&"L".into(), &10.5.into())
    );
    assert_eq!(json(&folder, "r.json")["curves"].as_array().unwrap().len(), 4);
    // Ring by ring they tear.
    run(&folder, "fit map.json -o torn.geojson --device cpu --samples 4 --topology no").code(0);
    let torn = json(&folder, "torn.geojson");
    assert!(shared(ring(&torn, 0, "/coordinates/0"), ring(&torn, 1, "/coordinates/0")) < 9);
}

#[test]
fn topologies_are_written_with_each_arc_once_and_read_back_the_same() {
    let folder = map();
    run(&folder, "fit map.topojson -o out.topojson --device cpu --samples 4").code(0);
    let out = json(&folder, "out.topojson");
    assert_eq!(out["arcs"].as_array().unwrap().len(), 4);
    assert_eq!(out["objects"]["lands"]["geometries"][1]["id"], "R");
    assert_eq!(out["objects"]["lands"]["geometries"][3]["coordinates"][0], 10.5);
    assert_eq!(out["objects"]["lands"]["geometries"][4]["type"], Value::Null);
    run(&folder, "fit map.topojson -o out.geojson --device cpu --samples 4").code(0);
    let read = |name: &str| io::read(folder.path().join(name)).unwrap();
    let (topo, geo) = (read("out.topojson"), read("out.geojson"));
    assert_eq!(topo.offsets(), geo.offsets());
    for i in 0..geo.len() {
        // GeoJSON has ten digits.
        let points = |batch: &faircurve::CurveBatch| {
            batch.points(i).iter().map(|x| (x * 1e8).round() as i64).collect::<BTreeSet<_>>()
        };
        assert_eq!(points(&topo), points(&geo), "curve {i}");
    }
    // GeoJSON becomes a topology too, and digits quantise.
    run(&folder, "fit out.geojson -o again.topojson --device cpu --samples 1 --digits 3").code(0);
    let again = json(&folder, "again.topojson");
    assert_eq!((&again["transform"]["scale"][0], again["arcs"].as_array().unwrap().len()), (&0.001.into(), 4));
    assert!(again["arcs"][0].as_array().unwrap().iter().all(|step| step[0].is_i64() && step[1].is_i64()));
    let again = read("again.topojson");
    let distance = again.points(1).iter().zip(geo.points(1)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(again.count(1) == geo.count(1) && distance <= 0.000_501, "{distance}");
}

#[test]
fn crossings_are_told_and_mended() {
    let world =
        format!("fit {}/examples/data/world-110m.topojson --device cpu --samples 8", env!("CARGO_MANIFEST_DIR"));
    let folder = TempDir::new().unwrap();
    let told = contains("crossings (2 in the data): curve").and(contains("--crossings mend mends them"));
    run(&folder, &format!("{world} -o a.geojson --crossings count")).code(0).stderr(told);
    let mended = contains("were drawn tighter, 2 left, which the data have: curve");
    run(&folder, &format!("{world} -o b.geojson --digits 6")).code(0).stderr(mended);
    let text = fs::read_to_string(folder.path().join("b.geojson")).unwrap();
    let decimals = |number: &str| number.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    let digits = text.split(|c: char| !(c.is_ascii_digit() || c == '.')).map(decimals).max();
    assert_eq!(digits, Some(6));
    run(&folder, &format!("{world} -o c.geojson --crossings ignore")).code(0).stderr(contains("crossing").not());
}

#[test]
fn rings_have_four_positions_at_least() {
    let folder = TempDir::new().unwrap();
    let point = r#"{"type":"Polygon","coordinates":[[[1,2],[1,2],[1,2],[1,2]]]}"#;
    fs::write(folder.path().join("point.geojson"), point).unwrap();
    run(&folder, "fit point.geojson -o out.geojson --device cpu").code(0);
    let out = json(&folder, "out.geojson");
    assert_eq!(out["coordinates"][0].to_string().replace(".0", ""), "[[1,2],[1,2],[1,2],[1,2]]");
}

#[test]
fn geometries_without_points_go_through_every_way_out_of_a_map() {
    let folder = TempDir::new().unwrap();
    let geometry = |kind: &str, coordinates: &str| {
        format!(r#"{{"type":"Feature","properties":{{}},"geometry":{{"type":"{kind}","coordinates":{coordinates}}}}}"#)
    };
    let ring = "[[[0,0],[4,0],[4,4],[0,4],[0,0]]]";
    let odd = [("Polygon", "[]"), ("Polygon", "[[]]"), ("MultiPolygon", "[[]]"), ("LineString", "[]")];
    let all = odd.into_iter().chain([("LineString", "[[1,1]]"), ("Polygon", ring)]);
    let features: Vec<String> = all.map(|(kind, coordinates)| geometry(kind, coordinates)).collect();
    fs::write(
        folder.path().join("in.geojson"),
        format!(r#"{{"type":"FeatureCollection","features":[{}]}}"#, features.join(",")),
    )
    .unwrap();
    for options in ["", "--digits 2", "--crossings count", "--topology no", "--method fair", "--topology no --points 5"]
    {
        for out in ["out.geojson", "out.topojson", "out.csv"] {
            let fit = format!("fit in.geojson -o {out} --device cpu --force {options}");
            run(&folder, &fit).code(1).stderr(contains("2 of 4 curves are not usable").and(contains("no point")));
            assert!(faircurve::io::read(folder.path().join(out)).unwrap().total_points() > 3, "{options} {out}");
        }
    }
}

#[test]
fn options_of_maps_are_refused_where_they_mean_nothing() {
    let folder = map();
    fs::write(folder.path().join("a.csv"), "curve,x,y,t\na,0,0,0\na,1,1,1\na,2,0,3\n").unwrap();
    let refused = |arguments: &str, sentence: &str| ran::refused(&folder, arguments, sentence);
    refused(
        "fit a.csv -o b.csv --snap 1",
        "--snap is for borders that curves share, which are not looked for here: add --topology yes",
    );
    refused("fit a.csv -o b.csv --topology yes", "the points have parameters, weights or constraints");
    refused(
        "fit map.json -o b.geojson --keep-area 2 --crossings mend",
        "--keep-area is 2; it is a share of a ring's area, from 0 to 1",
    );
    refused(
        "fit map.json -o b.geojson --keep-area 0.2 --crossings count",
        "--keep-area 0.2 is kept where crossings are mended: add --crossings mend",
    );
    refused("fit map.json -o b.geojson --snap -1", "the distance within which points are one is -1");
}

#[test]
fn topologies_that_are_none_are_explained() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.json");
    let complaint = |text: &str| {
        fs::write(&path, text).unwrap();
        let said = io::read(&path).unwrap_err().to_string();
        said.replace(&format!("{}", Path::new(&path).display()), "a.json")
    };
    let with = |geometry: &str| {
        complaint(&format!(r#"{{"type":"Topology","arcs":[[[0,0],[1,1]]],"objects":{{"o":{geometry}}}}}"#))
    };
    assert_eq!(complaint(r#"{"type":"Topology","objects":{}}"#), "a.json: the topology has no \"arcs\": add them");
    assert_eq!(complaint(r#"{"type":"Topology","arcs":[]}"#), "a.json: the topology has no \"objects\": add them");
    let arcs = complaint(r#"{"type":"Topology","arcs":[[[0,"x"]]],"objects":{}}"#);
    assert!(arcs.starts_with("a.json: \"arcs\" must be lists of positions, numbers all of them: "), "{arcs}");
    assert_eq!(
        with(r#"{"type":"LineString","arcs":[1]}"#),
        "a.json: object \"o\", geometry 0: it names arc 1, but there are 1 arcs: from −1 to 0 are possible"
    );
    assert_eq!(
        with(r#"{"type":"LineString","arcs":[[0]]}"#),
        "a.json: object \"o\", geometry 0: its arc [0] is no whole number: arcs are named by their numbers"
    );
    assert_eq!(
        with(r#"{"type":"Polygon","arcs":0}"#),
        "a.json: object \"o\", geometry 0: its arcs do not nest as its type asks: see TopoJSON's specification"
    );
    assert_eq!(with(r#"{"type":"Polygon"}"#), "a.json: object \"o\", geometry 0: it has no \"arcs\": add them");
    assert_eq!(
        with(r#"{"type":"Line","arcs":[0]}"#),
        "a.json: object \"o\", geometry 0: the type \"Line\" is none of TopoJSON's"
    );
    assert_eq!(with("7"), "a.json: object \"o\", geometry 0: it is no JSON object: TopoJSON needs one with a \"type\"");
}

/// The positions of a ring or line, without that which a ring repeats.
fn positions(document: &Value, feature: usize) -> Vec<[f64; 2]> {
    let geometry = &document["features"][feature]["geometry"];
    let line = if geometry["type"] == "Polygon" { &geometry["coordinates"][0] } else { &geometry["coordinates"] };
    let mut line: Vec<[f64; 2]> = serde_json::from_value(line.clone()).unwrap();
    line.truncate(line.len() - usize::from(geometry["type"] == "Polygon"));
    line
}

/// By how many degrees a line turns in all.
fn turning(line: &[[f64; 2]]) -> f64 {
    let steps = line.windows(2).map(|w| [w[1][0] - w[0][0], w[1][1] - w[0][1]]);
    let steps: Vec<[f64; 2]> = steps.filter(|step| *step != [0.0; 2]).collect();
    let angle = |u: [f64; 2], v: [f64; 2]| (u[0] * v[1] - u[1] * v[0]).atan2(u[0] * v[0] + u[1] * v[1]).abs();
    steps.windows(2).map(|w| angle(w[0], w[1])).sum::<f64>().to_degrees()
}

#[test]
fn mended_contour_lines_bring_no_stairs_of_pixels_back() {
    let folder = TempDir::new().unwrap();
    let contours = format!("fit {}/tests/data/contours.geojson --device cpu", env!("CARGO_MANIFEST_DIR"));
    for limit in ["--tube 3", "--tube 2.5"] {
        let fit = |how: &str| {
            run(&folder, &format!("{contours} {limit} --topology yes --crossings {how} -o {how}.geojson --force"))
        };
        fit("ignore").code(0);
        fit("mend").code(0).stderr(contains(" 0 left"));
        for i in 0..2 {
            let [before, after] =
                ["ignore.geojson", "mend.geojson"].map(|file| turning(&positions(&json(&folder, file), i)));
            assert!(after < 1.5 * before, "{limit}, line {i}: {before} became {after}");
        }
    }
}

#[test]
fn mended_borders_keep_their_own_direction_at_a_corner() {
    let folder = TempDir::new().unwrap();
    let rings = "[[[0,0.3],[0,0],[6,-0.03],[10,-0.01],[9.3,0.04],[9,0.3],[9,3],[0,3],[0,0.3]]]
        [[[0,0.3],[-3,0.3],[-3,-3],[14,-3],[14,-0.3],[10,-0.01],[6,-0.03],[0,0],[0,0.3]]]
        [[[10,-0.01],[14,-0.3],[14,3],[9,3],[9,0.3],[9.3,0.04],[10,-0.01]]]";
    polygons(&folder, "corner.geojson", rings);
    let direction = |how: &str| {
        let fit =
            format!("fit corner.geojson --method fair --corners 60 --samples 8 -o {how}.geojson --crossings {how}");
        run(&folder, &format!("{fit} --device cpu")).code(0);
        let ring = positions(&json(&folder, &format!("{how}.geojson")), 0);
        let corner = ring.iter().position(|p| *p == [0.0, 0.0]).unwrap();
        let next = ring[(corner + 1) % ring.len()];
        next[1].atan2(next[0]).to_degrees()
    };
    let (before, after) = (direction("ignore"), direction("mend"));
    assert!((before - after).abs() < 1.0, "{before} became {after}");
}

/// Writes polygons of one ring, a line each.
fn polygons(folder: &TempDir, file: &str, rings: &str) {
    let feature = |ring: &str| {
        format!(
            r#"{{"type":"Feature","properties":{{}},"geometry":{{"type":"Polygon","coordinates":{}}}}}"#,
            ring.trim()
        )
    };
    let features = rings.lines().map(feature).collect::<Vec<_>>().join(",");
    let crs = r#""crs":{"type":"name","properties":{"name":"EPSG:25832"}}"#;
    let text = format!(r#"{{"type":"FeatureCollection",{crs},"features":[{features}]}}"#);
    fs::write(folder.path().join(file), text).unwrap();
}

#[test]
fn borders_with_a_vertex_on_one_side_only_are_shared() {
    let folder = TempDir::new().unwrap();
    for (vertex, snap) in [("64,40", ""), ("64.1,40", "--snap 0.2")] {
        let left = format!("[[[0,0],[50,-10],[60,20],[{vertex}],[68,60],[60,90],[20,100],[-10,60],[0,0]]]");
        let right = "[[[50,-10],[110,0],[120,50],[100,95],[60,90],[68,60],[60,20],[50,-10]]]";
        polygons(&folder, "map.geojson", &format!("{left}\n{right}"));
        for method in ["", "--deviation 3", "--method fair", "--method scf"] {
            run(&folder, &format!("fit map.geojson -o out.geojson --samples 4 {method} {snap} --device cpu --force"))
                .code(0)
                .stderr(contains("1 border that curves share stay shared, and 2 junctions"));
            let out = json(&folder, "out.geojson");
            let shared = ring(&out, 0, "/coordinates/0").intersection(&ring(&out, 1, "/coordinates/0")).count();
            assert_eq!(shared, 17, "{method} {snap}");
        }
    }
}

#[test]
fn rings_that_go_there_and_back_stay_on_their_border() {
    let folder = TempDir::new().unwrap();
    let west = "[[[0,0],[4,0],[5,2],[4,4],[5,6],[0,6],[0,0]]]";
    let east = "[[[4,0],[9,0],[9,6],[5,6],[4,4],[5,2],[4,0]]]";
    for (sliver, count) in [("[[[5,2],[4,4],[5,2]]]", 3), ("[[[4,0],[5,2],[4,4],[5,2],[4,0]]]", 5)] {
        for method in ["--deviation 0.3", "", "--method fair"] {
            let fit = |rings: &str, file: &str| {
                polygons(&folder, "map.geojson", rings);
                run(&folder, &format!("fit map.geojson -o {file} --samples 2 {method} --device cpu --force")).code(0);
                json(&folder, file)
            };
            let with = fit(&format!("{west}\n{east}\n{sliver}"), "with.geojson");
            let without = fit(&format!("{west}\n{east}"), "without.geojson");
            let [border, sliver] = [0, 2].map(|i| ring(&with, i, "/coordinates/0"));
            assert!(sliver.len() == count && sliver.is_subset(&border), "{method}: {sliver:?}");
            assert_eq!(border, ring(&without, 0, "/coordinates/0"), "{method}: the border is as without it");
        }
    }
}

#[test]
fn polygons_are_mended_as_they_are_written() {
    let folder = TempDir::new().unwrap();
    let south = "[[[0,0],[40,0],[40,20],[22,20],[20.7,10],[20,4],[19.4,10],[18,20],[0,20],[0,0]]]";
    let north = "[[[0,40],[0,20],[18,20],[19.4,10],[20,4],[20.7,10],[22,20],[40,20],[40,40],[0,40]]]";
    polygons(&folder, "bay.geojson", &format!("{south}\n{north}"));
    for file in ["out.geojson", "out.topojson"] {
        let fit =
            |digits: u8| run(&folder, &format!("fit bay.geojson -o {file} --digits {digits} --device cpu --force"));
        fit(1).code(0).stderr(contains("0 left").and(contains("left out").not()));
        fit(0).code(0).stderr(contains("0 left").and(contains("left out where rounding folds a border")));
        let out = io::read(folder.path().join(file)).unwrap();
        for i in 0..2 {
            let points = out.points(i).as_chunks::<2>().0;
            let different: BTreeSet<_> = points.iter().map(|p| p.map(f64::to_bits)).collect();
            assert!(
                different.len() == points.len() && points.iter().flatten().all(|x| x.fract() == 0.0),
                "{file}, {i}"
            );
        }
    }
    // Where rounding leaves nothing between two, it is said, and what would help.
    polygons(
        &folder,
        "near.geojson",
        "[[[0,0],[10.2,0],[10.2,10],[0,10],[0,0]]]\n[[[10.4,1],[20,1],[20,9],[10.4,9],[10.4,1]]]",
    );
    let said = contains("in the data or once rounded")
        .and(contains("0 decimals do not keep apart what is left: --digits 1 does"));
    run(&folder, "fit near.geojson -o near.csv --digits 0 --device cpu").code(0).stderr(said);
}

#[test]
fn a_mended_coast_has_no_more_points_than_before() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("saronic.geojson"), include_str!("../data/saronic.geojson")).unwrap();
    let points = |crossings: &str| {
        let said = contains(if crossings == "mend" {
            "2 crossings: 9 spans were drawn tighter, 0 left"
        } else {
            "2 crossings"
        });
        let command =
            format!("map saronic.geojson -o {crossings}.geojson --within 10km --crossings {crossings} --device cpu");
        run(&folder, &command).code(0).stderr(said);
        io::read(folder.path().join(format!("{crossings}.geojson"))).unwrap().total_points()
    };
    let [crossing, mended] = ["count", "mend"].map(points);
    assert!(10 * mended < 11 * crossing, "{crossing} points, mended {mended}");
}

#[test]
fn polygons_keep_their_areas_with_their_shared_borders() {
    let folder = TempDir::new().unwrap();
    // Two countries whose common border bulges, and an island.
    let west = "[[[0,0],[2,0],[2.3,1],[2,2],[0,2],[0,1],[0,0]]]";
    let east = "[[[2,0],[4,0],[4,1],[4,2],[2,2],[2.3,1],[2,0]]]";
    let island = "[[[6,0],[7,0],[7.5,1],[7,2],[6,2],[5.5,1],[6,0]]]";
    polygons(&folder, "map.geojson", &format!("{west}\n{east}\n{island}"));
    let areas = |name: &str| -> Vec<f64> {
        let batch = io::read(folder.path().join(name)).unwrap();
        let area = |i: usize| {
            let points = batch.points(i).as_chunks::<2>().0;
            let cross = |k: usize| {
                let ([x, y], [v, w]) = (points[k], points[(k + 1) % points.len()]);
                x * w - y * v
            };
            0.5 * (0..points.len()).map(cross).sum::<f64>()
        };
        (0..batch.len()).map(area).collect()
    };
    for (file, option) in [("kept.geojson", "--preserve-area"), ("free.geojson", "--junctions free")] {
        run(&folder, &format!("fit map.geojson -o {file} --method fair --deviation 0.3 --device cpu {option}")).code(0);
    }
    let [data, kept, free] = ["map.geojson", "kept.geojson", "free.geojson"].map(areas);
    let apart = |found: &[f64]| data.iter().zip(found).map(|(a, b)| (b / a - 1.0).abs()).fold(0.0, f64::max);
    assert!(apart(&kept) < 1e-6 && apart(&free) > 0.1, "{data:?} {kept:?} {free:?}");
}
