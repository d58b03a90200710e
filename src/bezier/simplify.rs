//! [`Simplify`]: as few cubics as possible near a chain of cubics.
//!
//! Between corners the chain is fitted again with the longest pieces that the tolerance allows.
//! Each has the old curve's points and tangents at its ends, and the handles of least distance from
//! it (see [`Curve::beziers`]). Corners and straight pieces are kept.

use glam::DVec3;

use super::completed::{Assembly, Completed};
use super::handles::{VANISHING, check_corners, leaving, turn};
use crate::batch::{CurveBatch, Unfitted};
use crate::curve::{Curve, Jet, convert, vector};
use crate::device::Device;
use crate::error::{Error, Result};
use crate::parallel;
use crate::report::CurveReport;
use crate::status::CurveStatus;

/// A cubic's control points.
type Piece = [DVec3; 4];

/// Approximates chains of cubics by chains of fewer cubics.
///
/// Corners are kept, and so are the directions at all joints that remain. Straight pieces are kept,
/// unless three or more follow each other without a corner: these count as points of a curve.
///
/// ```
/// use faircurve::{CurveBatch, Device, bezier::Simplify};
/// // A quarter of a circle, in four pieces.
/// let at = |k: f64| (k * std::f64::consts::FRAC_PI_8).sin_cos();
/// let handle = 4.0 / 3.0 * (std::f64::consts::FRAC_PI_8 / 4.0).tan();
/// let mut points = vec![[1.0, 0.0]];
/// for k in 0..4 {
///     let ((s, c), (t, d)) = (at(k as f64), at(k as f64 + 1.0));
///     points.extend([[c - handle * s, s + handle * c], [d + handle * t, t - handle * d], [d, t]]);
/// }
/// let chains = CurveBatch::from_slices(&[&points[..]])?;
/// let fewer = Simplify { tolerance: 1e-3, ..Simplify::default() }.fit(&chains, &Device::cpu())?;
/// assert_eq!(fewer.control_points().count(0), 4, "one cubic");
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Simplify {
    /// The largest distance from any point of either chain to the other (units of the curves, > 0).
    /// By default 0.001.
    pub tolerance: f64,
    /// Joints where the direction turns by more than this (radians, 0 to π) are corners. By default
    /// one degree.
    pub corners: f64,
}

impl Default for Simplify {
    fn default() -> Self {
        Simplify { tolerance: 1e-3, corners: 1_f64.to_radians() }
    }
}

/// Points per old piece whose distance from the new pieces is checked. New pieces, which are
/// longer, have twice as many. With 4, hairpins passed between them. 16 take a tenth longer.
const LOOKS: usize = 16;

/// Chords per new piece for the search of nearest points. Old pieces have half as many.
const CHORDS: usize = 32;

/// The next nearest point is searched among this many on either side of the last.
const WINDOW: usize = 4 * CHORDS;

/// Newton steps to the nearest point of a piece, and the relative error that they leave.
const NEWTON_STEPS: usize = 3;
const SLACK: f64 = 1.0 + 1e-6;

/// A closed chain without a corner is fitted from this many of its joints. The result with the
/// fewest pieces is taken.
const STARTS: usize = 4;

/// A last piece is short below this fraction of the mean length. Then a tolerance that makes pieces
/// even is searched by this many bisections.
const SHORT: f64 = 0.6;
const BALANCINGS: usize = 4;

/// This many consecutive lines without a corner are points of a curve.
const RUN: usize = 3;

/// Handles closer to the chord than this fraction of its length are on it.
const STRAIGHT: f64 = 1e-9;

