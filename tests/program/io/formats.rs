//! Every format: all that it holds, every pair of them, bit for bit.

use std::collections::HashMap;

use faircurve::CurveBatch;
use faircurve::io::{self, Closed, Format, ReadOptions, WriteOptions};
use proptest::prelude::*;

use super::{FORMATS, assert_same, bits, through};

/// Zigzags far from round numbers: an open one, a closed one, a single point, a pair.
fn figures() -> CurveBatch {
    let wave: Vec<[f64; 2]> = (0..7).map(|k| [f64::from(k) / 3.0, (f64::from(k) * 1.1).sin() * 1e-7]).collect();
    let ring: Vec<[f64; 2]> =
        (0..5).map(|k| [(f64::from(k) * 1.2566).cos() * 1e5, (f64::from(k) * 1.2566).sin()]).collect();
    // Of y = 0 drawings lose the sign.
    let (point, pair) = ([[-0.0, 0.1 + 0.2]], [[1e300, 5e-324], [f64::MAX, f64::MIN_POSITIVE]]);
    let batch = CurveBatch::from_slices(&[&wave[..], &ring[..], &point[..], &pair[..]]).unwrap();
    let names = ["plain", "a \"quoted\", <odd> & \n two-line näme 曲线", "12/0", " spaces "];
    let batch = batch.with_names(names.map(String::from).to_vec()).unwrap();
    batch.closed_each(vec![false, true, false, false]).unwrap()
}

#[test]
fn every_pair_of_formats_keeps_every_bit_and_name() {
    let folder = tempfile::tempdir().unwrap();
    let figures = figures();
    for first in FORMATS {
        let once = through(folder.path(), &figures, first);
        assert_same(&once, &figures, first);
        for second in FORMATS {
            let twice = through(folder.path(), &once, second);
            assert_same(&twice, &figures, &format!("{first} then {second}"));
        }
    }
}

#[test]
fn parameters_and_weights_survive_where_the_format_holds_them() {
    let folder = tempfile::tempdir().unwrap();
    let points = [[0.0, 0.0, 1.0], [1.0, 0.5, 1.0], [2.0, 0.0, 1.0]];
    let batch = CurveBatch::from_slices(&[&points[..], &points[1..]]).unwrap();
    let t = vec![0.1, 0.7, 2.3, -1.0, 1e-9];
    let weight = vec![1.0, 1.0 / 3.0, 2.0, 5.0, 7.0];
    let batch = batch.with_parameters(t).unwrap().with_weights(weight).unwrap();
    let npz = through(folder.path(), &batch, "npz");
    let csv = through(folder.path(), &batch, "csv");
    for i in 0..2 {
        assert_eq!((npz.parameters(i), npz.weights(i)), (batch.parameters(i), batch.weights(i)));
        assert_eq!((csv.parameters(i), csv.weights(i)), (batch.parameters(i), None));
    }
}

#[test]
fn csv_is_written_in_rows_with_parameters_or_vertex_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    let batch = CurveBatch::from_slices(&[&[[0.5, 1.0], [2.0, -3.25]][..], &[[1.0, 1.0]][..]]).unwrap();
    let batch = batch.with_names(vec!["a,b".into(), "c".into()]).unwrap();
    io::write(&path, &batch).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "curve,x,y,t\n\"a,b\",0.5,1,0\n\"a,b\",2,-3.25,1\nc,1,1,0\n");
    let path = folder.path().join("b.csv");
    let batch = CurveBatch::from_slices(&[&[[0.5, 1.0, 2.0], [2.0, -3.25, 0.1]][..]]).unwrap();
    io::write(&path, &batch.with_parameters(vec![0.25, 0.75]).unwrap()).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "curve,x,y,z,t\n0,0.5,1,2,0.25\n0,2,-3.25,0.1,0.75\n");
}

