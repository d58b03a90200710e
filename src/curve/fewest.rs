//! [`Fewest`]: as few cubics as possible near a chain of cubics.
//!
//! Between corners the chain is fitted again with the longest pieces that the tolerance allows.
//! Each has the old curve's points and tangents at its ends, and the handles of least distance from
//! it (see [`Curve::beziers`]). Corners and straight pieces are kept.

use glam::DVec3;

use super::handles::{VANISHING, leaving, turn};
use super::measure::AnyCurve;
use super::{Curve, Jet, convert};

/// A cubic's control points.
type Piece = [DVec3; 4];

/// Approximates chains of cubics by chains of fewer cubics.
pub(crate) struct Fewest {
    /// The largest distance from any point of either chain to the other.
    pub tolerance: f64,
    /// Joints where the direction turns by more than this (radians) are corners.
    pub corners: f64,
    /// Whether joints lie where x or y is extreme.
    pub extremes: bool,
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

/// The turn of a corner of [`fewest`], one degree.
const CORNERS: f64 = std::f64::consts::PI / 180.0;

/// Extremes nearer to the ends of a piece are its ends.
const EXTREME: f64 = 1e-6;

/// The part of a tolerance that the first chain of [`fewest`] may take.
const FIRST: f64 = 0.1;

/// As few cubics as are within a tolerance of a curve, with joints at its extremes if so asked. Straight
/// ones have constant speed. A curve that was not fitted has one per edge.
pub(crate) fn fewest(curve: &dyn AnyCurve, tolerance: f64, extremes: bool) -> Vec<Piece> {
    let first = convert::beziers(curve, FIRST * tolerance);
    if !curve.is_fitted() {
        return first;
    }
    let fewest = Fewest { tolerance: (1.0 - FIRST) * tolerance, corners: CORNERS, extremes };
    fewest.chain(first, curve.is_closed()).into_iter().map(evened).collect()
}

/// A piece that has constant speed if it is a line.
fn evened(piece: Piece) -> Piece {
    let [a, b, c, d] = piece;
    let chord = d - a;
    let is_between = |handle: DVec3| (0.0..=chord.length_squared()).contains(&(handle - a).dot(chord));
    if !(is_straight(&piece) && is_between(b) && is_between(c)) {
        return piece;
    }
    [a, a + chord * (1.0 / 3.0), a + chord * (2.0 / 3.0), d]
}

/// Pieces that are divided where x or y is extreme, and the joints there.
fn at_extremes(pieces: &[Piece]) -> (Vec<Piece>, Vec<usize>) {
    let (mut all, mut joints) = (Vec::with_capacity(pieces.len()), vec![]);
    for (k, piece) in pieces.iter().enumerate() {
        let before = pieces[(k + pieces.len() - 1) % pieces.len()];
        let [from, to] = [before[3] - before[2], piece[1] - piece[0]];
        if from.x * to.x <= 0.0 || from.y * to.y <= 0.0 {
            joints.push(all.len());
        }
        let mut places: Vec<(f64, usize)> =
            (0..2).flat_map(|axis| turns(piece, axis).into_iter().map(move |v| (v, axis))).collect();
        places.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut left, mut from) = (*piece, 0.0);
        for (v, axis) in places.into_iter().filter(|(v, _)| (EXTREME..1.0 - EXTREME).contains(v)) {
            let [mut first, mut rest] = divided(&left, (v - from) / (1.0 - from));
            // Handles at an extreme are level, to the last bit.
            (first[2][axis], rest[1][axis]) = (first[3][axis], first[3][axis]);
            all.push(first);
            joints.push(all.len());
            (left, from) = (rest, v);
        }
        all.push(left);
    }
    (all, joints)
}

/// The parameters at which a coordinate of a piece is extreme.
fn turns(&[p, q, r, s]: &Piece, axis: usize) -> Vec<f64> {
    let [a, b, c] = [q - p, r - q, s - r].map(|side| side[axis]);
    let (square, linear) = (a - 2.0 * b + c, b - a);
    let root = (linear * linear - a * square).sqrt();
    // The roots of a + 2 linear v + square v², without cancellation.
    let sum = -(linear + root.copysign(linear));
    [sum / square, a / sum].into_iter().filter(|v| v.is_finite()).collect()
}

/// The two parts of a piece, by de Casteljau.
fn divided(&[p, q, r, s]: &Piece, v: f64) -> [Piece; 2] {
    let (a, b, c) = (p.lerp(q, v), q.lerp(r, v), r.lerp(s, v));
    let (d, e) = (a.lerp(b, v), b.lerp(c, v));
    let middle = d.lerp(e, v);
    [[p, a, d, middle], [middle, e, c, s]]
}

impl Fewest {
    /// A simpler chain.
    pub fn chain(&self, whole: Vec<Piece>, closed: bool) -> Vec<Piece> {
        let mut pieces = whole.clone();
        // Pieces of one point have no direction.
        pieces.retain(|piece| piece.iter().any(|point| *point != piece[0]));
        if pieces.is_empty() {
            return whole;
        }
        let extreme: Vec<usize>;
        (pieces, extreme) = if self.extremes { at_extremes(&pieces) } else { (pieces, vec![]) };
        let n = pieces.len();
        let mut stays = self.staying(&pieces, closed);
        stays.extend(extreme.into_iter().filter(|joint| (usize::from(!closed)..n).contains(joint)));
        stays.sort_unstable();
        stays.dedup();
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