impl Simplify {
    /// Simplifies chains of cubics: three control points per piece, and one more for open chains.
    ///
    /// The reports have ∫|X″|² of the new chains (pieces on (0, 1)), and the tolerance as
    /// `max_deviation`. A chain that cannot be simplified keeps its bits. All threads of the CPU
    /// work, whatever the device, which counts finished curves. A curve whose control points are
    /// not finite or do not form cubics keeps them and is `invalid`.
    ///
    /// # Errors
    /// A tolerance that is not positive, or an angle of corners outside 0 … π.
    pub fn fit(&self, chains: &CurveBatch, device: &Device) -> Result<Completed> {
        let Simplify { tolerance, corners } = *self;
        if !(tolerance > 0.0 && tolerance.is_finite()) {
            return Err(Error::argument(format!("the tolerance is {tolerance}; it must be a positive length")));
        }
        check_corners(corners)?;
        chains.allows(&[], "simplified chains")?;
        let simplified: Vec<std::result::Result<Vec<Piece>, Unfitted>> = parallel::map(chains.len(), 1, |i| {
            let pieces = pieces(chains, i)?;
            Ok(self.chain(pieces, chains.is_closed(i)))
        });
        device.finished(chains.len());
        let mut assembly = Assembly::new(chains);
        for (i, result) in simplified.into_iter().enumerate() {
            match result {
                Ok(pieces) => {
                    let energy = pieces.iter().map(bending).sum();
                    let report = CurveReport { max_deviation: tolerance, ..CurveReport::solved(energy) };
                    assembly.push(&control_points(&pieces, chains.is_closed(i), chains.dimension()), 3, vec![], report);
                }
                Err(problem) => assembly.push_unfitted(problem),
            }
        }
        Ok(assembly.finish(Device::cpu().report(false)?))
    }

    /// A simpler chain.
    fn chain(&self, mut pieces: Vec<Piece>, closed: bool) -> Vec<Piece> {
        let whole = pieces.clone();
        // Pieces of one point have no direction.
        pieces.retain(|piece| piece.iter().any(|point| *point != piece[0]));
        if pieces.is_empty() {
            return whole;
        }
        let n = pieces.len();
        let mut stays = self.staying(&pieces, closed);
        let round = |start: usize, ends: &[usize]| -> Vec<Piece> {
            let mut turned = pieces.clone();
            turned.rotate_left(start);
            ends.windows(2).flat_map(|ends| self.section(&turned[ends[0]..ends[1]])).collect()
        };
        match (closed, stays.first()) {
            (false, _) => {
                stays.insert(0, 0);
                stays.push(n);
                round(0, &stays)
            }
            (true, Some(&first)) => {
                let ends: Vec<usize> = stays.iter().map(|joint| joint - first).chain([n]).collect();
                round(first, &ends)
            }
            (true, None) => {
                let starts = (0..STARTS.min(n)).map(|k| k * n / STARTS.min(n));
                let all = starts.map(|start| round(start, &[0, n]));
                all.min_by_key(Vec::len).expect("there is a start")
            }
        }
    }

    /// The joints that stay: corners, and the ends of straight pieces that are kept.
    fn staying(&self, pieces: &[Piece], closed: bool) -> Vec<usize> {
        let n = pieces.len();
        let joints = usize::from(!closed)..n;
        let is_corner: Vec<bool> = (0..n)
            .map(|k| {
                !joints.contains(&k) || turn(backwards(&pieces[(k + n - 1) % n]), forwards(&pieces[k])) > self.corners
            })
            .collect();
        let straight: Vec<bool> = pieces.iter().map(is_straight).collect();
        let links = |k: usize| straight[(k + n - 1) % n] && straight[k % n] && !is_corner[k % n];
        // Of three lines in a row, joints two and two are linked.
        let in_a_row = |k: usize| (0..RUN).any(|back| (1..RUN).all(|j| links(k + n + j - back)));
        let is_line: Vec<bool> = (0..n).map(|k| straight[k] && !(n >= RUN && in_a_row(k))).collect();
        joints.filter(|&k| is_corner[k] || is_line[(k + n - 1) % n] || is_line[k]).collect()
    }

