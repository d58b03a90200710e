//! The data shipped, and longitudes across the antimeridian.

use std::path::{Path, PathBuf};

use faircurve::CurveBatch;
use faircurve::io::{self, ReadOptions};

use super::{assert_same, through};

fn data(name: &str) -> PathBuf {
    Path::new("examples/data").join(name)
}

/// Curves with two neighbours more than 180 apart in x.
fn torn(batch: &CurveBatch) -> Vec<usize> {
    let jumps = |points: &[f64]| {
        points.chunks_exact(2).zip(points[2..].chunks_exact(2)).any(|(a, b)| (b[0] - a[0]).abs() > 180.0)
    };
    (0..batch.len()).filter(|&i| batch.count(i) > 1 && jumps(batch.points(i))).collect()
}

#[test]
fn the_borders_of_the_world_come_in_whole_and_untorn() {
    // Repeated closing points are dropped, except of the rings round the pole, which become open
    // curves.
    let small = io::read(data("countries-110m.geojson")).unwrap();
    let closed = |batch: &CurveBatch| (0..batch.len()).filter(|&i| batch.is_closed(i)).count();
    assert_eq!((small.len(), small.total_points(), closed(&small)), (595, 8246 - 115, 115));
    let large = io::read(data("countries-50m.geojson.gz")).unwrap();
    assert_eq!((large.len(), large.total_points(), closed(&large)), (1959, 80617 - 1427, 1427));
    assert_eq!((torn(&small), torn(&large)), (vec![], vec![]));
    let beyond = |batch: &CurveBatch| -> Vec<usize> {
        (0..batch.len()).filter(|&i| batch.points(i).chunks_exact(2).any(|point| point[0].abs() > 180.0)).collect()
    };
    assert_eq!(beyond(&small), [1, 161, 162]);
    assert_eq!(beyond(&large), [554, 565, 1380]);
    assert_eq!(small.points(0)[..2], [178.1244, -17.5056]);
    // Round the South Pole: a whole turn from the first point to the last, at one latitude.
    for (batch, i, turn) in [(&small, 569, 360.0), (&large, 1851, -360.0), (&large, 1852, 360.0)] {
        let points = batch.points(i);
        let last = &points[points.len() - 2..];
        assert_eq!((batch.is_closed(i), last), (false, &[points[0] + turn, points[1]][..]), "curve {i}");
    }
}

#[test]
fn real_documents_come_back_with_properties_in_order() {
    let folder = tempfile::tempdir().unwrap();
    let batch = io::read(data("countries-110m.geojson")).unwrap();
    let again = through(folder.path(), &batch, "geojson");
    assert_same(&again, &batch, "110m");
    let value = |path: &Path| -> serde_json::Value { serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap() };
    let (before, after) = (value(&data("countries-110m.geojson")), value(&folder.path().join("batch.geojson")));
    let features = |value: &serde_json::Value| value["features"].as_array().unwrap().clone();
    assert_eq!(features(&after).len(), 595);
    for (i, (before, after)) in features(&before).iter().zip(&features(&after)).enumerate() {
        assert_eq!(before["properties"], after["properties"]);
        if ![1, 161, 162, 569].contains(&i) {
            let line = |feature: &serde_json::Value| -> Vec<[f64; 2]> {
                serde_json::from_value(feature["geometry"]["coordinates"].clone()).unwrap()
            };
            assert_eq!(line(before), line(after), "feature {i}");
        }
    }
}

#[test]
fn storms_come_in_with_their_own_time_axis_and_wind_as_weight() {
    let columns = "x=lon,y=lat,curve=id,t=hours,weight=wind".parse().unwrap();
    let storms = io::read_with(data("storms.csv.gz"), &ReadOptions { columns, ..ReadOptions::default() }).unwrap();
    assert_eq!((storms.len(), storms.total_points()), (654, 19537));
    assert_eq!((storms.name(0).as_ref(), storms.points(0)[..4].to_vec()), ("1", vec![-79.0, 27.5, -79.0, 28.5]));
    assert_eq!(storms.parameters(0).unwrap()[..4], [0.0, 6.0, 12.0, 18.0]);
    assert_eq!(storms.weights(0).unwrap()[0], 25.0);
    assert_eq!((0..storms.len()).filter(|&i| storms.problem(i).is_some()).count(), 0);
}

#[test]
fn longitudes_are_carried_on_in_csv_too_but_only_where_x_is_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    std::fs::write(&path, "lon,lat\n179,0\n-179,1\n-178,2\n").unwrap();
    let read = |columns: &str| {
        let columns = columns.parse().unwrap();
        io::read_with(&path, &ReadOptions { columns, ..ReadOptions::default() }).unwrap().coords().to_vec()
    };
    assert_eq!(read("x=lon,y=lat"), [179.0, 0.0, 181.0, 1.0, 182.0, 2.0]);
    assert_eq!(read("y=lon,x=lat"), [0.0, 179.0, 1.0, -179.0, 2.0, -178.0]);
}

#[test]
fn polygons_across_the_antimeridian_stay_whole_and_those_round_a_pole_too() {
    let folder = tempfile::tempdir().unwrap();
    let read = |text: &str| {
        let path = folder.path().join("a.json");
        std::fs::write(&path, text).unwrap();
        let batch = io::read(&path).unwrap();
        (0..batch.len())
            .map(|i| batch.points(i).chunks_exact(2).map(|point| point[0]).collect())
            .collect::<Vec<Vec<f64>>>()
    };
    let with_hole = r#"{"type":"Polygon","coordinates":[[[170,0],[-170,0],[-170,20],[170,20],[170,0]],
        [[-178,5],[-176,5],[-177,6],[-178,5]]]}"#;
    assert_eq!(read(with_hole), [vec![170.0, 190.0, 190.0, 170.0], vec![182.0, 184.0, 183.0]]);
    // One that begins far in the east has its middle within ±180, where its neighbours are.
    let from_the_east = r#"{"type":"Polygon","coordinates":[[[-175,0],[160,0],[160,20],[-175,20],[-175,0]]]}"#;
    assert_eq!(read(from_the_east), [[185.0, 160.0, 160.0, 185.0]]);
    let round = r#"{"type":"Polygon","coordinates":[[[0,80],[120,80],[-120,80],[0,80]]]}"#;
    // From one side of the antimeridian to the other, and back along the frame of the map.
    assert_eq!(read(round), [[-180.0, -120.0, 0.0, 120.0, 180.0, 180.0, -180.0]]);
    let metres = r#"{"type":"LineString","coordinates":[[0,2000],[300,2000]]}"#;
    assert_eq!(read(metres), [[0.0, 300.0]]);
    let named = |name: &str| {
        format!(
            r#"{{"type":"FeatureCollection","crs":{{"properties":{{"name":"{name}"}}}},"features":[
            {{"type":"Feature","geometry":{{"type":"LineString","coordinates":[[0,20],[300,20]]}}}}]}}"#
        )
    };
    for metres in ["urn:ogc:def:crs:EPSG::3857", "EPSG:25833", "WGS 84 / UTM zone 33N", "urn:ogc:def:crs:EPSG::43260"] {
        assert_eq!(read(&named(metres)), [[0.0, 300.0]], "{metres}");
    }
    for degrees in ["urn:ogc:def:crs:OGC:1.3:CRS84", "EPSG:4326", "urn:ogc:def:crs:EPSG::4258", "EPSG:4269", "WGS 84"] {
        assert_eq!(read(&named(degrees)), [[0.0, -60.0]], "{degrees}");
    }
}
