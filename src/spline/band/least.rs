//! [`Least`]: the curve of least bending within the discs of its knots, and of a given area.

use super::Corners;
use super::area::{Section, mean_width};
use super::corners::{between_runs, corners, sharper};
use super::curves::BandCurve;
use super::runs::{from_ends, inside, radius};
use crate::bounds::Bounds;
use crate::linalg::scalar::{Vector, add, dot, scale, subtract};
use crate::spline::knots::Knots;
use crate::spline::reinsch::Reinsch;

/// The length, in units of D, over which a knot's deviation weighs as much as bending. Of 1, 2, 3
/// and 4 it takes the fewest iterations from smooth curves to noise.
const REACH: f64 = 2.0;

/// The radii of the discs onto which values are projected, over the radii that are kept: first, and
/// where the curve does not settle within the band.
const SLACKS: [f64; 2] = [0.95, 0.85];

/// The distance that a knot of the curve may have from its disc's centre, over the disc's radius.
const ROOM: f64 = 1.05;

/// The part of a new value in over-relaxation.
const RELAXATION: f64 = 1.6;

/// See [`widest`]. Of 144 random islands all keep their area with 0.1, and 143 with 0.3.
const CLOSED: f64 = 0.3;

/// The distance in units of D that a corner may be from its vertex, as far as noise moves one.
const CORNER: f64 = 0.5;

/// Iterations at most, and at least.
const ITERATIONS: u32 = 300;
const FEWEST: u32 = 12;

/// An iteration that moves no projected value by more than this part of D ends the search, if the
/// curve is within the band.
const SETTLED: f64 = 0.01;

/// The curve found.
pub(super) struct Found {
    pub curve: BandCurve,
    /// ∫|p″|² in units of the input.
    pub energy: f64,
    /// The largest distance of p from q.
    pub farthest: f64,
    /// The part by which the area of a closed curve differs, if that is too much.
    pub excess: Option<f64>,
    pub iterations: u32,
}

/// One curve in units of D, and the buffers that a thread reuses.
#[derive(Default)]
pub(super) struct Least {
    problem: Reinsch<f64>,
    /// The polygon at the knots.
    polygon: Vec<f64>,
    /// The distance that each knot may be from it. 0 if it is pinned.
    radii: Vec<f64>,
    /// The projected values, and the sums of what projections took away from them.
    projected: Vec<f64>,
    dual: Vec<f64>,
    /// The curve at the knots.
    values: Vec<f64>,
    /// Those whose area is kept, and what their pressure moves each value by.
    sections: Vec<Section>,
    push: Vec<f64>,
    /// The knot of every entry of [`Knots`].
    rows: Vec<u32>,
    distance: f64,
    centre: [f64; 3],
}

impl Least {
    /// Sets up curve `i` with its pinned entries, in increasing order. `distances` are those that is kept
    /// and that corners are found at.
    pub fn load(&mut self, knots: &Knots, i: usize, distances: [f64; 2], pinned: &[usize], kept: Corners) {
        match knots.dimension {
            2 => self.load_in::<2>(knots, i, distances, pinned, kept),
            _ => self.load_in::<3>(knots, i, distances, pinned, kept),
        }
    }

