//! The program in a folder of its own, as its users run it.

use std::fs;

use assert_cmd::assert::Assert;
use assert_cmd::cargo::cargo_bin_cmd;
use faircurve::CurveBatch;
use predicates::prelude::*;
use predicates::str::{contains, is_empty, starts_with};
use tempfile::TempDir;

/// A folder with `in.csv`, which holds `text`.
pub fn folder(text: &str) -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("in.csv"), text).unwrap();
    folder
}

/// Runs the program in the folder; arguments are separated by blanks.
pub fn run(folder: &TempDir, arguments: &str) -> Assert {
    cargo_bin_cmd!("faircurve").current_dir(folder).args(arguments.split_whitespace()).assert()
}

/// Runs with an error expected: exit code 2, nothing on stdout, and this in the one sentence on
/// stderr.
pub fn refused(folder: &TempDir, arguments: &str, sentence: &str) {
    let one_line = predicate::function(|text: &str| text.lines().count() == 1);
    run(folder, arguments)
        .code(2)
        .stdout(is_empty())
        .stderr(starts_with("faircurve: ").and(contains(sentence)).and(one_line));
}

/// The largest distance of a point of curve `i` from the lines of another batch's, in the plane.
pub fn from_lines(batch: &CurveBatch, others: &CurveBatch, i: usize) -> f64 {
    let (d, lines) = (batch.dimension(), others.points(i));
    let n = others.count(i);
    let at = |k: usize| [lines[k % n * d], lines[k % n * d + 1]];
    let from_edge = |p: &[f64], k: usize| {
        let ([ax, ay], [bx, by]) = (at(k), at(k + 1));
        let (x, y) = (bx - ax, by - ay);
        let along = (((p[0] - ax) * x + (p[1] - ay) * y) / (x * x + y * y).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (p[0] - ax - along * x).hypot(p[1] - ay - along * y)
    };
    let edges = if others.is_closed(i) { n } else { n.saturating_sub(1) };
    let near = |p: &[f64]| (0..edges).map(|k| from_edge(p, k)).fold(f64::INFINITY, f64::min);
    batch.points(i).chunks_exact(d).map(near).filter(|near| near.is_finite()).fold(0.0, f64::max)
}

/// The diagonal of the box around curve `i`, in the plane.
pub fn diagonal(batch: &CurveBatch, i: usize) -> f64 {
    let extent = |c: usize| {
        let own = batch.points(i).iter().skip(c).step_by(batch.dimension());
        own.clone().fold(f64::NEG_INFINITY, |a, b| a.max(*b)) - own.fold(f64::INFINITY, |a, b| a.min(*b))
    };
    extent(0).hypot(extent(1))
}

/// The area of curve `i`, a planar ring.
pub fn area(batch: &CurveBatch, i: usize) -> f64 {
    let points: Vec<&[f64]> = batch.points(i).chunks_exact(batch.dimension()).collect();
    let cross = |k: usize| {
        let (a, b) = (points[k], points[(k + 1) % points.len()]);
        a[0] * b[1] - a[1] * b[0]
    };
    0.5 * (0..points.len()).map(cross).sum::<f64>().abs()
}
