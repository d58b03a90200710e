//! [`Minimisation`]: one curve and one energy, minimised by any of the methods that the papers
//! compare.

use crate::discrete::descent::Descent;
use crate::discrete::energy::{Energy, Functional, of_spans};
use crate::discrete::lane::Standing;
use crate::discrete::newton::Newton;
use crate::discrete::plan::{Direction, Plan, Step};
use crate::discrete::problem::{Problem, start};
use crate::error::{Error, Result};
use crate::linalg::scalar::{Vector, add, dot, scale, subtract};
use crate::linalg::{Real, Scalar};

/// Minimises an energy over the inner vertices of one open curve, by a method of your choice.
///
/// Both ends are held. It shows every iterate, for experiments, teaching and tests. It follows the
/// formulas alone, without rescaling and without a term that spreads vertices. The CPU works in
/// f64.
///
/// | method | step | measure of the gradient g |
/// |---|---|---|
/// | ordinary gradient | f − αg | √(g·g) |
/// | Sobolev gradient | f − αL⁻¹g, L the inner product of the energy's order: for order 1 (Lh)_i = (h_i − h_{i−1})/Δs_i − (h_{i+1} − h_i)/Δs_{i+1} | √(g·L⁻¹g) |
/// | Newton | f − H⁻¹g, H the exact Hessian | √(g·H⁻¹g) |
///
/// ```
/// use faircurve::discrete::{Direction, Step, length};
/// use faircurve::papers::renka::{Ending, InnerProduct, Minimisation, Minimiser};
///
/// let bent = [[0.0, 0.0], [1.0, 2.0], [2.0, -1.0], [3.0, 0.0]];
/// let method = Minimiser::Gradient {
///     product: InnerProduct::Sobolev,
///     step: Step::Constant(1.0),
///     direction: Direction::Steepest,
/// };
/// let shortest = Minimisation { method, ..Minimisation::new(length()) }.run(&bent, |_| {})?;
/// // Renka's theorem 3.1: one step, and the curve is the segment between its ends.
/// assert_eq!((shortest.ending, shortest.iterations), (Ending::Converged, 1));
/// assert!((shortest.length - 3.0).abs() < 1e-14);
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// Source: Renka, *Geometric Curve Modeling with Sobolev Gradients* (2006), sections 3 and 4.
#[derive(Clone, Debug)]
pub struct Minimisation {
    /// The energy to minimise.
    ///
    /// [`attachment`](crate::discrete::attachment) has no data to attach to here.
    pub energy: Energy,
    /// The method.
    ///
    /// By default it is steepest descent along Sobolev gradients, with a line search.
    pub method: Minimiser,
    /// The measure of the gradient at which the curve has converged, in the units of the method.
    ///
    /// See the table of methods. 10⁻⁸ by default.
    pub tolerance: f64,
    /// The most steps.
    ///
    /// 1,000 by default.
    pub max_iterations: u32,
}

/// A method of minimisation.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Minimiser {
    /// Descent along gradients.
    Gradient {
        /// The inner product in which derivatives become gradients.
        product: InnerProduct,
        /// The length of each step.
        step: Step,
        /// Steepest descent or conjugate gradients.
        direction: Direction,
    },
    /// Newton's method with full steps.
    Newton,
}

/// The inner product of perturbations of a curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum InnerProduct {
    /// The Euclidean product Σ g·h.
    Ordinary,
    /// The Sobolev product of derivatives with respect to arc length, of the energy's order.
    ///
    /// It is frozen at each iterate. For order 1 it is Σ (g_i − g_{i−1})·(h_i − h_{i−1})/Δs_i.
    #[default]
    Sobolev,
}

/// The ending of a minimisation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The measure of the gradient is at most the tolerance.
    Converged,
    /// The energy could not be reduced further.
    ///
    /// A constant step would raise it, or a line search found no step.
    Stalled,
    /// The iterations were used up.
    Exhausted,
    /// The Hessian is singular to working precision, or indefinite.
    ///
    /// Newton's method has no step to take.
    Singular,
    /// The energy or its gradient has left the range of the numbers.
    ///
    /// The curve is the last one with finite values.
    Broken,
}

/// A curve on the way.
#[derive(Clone, Copy, Debug)]
pub struct Iterate<'a, const D: usize> {
    /// The steps taken so far.
    ///
    /// 0 for the start curve.
    pub iteration: u32,
    /// Its energy.
    pub energy: f64,
    /// Its length Σ Δs.
    pub length: f64,
    /// Its vertices.
    pub vertices: &'a [[f64; D]],
}

/// The result of a minimisation.
#[derive(Clone, Debug, PartialEq)]
pub struct Minimised<const D: usize> {
    /// The ending.
    pub ending: Ending,
    /// The curve.
    pub vertices: Vec<[f64; D]>,
    /// Its energy.
    pub energy: f64,
    /// Its length Σ Δs.
    pub length: f64,
    /// The measure of its gradient.
    ///
    /// NaN where the method's matrix is singular.
    pub gradient_norm: f64,
    /// The steps taken.
    pub iterations: u32,
}

