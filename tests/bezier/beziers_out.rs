//! Béziers out of every fit: near the curve, smooth, joined, few.

use std::fs;

use assert_cmd::cargo::cargo_bin_cmd;
use faircurve::io::{self, Closed, ReadOptions};
use faircurve::{Curve, CurveBatch, Device, Fit, Jet, discrete::Fair, scf::Smooth, spline};
use glam::DVec3;
use kurbo::{BezPath, PathEl};
use predicates::str::contains;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::distance::{by_span, deviation};

/// Walks of gentle and sharp turns, of size about 10; every second one closed.
fn walks(dimension: usize, curves: usize, seed: u64) -> CurveBatch {
    println!("seed {seed}, {dimension}-D");
    let mut rng = StdRng::seed_from_u64(seed);
    let (mut coords, mut offsets) = (Vec::new(), vec![0]);
    for i in 0..curves {
        let count = rng.random_range(5..10);
        for k in 0..count {
            let angle = std::f64::consts::TAU * k as f64 / count as f64;
            let radius = rng.random_range(4.0..6.0);
            let along = [radius * angle.cos(), radius * angle.sin(), rng.random_range(-1.5..1.5)];
            let across = [k as f64, rng.random_range(-0.8..0.8), rng.random_range(-0.8..0.8)];
            coords.extend(&(if i % 2 == 1 { along } else { across })[..dimension]);
        }
        offsets.push(coords.len() / dimension);
    }
    let closed = (0..curves).map(|i| i % 2 == 1).collect();
    CurveBatch::from_ragged(dimension, coords, offsets).unwrap().closed_each(closed).unwrap()
}

/// Fits of every method to a batch.
fn fits(batch: &CurveBatch) -> Vec<(String, Fit)> {
    let cpu = Device::cpu();
    let smoothing = spline::Smoothing { target: spline::SmoothingTarget::Lambda(0.1), ..spline::Smoothing::default() };
    let mut all = vec![
        ("natural".to_string(), spline::Natural::default().fit(batch, &cpu).unwrap()),
        ("smoothing".into(), smoothing.fit(batch, &cpu).unwrap()),
        ("fair".into(), Fair::default().fit(batch, &cpu).unwrap()),
    ];
    if batch.dimension() == 2 {
        for exponent in [1.2, 2.0, 20.0] {
            let smooth = Smooth { exponent, ..Smooth::default() };
            all.push((format!("scf {exponent}"), smooth.fit(batch, &cpu).unwrap()));
        }
    }
    all
}

fn splines(method: &str) -> bool {
    method == "natural" || method == "smoothing"
}

#[test]
fn no_point_of_curve_or_beziers_is_farther_from_the_other_than_the_tolerance() {
    for (dimension, seed) in [(2, 1), (3, 2)] {
        for (method, fit) in fits(&walks(dimension, 8, seed)) {
            for tolerance in [1e-1, 1e-3, 1e-5] {
                for i in 0..fit.len() {
                    let curve = fit.curve(i);
                    let pieces = curve.beziers(tolerance);
                    let found = deviation(&*curve, &pieces, 64, 0.5 * tolerance);
                    assert!(found <= tolerance, "{method}, curve {i}, {tolerance}: {}", found / tolerance);
                }
            }
        }
    }
}

