//! The descent: conjugate gradients as published, then damped Newton steps.
//!
//! Both work in the metric of the current curve.
//!
//! 1. *As published.* s_k solves DᵀD s = g, where the rows and columns of data points are zeroed
//!    but for their diagonal. The direction is p_k = s_k + β p_{k−1}, with β = s_k·(s_k − s_{k−1})
//!    / s_{k−1}·s_{k−1} (Polak and Ribière, with Euclidean products of Sobolev gradients). At every
//!    fourth iteration p_k = s_k, so that three conjugate directions follow each start. The line
//!    search brackets by doubling from 10⁻⁵. The printed results end where φ falls by less than
//!    10⁻³ (1 + φ). This descent goes on with 2 where φ falls by less than 10⁻³ φ, which does not
//!    depend on the units.
//! 2. *Beyond.* From there p solves (∇²φ + λ H DᵀD) p = −g, with λ by Levenberg and Marquardt. λ →
//!    ∞ is the descent above with small steps, and λ → 0 is Newton's method.

use faircurve::CurveStatus;

use super::energy::{Differences, solve_free};
use super::mesh::Placed;
use super::search;
use super::{Graph, GraphTrace};

/// The least fall of φ in an iteration, as a fraction of 1 + φ (as published) or of φ.
///
/// An iteration with a smaller fall is the last of its kind.
const LEAST_FALL: f64 = 1e-3;

/// The number of iterations after which a direction is the Sobolev gradient itself again.
const RESTART: usize = 4;

/// A graph this many times longer than its data's polygon has run away.
const RUNAWAY: f64 = 10.0;

/// The largest turn of a graph at a mesh point, in radians, that resolves its curve.
///
/// About 60 segments a circle are fine.
const RESOLVED_TURN: f64 = 0.2;

/// λ at first, the least λ after a matrix was not positive definite, and the range of λ.
const DAMPING: f64 = 0.01;
const DAMPING_FOR_INDEFINITE: f64 = 1e-6;
const DAMPING_RANGE: [f64; 2] = [1e-15, 1e12];

/// The kind of an iteration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum GraphMove {
    /// A line search along a conjugate direction, as published.
    Conjugate,
    /// A damped Newton step.
    Newton,
}

/// One iteration of a descent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GraphIteration {
    /// Its kind.
    pub kind: GraphMove,
    /// φ after it.
    pub phi: f64,
    /// The step that the line search chose along the direction.
    ///
    /// 1 for Newton steps.
    pub step: f64,
    /// √⟨g, L⁻¹g⟩ before it.
    pub gradient_norm: f64,
}

/// A graph on its way.
struct Descent<'a> {
    options: &'a Graph,
    mesh: Placed,
    y: Vec<f64>,
    here: Differences,
    phi: f64,
    gradient: Vec<f64>,
    /// The gradient in the metric of DᵀD.
    sobolev: Vec<f64>,
    gradient_norm: f64,
    /// The length of the polygon of the data.
    polygon: f64,
    iterations: Vec<GraphIteration>,
}

/// Descends from the given ordinates.
///
/// `None` where numbers leave their range.
pub(super) fn run(options: &Graph, mesh: Placed, y: Vec<f64>, mut observe: impl FnMut(&[f64])) -> Option<GraphTrace> {
    let at = |k: usize| (k as f64 * mesh.width, y[k]);
    let chord = |pair: &[usize]| (at(pair[1]).0 - at(pair[0]).0).hypot(at(pair[1]).1 - at(pair[0]).1);
    let polygon = mesh.data.windows(2).map(chord).sum();
    let here = Differences::of(&y, mesh.width);
    let mut descent = Descent {
        options,
        phi: here.energy(mesh.width),
        mesh,
        y,
        here,
        gradient: Vec::new(),
        sobolev: Vec::new(),
        gradient_norm: f64::NAN,
        polygon,
        iterations: Vec::new(),
    };
    let initial_phi = descent.phi;
    observe(&descent.y);
    descent.measure();
    let ended = match descent.conjugate(&mut observe) {
        Some(ended) => ended,
        None => descent.newton(&mut observe),
    };
    if matches!(ended, Ended::OutOfRange) {
        return None;
    }
    let (status, message) = descent.status(ended);
    Some(GraphTrace {
        start: descent.mesh.start,
        width: descent.mesh.width,
        data: descent.mesh.data,
        initial_phi,
        iterations: descent.iterations,
        ordinates: descent.y,
        phi: descent.phi,
        gradient_norm: descent.gradient_norm,
        status,
        message,
    })
}