    /// Simplifies pieces without a corner between them.
    fn section(&self, pieces: &[Piece]) -> Vec<Piece> {
        if pieces.len() < 2 {
            return pieces.to_vec();
        }
        let section = &Section::new(pieces);
        let fewer = convert::beziers(&section, self.tolerance);
        if fewer.len() >= pieces.len() {
            return pieces.to_vec();
        }
        let is_near = |fewer: &[Piece]| {
            self.is_near(pieces, LOOKS, fewer, CHORDS) && self.is_near(fewer, 2 * LOOKS, pieces, CHORDS / 2)
        };
        if is_near(&fewer) {
            // If the last piece is short, the least tolerance with the same number of pieces makes
            // them even.
            let (mut best, mut low, mut high) = (fewer, 0.0, self.tolerance);
            let [last, mean] =
                [polygon(&best[best.len() - 1]), best.iter().map(polygon).sum::<f64>() / best.len() as f64];
            for _ in 0..if last < SHORT * mean { BALANCINGS } else { 0 } {
                let middle = 0.5 * (low + high);
                let even = convert::beziers(&section, middle);
                if even.len() > best.len() {
                    low = middle;
                } else {
                    high = middle;
                    best = if is_near(&even) { even } else { best };
                }
            }
            return best;
        }
        // A detail between the compared points was missed. Each half is compared at as many points.
        let (first, second) = pieces.split_at(pieces.len() / 2);
        [self.section(first), self.section(second)].concat()
    }

    /// Whether `looks` points of each piece are within the tolerance of other pieces.
    fn is_near(&self, pieces: &[Piece], looks: usize, others: &[Piece], chords: usize) -> bool {
        let ends = others.iter().flat_map(|piece| (0..chords).map(move |k| point(piece, k as f64 / chords as f64)));
        let ends: Vec<DVec3> = ends.chain([others[others.len() - 1][3]]).collect();
        let mut last = 0;
        pieces.iter().flat_map(|piece| (0..looks).map(move |k| point(piece, k as f64 / looks as f64))).all(|place| {
            let window = last.max(WINDOW) - WINDOW..(last + WINDOW).min(ends.len());
            let nearest = window.min_by(|&a, &b| {
                let [a, b] = [a, b].map(|k| place.distance_squared(ends[k]));
                a.total_cmp(&b)
            });
            last = nearest.expect("there is a place");
            // At a joint both pieces are tried.
            let (k, v) = (last / chords, (last % chords) as f64 / chords as f64);
            let on = others.get(k).map(|piece| near(piece, place, v));
            let before = (v == 0.0 && k > 0).then(|| near(&others[k - 1], place, 1.0));
            on.into_iter().chain(before).any(|near| near.distance(place) <= SLACK * self.tolerance)
        })
    }
}

/// The pieces of a chain, or why it cannot be simplified.
fn pieces(chains: &CurveBatch, i: usize) -> std::result::Result<Vec<Piece>, Unfitted> {
    if let Some(problem) = chains.problem(i) {
        return Err(problem.clone());
    }
    let (count, spans) = (chains.count(i), chains.spans(i));
    let points: Vec<DVec3> = chains.points(i).chunks_exact(chains.dimension()).map(vector).collect();
    let unfitted = |status, what: &str| Unfitted { status, message: chains.sentence(i, count.saturating_sub(1), what) };
    match spans {
        _ if count < 2 => Err(unfitted(CurveStatus::Degenerate, "it is a single point: there is nothing to simplify")),
        spans if !spans.is_multiple_of(3) => {
            let more = if chains.is_closed(i) { "" } else { " and one more" };
            let what = format!("{count} control points are no cubics: give three a piece{more}");
            Err(unfitted(CurveStatus::Invalid, &what))
        }
        spans => Ok((0..spans / 3).map(|k| std::array::from_fn(|j| points[(3 * k + j) % count])).collect()),
    }
}

/// The control points of a chain, without the repeated first one of a closed chain.
fn control_points(pieces: &[Piece], closed: bool, dimension: usize) -> Vec<f64> {
    let mut coords = Vec::with_capacity((3 * pieces.len() + 1) * dimension);
    if !closed {
        coords.extend_from_slice(&pieces[0][0].to_array()[..dimension]);
    }
    for piece in pieces {
        for point in if closed { &piece[..3] } else { &piece[1..] } {
            coords.extend_from_slice(&point.to_array()[..dimension]);
        }
    }
    coords
}

