//! How many decimals GeoJSON is written with.

use std::fs;

use faircurve::io::decimals_of;
use faircurve::{CurveBatch, io};
use tempfile::TempDir;

use crate::ran::run;

fn batch(points: &[[f64; 2]]) -> CurveBatch {
    CurveBatch::from_slices(&[points]).unwrap()
}

#[test]
fn coordinates_have_the_decimals_of_the_points_and_ten_digits_at_least() {
    let needed = |a: f64, b: f64| decimals_of(&batch(&[[a, 0.0], [b, 1.0]]));
    assert_eq!(needed(512_030.25, 512_031.75), Some(4));
    assert_eq!(needed(512_030.25, 512_031.123_456), Some(6));
    assert_eq!(needed(0.5, 0.25), Some(9));
    assert_eq!(needed(3e12, 5e12), Some(0));
    assert_eq!(needed(2e-7, 1e-7), Some(9));
    // Points with all digits keep them; so do curves so small that their digits lie further down.
    assert_eq!(needed(0.1 + 0.2, 1.0), None);
    assert_eq!(decimals_of(&batch(&[[0.0, 0.0], [0.0, 0.0]])), Some(10));
    assert_eq!(decimals_of(&batch(&[[1e-20, 0.0], [0.0, 2e-20]])), None);
    // Blanks have no say.
    assert_eq!(needed(f64::NAN, 0.25), Some(9));
}

#[test]
fn geojson_keeps_the_digits_of_its_data_and_no_more_than_degrees_need() {
    let folder = TempDir::new().unwrap();
    let rows = [[7.25, 50.5], [8.125, 51.0], [9.0, 50.25]];
    let document = |rows: &[[f64; 2]], crs: &str| {
        let feature = serde_json::json!({"type": "Feature", "properties": {}, "geometry": {"type": "LineString", "coordinates": rows}});
        format!("{{\"type\":\"FeatureCollection\",{crs}\"features\":[{feature}]}}")
    };
    let fitted = |text: String, options: &str| {
        fs::write(folder.path().join("in.geojson"), text).unwrap();
        run(&folder, &format!("fit in.geojson -o out.geojson --device cpu --force --samples 4 {options}")).code(0);
        let batch = io::read(folder.path().join("out.geojson")).unwrap();
        let written = fs::read_to_string(folder.path().join("out.geojson")).unwrap();
        let numbers = written.split(['[', ',', ']']).filter(|text| text.parse::<f64>().is_ok());
        let most = numbers.map(|text| text.split_once('.').map_or(0, |(_, decimals)| decimals.len())).max();
        (batch, most.unwrap())
    };
    let (short, decimals) = fitted(document(&rows, ""), "");
    assert_eq!((decimals, &short.coords()[..2], &short.coords()[8..10]), (8, &rows[0][..], &rows[1][..]));
    let third = rows.map(|[x, y]| [x / 3.0, y / 3.0]);
    let (degrees, decimals) = fitted(document(&third, ""), "");
    assert_eq!(decimals, 9);
    let (all, decimals) = fitted(document(&third, ""), "--digits 15");
    assert!(decimals > 12);
    assert!(all.coords().iter().zip(degrees.coords()).all(|(a, b)| (a - b).abs() <= 0.5000001e-9));
    // Coordinates of a plane have all digits that its points have.
    let metres = third.map(|[x, y]| [1000.0 * x, 1000.0 * y]);
    let (exact, decimals) = fitted(document(&metres, ""), "");
    assert!(decimals > 10);
    assert_eq!(&exact.coords()[8..10], &metres[1]);
}
