//! Fewer cubics for chains of cubics.

use faircurve::bezier::{Completed, Simplify};
use faircurve::io::{self, ReadOptions};
use faircurve::spline::{Natural, Parametrisation};
use faircurve::{CurveBatch, CurveStatus, Device, Fit};
use glam::DVec2;
use kurbo::{CubicBez, ParamCurve, ParamCurveNearest, Point};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

fn simplified(chains: &CurveBatch, tolerance: f64) -> Completed {
    Simplify { tolerance, ..Simplify::default() }.fit(chains, &Device::cpu()).unwrap()
}

fn batch(chains: &[&[[f64; 2]]]) -> CurveBatch {
    CurveBatch::from_slices(chains).unwrap()
}

fn points(batch: &CurveBatch, i: usize) -> Vec<DVec2> {
    batch.points(i).as_chunks::<2>().0.iter().map(|&point| point.into()).collect()
}

fn cubics(batch: &CurveBatch, i: usize) -> Vec<CubicBez> {
    let points: Vec<Point> = points(batch, i).iter().map(|p| Point::new(p.x, p.y)).collect();
    let at = |k: usize| points[k % points.len()];
    (0..batch.spans(i) / 3).map(|k| CubicBez::new(at(3 * k), at(3 * k + 1), at(3 * k + 2), at(3 * k + 3))).collect()
}

/// The largest distance of places of a chain from another, by kurbo.
fn distance(from: &[CubicBez], to: &[CubicBez]) -> f64 {
    let places = from.iter().flat_map(|piece| (0..=24).map(|k| piece.eval(k as f64 / 24.0)));
    let far =
        |place: Point| to.iter().map(|piece| piece.nearest(place, 1e-10).distance_sq).fold(f64::INFINITY, f64::min);
    places.map(far).fold(0.0, f64::max).sqrt()
}

/// Smooth closed and open curves in pieces.
fn smooth(curves: usize, seed: u64, parametrisation: Parametrisation) -> CurveBatch {
    let mut rng = StdRng::seed_from_u64(seed);
    println!("seed {seed}");
    let (mut coords, mut offsets) = (Vec::new(), vec![0]);
    for _ in 0..curves {
        let count = rng.random_range(4..40);
        let wild = rng.random_range(0.0..1.0);
        for k in 0..count {
            let (s, c) = (k as f64 * 6.2 / count as f64).sin_cos();
            coords.extend([c, s].map(|x| 100.0 * (x + wild * rng.random_range(-0.5..0.5))));
        }
        offsets.push(coords.len() / 2);
    }
    let closed = (0..curves).map(|i| i % 2 == 0).collect();
    let data = CurveBatch::from_ragged(2, coords, offsets).unwrap().closed_each(closed).unwrap();
    Natural { parametrisation, ..Natural::default() }.fit(&data, &Device::cpu()).unwrap().beziers(1e-9)
}

#[test]
fn chains_of_fewer_cubics_are_near_both_ways_and_as_smooth_as_before() {
    // Those by chords are smoother. The others have hairpins.
    for parametrisation in [Parametrisation::ChordLength, Parametrisation::Centripetal, Parametrisation::Uniform] {
        are_near_both_ways_and_as_smooth(&smooth(60, 3, parametrisation));
    }
}

fn are_near_both_ways_and_as_smooth(chains: &CurveBatch) {
    for tolerance in [0.01, 0.3, 10.0] {
        let fewer = simplified(chains, tolerance);
        for i in 0..chains.len() {
            let (old, new) = (cubics(chains, i), cubics(fewer.control_points(), i));
            assert!(new.len() <= old.len());
            let far = [distance(&old, &new), distance(&new, &old)];
            let within = far.iter().all(|far| *far <= tolerance * (1.0 + 1e-6));
            assert!(within, "chain {i}: {far:?} with a tolerance of {tolerance}");
            for k in usize::from(!chains.is_closed(i))..new.len() {
                let (before, after) = (new[(k + new.len() - 1) % new.len()], new[k]);
                let (arrives, leaves) = (before.p3 - before.p2, after.p1 - after.p0);
                let turn = arrives.cross(leaves).atan2(arrives.dot(leaves));
                assert!(turn.abs() < 1e-6, "chain {i}, joint {k} turns by {turn}");
            }
        }
        let count = |batch: &CurveBatch| batch.total_points() / 3;
        println!("{tolerance}: {} cubics became {}", count(chains), count(fewer.control_points()));
        assert!(tolerance < 0.1 || count(fewer.control_points()) * 10 < count(chains) * 9);
    }
}