#[test]
fn csv_columns_become_parameters_weights_and_constraints() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    let header = "nu,known,curve,ty,tx,x,y,kx,ky,t,weight\n";
    let rows = ",1, s p ,0.5,2, 1 ,2,,,0,1\n1.5,0, s p ,,,3,4,7,8,1,2\n";
    std::fs::write(&path, format!("{header}{rows}")).unwrap();
    let batch = io::read(&path).unwrap();
    assert_eq!((batch.name(0).as_ref(), batch.points(0)), (" s p ", &[1.0, 2.0, 3.0, 4.0][..]));
    assert_eq!((batch.parameters(0), batch.weights(0)), (Some(&[0.0, 1.0][..]), Some(&[1.0, 2.0][..])));
    let constraints = batch.constraints();
    let free = f64::NAN.to_bits();
    let tangents = bits(constraints.tangents.as_ref().unwrap());
    assert_eq!(tangents, [2.0f64.to_bits(), 0.5f64.to_bits(), free, free]);
    let curvatures = bits(constraints.curvatures.as_ref().unwrap());
    assert_eq!(curvatures, [free, free, 7.0f64.to_bits(), 8.0f64.to_bits()]);
    assert_eq!(bits(constraints.exponents.as_ref().unwrap()), [free, 1.5f64.to_bits()]);
    assert_eq!(constraints.known, Some(vec![true, false]));
}

#[test]
fn csv_without_a_curve_column_is_one_curve_and_columns_can_be_mapped_or_dropped() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    std::fs::write(&path, "x,y,weight,east,north\n9,9,0,1,2\n9,9,0,3,4\n").unwrap();
    let columns = "x=east, y=north, weight=".parse().unwrap();
    let batch = io::read_with(&path, &ReadOptions { columns, ..ReadOptions::default() }).unwrap();
    assert_eq!((batch.len(), batch.points(0), batch.weights(0)), (1, &[1.0, 2.0, 3.0, 4.0][..], None));
}

#[test]
fn closed_curves_are_those_marked_those_that_return_and_those_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    let rows = "curve,x,y,t\na,0,0,0\na,1,0,1\na,1,1,2\na,0,0,3.5\nb,0,0,0\nb,1,1,1\n";
    std::fs::write(&path, rows).unwrap();
    let read = |closed| io::read_with(&path, &ReadOptions { closed, ..ReadOptions::default() }).unwrap();
    let flags = |batch: &CurveBatch| (0..batch.len()).map(|i| (batch.is_closed(i), batch.count(i))).collect::<Vec<_>>();
    assert_eq!(flags(&read(Closed::Auto)), [(true, 3), (false, 2)]);
    assert_eq!(read(Closed::Auto).closing_span(0), Some(1.5));
    assert_eq!(flags(&read(Closed::Yes)), [(true, 3), (true, 2)]);
    assert_eq!(flags(&read(Closed::No)), [(false, 4), (false, 2)]);

    let path = folder.path().join("a.geojson");
    let polygon = r#"{"type":"Polygon","coordinates":[[[0,0],[1,0],[1,1],[0,0]]]}"#;
    std::fs::write(&path, polygon).unwrap();
    let read = |closed| io::read_with(&path, &ReadOptions { closed, ..ReadOptions::default() }).unwrap();
    assert_eq!(flags(&read(Closed::No)), [(true, 3)], "polygon rings are always closed");
    let opened = read(Closed::Auto).closed(false);
    io::write(folder.path().join("b.geojson"), &opened).unwrap();
    assert_eq!(std::fs::read_to_string(folder.path().join("b.geojson")).unwrap(), polygon, "and are written so");
}