    fn load_in<const D: usize>(
        &mut self,
        knots: &Knots,
        i: usize,
        [distance, scale_of_corners]: [f64; 2],
        pinned: &[usize],
        kept: Corners,
    ) {
        let (closed, values) = (knots.closed[i], knots.values(i));
        (self.distance, self.centre) = (distance, Bounds::<3>::of_flat(values, D).middle());
        let centre = self.centre;
        let place = |point: &Vector<f64, D>| std::array::from_fn(|c| (point[c] - centre[c]) / distance);
        let points: Vec<Vector<f64, D>> = values.as_chunks::<D>().0.iter().map(place).collect();
        let t: Vec<f64> = knots.t(i).iter().map(|t| t / distance).collect();
        let ends = from_ends(&points, &t);
        let kept = match kept {
            Corners::Rounded => vec![],
            Corners::Auto => {
                let unit = distance / scale_of_corners;
                let points: Vec<Vector<f64, D>> = points.iter().map(|point| scale(unit, *point)).collect();
                corners(&points, closed)
            }
            Corners::Straight => between_runs(&points, &t, closed),
            Corners::Above(angle) => sharper(&points, closed, angle),
        };
        let (mut polygon, mut radii, mut spans) = (Vec::new(), Vec::new(), Vec::new());
        self.rows.clear();
        for (k, point) in points.iter().enumerate() {
            self.rows.push(polygon.len() as u32);
            if closed && k + 1 == points.len() {
                break;
            }
            polygon.push(*point);
            radii.push(if pinned.binary_search(&k).is_ok() { 0.0 } else { radius(ends[k][0].max(ends[k][1])) });
            let Some(next) = points.get(k + 1) else { break };
            let (length, own) = (t[k + 1] - t[k], [ends[k][1], ends[k + 1][0]]);
            let mut before = 0.0;
            for at in inside(length, own) {
                polygon.push(add(*point, scale(at / length, subtract(*next, *point))));
                radii.push(radius((own[0] + at).min(own[1] + length - at)));
                spans.push(at - before);
                before = at;
            }
            spans.push(length - before);
        }
        self.polygon = polygon.into_flattened();
        self.radii = radii;
        let n = self.radii.len();
        let share = |k: usize| {
            let before = if k == 0 && !closed { 0.0 } else { spans[(k + n - 1) % n] };
            0.5 * (before + spans.get(k).copied().unwrap_or(0.0))
        };
        let inner = if closed { 0..n } else { 1..n - 1 };
        let corners = kept.into_iter().map(|k| self.rows[k] as usize);
        self.problem.corners = corners.filter(|row| inner.contains(row)).collect();
        for &row in &self.problem.corners {
            self.radii[row] = self.radii[row].min(CORNER);
        }
        // λ is 1. The smaller a disc is, the more its deviation weighs.
        let weigh = |k: usize| REACH.powi(4) * self.radii[k] / share(k);
        let problem = &mut self.problem;
        problem.inverse_weights = (0..n).map(weigh).collect();
        (problem.count, problem.dimension, problem.closed, problem.spans) = (n, D, closed, spans);
    }

    /// The curve. `None` where numbers overflow.
    pub fn find(&mut self, keep_area: bool) -> Option<Found> {
        self.problem.data.clone_from(&self.polygon);
        self.problem.prepare();
        self.problem.solve(1.0);
        self.sections.clear();
        if keep_area && self.problem.dimension == 2 {
            let pinned: Vec<usize> = (0..self.radii.len()).filter(|&k| self.radii[k] == 0.0).collect();
            self.sections = Section::all(&self.problem, &self.polygon, &pinned);
        }
        let mut iterations = 0;
        for (slack, keep_area) in [(SLACKS[0], true), (SLACKS[1], true), (SLACKS[1], false)] {
            let (own, is_kept) = self.descend(slack, keep_area);
            iterations += own;
            // Without pressure only what has left the band is tried again.
            if is_kept || slack == SLACKS[1] && self.farthest() <= 1.0 {
                break;
            }
        }
        self.scale_to_area();
        self.found(iterations)
    }

    /// The section of a closed curve without pinned knots.
    fn whole(&self) -> Option<Section> {
        let is_free = self.problem.closed && self.radii.iter().all(|radius| *radius > 0.0);
        self.sections.first().copied().filter(|_| is_free)
    }

    /// Scales a closed curve to its area, if it has another and stays within the band.
    fn scale_to_area(&mut self) {
        let Some(section) = self.whole().filter(|section| section.excess().is_some()) else { return };
        let before = self.values.clone();
        section.scale(&mut self.values);
        if self.interpolate() && self.farthest() <= 1.0 {
            self.sections[0].measure(&self.problem, &self.values);
        } else {
            self.values = before;
        }
    }

    /// The spline through the values.
    fn interpolate(&mut self) -> bool {
        self.problem.data.clone_from(&self.values);
        self.problem.prepare();
        self.problem.solve(0.0)
    }

    /// Iterates from the polygon, with or without pressure on the areas. Returns the number of
    /// iterations, and whether the curve is within the band and keeps the areas that it has to.
    fn descend(&mut self, slack: f64, keep_area: bool) -> (u32, bool) {
        self.projected.clone_from(&self.polygon);
        self.values.clone_from(&self.polygon);
        for buffer in [&mut self.dual, &mut self.push] {
            buffer.clear();
            buffer.resize(self.polygon.len(), 0.0);
        }
        self.sections.iter_mut().for_each(Section::restart);
        for iteration in 1..=ITERATIONS {
            for section in self.sections.iter_mut().filter(|_| keep_area) {
                section.push(&self.problem, &self.values, &mut self.push);
            }
            let moved = self.iterate(slack);
            let (problem, values) = (&self.problem, &self.values);
            let mut kept = true;
            for section in &mut self.sections {
                kept &= section.measure(problem, values);
            }
            let is_settled = iteration >= FEWEST && moved <= SETTLED && (!keep_area || kept);
            if is_settled && self.is_within() {
                return (iteration, true);
            }
            if moved.is_nan() {
                break;
            }
        }
        (ITERATIONS, false)
    }

