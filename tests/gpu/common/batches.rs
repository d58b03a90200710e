//! Batches for the tests: random ragged ones, nasty ones, real ones.

use faircurve::io::{self, Closed, ReadOptions};
use faircurve::{Constraints, CurveBatch};
use rand::RngExt;
use rand::rngs::StdRng;

/// Lengths around every lane, chunk and workgroup boundary, and some long ones.
pub fn sizes() -> Vec<usize> {
    (1..=130).chain(255..=257).chain([1000, 4097]).collect()
}

/// Random walks of these sizes, each one open and one closed.
pub fn walks(dimension: usize, sizes: &[usize], rng: &mut StdRng) -> CurveBatch {
    let (mut coords, mut offsets) = (Vec::new(), vec![0]);
    for n in sizes.iter().flat_map(|&n| [n, n]) {
        let mut at = vec![0.0; dimension];
        for _ in 0..n {
            at.iter_mut().for_each(|x| *x += rng.random_range(-1.0..1.0));
            coords.extend_from_slice(&at);
        }
        offsets.push(coords.len() / dimension);
    }
    let closed = (0..2 * sizes.len()).map(|i| i % 2 == 1).collect();
    CurveBatch::from_ragged(dimension, coords, offsets).unwrap().closed_each(closed).unwrap()
}

/// The same curves with knots of their own, whose spans lie anywhere in so many decades.
pub fn with_uneven_knots(batch: CurveBatch, decades: f64, rng: &mut StdRng) -> CurveBatch {
    let mut span = || 10_f64.powf(rng.random_range(-decades..=0.0));
    let mut t = Vec::with_capacity(batch.total_points());
    for i in 0..batch.len() {
        let mut at = 0.0;
        t.extend((0..batch.count(i)).map(|_| {
            at += span();
            at
        }));
    }
    let closing = (0..batch.len()).map(|_| span()).collect();
    batch.with_parameters(t).unwrap().with_closing_spans(closing).unwrap()
}

/// The same curves with every second pair of neighbours moved together until only so much of their
/// distance is left.
pub fn with_close_points(batch: &CurveBatch, left: f64) -> CurveBatch {
    let d = batch.dimension();
    let mut coords = batch.coords().to_vec();
    for i in 0..batch.len() {
        let curve = &mut coords[batch.offsets()[i] * d..batch.offsets()[i + 1] * d];
        for pair in curve.chunks_exact_mut(2 * d) {
            let (first, second) = pair.split_at_mut(d);
            second.iter_mut().zip(first).for_each(|(y, x)| *y = *x + left * (*y - *x));
        }
    }
    let closed = (0..batch.len()).map(|i| batch.is_closed(i)).collect();
    CurveBatch::from_ragged(d, coords, batch.offsets().to_vec()).unwrap().closed_each(closed).unwrap()
}

/// The same curves with tangents at the first point, the last, both, or none; every ninth curve of
/// three points or more also has one in the middle, which no spline meets.
pub fn with_clamped_ends(batch: CurveBatch, rng: &mut StdRng) -> CurveBatch {
    let d = batch.dimension();
    let mut tangents = vec![f64::NAN; batch.total_points() * d];
    for i in (0..batch.len()).filter(|&i| !batch.is_closed(i) && batch.count(i) > 1) {
        let ends = [batch.offsets()[i], batch.offsets()[i + 1] - 1];
        for end in ends.into_iter().enumerate().filter(|(end, _)| (i / 2 + 1) >> end & 1 == 1).map(|(_, point)| point) {
            tangents[end * d..(end + 1) * d].iter_mut().for_each(|x| *x = rng.random_range(-1.0..1.0));
        }
        if i % 9 == 0 && batch.count(i) > 2 {
            tangents[(batch.offsets()[i] + 1) * d..][..d].fill(0.5);
        }
    }
    batch.with_constraints(Constraints { tangents: Some(tangents), ..Constraints::default() }).unwrap()
}