#[test]
fn a_closed_curve_comes_back_closed_from_rows() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    let ring = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]];
    let batch = CurveBatch::from_slices(&[&ring[..], &ring[..]]).unwrap();
    let batch = batch.with_names(vec!["a".into(), "b".into()]).unwrap().closed_each(vec![true, false]).unwrap();
    io::write(&path, &batch).unwrap();
    let text = "curve,x,y,t,closed\na,0,0,0,1\na,2,0,1,1\na,2,2,2,1\na,0,0,3,1\nb,0,0,0,0\nb,2,0,1,0\nb,2,2,2,0\n";
    assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    let read = |closed| {
        let batch = io::read_with(&path, &ReadOptions { closed, ..ReadOptions::default() }).unwrap();
        (0..batch.len()).map(|i| (batch.is_closed(i), batch.count(i))).collect::<Vec<_>>()
    };
    assert_eq!(read(Closed::Auto), [(true, 3), (false, 3)]);
    assert_eq!(read(Closed::Yes), [(true, 3), (true, 3)]);
    assert_eq!(read(Closed::No), [(false, 4), (false, 3)]);
    // What the column says holds for a curve that returns, too.
    std::fs::write(&path, "x,y,closed\n0,0,0\n1,0,0\n1,1,0\n0,0,0\n").unwrap();
    assert_eq!(read(Closed::Auto), [(false, 4)]);
    std::fs::write(&path, "x,y,closed\n0,0,1\n1,0,1\n1,1,1\n0,0,1\n").unwrap();
    assert_eq!(read(Closed::Auto), [(true, 3)]);
    for (name, closed) in [("octopus.csv", &[true, true][..]), ("dots.csv", &[true, true, false])] {
        let batch = io::read(format!("examples/data/{name}")).unwrap();
        assert_eq!((0..batch.len()).map(|i| batch.is_closed(i)).collect::<Vec<_>>(), closed, "{name}, as NOTICE says");
    }
}

#[test]
fn headers_in_capitals_of_longitudes_and_none_at_all_are_read() {
    let read = |text: &str| {
        let csv = ReadOptions { format: Some(Format::Csv), ..ReadOptions::default() };
        io::read_from(text.as_bytes(), &csv).unwrap()
    };
    let batch = read("CURVE,X,Y,Weight\na,1,2,3\na,4,5,6\n");
    assert_eq!((batch.name(0).as_ref(), batch.points(0)), ("a", &[1.0, 2.0, 4.0, 5.0][..]));
    assert_eq!(batch.weights(0), Some(&[3.0, 6.0][..]));
    let batch = read("Latitude,Longitude\n10,170\n11,-170\n");
    assert_eq!(batch.points(0), [170.0, 10.0, 190.0, 11.0], "with the rule for longitudes");
    assert_eq!(read("1.5,2\n-3e1,.5\n").points(0), [1.5, 2.0, -30.0, 0.5]);
    let solid = read("\r\n1, 2,3\r\n4,5,nan");
    assert_eq!((solid.dimension(), solid.count(0), &solid.points(0)[..5]), (3, 2, &[1.0, 2.0, 3.0, 4.0, 5.0][..]));
    assert!(solid.problem(0).unwrap().message.starts_with("input, line 3, curve 0, point 1: z is NaN"), "{solid:?}");
    let mapped =
        ReadOptions { columns: "x=1,y=2".parse().unwrap(), format: Some(Format::Csv), ..ReadOptions::default() };
    assert_eq!(
        io::read_from(&b"2,1\n5,6\n"[..], &mapped).unwrap().points(0),
        [6.0, 5.0],
        "a header, if it is said to be one"
    );
}

#[test]
fn curves_that_geojson_and_svg_cannot_hold_keep_their_place_and_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    std::fs::write(&path, "curve,x,y\na,0,0\na,1,nan\nb,0,0\nb,1,1\nc,inf,0\nd,2,2\n").unwrap();
    let batch = io::read(&path).unwrap();
    let geojson = through(folder.path(), &batch, "geojson");
    let counts: Vec<_> = (0..geojson.len()).map(|i| (geojson.name(i).into_owned(), geojson.count(i))).collect();
    assert_eq!(counts, [("a".into(), 0), ("b".into(), 2), ("c".into(), 0), ("d".into(), 1)]);
    let svg = through(folder.path(), &batch, "svg");
    assert_eq!((svg.len(), svg.name(0).as_ref(), svg.points(0)), (2, "b", &[0.0, 0.0, 1.0, 1.0][..]));
    let drawn = std::fs::read_to_string(folder.path().join("batch.svg")).unwrap();
    assert!(drawn.contains("<path id=\"a\" d=\"\"/>"), "{drawn}");
    for exact in ["csv", "npz"] {
        let same = through(folder.path(), &batch, exact);
        assert_eq!(same.offsets(), batch.offsets());
        assert!(same.coords()[3].is_nan() && same.coords()[8] == f64::INFINITY, "{exact}");
    }
}