#[test]
fn a_cubic_in_pieces_becomes_one_again() {
    let whole = CubicBez::new((0.0, 0.0), (30.0, 80.0), (90.0, -40.0), (120.0, 10.0));
    let mut points = vec![[0.0, 0.0]];
    for ends in [0.0, 0.11, 0.3, 0.65, 1.0].windows(2) {
        let piece = whole.subsegment(ends[0]..ends[1]);
        points.extend([piece.p1, piece.p2, piece.p3].map(|p| [p.x, p.y]));
    }
    let found = simplified(&batch(&[&points]), 1e-3);
    let found = cubics(found.control_points(), 0);
    assert_eq!(found.len(), 1);
    let off = [(found[0].p1, whole.p1), (found[0].p2, whole.p2)].map(|(a, b)| a.distance(b));
    assert!(off.iter().all(|off| *off < 1.0), "{off:?}");
}

/// A square with round corners, a half circle on a stem, and a polygon of 200 sides.
fn shapes() -> CurveBatch {
    let svg = "<svg><path id='stem' d='M0 0H10V50A20 20 0 0 1 -30 50V0Z'/><rect id='round' width='90' height='40' rx='10'/>\
               <polygon id='many' points='";
    let many: String = (0..400)
        .map(|k| (k as f64 * std::f64::consts::TAU / 400.0).sin_cos())
        .map(|(s, c)| format!("{c},{s} "))
        .collect();
    let options = ReadOptions { controls: true, format: Some(io::Format::Svg), ..ReadOptions::default() };
    io::read_from(format!("{svg}{many}'/></svg>").as_bytes(), &options).unwrap()
}

#[test]
fn corners_and_lines_stay_and_lines_in_a_row_are_points_of_a_curve() {
    let chains = shapes();
    let fewer = simplified(&chains, 0.05);
    let control = fewer.control_points();
    let stem = points(control, 0);
    for corner in [[0.0, 0.0], [10.0, 0.0], [10.0, -50.0], [-30.0, -50.0], [-30.0, 0.0]] {
        assert!(stem.contains(&corner.into()), "{corner:?} of {stem:?}");
    }
    let straight = |piece: &CubicBez| (piece.p1 - piece.p0).cross(piece.p3 - piece.p0).abs() < 1e-9;
    let lines = |i: usize| cubics(control, i).iter().filter(|piece| straight(piece)).count();
    assert_eq!([lines(0), lines(1), lines(2)], [4, 4, 0]);
    assert!(cubics(control, 2).len() <= 8, "{} cubics for a circle of 400 lines", cubics(control, 2).len());
}

#[test]
fn what_cannot_be_simpler_keeps_its_bits_and_a_batch_is_its_chains() {
    let chains = smooth(20, 5, Parametrisation::ChordLength);
    let nothing = simplified(&chains, 1e-13);
    assert_eq!(nothing.control_points().coords(), chains.coords());
    let all = simplified(&chains, 1.0);
    for i in 0..chains.len() {
        let one = CurveBatch::from_ragged(2, chains.points(i).to_vec(), vec![0, chains.count(i)]).unwrap();
        let alone = simplified(&one.closed_each(vec![chains.is_closed(i)]).unwrap(), 1.0);
        assert_eq!(alone.control_points().points(0), all.control_points().points(i), "chain {i}");
    }
}

