//! Control points in files: which are known, and what SVG's paths are as chains of cubic Béziers.

use faircurve::io::{self, Closed, ReadOptions, WriteOptions};
use faircurve::{Constraints, CurveBatch};

use super::{assert_same, bits, through};

#[test]
fn unknown_control_points_may_be_blank_and_known_ones_must_be_finite() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    let rows = "known,curve,x,y\n1,a,0,0\n0,a,,\n0,a,5, \n1.0,a,3,0\n1,b,0,0\n0,b,inf,nan\n1,b,nan,0\n0,b,,\n";
    std::fs::write(&path, rows).unwrap();
    let batch = io::read(&path).unwrap();
    let nan = f64::NAN.to_bits();
    assert_eq!(bits(batch.points(0)), [0, 0, nan, nan, 5.0f64.to_bits(), nan, 3.0f64.to_bits(), 0]);
    assert_eq!(batch.constraints().known.as_deref(), Some(&[true, false, false, true, true, false, true, false][..]));
    assert_eq!(batch.problem(0), None);
    let problem = batch.problem(1).unwrap();
    let place = path.display();
    assert_eq!(
        problem.message,
        format!(
            "{place}, line 8, curve b, point 2: x is NaN; every coordinate must be a finite number: mend or remove the point"
        )
    );
}

#[test]
fn an_unknown_last_row_closes_no_curve_of_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    let read = |closed, last: &str| {
        std::fs::write(&path, format!("x,y,known\n0,0,1\n1,0,1\n1,1,1\n{last}\n")).unwrap();
        let batch = io::read_with(&path, &ReadOptions { closed, ..ReadOptions::default() }).unwrap();
        (batch.is_closed(0), batch.constraints().known.as_ref().map(Vec::len))
    };
    assert_eq!(read(Closed::Auto, "0,0,1"), (true, Some(3)));
    assert_eq!(read(Closed::Auto, "0,0,0"), (false, Some(4)));
    assert_eq!(read(Closed::Yes, ",,0"), (true, Some(4)));
}

#[test]
fn known_flags_survive_npz() {
    let folder = tempfile::tempdir().unwrap();
    let a = [[0.0, 0.0], [f64::NAN, f64::NAN], [2.0, 0.0], [0.0, 0.0]];
    let b = [[5.0, 5.0], [6.0, f64::NEG_INFINITY]];
    let batch = CurveBatch::from_slices(&[&a[..], &b[..]]).unwrap();
    let known = Some(vec![true, false, true, true, true, false]);
    let batch = batch.with_constraints(Constraints { known, ..Constraints::default() }).unwrap().closed_auto();
    let read = through(folder.path(), &batch, "npz.gz");
    assert_eq!(read.constraints(), batch.constraints());
    assert_eq!(read.constraints().known.as_ref().map(Vec::len), Some(5));
    assert_eq!((read.is_closed(0), read.count(0), read.problem(0), read.problem(1)), (true, 3, None, None));
    let plain = batch.with_constraints(Constraints::default()).unwrap();
    assert_eq!(through(folder.path(), &plain, "npz").constraints().known, None);
}

/// The control points of a drawing, each curve with its name and whether it is closed.
fn controls(d: &str) -> CurveBatch {
    controls_of(&format!("<path id='p' d='{d}'/>"))
}

fn controls_of(elements: &str) -> CurveBatch {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.svg");
    std::fs::write(&path, format!("<svg>{elements}</svg>")).unwrap();
    io::read_with(&path, &ReadOptions { controls: true, ..ReadOptions::default() }).unwrap()
}

/// `wanted` are coordinates of the drawing, whose y points down.
fn assert_near(found: &[f64], wanted: &[f64]) {
    assert_eq!(found.len(), wanted.len(), "{found:?}");
    let wanted = wanted.iter().enumerate().map(|(k, x)| if k % 2 == 0 { *x } else { -x });
    let furthest = found.iter().zip(wanted.clone()).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
    assert!(furthest < 1e-14, "{found:?} instead of {:?}", wanted.collect::<Vec<_>>());
}