#[test]
fn svg_vertices_come_from_every_element_through_its_transforms() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.svg");
    let text = r##"<?xml version="1.0"?><!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" "http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd">
<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><defs><path id="unused" d="M0,0L1,1"/></defs>
<path id="a" d="M1 2 h2 v3 l-1-1 M10,10 C11,11 12,11 13,10 S15,9 16,10 Q17,8 18,10 z m1 1 L2,2"/>
<g transform="translate(10,20) scale(2)"><polyline id="b" points="0,0 1,0, 1-1"/>
  <polygon id="c" points="0 0 1 0 1 1" transform="matrix(0 1 -1 0 0 0)"/></g>
<line id="d" x2="4" y2="3" transform="rotate(90 1 1)"/><rect id="e" width="3" height="2"/></svg>"##;
    std::fs::write(&path, text).unwrap();
    let batch = io::read(&path).unwrap();
    let curves: Vec<_> =
        (0..batch.len()).map(|i| (batch.name(i).into_owned(), batch.is_closed(i), batch.points(i).to_vec())).collect();
    let expected: [(&str, bool, &[f64]); 7] = [
        ("a/0", false, &[1., 2., 3., 2., 3., 5., 2., 4.]),
        ("a/1", true, &[10., 10., 13., 10., 16., 10., 18., 10.]),
        ("a/2", false, &[11., 11., 2., 2.]),
        ("b", false, &[10., 20., 12., 20., 12., 18.]),
        ("c", true, &[10., 20., 10., 22., 8., 22.]),
        ("d", false, &[2., 0., -1., 4.]),
        ("e", true, &[0., 0., 3., 0., 3., 2., 0., 2.]),
    ];
    assert_eq!(curves.len(), expected.len());
    for ((name, closed, points), wanted) in curves.iter().zip(expected) {
        assert_eq!((name.as_str(), *closed), (wanted.0, wanted.1));
        assert_eq!(points.len(), wanted.2.len(), "{name}");
        // y points down in the drawing.
        let wanted = wanted.2.iter().enumerate().map(|(k, x)| if k % 2 == 0 { *x } else { -x });
        let furthest = points.iter().zip(wanted).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
        assert!(furthest < 1e-14, "{name}: {points:?}");
    }
}

/// Twice the area that points run round, x to the right and y up: positive where they run
/// counterclockwise.
fn area(points: &[f64]) -> f64 {
    let n = points.len() / 2;
    (0..n)
        .map(|k| (k, (k + 1) % n))
        .map(|(k, j)| points[2 * k] * points[2 * j + 1] - points[2 * j] * points[2 * k + 1])
        .sum()
}