#[test]
fn borders_keep_the_tolerance_in_half_the_pieces_of_plain_halving() {
    // Pieces that halving of Hermite's cubics takes at 1e-6 of the size, as it was first done here.
    let halved = [("fair", 35_274), ("scf 1.2", 35_193), ("scf 2", 26_202), ("scf 20", 34_133)];
    let batch = io::read(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/data/countries-110m.geojson")).unwrap();
    let tolerance = 3.6e-4;
    for (method, fit) in fits(&batch) {
        let curves: Vec<_> = (0..fit.len()).map(|i| fit.curve(i)).filter(|curve| curve.is_fitted()).collect();
        let chains: Vec<_> = curves.iter().map(|curve| curve.beziers(tolerance)).collect();
        let count: usize = chains.iter().map(Vec::len).sum();
        if let Some((_, halved)) = halved.iter().find(|(name, _)| *name == method) {
            assert!(2 * count <= *halved, "{method}: {count} of {halved}");
        }
        for (curve, pieces) in curves.iter().zip(&chains).step_by(29) {
            let found = deviation(&**curve, pieces, 32, 0.5 * tolerance);
            assert!(found <= tolerance, "{method}: {}", found / tolerance);
        }
    }
}

#[test]
fn splines_are_one_exact_piece_a_span_whatever_the_tolerance() {
    for (dimension, seed) in [(2, 3), (3, 4)] {
        for (method, fit) in fits(&walks(dimension, 20, seed)).into_iter().filter(|(method, _)| splines(method)) {
            for i in 0..fit.len() {
                let curve = fit.curve(i);
                for tolerance in [1.0, 1e-9, 1e-300] {
                    assert_eq!(curve.beziers(tolerance).len(), curve.spans(), "{method} {i}");
                }
                assert!(deviation(&*curve, &curve.beziers(1.0), 16, 0.0) <= 1e-14, "{method} {i}");
            }
        }
    }
}

#[test]
fn handles_are_in_one_line_at_every_joint_and_pieces_are_joined_bit_for_bit() {
    for (dimension, seed) in [(2, 5), (3, 6)] {
        let batch = walks(dimension, 20, seed);
        for (method, fit) in fits(&batch) {
            for i in (0..fit.len()).filter(|&i| fit.reports()[i].status.is_usable()) {
                for tolerance in [1e-1, 1e-5] {
                    let pieces = fit.curve(i).beziers(tolerance);
                    let after = pieces.iter().skip(1).chain(batch.is_closed(i).then_some(&pieces[0]));
                    for (piece, next) in pieces.iter().zip(after) {
                        assert_eq!(piece[3], next[0], "{method} {i}");
                        let angle = (piece[3] - piece[2]).angle_between(next[1] - next[0]);
                        assert!(angle <= 1e-6, "{method} {i}: {angle:.1e}");
                    }
                }
            }
        }
    }
}

#[test]
fn data_points_are_joints() {
    let batch = walks(2, 10, 7);
    for (method, fit) in fits(&batch).into_iter().filter(|(method, _)| method != "smoothing") {
        for i in 0..fit.len() {
            let curve = fit.curve(i);
            let pieces = curve.beziers(1e-4);
            for (own, point) in by_span(&*curve, &pieces).iter().zip(batch.points(i).chunks_exact(2)) {
                let start = own[0][0];
                assert!((start.x - point[0]).hypot(start.y - point[1]) <= 1e-14, "{method} {i}: {start} {point:?}");
            }
        }
    }
}

#[test]
fn the_same_curve_gives_the_same_bits() {
    let batch = walks(2, 10, 8);
    for ((method, a), (_, b)) in fits(&batch).into_iter().zip(fits(&batch)) {
        let bits = |fit: &Fit| -> Vec<u64> { fit.beziers(1e-4).coords().iter().map(|x| x.to_bits()).collect() };
        assert_eq!(bits(&a), bits(&b), "{method}");
    }
}

#[test]
fn a_stricter_tolerance_takes_more_pieces_but_never_many_more() {
    for (method, fit) in fits(&walks(2, 20, 9)) {
        let count = |tolerance: f64| -> usize { (0..fit.len()).map(|i| fit.curve(i).beziers(tolerance).len()).sum() };
        let counts: Vec<usize> = (0..6).map(|k| count(10f64.powi(-k - 1))).collect();
        println!("{method}: {counts:?}");
        assert!(counts.windows(2).all(|pair| pair[0] <= pair[1]), "{method}: {counts:?}");
        // Six orders would be 2.15 times, four 3.16. Fair curves are 16 cubics a span.
        let spans: usize = (0..fit.len()).map(|i| fit.curve(i).spans()).sum();
        let most = |three: &[usize]| if method == "fair" { 16 * spans } else { 4 * three[0] };
        assert!(counts.windows(3).all(|three| three[2] <= most(three)), "{method}: {counts:?}");
    }
}

/// A curve over [0, 1] of its own.
struct Made(Box<dyn Fn(f64) -> [DVec3; 2] + Sync>);

/// The curve of these points and derivatives.
fn made(at: impl Fn(f64) -> [DVec3; 2] + Sync + 'static) -> Made {
    Made(Box::new(at))
}

impl Curve for Made {
    fn dimension(&self) -> usize {
        2
    }
    fn is_closed(&self) -> bool {
        false
    }
    fn knots(&self) -> &[f64] {
        &[0.0, 1.0]
    }
    fn jet(&self, _: usize, u: f64) -> Jet {
        let [point, first] = (self.0)(u);
        Jet { point, first, ..Jet::default() }
    }
}

#[test]
fn a_quarter_of_a_circle_is_off_by_a_few_in_ten_thousand_whatever_its_parameter() {
    // The best G1 cubic with the circle's ends: radius off by 2.7e-4 (handles 0.5519, Goldapp 1991:
    // 1.96e-4 between its two sides).
    let even = made(|u| {
        let (sine, cosine) = (0.5 * std::f64::consts::PI * u).sin_cos();
        [DVec3::new(cosine, sine, 0.0), 0.5 * std::f64::consts::PI * DVec3::new(-sine, cosine, 0.0)]
    });
    // tan of the half angle: rational, uneven.
    let uneven = made(|u| {
        let w = 1.0 + u * u;
        let slope = DVec3::new(-4.0 * u, 2.0 * (1.0 - u * u), 0.0) / (w * w);
        [DVec3::new((1.0 - u * u) / w, 2.0 * u / w, 0.0), slope]
    });
    for curve in [even, uneven] {
        let pieces = curve.beziers(2.8e-4);
        assert_eq!(pieces.len(), 1);
        assert!(deviation(&curve, &pieces, 200, 0.0) <= 2.8e-4);
        let handle = (pieces[0][1] - pieces[0][0]).length();
        assert!((0.548..0.556).contains(&handle), "{handle}");
        // Halved once, the sixth order leaves about 1/64 where the fourth would leave 1.7e-5.
        assert_eq!(curve.beziers(1.0e-5).len(), 2);
    }
}

#[test]
fn cusps_corners_lines_and_jumps_of_curvature_keep_the_tolerance() {
    let cases: [(&str, Made); 4] = [
        // The derivative vanishes at 1/2, and the curve turns back.
        (
            "cusp",
            made(|u| {
                let t = u - 0.5;
                [DVec3::new(t * t, t * t * t + t.powi(5), 0.0), DVec3::new(2.0 * t, 3.0 * t * t + 5.0 * t.powi(4), 0.0)]
            }),
        ),
        (
            "still at its start",
            made(|u| {
                let t = u.powi(4);
                [DVec3::new(t, t * t, 0.0), 4.0 * u.powi(3) * DVec3::new(1.0, 2.0 * t, 0.0)]
            }),
        ),
        (
            "line at uneven speed",
            made(|u| [DVec3::new(u.exp(), -2.0 * u.exp(), 0.0), DVec3::new(u.exp(), -2.0 * u.exp(), 0.0)]),
        ),
        // Two circles, left then right, at a place that no halving meets.
        (
            "jump",
            made(|u| {
                let t = 2.0 * (u - 0.3);
                let side = t.signum();
                [DVec3::new(t.sin(), side * (1.0 - t.cos()), 0.0), 2.0 * DVec3::new(t.cos(), side * t.sin(), 0.0)]
            }),
        ),
    ];
    for (name, curve) in cases {
        for tolerance in [1e-2, 1e-3, 1e-4, 1e-5] {
            let pieces = curve.beziers(tolerance);
            let found = deviation(&curve, &pieces, 400, 0.0);
            println!("{name}, {tolerance}: {} pieces, {:.3}", pieces.len(), found / tolerance);
            assert!(found <= tolerance, "{name}, {tolerance}: {}", found / tolerance);
            assert!(pieces.len() <= 24, "{name}, {tolerance}: {} pieces", pieces.len());
            if name.starts_with("line") {
                assert_eq!(pieces.len(), 1);
            }
        }
    }
}

/// A turn about a point so far from the origin, in units of its size.
fn turn(size: f64, far: f64) -> Made {
    made(move |u| {
        let (sine, cosine) = (3.0 * u).sin_cos();
        [size * (DVec3::new(cosine, sine, 0.0) + far), 3.0 * size * DVec3::new(-sine, cosine, 0.0)]
    })
}

#[test]
fn a_tolerance_below_rounding_ends_and_is_the_least_that_makes_sense() {
    for (size, far) in [(1.0, 0.0), (1.0, 1e6), (1e-250, 0.0), (1e251, 0.0), (1e251, 1e6), (1e300, 0.0)] {
        let turn = turn(size, far);
        let least = faircurve::bezier::LEAST_TOLERANCE * size * (1.0 + far);
        let [sensible, tiny, none] = [least, 1e-320, 0.0].map(|tolerance| turn.beziers(tolerance).len());
        println!("size {size}, {far} away: {sensible} {tiny} {none}");
        assert!(sensible < 300, "{size} {far}: {sensible}");
        assert!(tiny <= sensible + 2 && none <= sensible + 2, "{size} {far}: {sensible} {tiny} {none}");
    }
}

#[test]
fn the_beziers_of_a_curve_of_any_size_are_those_of_it_in_other_units() {
    let tolerance = 1e-6;
    let usual = turn(1.0, 2.0).beziers(tolerance);
    for exponent in [-1000, -700, -100, 100, 700, 1000] {
        let size = f64::from(exponent).exp2();
        let own = turn(size, 2.0).beziers(tolerance * size);
        let scaled: Vec<_> = usual.iter().map(|piece| piece.map(|point| point * size)).collect();
        assert_eq!(own, scaled, "2^{exponent}");
    }
}

#[test]
fn repeated_points_have_no_piece_and_unfitted_curves_are_their_polylines() {
    let repeats = [[0.0, 0.0], [1.0, 1.0], [1.0, 1.0], [2.0, 0.0]];
    let bad = [[0.0, 0.0], [f64::NAN, 1.0], [2.0, 0.0]];
    let point = [[5.0, 5.0]];
    let batch = CurveBatch::from_slices(&[&repeats[..], &bad[..], &point[..]]).unwrap();
    for (method, fit) in fits(&batch) {
        let pieces = fit.curve(0).beziers(1e-3);
        assert!(pieces.iter().all(|p| p[0] != p[3]), "{method}: {pieces:?}");
        let (first, last) = (fit.curve(0).jet(0, 0.0).point, fit.curve(0).jet(2, 1.0).point);
        assert_eq!([pieces[0][0], pieces[pieces.len() - 1][3]], [first, last], "{method}");
        let polyline = fit.curve(1).beziers(1e-3);
        assert_eq!(polyline.len(), 2, "{method}");
        assert_eq!((polyline[0][0], polyline[1][3]), (DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0)), "{method}");
        let chains = fit.beziers(1e-3);
        assert_eq!((chains.count(1), chains.points(2)), (7, &[5.0, 5.0][..]), "{method}");
    }
}

