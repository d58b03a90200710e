//! Fewer cubics for the outlines of a drawing, beside kurbo's `simplify_bezpath` and `fit_to_bezpath_opt`.
//!
//! ```sh
//! cargo run --release --example peer_simplify -- DRAWING.svg TOLERANCE
//! ```
//!
//! Prints, for each, the number of segments, the largest distance of the old outlines from the new
//! ones, how many are farther than the tolerance, and the time on one thread.

use std::time::Instant;

use faircurve::bezier::Simplify;
use faircurve::io::{self, ReadOptions};
use faircurve::{CurveBatch, Device};
use kurbo::simplify::{SimplifyOptLevel, SimplifyOptions, simplify_bezpath};
use kurbo::{BezPath, CubicBez, ParamCurve, ParamCurveNearest, PathSeg, Point};

/// Places of every old segment that are compared.
const PLACES: usize = 16;

fn main() -> faircurve::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().expect("a drawing");
    let tolerance: f64 = arguments.next().expect("a tolerance").parse().expect("a number");
    let chains = io::read_with(&file, &ReadOptions { controls: true, ..ReadOptions::default() })?;
    let old: Vec<BezPath> = (0..chains.len()).map(|i| path(&chains, i)).collect();
    println!("{} outlines, {} cubics", old.len(), old.iter().map(segments).sum::<usize>());
    let threads = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let start = Instant::now();
    let simplify = Simplify { tolerance, ..Simplify::default() };
    let fewer = threads.install(|| simplify.fit(&chains, &Device::cpu()))?;
    let seconds = start.elapsed().as_secs_f64();
    let ours: Vec<BezPath> = (0..chains.len()).map(|i| path(fewer.control_points(), i)).collect();
    show("faircurve", [&old, &ours], tolerance, seconds);
    for (name, level) in [("kurbo", SimplifyOptLevel::Subdivide), ("kurbo, optimised", SimplifyOptLevel::Optimize)] {
        let options = SimplifyOptions::default().opt_level(level).angle_thresh(simplify.corners);
        let start = Instant::now();
        let theirs: Vec<BezPath> = old.iter().map(|path| simplify_bezpath(path.iter(), tolerance, &options)).collect();
        show(name, [&old, &theirs], tolerance, start.elapsed().as_secs_f64());
    }
    Ok(())
}

/// A chain as a path. Straight pieces are lines, as kurbo takes them.
fn path(chains: &CurveBatch, i: usize) -> BezPath {
    let points: Vec<Point> = chains.points(i).as_chunks::<2>().0.iter().map(|&[x, y]| Point::new(x, y)).collect();
    let mut path = BezPath::new();
    let Some(&first) = points.first() else { return path };
    path.move_to(first);
    for k in 0..chains.spans(i) / 3 {
        let [a, b, c, d] = std::array::from_fn(|j| points[(3 * k + j) % points.len()]);
        match CubicBez::new(a, b, c, d) {
            _ if a == d && b == a && c == a => {}
            cubic if is_straight(&cubic) => path.line_to(d),
            _ => path.curve_to(b, c, d),
        }
    }
    path
}

fn is_straight(&CubicBez { p0, p1, p2, p3 }: &CubicBez) -> bool {
    let chord = p3 - p0;
    let off = |p: Point| (p - p0).cross(chord).abs() / chord.hypot();
    off(p1).max(off(p2)) < 1e-9 * chord.hypot()
}

fn segments(path: &BezPath) -> usize {
    path.segments().count()
}

fn show(name: &str, [old, new]: [&[BezPath]; 2], tolerance: f64, seconds: f64) {
    let far: Vec<f64> = old.iter().zip(new).map(|(old, new)| distance(old, new)).collect();
    let (worst, farther) =
        (far.iter().fold(0.0, |a: f64, b| a.max(*b)), far.iter().filter(|d| **d > tolerance).count());
    let segments: usize = new.iter().map(segments).sum();
    println!(
        "{name}: {segments} segments, within {worst:.4}, {farther} outlines farther than {tolerance}, {seconds:.2} s"
    );
}

/// The largest distance of places of a path from another.
fn distance(old: &BezPath, new: &BezPath) -> f64 {
    let new: Vec<PathSeg> = new.segments().collect();
    let nearest =
        |place: Point| new.iter().map(|segment| segment.nearest(place, 1e-9).distance_sq).fold(f64::INFINITY, f64::min);
    let places = old.segments().flat_map(|segment| (0..PLACES).map(move |k| segment.eval(k as f64 / PLACES as f64)));
    places.map(|place| if new.is_empty() { 0.0 } else { nearest(place) }).fold(0.0, f64::max).sqrt()
}
