//! GeoJSON documents come back as they were, with new coordinates.

use faircurve::io::{self, WriteOptions};

#[test]
fn a_geojson_document_comes_back_with_all_it_held_but_the_bounding_boxes() {
    let folder = tempfile::tempdir().unwrap();
    let (path, out) = (folder.path().join("a.geojson"), folder.path().join("b.geojson"));
    let bbox = r#""bbox": [0, 0, 9, 9]"#;
    let text = |bbox: &str, after: &str| {
        format!(
            r#"{{"name": "odd \u00e9", {bbox}"type": "FeatureCollection", "features": [
  {{"type": "Feature", "id": 12345678901234567890, "properties": {{"n": 1.10, "curve": null}}, {bbox}"tail": [1, {{"a": []}}],
   "geometry": {{"coordinates": [[0,0],[1,2.5],[2,0]], "type": "LineString"{after}}}}},
  {{"type": "Feature", "properties": {{"bbox": "kept"}}, "geometry": {{"type": "Point", "coordinates": [1.50, 2.0], "bbox": [1,2,1,2]}}}},
  {{"type": "Feature", "properties": null, "geometry": null}},
  {{"type": "Feature", "properties": {{}}, "geometry": {{"type": "MultiLineString", "coordinates": [[[0,0],[1,1]],[[5,5],[6,6],[7,5],[5,5]]]}}}},
  {{"type": "Feature", "properties": {{}}, "geometry": {{"type": "Polygon", "coordinates": [[[0,0],[9,0],[9,9],[0,0]],[[5,4],[6,5],[6,4],[5,4]]]}}}},
  {{"type": "Feature", "properties": {{}}, "geometry": {{"type": "GeometryCollection", "geometries": [
    {{"type": "MultiPoint", "coordinates": [[3.0, 4.0]]}},
    {{"type": "MultiPolygon", "coordinates": [[[[0,0],[1,0],[1,1],[0,0]]],[[[2,2],[3,2],[3,3],[2,2]],[[2.5,2.25],[2.75,2.5],[2.75,2.25],[2.5,2.25]]]]}}]}}}}
], "foreign": true}}
"#
        )
    };
    std::fs::write(&path, text(&format!("{bbox} , "), &format!(" , {bbox}"))).unwrap();
    let batch = io::read(&path).unwrap();
    let names: Vec<_> = (0..batch.len()).map(|i| batch.name(i).into_owned()).collect();
    assert_eq!(names, ["0", "3/0", "3/1", "4/0", "4/1", "5/0", "5/1", "5/2"]);
    let closed: Vec<_> = (0..batch.len()).map(|i| batch.is_closed(i)).collect();
    assert_eq!(closed, [false, false, true, true, true, true, true, true]);
    io::write(&out, &batch).unwrap();
    assert_eq!(std::fs::read_to_string(&out).unwrap(), text("", ""));
    // A second opinion on what was written.
    let parsed: geojson::GeoJson = std::fs::read_to_string(&out).unwrap().parse().unwrap();
    assert!(matches!(parsed, geojson::GeoJson::FeatureCollection(collection) if collection.features.len() == 6));
}

#[test]
fn features_and_geometries_alone_altitudes_and_more_numbers_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let through = |text: &str| {
        let (path, out) = (folder.path().join("a.json"), folder.path().join("b.json"));
        std::fs::write(&path, text).unwrap();
        let batch = io::read(&path).unwrap();
        io::write_with(&out, &batch, &WriteOptions { overwrite: true, ..WriteOptions::default() }).unwrap();
        (batch, std::fs::read_to_string(&out).unwrap())
    };
    let geometry = r#"{"type":"LineString","coordinates":[[0,0,7],[1,2.5,8]]}"#;
    let (batch, out) = through(geometry);
    assert_eq!((batch.dimension(), batch.coords(), out.as_str()), (3, &[0.0, 0.0, 7.0, 1.0, 2.5, 8.0][..], geometry));
    let feature = format!(r#"{{"type":"Feature","geometry":{geometry},"properties":{{"curve":"name"}}}}"#);
    let (batch, out) = through(&feature);
    assert_eq!((batch.name(0).as_ref(), out.as_str()), ("name", feature.as_str()));
    let (batch, out) = through(r#"{"type":"LineString","coordinates":[[0,0,7,1e3,"x"],[1,2.5,8]]}"#);
    assert_eq!((batch.dimension(), out.as_str()), (3, geometry));
    let (batch, out) = through(r#"{"type":"MultiLineString","coordinates":[[],[[0,1]]]}"#);
    assert_eq!((batch.count(0), batch.count(1)), (0, 1));
    assert_eq!(out, r#"{"type":"MultiLineString","coordinates":[[],[[0,1]]]}"#);
}

#[test]
fn a_drawing_in_another_encoding_comes_back_as_utf_8() {
    let text = |encoding: &str| {
        format!(
            "<?xml version=\"1.0\" encoding=\"{encoding}\"?>\n<svg><title>Größe</title><path id=\"ü\" d=\"M0,0L1,1\"/></svg>\n"
        )
    };
    let folder = tempfile::tempdir().unwrap();
    let [from, to] = ["a.svg", "b.svg"].map(|name| folder.path().join(name));
    let latin: Vec<u8> = text("iso-8859-1").chars().map(|c| c as u8).collect();
    let units: Vec<u8> = format!("\u{feff}{}", text("UTF-16")).encode_utf16().flat_map(u16::to_be_bytes).collect();
    for bytes in [latin, units] {
        std::fs::write(&from, bytes).unwrap();
        let batch = io::read(&from).unwrap();
        assert_eq!(batch.name(0), "ü");
        io::write_with(&to, &batch, &WriteOptions { overwrite: true, ..WriteOptions::default() }).unwrap();
        let written = std::fs::read_to_string(&to).unwrap();
        assert_eq!(written.replace("M0 0L1 1", "M0,0L1,1"), text("UTF-8"));
    }
}