#[test]
fn closed_chains_come_back_to_their_first_point_bit_for_bit() {
    let batch = walks(2, 10, 10);
    for (method, fit) in fits(&batch) {
        let chains = fit.beziers(1e-4);
        for i in (0..fit.len()).filter(|&i| batch.is_closed(i)) {
            let pieces = fit.curve(i).beziers(1e-4);
            assert_eq!(pieces[0][0], pieces[pieces.len() - 1][3], "{method} {i}");
            assert_eq!((chains.count(i), chains.is_closed(i)), (3 * pieces.len(), true), "{method} {i}");
        }
    }
}

const TWO: &str = "curve,x,y\na,0,0\na,1,2\na,3,1\nb,0,5\nb,2,6\nb,3,4\nb,5,5\n";

fn program(folder: &tempfile::TempDir, arguments: &str) -> assert_cmd::assert::Assert {
    cargo_bin_cmd!("faircurve").current_dir(folder).args(arguments.split_whitespace()).assert()
}

/// Control points of the paths of a drawing, with y up.
fn drawn(folder: &tempfile::TempDir, name: &str) -> Vec<Vec<[f64; 2]>> {
    let text = fs::read_to_string(folder.path().join(name)).unwrap();
    let document = roxmltree::Document::parse(&text).unwrap();
    let paths = document.descendants().filter_map(|node| node.attribute("d"));
    paths
        .map(|d| {
            let mut points = Vec::new();
            for element in BezPath::from_svg(d).unwrap().elements() {
                match *element {
                    PathEl::MoveTo(p) => points.push([p.x, -p.y]),
                    PathEl::CurveTo(p, q, r) => points.extend([p, q, r].map(|p| [p.x, -p.y])),
                    PathEl::ClosePath => {}
                    other => panic!("{other:?}"),
                }
            }
            points
        })
        .collect()
}