#[test]
fn every_path_command_is_read_as_the_cubic_that_it_is() {
    let batch = controls("M1 2 l3 6 H7 V5 Q10 5 10 8 T13 14 C14 14 15 15 15 16 s1 2 3 2");
    assert_near(
        batch.points(0),
        &[
            1., 2., 2., 4., 3., 6., 4., 8., // l
            5., 8., 6., 8., 7., 8., // H
            7., 7., 7., 6., 7., 5., // V
            9., 5., 10., 6., 10., 8., // Q
            10., 10., 11., 12., 13., 14., // T
            14., 14., 15., 15., 15., 16., // C
            15., 17., 16., 18., 18., 18., // s
        ],
    );
    assert_eq!((batch.len(), batch.name(0).as_ref(), batch.is_closed(0)), (1, "p", false));
}

#[test]
fn shorthands_go_on_from_curves_of_their_own_kind_alone() {
    for (short, explicit) in [
        ("M0 5C0 8 4 8 4 5T8 5", "M0 5C0 8 4 8 4 5Q4 5 8 5"),
        ("M0 5Q2 9 4 5S8 1 8 5", "M0 5Q2 9 4 5C4 5 8 1 8 5"),
        ("M0 5C1 7 3 7 4 5ZS2 4 4 4", "M0 5C1 7 3 7 4 5ZM0 5C0 5 2 4 4 4"),
        ("M0 5Q1 7 4 5zt2 4", "M0 5Q1 7 4 5ZM0 5Q0 5 2 9"),
        ("M1 2S3 4 5 6", "M1 2C1 2 3 4 5 6"),
        ("M1 2L3 3T5 6", "M1 2L3 3Q3 3 5 6"),
        ("M1 2H3t5 6", "M1 2L3 2Q3 2 8 8"),
        ("M1 2A5 5 0 0 1 3 3S4 4 5 5", "M1 2A5 5 0 0 1 3 3C3 3 4 4 5 5"),
        ("M1 2C1 3 2 4 3 4S5 6 7 8s1 2 3 4", "M1 2C1 3 2 4 3 4C4 4 5 6 7 8C9 10 8 10 10 12"),
        ("M1 2Q2 4 3 4T5 6t1 0", "M1 2Q2 4 3 4Q4 4 5 6Q6 8 6 6"),
        // What follows a move is a line, and a close starts again where its subpath did.
        ("m1 2 3 4-1-1zl1 1", "M1 2L4 6L3 5ZM1 2L2 3"),
        ("M1 2 3.5.5e1-1-1", "M1 2L3.5 5L-1-1"),
    ] {
        let (found, wanted) = (controls(short), controls(explicit));
        assert_eq!(found.offsets(), wanted.offsets(), "{short}");
        assert_eq!(bits(found.coords()), bits(wanted.coords()), "{short}");
    }
}

#[test]
fn arcs_are_read_as_cubics_that_meet_their_circle() {
    let batch = controls("M5 0 A5 5 0 0 1 0 5 A5 5 0 0 1 -5 0 A5 5 0 0 1 5 0 Z");
    assert!(batch.is_closed(0), "the last arc ends at the start but for rounding");
    let pieces = batch.count(0) / 3;
    assert_eq!((batch.count(0) % 3, pieces), (0, 4), "no straight piece closes the circle");
    for k in 0..pieces {
        let [a, b, c, d] = [0, 1, 2, 3].map(|j| (3 * k + j) % (3 * pieces)).map(|k| &batch.points(0)[2 * k..2 * k + 2]);
        let middle = [0, 1].map(|axis| (a[axis] + 3.0 * b[axis] + 3.0 * c[axis] + d[axis]) / 8.0);
        assert!((a[0].hypot(a[1]) - 5.0).abs() < 1e-14, "{a:?}");
        assert!((middle[0].hypot(middle[1]) - 5.0).abs() < 5.0 * 3e-4, "{middle:?}");
    }
}