    /// The curve through the values found. `None` if they are not finite.
    fn found(&mut self, iterations: u32) -> Option<Found> {
        let (d, n, closed) = (self.problem.dimension, self.problem.count, self.problem.closed);
        if !self.interpolate() || self.values.iter().chain(&self.problem.moments).any(|x| !x.is_finite()) {
            return None;
        }
        let Least { distance, centre, .. } = *self;
        let again = usize::from(closed);
        let mut t = vec![0.0];
        t.extend(self.problem.spans.iter().scan(0.0, |at, span| {
            *at += span * distance;
            Some(*at)
        }));
        let value = |at: usize| centre[at % d] + distance * self.values[at];
        let wrapped = |at: usize| if at < n * d { at } else { at - n * d };
        Some(Found {
            energy: self.problem.energy() / distance,
            farthest: self.farthest() * distance,
            excess: self.whole().and_then(|section| section.excess()),
            iterations,
            curve: BandCurve {
                dimension: d,
                closed,
                t,
                values: (0..(n + again) * d).map(|at| value(wrapped(at))).collect(),
                second: (0..(n + again) * d).map(|at| self.problem.moments[wrapped(at)] / distance).collect(),
                rows: self.rows.clone(),
                knots: vec![],
            },
        })
    }

    /// One iteration. Returns the largest move of a projected value.
    fn iterate(&mut self, slack: f64) -> f64 {
        let d = self.problem.dimension;
        for (at, data) in self.problem.data.iter_mut().enumerate() {
            *data = self.projected[at] - self.dual[at] + self.push[at];
        }
        self.problem.solve_again();
        let mut largest = 0.0_f64;
        for (k, &radius) in self.radii.iter().enumerate() {
            let mut away = [0.0; 3];
            for (c, away) in away.iter_mut().enumerate().take(d) {
                let at = k * d + c;
                self.values[at] = self.problem.data[at] - self.problem.correction[at];
                let relaxed = RELAXATION * self.values[at] + (1.0 - RELAXATION) * self.projected[at];
                *away = relaxed + self.dual[at] - self.polygon[at];
            }
            let length = dot(away, away).sqrt();
            let factor = if length > slack * radius { slack * radius / length } else { 1.0 };
            let mut square = 0.0;
            for (c, away) in away.iter().enumerate().take(d) {
                let at = k * d + c;
                let to = self.polygon[at] + factor * away;
                square += (to - self.projected[at]).powi(2);
                self.dual[at] = (1.0 - factor) * away;
                self.projected[at] = to;
            }
            largest = largest.max(square.sqrt());
        }
        largest
    }

    /// The largest distance of the curve from the polygon at one arc length, by the Bézier control
    /// points of their difference.
    fn farthest(&self) -> f64 {
        let (d, n) = (self.problem.dimension, self.problem.count);
        let mut farthest = 0.0_f64;
        for (k, h) in self.problem.spans.iter().enumerate() {
            let next = if k + 1 == n { 0 } else { k + 1 };
            let mut points = [[0.0; 3]; 4];
            for c in 0..d {
                let ends = [k, next].map(|k| k * d + c);
                let [p, s] = ends.map(|at| self.values[at] - self.polygon[at]);
                let [m, o] = ends.map(|at| h * h * self.problem.alpha * self.problem.moments[at]);
                let [from, to] = [s - p - (2.0 * m + o) / 6.0, s - p + (m + 2.0 * o) / 6.0];
                let own = [p, p + from / 3.0, s - to / 3.0, s];
                points.iter_mut().zip(own).for_each(|(point, x)| point[c] = x);
            }
            farthest = points.iter().fold(farthest, |so_far, e| so_far.max(dot(*e, *e)));
        }
        farthest.sqrt()
    }

    /// Whether the curve is within the band, and its knots within their discs.
    fn is_within(&self) -> bool {
        let d = self.problem.dimension;
        let away =
            |k: usize| (0..d).map(|c| (self.values[k * d + c] - self.polygon[k * d + c]).powi(2)).sum::<f64>().sqrt();
        (0..self.radii.len()).all(|k| away(k) <= ROOM * self.radii[k]) && self.farthest() <= 1.0
    }
}

/// The largest D with which a closed polygon keeps its shape: [`CLOSED`] of its mean width, 2 A/ℓ,
/// or of half its size if it is spatial.
pub(super) fn widest(points: &[f64], dimension: usize) -> f64 {
    CLOSED
        * match dimension {
            2 => mean_width(points.as_chunks().0),
            _ => 0.5 * Bounds::<3>::of_flat(points, 3).diagonal(),
        }
}