#[test]
fn chains_that_cannot_be_simplified_have_a_status_and_spoil_no_other() {
    let good = [[0.0, 0.0], [1.0, 1.0], [2.0, 1.0], [3.0, 0.0], [4.0, -1.0], [5.0, -1.0], [6.0, 0.0]];
    let mut hole = good;
    hole[2][0] = f64::NAN;
    let chains = batch(&[&good, &hole, &good[..6], &good[..1], &[[2.0, 2.0]; 7], &[], &good]);
    let completed = simplified(&chains, 0.1);
    let status: Vec<CurveStatus> = completed.reports().iter().map(|report| report.status).collect();
    use CurveStatus::{Converged, Degenerate, Invalid};
    assert_eq!(status, [Converged, Invalid, Invalid, Degenerate, Converged, Degenerate, Converged]);
    let message = completed.reports()[2].message.clone().unwrap();
    assert!(message.contains("6 control points are no cubics"), "{message}");
    assert_eq!(completed.control_points().points(4), chains.points(4));
    assert_eq!(completed.control_points().points(0), completed.control_points().points(6));
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = Simplify { tolerance: bad, ..Simplify::default() }.fit(&chains, &Device::cpu()).unwrap_err();
        assert!(error.to_string().contains("must be a positive length"), "{error}");
    }
}

#[test]
fn handles_of_no_length_and_huge_and_tiny_chains_are_simplified_alike() {
    let base = [[0.0, 0.0], [0.0, 0.0], [1.0, 1.0], [2.0, 1.0], [3.0, 1.0], [4.0, 0.0], [4.0, 0.0]];
    for scale in [1e-60, 1.0, 1e60] {
        let scaled = base.map(|point| point.map(|x| x * scale));
        let completed = simplified(&batch(&[&scaled]), 0.5 * scale);
        assert_eq!(completed.reports()[0].status, CurveStatus::Converged);
        assert_eq!(cubics(completed.control_points(), 0).len(), 1, "of size {scale}");
    }
}

#[test]
fn what_is_simplified_is_a_fit_as_any_other() {
    let chains = smooth(4, 8, Parametrisation::ChordLength);
    let completed = simplified(&chains, 0.5);
    let pieces: Vec<usize> = (0..4).map(|i| completed.control_points().spans(i) / 3).collect();
    let fit: Fit = completed.into_fit();
    assert!((0..4).all(|i| fit.curve(i).spans() == pieces[i] && fit.reports()[i].max_deviation == 0.5));
}

#[test]
fn joints_lie_at_extremes_where_fonts_ask_for_them() {
    // A circle whose joints are turned by 20 degrees, as one chain of four cubics.
    let kappa = 4.0 / 3.0 * (std::f64::consts::FRAC_PI_8).tan();
    let at = |k: f64| (k * std::f64::consts::FRAC_PI_2 + 20_f64.to_radians()).sin_cos();
    let points: Vec<[f64; 2]> = (0..4)
        .flat_map(|k| {
            let ((s, c), (t, d)) = (at(f64::from(k)), at(f64::from(k) + 1.0));
            [[c, s], [c - kappa * s, s + kappa * c], [d + kappa * t, t - kappa * d]]
        })
        .collect();
    let chains = CurveBatch::from_slices(&[&points[..]]).unwrap().closed(true);
    let simplify = |extremes| {
        let simplify = Simplify { tolerance: 5e-4, extremes, ..Simplify::default() };
        simplify.fit(&chains, &Device::cpu()).unwrap().control_points().points(0).to_vec()
    };
    let points = simplify(true);
    assert_eq!(points.len(), 2 * 12, "four cubics");
    for k in 0..4 {
        let [x, y, to_x, to_y] = points[6 * k..6 * k + 4].try_into().unwrap();
        assert!(x.abs().max(y.abs()) > 0.999, "a joint at an extreme");
        assert!(x == to_x || y == to_y, "handles are level to the last bit: {x}, {y} to {to_x}, {to_y}");
    }
    assert!(simplify(false).chunks(6).any(|joint| joint[0].abs().max(joint[1].abs()) < 0.99));
}