/// The reason why a descent ended.
enum Ended {
    Converged,
    RanAway,
    PublishedRule,
    MaxIterations,
    /// No step lowers φ any more.
    Stalled,
    /// Numbers left their range.
    OutOfRange,
}

impl Descent<'_> {
    /// Computes the gradients at the current curve.
    ///
    /// The norm is NaN where numbers left their range.
    fn measure(&mut self) {
        let (width, data) = (self.mesh.width, &self.mesh.data);
        self.gradient = self.here.gradient(width, data);
        self.gradient_norm = f64::NAN;
        if let Some(sobolev) = solve_free(self.here.metric(width), data, self.gradient.clone()) {
            self.gradient_norm = (dot(&self.gradient, &sobolev).max(0.0) / width).sqrt();
            self.sobolev = sobolev;
        }
    }

    fn converged(&self) -> bool {
        // Ordinates are known to ε|y|, and y″ to a few ε|y|/H². The norm of g is at most twice that
        // of such a y″.
        let size = self.y.iter().fold(0.0f64, |most, y| most.max(y.abs()));
        let noise = 8.0 * f64::EPSILON * size / (self.mesh.width * self.mesh.width);
        let length = self.mesh.width * self.y.len() as f64;
        self.phi.is_finite()
            && self.gradient_norm <= (self.options.tolerance * self.phi.sqrt()).max(noise * length.sqrt())
    }

    fn length(&self) -> f64 {
        self.y.windows(2).map(|y| self.mesh.width.hypot(y[1] - y[0])).sum()
    }

    /// The largest angle between neighbouring segments.
    fn sharpest_turn(&self) -> f64 {
        let angle = |y: &[f64]| (y[1] - y[0]).atan2(self.mesh.width);
        self.y.windows(3).map(|y| (angle(&y[1..]) - angle(y)).abs()).fold(0.0, f64::max)
    }

    /// Whether the descent is over before its next iteration.
    fn over(&self) -> Option<Ended> {
        if self.converged() {
            Some(Ended::Converged)
        } else if self.length() > RUNAWAY * self.polygon {
            Some(Ended::RanAway)
        } else if !(self.phi.is_finite() && self.gradient_norm.is_finite()) {
            Some(Ended::OutOfRange)
        } else if self.iterations.len() >= self.options.max_iterations as usize {
            Some(Ended::MaxIterations)
        } else {
            None
        }
    }

    /// Replaces the curve by the next one.
    fn move_to(&mut self, y: Vec<f64>, kind: GraphMove, step: f64, observe: &mut impl FnMut(&[f64])) {
        self.here = Differences::of(&y, self.mesh.width);
        self.y = y;
        self.phi = self.here.energy(self.mesh.width);
        self.iterations.push(GraphIteration { kind, phi: self.phi, step, gradient_norm: self.gradient_norm });
        observe(&self.y);
        self.measure();
    }

    /// Runs the published descent until its rule is met.
    ///
    /// `None` when Newton's method is to go on.
    fn conjugate(&mut self, observe: &mut impl FnMut(&[f64])) -> Option<Ended> {
        let width = self.mesh.width;
        let (mut direction, mut before) = (Vec::new(), Vec::new());
        loop {
            if let Some(ended) = self.over() {
                return Some(ended);
            }
            if !self.iterations.len().is_multiple_of(RESTART) {
                let beta = (dot(&self.sobolev, &self.sobolev) - dot(&self.sobolev, &before)) / dot(&before, &before);
                direction.iter_mut().zip(&self.sobolev).for_each(|(p, s)| *p = s + beta * *p);
            }
            let downhill = !direction.is_empty() && dot(&self.gradient, &direction) > 0.0;
            if self.iterations.len().is_multiple_of(RESTART) || !downhill {
                direction.clone_from(&self.sobolev);
            }
            let along = Differences::of(&direction, width);
            let energy = |step: f64| self.here.energy_along(&along, step, width);
            let Some((step, _)) = search::minimise(energy, self.phi) else {
                return self.options.published.then_some(Ended::Stalled);
            };
            let y = self.y.iter().zip(&direction).map(|(y, p)| y - step * p).collect();
            let phi = self.phi;
            before.clone_from(&self.sobolev);
            self.move_to(y, GraphMove::Conjugate, step, observe);
            let published = self.options.published;
            if phi - self.phi < LEAST_FALL * (self.phi + f64::from(published)) {
                let ended = self.over().unwrap_or(Ended::PublishedRule);
                return published.then_some(ended);
            }
        }
    }

    /// Runs damped Newton steps to the end.
    fn newton(&mut self, observe: &mut impl FnMut(&[f64])) -> Ended {
        let width = self.mesh.width;
        let mut damping = DAMPING;
        loop {
            if let Some(ended) = self.over() {
                return ended;
            }
            let (hessian, metric) = (self.here.hessian(width), self.here.metric(width));
            let downhill: Vec<f64> = self.gradient.iter().map(|g| -g).collect();
            let y = loop {
                if damping > DAMPING_RANGE[1] {
                    return Ended::Stalled;
                }
                let matrix = hessian.clone().plus(damping * width, &metric);
                let Some(p) = solve_free(matrix, &self.mesh.data, downhill.clone()) else {
                    damping = (4.0 * damping).max(DAMPING_FOR_INDEFINITE);
                    continue;
                };
                // The fall that the quadratic model promises, from (∇²φ + λL) p = −g.
                let square = width * self.here.metric_of(width, &p);
                let promised = 0.5 * (dot(&downhill, &p) + damping * square);
                let y: Vec<f64> = self.y.iter().zip(&p).map(|(y, p)| y + p).collect();
                let phi = Differences::of(&y, width).energy(width);
                // Below this a fall of φ is rounding, and only the gradient tells whether a step is
                // good.
                let resolved = promised > 1e-13 * self.phi;
                let kept = if resolved { (self.phi - phi) / promised } else { f64::from(phi.is_finite()) };
                if kept > 1e-4 {
                    if kept > 0.75 {
                        damping = (damping / 5.0).max(DAMPING_RANGE[0]);
                    } else if kept < 0.25 {
                        damping *= 2.0;
                    }
                    break y;
                }
                damping *= 4.0;
            };
            self.move_to(y, GraphMove::Newton, 1.0, observe);
        }
    }

    fn status(&self, ended: Ended) -> (CurveStatus, Option<String>) {
        let (norm, wanted) = (self.gradient_norm, self.options.tolerance * self.phi.sqrt());
        let iterations = self.iterations.len();
        let not_converged = |what: String| (CurveStatus::NotConverged, Some(what));
        match ended {
            Ended::Converged => {
                let turn = self.sharpest_turn();
                let what = || {
                    format!(
                        "the graph turns by {turn:.2} rad at one mesh point: this is a minimum for the mesh, of which steep data have \
                         several; a curve that is no graph is fairer here"
                    )
                };
                (CurveStatus::Converged, (turn > RESOLVED_TURN).then(what))
            }
            Ended::RanAway => {
                let times = self.length() / self.polygon;
                let what = format!(
                    "the graph has grown {times:.3} times as long as its data's polygon (the limit is {RUNAWAY}) while its energy \
                     fell to {:.6e}: there is no least one; add points, or choose a method with a length energy",
                    self.phi
                );
                (CurveStatus::Unbounded, Some(what))
            }
            Ended::PublishedRule => not_converged(format!(
                "stopped by the published rule after {iterations} iterations, with a gradient of {norm:.2e} where {wanted:.2e} was \
                 asked for: leave the rule out to go on"
            )),
            Ended::MaxIterations => not_converged(format!(
                "the gradient is {norm:.2e} after {iterations} iterations, and {wanted:.2e} was asked for: allow more iterations, \
                 or a larger tolerance"
            )),
            Ended::Stalled | Ended::OutOfRange => not_converged(format!(
                "no step lowers the energy below {:.6e}, with a gradient of {norm:.2e} where {wanted:.2e} was asked for: allow a \
                 larger tolerance, or take a wider mesh",
                self.phi
            )),
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::super::mesh::{Mesh, set_up};
    use super::*;

    #[test]
    fn steep_data_have_a_minimum_for_every_place_where_the_mesh_may_jump() {
        // The fourth data set of TOMS 828. The graph falls by 2.4 within two mesh widths, and
        // climbs by 2.5 within two.
        let t = [0.0, 1.0, 1.5, 2.5, 4.0, 4.5, 5.5, 6.0, 8.0, 10.0];
        let y = [10.0, 8.0, 5.0, 4.0, 3.5, 3.4, 6.0, 7.1, 8.0, 8.5];
        let options = Graph { mesh: Mesh::Width(0.04), ..Graph::default() };
        let found = options.trace(&t, &y, |_| {}).unwrap();
        assert_eq!(found.status, CurveStatus::Converged);
        assert!((found.phi - 0.761_005_655_9).abs() < 1e-9, "{}", found.phi);
        assert!(found.message.as_ref().unwrap().contains("turns by 1.74"), "{:?}", found.message);
        // There are other minima nearby. In one the cliffs have other shapes, known to nine digits
        // from another program. In the other the second cliff is a mesh width to the left.
        for (moved, phi) in [
            (&[(29, 6.752), (30, 6.438), (135, 5.588)][..], 0.758_712_558),
            (&[(134, found.ordinates[135])][..], 0.785_945_634),
        ] {
            let mut start = found.ordinates.clone();
            moved.iter().for_each(|&(k, y)| start[k] = y);
            let (mesh, _) = set_up(options.mesh, &t, &y).unwrap();
            let trace = run(&options, mesh, start, |_| {}).unwrap();
            assert_eq!(trace.status, CurveStatus::Converged);
            assert!((trace.phi - phi).abs() < 5e-9, "{} instead of {phi}", trace.phi);
        }
    }

    #[test]
    fn data_on_a_line_have_nothing_to_descend() {
        for scale in [1e-9, 1.0, 1e9] {
            let t = [0.0, 0.3, 1.1, 2.0].map(|t| t * scale);
            let trace = Graph::default().trace(&t, &t.map(|t| 3.0 * t - scale), |_| {}).unwrap();
            assert_eq!((trace.status, trace.message), (CurveStatus::Converged, None));
            assert!(trace.iterations.len() < 3 && trace.phi * scale < 1e-15, "{scale}: {}", trace.phi);
        }
    }

    #[test]
    fn a_graph_ends_as_it_does_in_other_units() {
        let (t, y) = ([0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 0.8, 0.3, 0.9, 0.2]);
        let trace = |scale: f64| {
            let trace = Graph::default().trace(&t.map(|t| t * scale), &y.map(|y| y * scale), |_| {}).unwrap();
            assert_eq!(trace.status, CurveStatus::Converged, "{:?}", trace.message);
            trace.phi * scale
        };
        let wanted = trace(1.0);
        // φ is flat at its minimum. A gradient of 1e-8 √φ leaves 1e-16 φ.
        for scale in [1e-8, 1e-3, 1e3, 1e8] {
            assert!((trace(scale) / wanted - 1.0).abs() < 1e-12, "{scale}: {} {wanted}", trace(scale));
        }
    }

    #[test]
    fn numbers_that_leave_their_range_are_an_error_not_a_curve() {
        let error = Graph::default().trace(&[0.0, 1e-200, 2e-200], &[0.0, 1e200, 0.0], |_| {}).unwrap_err().to_string();
        assert!(error.contains("its energy leaves the range of the numbers: scale the curve"), "{error}");
    }

    #[test]
    fn endings_short_of_a_minimum_say_what_to_do() {
        let (t, y) = ([0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 0.8, 0.3, 0.9, 0.2]);
        let ends = |options: Graph| {
            let trace = options.trace(&t, &y, |_| {}).unwrap();
            assert_eq!(trace.status, CurveStatus::NotConverged);
            trace.message.unwrap()
        };
        let message = ends(Graph { max_iterations: 2, ..Graph::default() });
        assert!(message.contains("after 2 iterations") && message.contains("allow more iterations"), "{message}");
        let message = ends(Graph { published: true, ..Graph::default() });
        assert!(message.contains("published rule") && message.contains("leave the rule out to go on"), "{message}");
        let short = ends(Graph { max_iterations: 0, ..Graph::default() });
        assert!(short.contains("after 0 iterations"), "{short}");
    }
}