#[test]
fn a_closed_subpath_gets_a_straight_piece_where_it_does_not_end_at_its_start() {
    let open_end = controls("M0 0 C0 1 1 3 3 3 Z");
    assert!(open_end.is_closed(0));
    assert_near(open_end.points(0), &[0., 0., 0., 1., 1., 3., 3., 3., 2., 2., 1., 1.]);
    let returns = controls("M0 0 C0 1 1 3 3 3 C3 0 0 0 0 0 Z");
    assert!(returns.is_closed(0));
    // The last handle lies at the start, and stays.
    assert_near(returns.points(0), &[0., 0., 0., 1., 1., 3., 3., 3., 3., 0., 0., 0.]);
    let unmarked = controls("M0 0 C0 1 1 3 3 3 C3 1 1 0 0 0");
    assert!(unmarked.is_closed(0), "its last point repeats its first");
    assert_eq!(unmarked.count(0), 6);
}

#[test]
fn subpaths_elements_and_transforms_make_chains_too() {
    let batch = controls_of(
        "<g transform='translate(10 20) scale(2)'><path id='a' d='M0 0 q3 0 3 3 M5 5 Z M7 7 L7 10 z l3 0'/></g>
         <polyline id='b' points='0,0 3,3'/><polygon id='c' points='0 0 3 0 3 3'/><line id='d' x2='3'/>",
    );
    let names: Vec<String> = (0..batch.len()).map(|i| batch.name(i).into_owned()).collect();
    assert_eq!(names, ["a/0", "a/1", "a/2", "a/3", "b", "c", "d"]);
    let shapes: Vec<(usize, bool)> = (0..batch.len()).map(|i| (batch.count(i), batch.is_closed(i))).collect();
    assert_eq!(shapes, [(4, false), (1, true), (6, true), (4, false), (4, false), (9, true), (4, false)]);
    assert_near(batch.points(0), &[10., 20., 14., 20., 16., 22., 16., 26.]);
    assert_near(batch.points(2), &[24., 34., 24., 36., 24., 38., 24., 40., 24., 38., 24., 36.]);
    assert_near(batch.points(3), &[24., 34., 26., 34., 28., 34., 30., 34.]);
    assert_near(batch.points(5), &[0., 0., 1., 0., 2., 0., 3., 0., 3., 1., 3., 2., 3., 3., 2., 2., 1., 1.]);
}

#[test]
fn chains_of_cubics_survive_svg_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let wave: Vec<[f64; 2]> = (0..13).map(|k| [f64::from(k) / 3.0, (f64::from(k) * 1.1).sin() * 1e-7]).collect();
    let ring: Vec<[f64; 2]> = (0..9).map(|k| [(f64::from(k) * 0.7).cos() * 1e5, (f64::from(k) * 0.7).sin()]).collect();
    // The last handle of this one coincides with its start.
    let tight = [[0.1, 0.2], [1.0, 2.0], [3.0, 3.0], [4.0, 4.0], [2.0, 1.0], [0.1, 0.2]];
    let point = [[-0.0, 0.1 + 0.2]];
    let batch = CurveBatch::from_slices(&[&wave[..], &ring[..], &tight[..], &point[..]]).unwrap();
    let flags = [false, true, true, false];
    // Closing would drop the last handle: here it is no repeated point.
    let known = Some((0..batch.total_points()).map(|at| at != 13 + 9 + 5).collect());
    let batch = batch.with_constraints(Constraints { known, ..Constraints::default() }).unwrap();
    let batch = batch.closed_each(flags.to_vec()).unwrap().with_constraints(Constraints::default()).unwrap();
    assert_eq!(batch.count(2), 6);
    for extension in ["svg", "svg.gz"] {
        let path = folder.path().join(format!("a.{extension}"));
        io::write_with(&path, &batch, &WriteOptions { beziers: true, ..WriteOptions::default() }).unwrap();
        let read = io::read_with(&path, &ReadOptions { controls: true, ..ReadOptions::default() }).unwrap();
        assert_same(&read, &batch, extension);
    }
}