#[test]
fn what_is_seen_stays_what_is_seen_between_drawings_maps_and_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let d = |name: &str| {
        let text = std::fs::read_to_string(file(name)).unwrap();
        let from = text.find(" d=\"").unwrap() + 4;
        text[from..].split('"').next().unwrap().to_string()
    };
    // A wedge of the north: 80° stands above 10°.
    std::fs::write(file("a.json"), r#"{"type":"Polygon","coordinates":[[[0,10],[40,10],[40,80],[0,10]]]}"#).unwrap();
    let map = io::read(file("a.json")).unwrap();
    io::write(file("a.svg"), &map).unwrap();
    assert_eq!(d("a.svg"), "M0,-10L40,-10 40,-80Z", "SVG's y points down");
    let text = std::fs::read_to_string(file("a.svg")).unwrap();
    let view_box = text.split("viewBox=\"").nth(1).unwrap().split('"').next().unwrap();
    for (found, wanted) in view_box.split(' ').zip([-1.4, -81.4, 42.8, 72.8]) {
        assert!((found.parse::<f64>().unwrap() - wanted).abs() < 1e-12, "{view_box}");
    }
    let drawing = io::read(file("a.svg")).unwrap();
    assert_same(&drawing, &map, "there and back");
    // A drawing: right along the top, then down.
    let text = r#"<svg><path d="M1,2.5L9,2.5 9,7Z"/></svg>"#;
    std::fs::write(file("b.svg"), text).unwrap();
    let drawing = io::read(file("b.svg")).unwrap();
    assert_eq!(drawing.points(0), [1.0, -2.5, 9.0, -2.5, 9.0, -7.0]);
    assert!(area(drawing.points(0)) < 0.0, "clockwise, as seen");
    io::write(file("c.svg"), &drawing).unwrap();
    assert_eq!(d("c.svg"), "M1,2.5L9,2.5 9,7Z");
    for extension in ["csv", "json", "npz"] {
        let other = through(folder.path(), &drawing, extension);
        assert_eq!(other.points(0), drawing.points(0), "{extension}");
        io::write_with(file("d.svg"), &other, &WriteOptions { overwrite: true, ..WriteOptions::default() }).unwrap();
        assert_eq!(d("d.svg")[..17], d("c.svg")[..17], "{extension}");
    }
    // The picture of it runs as it does: its y points down, too.
    let fit = faircurve::spline::Natural::default().fit(&drawing, &faircurve::Device::cpu()).unwrap();
    let picture = faircurve::picture::Picture { points: false, ..Default::default() }.draw(&drawing, &fit);
    let path =
        picture.split(" d=\"").filter_map(|rest| rest.split('"').next()).find(|d| d.contains(['C', 'c'])).unwrap();
    let flat: Vec<f64> = kurbo::BezPath::from_svg(path)
        .unwrap()
        .elements()
        .iter()
        .filter_map(|element| element.end_point())
        .flat_map(|p| [p.x, p.y])
        .collect();
    assert!(area(&flat) > 0.0, "with y down clockwise is positive: {path}");
}

