//! Maps with one odd item: null, without points, with altitudes here and there. It is its own trouble, and stays as it is.

use faircurve::CurveBatch;
use faircurve::io::{self, Antimeridian, WriteOptions};
use faircurve::topology::{Options, Topology};

use super::errors::without_folder;

/// A map of lines, one of which is odd.
fn with_odd(odd: &str) -> (tempfile::TempDir, CurveBatch) {
    let good = |x: u8| format!("{{\"type\":\"LineString\",\"coordinates\":[[{x},0],[{x},1],[{x},3]]}}");
    let feature = |geometry: &str| format!("{{\"type\":\"Feature\",\"properties\":null,\"geometry\":{geometry}}}");
    let features = [feature(&good(0)), odd.into(), feature(&good(1))].join(",\n");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.geojson");
    std::fs::write(&path, format!("{{\"type\":\"FeatureCollection\",\"features\":[\n{features}\n]}}")).unwrap();
    let batch = io::read(&path).unwrap();
    (folder, batch)
}

#[test]
fn a_null_stays_and_is_no_trouble() {
    let geometry = |text: &str| format!("{{\"type\":\"Feature\",\"properties\":{{}},\"geometry\":{text}}}");
    let nested = r#"{"type":"GeometryCollection","geometries":[null,{"type":"Point","coordinates":[1,2]},null]}"#;
    for odd in ["null".to_string(), geometry("null"), geometry(nested)] {
        let (folder, batch) = with_odd(&odd);
        assert_eq!((batch.len(), batch.name(1).as_ref()), (2, "2"), "{odd}");
        assert!((0..2).all(|i| batch.problem(i).is_none()));
        let path = folder.path().join("b.geojson");
        io::write(&path, &batch).unwrap();
        let texts = ["a.geojson", "b.geojson"].map(|name| std::fs::read_to_string(folder.path().join(name)).unwrap());
        assert_eq!(texts[0], texts[1]);
    }
}

#[test]
fn nulls_of_a_topology_stay_where_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let [from, to] = ["a.topojson", "b.topojson"].map(|name| folder.path().join(name));
    let collection = r#"{"type":"GeometryCollection","geometries":[null,{"type":"LineString","arcs":[0]}]}"#;
    let geometries = [
        "null",
        r#"{"type":"LineString","arcs":[0]}"#,
        r#"{"type":null}"#,
        "null",
        r#"{"type":"MultiPolygon","arcs":[]}"#,
        collection,
    ];
    let all = geometries.join(",");
    std::fs::write(
        &from,
        format!(r#"{{"type":"Topology","arcs":[[[0,0],[1,1]]],"objects":{{"a":{{"type":"GeometryCollection","geometries":[{all}]}}}}}}"#),
    )
    .unwrap();
    io::write(&to, &io::read(&from).unwrap()).unwrap();
    let written: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&to).unwrap()).unwrap();
    let found = written["objects"]["a"]["geometries"].as_array().unwrap();
    for (k, wanted) in geometries.iter().enumerate() {
        assert_eq!(found[k], serde_json::from_str::<serde_json::Value>(wanted).unwrap(), "geometry {k}");
    }
}

#[test]
fn a_line_or_ring_without_points_is_named_by_its_feature() {
    let geometry = |kind: &str, coordinates: &str| {
        let geometry = format!("{{\"type\":\"{kind}\",\"coordinates\":{coordinates}}}");
        format!("{{\"type\":\"Feature\",\"properties\":{{}},\"geometry\":{geometry}}}")
    };
    for (kind, coordinates) in [
        ("LineString", "[]"),
        ("LineString", "null"),
        ("Polygon", "[[]]"),
        ("MultiLineString", "[null]"),
        ("MultiPolygon", "[[[]]]"),
    ] {
        let (folder, batch) = with_odd(&geometry(kind, coordinates));
        let topology = Topology::new(&batch, &Options::of(&batch)).unwrap();
        let [alone, shared] = [&batch, topology.strokes()].map(|batch| {
            let fit = faircurve::spline::Natural::default().fit(batch, &faircurve::Device::cpu()).unwrap();
            let said: Vec<String> = fit.reports().iter().filter_map(|report| report.message.clone()).collect();
            without_folder(&said.join("; "), folder.path())
        });
        let wanted =
            "a.geojson, curve 1, point 0: the curve has no point; it needs two distinct ones: add them, or remove it";
        assert_eq!([&*alone, &*shared], [wanted; 2], "{kind} {coordinates}");
    }
    // Nothing at all is no curve.
    for (kind, coordinates) in
        [("Polygon", "[]"), ("Polygon", "null"), ("MultiPolygon", "[[]]"), ("MultiLineString", "null")]
    {
        let (_, batch) = with_odd(&geometry(kind, coordinates));
        assert_eq!(batch.len(), 2, "{kind} {coordinates}");
    }
}

#[test]
fn altitudes_are_missing_where_they_were_and_trouble_one_line() {
    let geometry = |coordinates: &str| {
        let geometry = format!("{{\"type\":\"LineString\",\"coordinates\":{coordinates}}}");
        format!("{{\"type\":\"Feature\",\"properties\":{{}},\"geometry\":{geometry}}}")
    };
    let high = "[[170,0,5],[-170,0,6],[-160,0,7]]";
    let (_, batch) = with_odd(&geometry(high));
    assert_eq!((batch.dimension(), batch.problem(0), batch.problem(1)), (3, None, None));
    assert_eq!(batch.notes(), ["2 lines have no altitudes, such as 0: 0 is taken, and not written in GeoJSON"]);
    for mixed in ["[[170,0],[-170,0,6],[-160,0,7]]", "[[170,0,5],[-170,0,6],[-160,0]]"] {
        let (folder, batch) = with_odd(&geometry(mixed));
        let problem = without_folder(&batch.problem(1).unwrap().message, folder.path());
        let point = if mixed.ends_with("0]]") { 2 } else { 0 };
        let wanted =
            format!("a.geojson, curve 1, point {point}: it has no altitude, and others of its line have one: add it");
        assert!(problem.starts_with(&wanted), "{problem}");
        assert_eq!([0, 2].map(|i| batch.problem(i)), [None, None]);
        for antimeridian in [Antimeridian::Keep, Antimeridian::Cut] {
            let path = folder.path().join("b.geojson");
            let options = WriteOptions { overwrite: true, antimeridian, ..WriteOptions::default() };
            io::write_with(&path, &batch, &options).unwrap();
            let back = io::read(&path).unwrap();
            assert!(back.problem(0).is_none() && back.problem(back.len() - 1).is_none());
            let text = std::fs::read_to_string(&path).unwrap();
            assert_eq!(text.matches("[0,0],[0,1],[0,3]").count(), 1, "{text}");
            assert!(text.contains(if point == 0 { "[170,0]," } else { ",0]]" }), "{text}");
        }
    }
}