#[test]
fn every_method_takes_a_tolerance_with_as_bezier_and_files_hold_that_many_pieces() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("in.csv"), TWO).unwrap();
    let batch = io::read(folder.path().join("in.csv")).unwrap();
    for method in ["natural", "smoothing --smoothing 0.1", "fair", "scf"] {
        let arguments = format!("fit in.csv --method {method} --device cpu --force --as bezier");
        let mut counts = Vec::new();
        for tolerance in ["", " --tolerance 0.1", " --tolerance 0.00001"] {
            for file in ["out.npz", "out.csv", "out.svg"] {
                program(&folder, &format!("{arguments}{tolerance} -o {file}")).code(0);
            }
            let control = io::read(folder.path().join("out.npz")).unwrap();
            let table = io::read(folder.path().join("out.csv")).unwrap();
            let paths = drawn(&folder, "out.svg");
            assert_eq!(paths.len(), 2);
            for (i, path) in paths.iter().enumerate() {
                let pieces = (control.count(i) - 1) / 3;
                assert_eq!(
                    (control.count(i), table.count(i), path.len()),
                    (3 * pieces + 1, 3 * pieces + 1, 3 * pieces + 1)
                );
                for (p, q) in path.iter().zip(control.points(i).chunks_exact(2)) {
                    let off = (p[0] - q[0]).hypot(p[1] - q[1]);
                    // Exact without a tolerance, else rounded to a hundredth of it.
                    let allowed = tolerance.split(' ').next_back().and_then(|t| t.parse().ok()).unwrap_or(0.0) * 0.0071;
                    assert!(off <= allowed * (1.0 + 1e-9), "{method}{tolerance}: {off}");
                }
            }
            counts.push(control.count(0) + control.count(1));
        }
        assert!(counts[1] <= counts[2], "{method}: {counts:?}");
        if method == "natural" {
            let exact = spline::Natural::default().fit(&batch, &Device::cpu()).unwrap().beziers(1.0);
            // One per span, and fewer where the tolerance allows.
            assert!(counts[0] == exact.total_points() && counts[1] < counts[0], "{counts:?}");
        }
    }
}