#[test]
fn bezier_chains_are_drawn_as_cubics_and_written_as_control_points() {
    let folder = tempfile::tempdir().unwrap();
    let open = [[0.0, 0.0], [1.0, 2.0], [2.0, 2.0], [3.0, 0.0], [4.0, -2.0], [5.0, -2.0], [6.0, 0.0]];
    let ring = [[0.0, 0.0], [1.0, 2.0], [2.0, 2.0], [0.0, 0.0]];
    let batch = CurveBatch::from_slices(&[&open[..], &ring[..]]).unwrap();
    let options = WriteOptions { beziers: true, ..WriteOptions::default() };
    for name in ["a.svg", "a.csv", "a.npz"] {
        io::write_with(folder.path().join(name), &batch, &options).unwrap();
    }
    let svg = std::fs::read_to_string(folder.path().join("a.svg")).unwrap();
    let paths: Vec<&str> = svg.lines().filter(|line| line.starts_with("<path")).collect();
    assert_eq!(
        paths,
        [r#"<path id="0" d="M0,0C1,-2 2,-2 3,0 4,2 5,2 6,0"/>"#, r#"<path id="1" d="M0,0C1,-2 2,-2 0,0Z"/>"#]
    );
    assert!(svg.contains(r#"viewBox="-0.12 -2.12 6.24 4.24""#), "{svg}");
    let closed = batch.clone().closed_each(vec![false, true]).unwrap();
    io::write_with(folder.path().join("b.svg"), &closed, &options).unwrap();
    assert_eq!(std::fs::read_to_string(folder.path().join("b.svg")).unwrap(), svg);
    for name in ["a.csv", "a.npz"] {
        let options = ReadOptions { closed: Closed::No, ..ReadOptions::default() };
        assert_same(&io::read_with(folder.path().join(name), &options).unwrap(), &batch, name);
    }
}

#[test]
fn equal_batches_give_equal_bytes() {
    let folder = tempfile::tempdir().unwrap();
    for extension in FORMATS {
        let (a, b) = (folder.path().join(format!("a.{extension}")), folder.path().join(format!("b.{extension}")));
        io::write(&a, &figures()).unwrap();
        io::write(&b, &figures()).unwrap();
        assert_eq!(std::fs::read(&a).unwrap(), std::fs::read(&b).unwrap(), "{extension}");
    }
}

#[test]
fn formats_are_known_by_extension_and_word() {
    let of = |name: &str| Format::of_extension(name).map(|format| format.to_string());
    let known = HashMap::from([
        ("a.CSV", "csv"),
        ("a.b.json", "geojson"),
        ("a.geojson.gz", "geojson"),
        ("x/a.Svg", "svg"),
        ("a.npz.GZ", "npz"),
    ]);
    for (name, format) in known {
        assert_eq!(of(name).as_deref(), Some(format), "{name}");
    }
    for unknown in ["a", "a.gz", "csv", "a.csv.zip", ".csv"] {
        assert_eq!(of(unknown), None, "{unknown}");
    }
}

/// Any finite number, bit patterns of all sizes among them; but none that GeoJSON takes for a
/// longitude beyond ±180, since curves are carried across the antimeridian there.
fn number() -> impl Strategy<Value = f64> {
    let any = prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO;
    let any = any.prop_map(|x| if (90.0..=360.0).contains(&x.abs()) { x * 8.0 } else { x });
    prop_oneof![-90.0..90.0f64, any]
}

fn batches() -> impl Strategy<Value = CurveBatch> {
    (2..=3usize, 1..6usize)
        .prop_flat_map(|(d, curves)| {
            let curve = prop::collection::vec(number(), d..9 * d);
            let names = prop::collection::hash_set("[^\u{0}]{0,8}", curves);
            (Just(d), prop::collection::vec(curve, curves), names, prop::collection::vec(any::<bool>(), curves))
        })
        .prop_map(|(d, curves, names, closed)| {
            let mut offsets = vec![0];
            curves.iter().for_each(|curve| offsets.push(offsets[offsets.len() - 1] + curve.len() / d));
            let mut coords: Vec<f64> = curves.iter().flat_map(|curve| &curve[..curve.len() / d * d]).copied().collect();
            for ends in offsets.windows(2).filter(|ends| ends[1] - ends[0] > 2) {
                // A curve that comes back to its first point is read as a closed one.
                let (first, last) = (ends[0] * d, (ends[1] - 1) * d);
                if (0..d).all(|c| coords[first + c] == coords[last + c]) {
                    coords[last] = if coords[first] == 1.0 { 2.0 } else { 1.0 };
                }
            }
            let batch = CurveBatch::from_ragged(d, coords, offsets).unwrap();
            // A closed curve of one point cannot be told from a point in GeoJSON.
            let closed = (0..batch.len()).map(|i| closed[i] && batch.count(i) > 1).collect();
            batch.with_names(names.into_iter().collect()).unwrap().closed_each(closed).unwrap()
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn any_batch_survives_csv_npz_and_geojson(batch in batches()) {
        let folder = tempfile::tempdir().unwrap();
        for extension in ["csv", "npz", "geojson"] {
            assert_same(&through(folder.path(), &batch, extension), &batch, extension);
        }
    }
}

#[test]
fn the_page_of_files_lists_all_formats_as_they_are() {
    let page = include_str!("../../../docs/files.md");
    for format in Format::ALL {
        let extensions: Vec<String> = format.extensions().map(|extension| format!("`.{extension}`")).collect();
        let [reads, writes] = format.holds();
        let row = format!("| {} ({}) | {reads} | {writes} |", format.title(), extensions.join(", "));
        assert!(page.contains(&row), "docs/files.md lacks: {row}");
        assert_eq!(Format::of_extension(format!("a.{format}.gz")), Some(*format));
    }
}