/// ∫|X″|² of a cubic on (0, 1).
fn bending(&[a, b, c, d]: &Piece) -> f64 {
    let (start, end) = (a - 2.0 * b + c, b - 2.0 * c + d);
    12.0 * (start.length_squared() + start.dot(end) + end.length_squared())
}

fn point(&[a, b, c, d]: &Piece, v: f64) -> DVec3 {
    let w = 1.0 - v;
    a * (w * w * w) + b * (3.0 * w * w * v) + c * (3.0 * w * v * v) + d * (v * v * v)
}

fn derivative(&[a, b, c, d]: &Piece, v: f64) -> DVec3 {
    let w = 1.0 - v;
    3.0 * ((b - a) * (w * w) + (c - b) * (2.0 * w * v) + (d - c) * (v * v))
}

/// The point of a piece nearest to `place`, by Newton steps from the parameter `v`.
fn near(piece: &Piece, place: DVec3, mut v: f64) -> DVec3 {
    let mut best = point(piece, v);
    for _ in 0..NEWTON_STEPS {
        let first = derivative(piece, v);
        v = (v + (place - point(piece, v)).dot(first) / first.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let here = point(piece, v);
        if here.distance_squared(place) < best.distance_squared(place) {
            best = here;
        }
    }
    best
}

/// The length of the control polygon.
fn polygon(&[a, b, c, d]: &Piece) -> f64 {
    a.distance(b) + b.distance(c) + c.distance(d)
}

/// Whether a piece is a line.
fn is_straight(&[a, b, c, d]: &Piece) -> bool {
    let chord = d - a;
    let off = |handle: DVec3| (handle - a).cross(chord).length();
    off(b).max(off(c)) <= STRAIGHT * chord.length_squared()
}

/// Control points from the start of a piece.
fn forwards(piece: &Piece) -> impl Iterator<Item = DVec3> + Clone {
    piece.iter().copied()
}

/// Control points from the end of a piece.
fn backwards(piece: &Piece) -> impl Iterator<Item = DVec3> + Clone {
    piece.iter().rev().copied()
}

/// Consecutive pieces as a curve of one span.
struct Section<'a> {
    pieces: &'a [Piece],
    /// The parameter where each piece ends, in proportion to the lengths of the control polygons.
    ends: Vec<f64>,
}

impl<'a> Section<'a> {
    fn new(pieces: &'a [Piece]) -> Self {
        let mut sum = 0.0;
        let mut ends: Vec<f64> = Vec::with_capacity(pieces.len());
        for piece in pieces {
            sum += polygon(piece);
            ends.push(sum);
        }
        for end in &mut ends {
            *end /= sum;
        }
        Section { pieces, ends }
    }
}

impl Curve for Section<'_> {
    fn dimension(&self) -> usize {
        3
    }

    fn is_closed(&self) -> bool {
        false
    }

    fn knots(&self) -> &[f64] {
        &[0.0, 1.0]
    }

    fn jet(&self, _: usize, u: f64) -> Jet {
        let k = self.ends.partition_point(|&end| end < u).min(self.pieces.len() - 1);
        let from = if k == 0 { 0.0 } else { self.ends[k - 1] };
        let (piece, width) = (&self.pieces[k], self.ends[k] - from);
        let v = if u == 1.0 { 1.0 } else { ((u - from) / width).clamp(0.0, 1.0) };
        let mut first = derivative(piece, v);
        if v == 0.0 || v == 1.0 {
            // A handle of length 0 takes its direction from the next point, and the speed of the
            // chord.
            let chord = piece[0].distance(piece[3]);
            if first.length() <= VANISHING * chord {
                first = if v == 0.0 { leaving(forwards(piece)) } else { -leaving(backwards(piece)) } * chord;
            }
        }
        Jet { point: point(piece, v), first: first / width, ..Jet::default() }
    }
}
