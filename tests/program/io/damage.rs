//! Damaged files of every format.

use std::sync::LazyLock;

use faircurve::CurveBatch;
use faircurve::io::{self, Format, ReadOptions};
use proptest::prelude::*;

/// Some bytes put in the place of others.
fn damages() -> impl Strategy<Value = (f64, Vec<u8>, usize)> {
    let bytes = prop_oneof![
        prop::collection::vec(any::<u8>(), 0..4),
        prop::sample::select(vec![
            "nan",
            "1e999",
            "[",
            "]",
            "{",
            ",",
            "\"",
            "<",
            ">",
            "-",
            "\n",
            "9999999999999999999",
            "null",
            "Z"
        ])
        .prop_map(|text| text.as_bytes().to_vec()),
    ];
    (0.0..1.0f64, bytes, 0..4usize)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn a_damaged_file_is_an_error_or_a_batch_and_never_a_panic(damages in prop::collection::vec(damages(), 1..4), sample in 0..4usize) {
        let (format, mut bytes) = SAMPLES[sample].clone();
        for (at, new, old) in damages {
            let start = (at * bytes.len() as f64) as usize;
            bytes.splice(start..(start + old).min(bytes.len()), new);
        }
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), &bytes).unwrap();
        if let Ok(batch) = io::read_with(file.path(), &ReadOptions { format: Some(format), ..ReadOptions::default() }) {
            let says_so = || batch.notes().iter().any(|note| note.starts_with("no curve was found: "));
            prop_assert!(!batch.is_empty() || says_so());
        }
    }
}

static SAMPLES: LazyLock<[(Format, Vec<u8>); 4]> = LazyLock::new(|| {
    let csv = "curve,x,y,t,tx,ty\na,0,0,0,,\na,1,1,1,2,3\n\"b\",5,5,0,,\nb,6,6,1,,\n";
    let geojson = r#"{"bbox":[0,1],"type":"FeatureCollection","features":[{"type":"Feature","bbox":[0,1],"properties":{"curve":"a"},
        "geometry":{"type":"GeometryCollection","geometries":[{"type":"MultiPolygon","coordinates":[[[[179,0],[-179,0],[-179,9],[179,0]],
        [[-179.5,1],[-179.4,1],[-179.4,2],[-179.5,1]]]],"bbox":[]},{"type":"LineString","coordinates":[[0,1.5],[2e1,3]]}]}}]}"#;
    let svg = r#"<svg><g transform="translate(1 2) rotate(3)"><path id="a" d="M1 2h3l4 5A1 2 3 0 1 9 9zc1 2 3 4 5 6s1 2 3 4q1 2 3 4t1 2"/>
        <polygon points="1,2 3,4 5,6"/><line x1="1"/></g></svg>"#;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    let batch = CurveBatch::from_slices(&[&[[0.0, 1.0], [2.0, 3.0]][..], &[[4.0, 5.0]][..]]).unwrap();
    io::write(&path, &batch.with_names(vec!["a".into(), "bc".into()]).unwrap()).unwrap();
    [
        (Format::Csv, csv.into()),
        (Format::GeoJson, geojson.into()),
        (Format::Svg, svg.into()),
        (Format::Npz, std::fs::read(path).unwrap()),
    ]
});