/// Curves that are hard, degenerate or impossible, each by its name.
pub fn nasty(dimension: usize) -> CurveBatch {
    let wave = |n: usize, center: f64, size: f64| -> Vec<Vec<f64>> {
        let point = |k: usize| {
            let a = 2.4 * k as f64;
            [a.sin(), (1.7 * a).cos(), (0.6 * a).sin()].map(|x| center + size * x)[..dimension].to_vec()
        };
        (0..n).map(point).collect()
    };
    let line = |at: &[f64]| -> Vec<Vec<f64>> { at.iter().map(|x| vec![0.3 + x, 0.7 - 2.0 * x, 0.1 * x]).collect() };
    let mut with_nan = wave(20, 0.0, 1.0);
    with_nan[7][1] = f64::NAN;
    let mut with_infinity = wave(20, 0.0, 1.0);
    with_infinity[19][0] = f64::INFINITY;
    let mut repeated = wave(12, 0.0, 1.0);
    [3, 3, 7, 0, 14].into_iter().for_each(|k| repeated.insert(k, repeated[k].clone()));
    let mut close = wave(12, 0.0, 1.0);
    close.insert(5, close[5].iter().map(|x| x + 1e-7).collect());
    let mut outlier = wave(40, 0.0, 1.0);
    outlier[11][0] = 1e5;
    let curves: Vec<(&str, bool, Vec<Vec<f64>>)> = vec![
        ("far from the origin", false, wave(60, 1e6, 1.0)),
        ("far and closed", true, wave(60, -1e6, 1.0)),
        ("empty", false, vec![]),
        ("tiny", false, wave(30, 0.0, 1e-9)),
        ("tiny and far", true, wave(30, 1e-3, 1e-9)),
        ("huge", true, wave(30, 0.0, 1e9)),
        ("beyond the range of f32", false, wave(30, 0.0, 1e100)),
        ("below the range of f32", true, wave(30, 0.0, 1e-100)),
        ("nan", false, with_nan),
        ("after nan", false, wave(20, 0.0, 1.0)),
        ("infinity", true, with_infinity),
        ("after infinity", true, wave(20, 0.0, 1.0)),
        ("collinear", false, line(&[0.0, 1.0, 1.5, 4.0, 4.25, 9.0])),
        ("collinear, to and fro", false, line(&[0.0, 2.0, 1.0, 4.0, -3.0])),
        ("collinear and closed", true, line(&[0.0, 1.0, 1.5, 4.0])),
        ("one point", false, wave(1, 0.0, 1.0)),
        ("one point, closed", true, wave(1, 0.0, 1.0)),
        ("two points", false, wave(2, 0.0, 1.0)),
        ("two points, closed", true, wave(2, 0.0, 1.0)),
        ("three points", false, wave(3, 0.0, 1.0)),
        ("three points, closed", true, wave(3, 0.0, 1.0)),
        ("repeated points", false, repeated.clone()),
        ("repeated points, closed", true, repeated),
        ("one point many times", false, vec![vec![0.5; 3]; 9]),
        ("one point many times, closed", true, vec![vec![0.5; 3]; 9]),
        ("two points that almost coincide", false, close),
        ("an outlier", false, outlier),
        ("plain", false, wave(33, 0.0, 1.0)),
        ("empty and closed", true, vec![]),
    ];
    of_named(dimension, curves)
}

/// Curves with parameters that are wrong or hard, each by its name, beside good ones.
pub fn nasty_parameters() -> CurveBatch {
    let points: Vec<Vec<f64>> = (0..12).map(|k| vec![(1.3 * k as f64).sin(), (2.9 * k as f64).cos()]).collect();
    let even: Vec<f64> = (0..12).map(|k| k as f64).collect();
    let change = |k: usize, t: f64| {
        let mut changed = even.clone();
        changed[k] = t;
        changed
    };
    let of = |f: fn(f64) -> f64| even.iter().map(|&t| f(t)).collect::<Vec<f64>>();
    let cases: Vec<(&str, Vec<f64>)> = vec![
        ("even", even.clone()),
        ("decreasing", change(6, 4.5)),
        ("even, after a bad one", even.clone()),
        ("not a number", change(6, f64::NAN)),
        ("infinite", change(11, f64::INFINITY)),
        ("equal at different points", change(6, 5.0)),
        ("ten a decade over six decades", of(|t| 10_f64.powf(0.5 * t))),
        ("a span of 1e-12", change(6, 5.0 + 1e-12)),
        ("long ago", of(|t| 1e9 + t)),
        ("a unit of 1e-30", of(|t| 1e-30 * t)),
        ("over a hundred decades", of(|t| 10_f64.powf(9.0 * t))),
        ("over two hundred decades", of(|t| 10_f64.powf(20.0 * t - 110.0))),
    ];
    let t = cases.iter().flat_map(|(_, t)| t.clone()).collect();
    let curves = cases.into_iter().map(|(name, _)| (name, false, points.clone())).collect();
    of_named(2, curves).with_parameters(t).unwrap()
}

fn of_named(dimension: usize, curves: Vec<(&str, bool, Vec<Vec<f64>>)>) -> CurveBatch {
    let (mut coords, mut offsets) = (Vec::new(), vec![0]);
    for (_, _, points) in &curves {
        points.iter().for_each(|point| coords.extend_from_slice(&point[..dimension]));
        offsets.push(coords.len() / dimension);
    }
    let closed = curves.iter().map(|(_, closed, _)| *closed).collect();
    let names = curves.iter().map(|(name, _, _)| name.to_string()).collect();
    let batch = CurveBatch::from_ragged(dimension, coords, offsets).unwrap();
    batch.closed_each(closed).unwrap().with_names(names).unwrap()
}

fn example(file: &str, options: ReadOptions) -> CurveBatch {
    // benches/hardware.sh takes the tests to a machine without the sources, and says where the data are there.
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/data");
    let folder = std::env::var("FAIRCURVE_DATA").unwrap_or_else(|_| own.into());
    io::read_with(format!("{folder}/{file}"), &options).unwrap()
}

/// Tracks of tropical storms over their own time axis.
pub fn storms() -> CurveBatch {
    let columns = "x=lon,y=lat,curve=id,t=hours,weight=wind".parse().unwrap();
    example("storms.csv.gz", ReadOptions { columns, closed: Closed::No, ..ReadOptions::default() })
}

/// Outlines of countries, closed.
pub fn countries() -> CurveBatch {
    example("countries-110m.geojson", ReadOptions::default())
}