impl Minimisation {
    /// Minimises this energy by the default method.
    pub fn new(energy: Energy) -> Self {
        let method =
            Minimiser::Gradient { product: InnerProduct::Sobolev, step: Step::Search, direction: Direction::Steepest };
        Minimisation { energy, method, tolerance: 1e-8, max_iterations: 1_000 }
    }

    /// Minimises from the curve with these vertices, 2-D or 3-D.
    ///
    /// `observe` is shown the start curve, then the curve after every step.
    ///
    /// # Errors
    /// - Options out of range.
    /// - An energy with [`attachment`](crate::discrete::attachment).
    /// - Fewer than three vertices, vertices that are not finite, or two neighbours at one place.
    pub fn run<const D: usize>(
        &self,
        vertices: &[[f64; D]],
        observe: impl FnMut(Iterate<'_, D>),
    ) -> Result<Minimised<D>> {
        self.check(vertices)?;
        Ok(match self.method {
            Minimiser::Gradient { product, step, direction } => {
                let order = if product == InnerProduct::Ordinary { 0 } else { self.energy.order() };
                self.descend::<f64, D>(order, step, direction, vertices, observe)
            }
            Minimiser::Newton => self.newton(vertices, observe),
        })
    }

    fn check<const D: usize>(&self, vertices: &[[f64; D]]) -> Result<()> {
        let refuse = |what: String| Err(Error::argument(what));
        if !(2..=3).contains(&D) {
            return refuse(format!("vertices have {D} coordinates; curves are 2-D or 3-D"));
        }
        if !(self.tolerance >= 0.0 && self.tolerance.is_finite()) {
            let given = self.tolerance;
            return refuse(format!("tolerance is {given}; it must be finite and not negative, such as 1e-8"));
        }
        if let Minimiser::Gradient { step: Step::Constant(step), .. } = self.method
            && !(step > 0.0 && step.is_finite())
        {
            return refuse(format!("the constant step is {step}; it must be finite and positive, such as 1"));
        }
        if self.energy.is_attached() {
            return refuse(
                "the energy has an attachment, and a minimisation knows no data points: leave it out".to_string(),
            );
        }
        if vertices.len() < 3 {
            return refuse(format!("{} vertices; with both ends held, three at least are needed", vertices.len()));
        }
        if let Some(k) = vertices.iter().position(|vertex| !vertex.iter().all(|x| x.is_finite())) {
            return refuse(format!("vertex {k} is {:?}; coordinates must be finite", vertices[k]));
        }
        if let Some(k) = vertices.windows(2).position(|pair| pair[0] == pair[1]) {
            let vertex = vertices[k];
            return refuse(format!("vertices {k} and {} are both {vertex:?}; neighbours must differ", k + 1));
        }
        Ok(())
    }

    /// The curve as a problem, with displacements from where it is.
    ///
    /// The ends are pinned, and the weight of the inner product is 1.
    fn problem<const D: usize>(&self, vertices: &[[f64; D]]) -> Problem<D> {
        let last = vertices.len() - 1;
        Problem {
            has_tangents: false,
            closed: false,
            base: vertices.windows(2).map(|pair| subtract(pair[1], pair[0])).collect(),
            data: vec![0, last as u32],
            pinned: vec![0, last as u32],
            attached: Vec::new(),
            weights: self.energy.terms().iter().map(|(weight, _)| *weight).collect(),
            gauge: 0.0,
            free: vec![1.0; vertices.len()],
            taut: of_spans(&[vertices[0], vertices[last]], &[0, last as u32], false, 1.0),
            fences: Default::default(),
            walls: Vec::new(),
            places: Vec::new(),
            surface: None,
            ways: Default::default(),
            highest: 1.0,
            curvature: 1.0,
            tolerance: self.tolerance,
            most_iterations: self.max_iterations,
            longest: f64::INFINITY,
        }
    }

    fn functionals(&self) -> Vec<&Functional> {
        self.energy.terms().iter().map(|(_, functional)| functional).collect()
    }

    /// Descent along gradients, in the arithmetic of S.
    fn descend<S: Scalar, const D: usize>(
        &self,
        order: usize,
        step: Step,
        direction: Direction,
        vertices: &[[f64; D]],
        mut observe: impl FnMut(Iterate<'_, D>),
    ) -> Minimised<D> {
        let plan = Plan { direction, step, order, gauge: 0 };
        let problem = self.problem(vertices);
        let mut descent = start::<S, D>(&plan, &self.functionals(), &[&problem]);
        let lane = &mut descent.lanes[0];
        // Ordinary gradients may be slow for thousands of steps while the energy falls.
        lane.patience = u32::MAX;
        // The step may turn an edge over if the energy is a function of edges alone. Curvatures
        // must not meet such an edge.
        lane.guarded = self.energy.order() > 1;
        let mut here = Here::new(vertices);
        while descent.is_running() {
            descent.tick();
            let lane = &descent.lanes[0];
            let energy = lane.energy.to_f64();
            let moved = lane.iterations > here.iteration || here.energy.is_nan();
            if !moved || lane.standing == Standing::Broken {
                continue;
            }
            if matches!(step, Step::Constant(_)) && energy >= here.energy && lane.standing != Standing::Converged {
                return here.end(Ending::Stalled);
            }
            here.move_to(&descent, vertices);
            observe(here.iterate());
        }
        let constant = matches!(step, Step::Constant(_));
        here.end(match descent.lanes[0].standing {
            Standing::Converged => Ending::Converged,
            Standing::Exhausted => Ending::Exhausted,
            // A constant step is refused only if it leaves the range of the numbers.
            Standing::Stalled if !constant => Ending::Stalled,
            _ => Ending::Broken,
        })
    }

    /// Newton's method with full steps.
    fn newton<const D: usize>(&self, vertices: &[[f64; D]], mut observe: impl FnMut(Iterate<'_, D>)) -> Minimised<D> {
        let plan = Plan { direction: Direction::Steepest, step: Step::Constant(1.0), order: 0, gauge: 0 };
        let problem = self.problem(vertices);
        let Descent { mut edges, pins, weights, terms, mut u, .. } =
            start::<f64, D>(&plan, &self.functionals(), &[&problem]);
        let mut newton = Newton::new(self.energy.order(), false, &edges, &pins.movable);
        let (mut g, mut p) = (u.clone(), u.clone());
        let mut here = Here::new(vertices);
        for iteration in 0.. {
            edges.place(&u);
            edges.clear();
            let energy: f64 = terms.iter().map(|(weight, functional)| edges.add(*weight, functional)).sum();
            edges.gradient(&pins.movable, &mut g);
            if !(energy.is_finite() && g.iter().flatten().all(|g| g.is_finite())) {
                return here.end(Ending::Broken);
            }
            here.iteration = iteration;
            (here.energy, here.length, here.gradient_norm) = (energy, edges.total_length(), f64::NAN);
            here.vertices.iter_mut().zip(vertices).zip(&u).for_each(|((to, from), u)| *to = add(*from, *u));
            observe(here.iterate());
            newton.assemble(&edges, &terms, None, &weights);
            if is_singular(newton.factor(0.0), newton.largest(), D * vertices.len()) {
                return here.end(Ending::Singular);
            }
            p.iter_mut().zip(&g).for_each(|(p, g)| *p = scale(-1.0, *g));
            newton.solve(&mut p);
            let decrement = -p.iter().zip(&g).map(|(p, g)| dot(*p, *g)).sum::<f64>();
            here.gradient_norm = decrement.max(0.0).sqrt();
            if here.gradient_norm <= self.tolerance {
                return here.end(Ending::Converged);
            }
            if iteration >= self.max_iterations {
                break;
            }
            u.iter_mut().zip(&p).for_each(|(u, p)| *u = add(*u, *p));
        }
        here.end(Ending::Exhausted)
    }
}

/// Whether a Hessian of n unknowns with this smallest pivot is singular or indefinite.
///
/// H = L D Lᵀ counts as singular where a pivot is not above n ε a. ε is the rounding of f64, and a
/// is the largest entry on the diagonal of H. Pivots of a semidefinite matrix are at most a, and to
/// first order rounding perturbs them by at most n ε a. Below that a pivot cannot be told from 0,
/// and a solution would consist of rounding errors.
fn is_singular(smallest: f64, largest: f64, n: usize) -> bool {
    smallest.is_nan() || smallest <= n as f64 * f64::EPSILON * largest
}

/// The curve in its current state.
struct Here<const D: usize> {
    iteration: u32,
    /// The energy.
    ///
    /// NaN before the first evaluation.
    energy: f64,
    length: f64,
    gradient_norm: f64,
    vertices: Vec<Vector<f64, D>>,
}

impl<const D: usize> Here<D> {
    fn new(vertices: &[[f64; D]]) -> Self {
        let nan = f64::NAN;
        Here { iteration: 0, energy: nan, length: nan, gradient_norm: nan, vertices: vertices.to_vec() }
    }

    /// Takes the state that the descent has reached.
    fn move_to<S: Scalar>(&mut self, descent: &Descent<'_, S, D>, from: &[[f64; D]]) {
        let lane = &descent.lanes[0];
        self.iteration = lane.iterations;
        self.energy = lane.energy.to_f64();
        self.length = lane.length.to_f64();
        self.gradient_norm = lane.norm2.to_f64().sqrt();
        for ((to, from), u) in self.vertices.iter_mut().zip(from).zip(&descent.u) {
            *to = std::array::from_fn(|c| from[c] + u[c].lane(0).to_f64());
        }
    }

    fn iterate(&self) -> Iterate<'_, D> {
        Iterate { iteration: self.iteration, energy: self.energy, length: self.length, vertices: &self.vertices }
    }

    fn end(self, ending: Ending) -> Minimised<D> {
        let Here { iteration: iterations, energy, length, gradient_norm, vertices } = self;
        Minimised { ending, vertices, energy, length, gradient_norm, iterations }
    }
}

#[cfg(test)]
mod tests;