#[test]
fn a_tolerance_makes_an_svg_of_few_digits_whose_ends_still_meet() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(
        folder.path().join("in.csv"),
        "curve,x,y\na,0.123456789,0\na,1,2.1\na,3,1.7\nb,3,1.7\nb,2,6\nb,5,5.55555555\n",
    )
    .unwrap();
    program(&folder, "fit in.csv -o exact.svg --as bezier --device cpu").code(0);
    program(&folder, "fit in.csv -o rounded.svg --as bezier --tolerance 0.01 --device cpu").code(0);
    program(&folder, "fit in.csv -o ring.svg --as bezier --tolerance 0.01 --device cpu --closed yes").code(0);
    let bytes = |name: &str| {
        let text = fs::read_to_string(folder.path().join(name)).unwrap();
        let document = roxmltree::Document::parse(&text).unwrap();
        document.descendants().filter_map(|node| node.attribute("d")).map(str::len).sum::<usize>()
    };
    assert!(3 * bytes("rounded.svg") < 2 * bytes("exact.svg"), "{} {}", bytes("rounded.svg"), bytes("exact.svg"));
    let paths = drawn(&folder, "rounded.svg");
    assert_eq!(paths[0][0], [0.1235, 0.0]);
    let apart = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]);
    let ends = [0, 1].map(|i| paths[i][paths[i].len() - 1]);
    assert!(apart(ends[0], paths[1][0]) <= 1e-14 && apart(ends[1], [5.0, 5.5556]) <= 1e-14, "{paths:?}");
    let ring = &drawn(&folder, "ring.svg")[0];
    assert_eq!(ring.len() % 3, 1);
    assert!(apart(ring[0], ring[ring.len() - 1]) <= 1e-14, "{ring:?}");
    let options = ReadOptions { closed: Closed::Auto, ..ReadOptions::default() };
    assert!(io::read_with(folder.path().join("ring.svg"), &options).unwrap().is_closed(0));
}

#[test]
fn tolerances_that_make_no_sense_are_refused_with_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("in.csv"), TWO).unwrap();
    let refused = |arguments: &str, sentence: &str| {
        program(&folder, &format!("fit in.csv -o out.csv {arguments}")).code(2).stderr(contains(sentence));
    };
    for (value, word) in [("0", "0"), ("-1", "-1"), ("inf", "inf"), ("nan", "NaN")] {
        let sentence = format!("--tolerance is {word}; it must be a positive distance, such as --tolerance 0.001");
        refused(&format!("--as bezier --tolerance {value}"), &sentence);
        refused(&format!("--tolerance {value}"), &sentence);
    }
    refused(
        "--as bezier --tolerance 1e-13",
        "but coordinates up to 6 are rounded to about as much: give 6e-12 or more",
    );
    refused("--tolerance auto", "--tolerance auto is a part of --within");
    refused("--within 1 --tolerance 2", "--tolerance 2 is a part of --within 1: give less, in the same unit");
    refused("--within 1 --tolerance 1%", "--tolerance 1% is a part of --within 1: give less, in the same unit");
    refused("--tolerance 1km", "does not say the unit of its coordinates");
}
