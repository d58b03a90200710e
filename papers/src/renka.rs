//! [`Minimisation`]: one curve and one energy, minimised by any of the methods that the papers
//! compare.

use faircurve::discrete::{Energy, Evaluate, Evaluation, MOST_EDGES, Want};
use faircurve::linalg::Real;
use faircurve::{CurveBatch, Device, Error, Result};

use crate::banded::Banded;
use crate::line_search::{LineSearch, Trial};

type Vector<const D: usize> = [f64; D];

/// Minimises an energy over the inner vertices of one open curve, by a method of your choice.
///
/// Both ends are held. Every iterate is shown. There is no rescaling, and no term that spreads
/// vertices.
///
/// | method | step | measure of the gradient g |
/// |---|---|---|
/// | ordinary gradient | f − αg | √(g·g) |
/// | Sobolev gradient | f − αL⁻¹g, (Lh)_i = (h_i − h_{i−1})/Δs_i − (h_{i+1} − h_i)/Δs_{i+1} | √(g·L⁻¹g) |
/// | Newton | f − H⁻¹g, H the exact Hessian | √(g·H⁻¹g) |
///
/// ```
/// use faircurve::discrete::length;
/// use faircurve_papers::renka::{Direction, Ending, InnerProduct, Minimisation, Minimiser, Step};
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
    /// [`attachment`](faircurve::discrete::attachment) has no data to attach to here.
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
pub enum InnerProduct {
    /// The Euclidean product Σ g·h.
    Ordinary,
    /// The Sobolev product of first derivatives by arc length, Σ (g_i − g_{i−1})·(h_i − h_{i−1})/Δs_i.
    ///
    /// It is frozen at each iterate.
    #[default]
    Sobolev,
}

/// How the direction follows from the gradient z.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Direction {
    /// −z
    #[default]
    Steepest,
    /// −z + βp with β = max(0, min(Hestenes–Stiefel, Dai–Yuan)).
    Conjugate,
}

/// The length of each step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Step {
    /// Always this long.
    Constant(f64),
    /// As long as a line search finds.
    #[default]
    Search,
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
    /// - An energy with [`attachment`](faircurve::discrete::attachment).
    /// - Fewer than three vertices, vertices that are not finite, or two neighbours at one place.
    pub fn run<const D: usize>(
        &self,
        vertices: &[[f64; D]],
        observe: impl FnMut(Iterate<'_, D>),
    ) -> Result<Minimised<D>> {
        self.check(vertices)?;
        match self.method {
            Minimiser::Gradient { product, step, direction } => {
                self.descend(product, step, direction, vertices, observe)
            }
            Minimiser::Newton => self.newton(vertices, observe),
        }
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

    /// The energy and its derivatives at the curve with these vertices. Ends have no gradient.
    fn evaluate<const D: usize>(&self, vertices: &[Vector<D>], want: Want<'_>) -> Result<Evaluation> {
        let batch = CurveBatch::from_ragged(D, vertices.as_flattened().to_vec(), vec![0, vertices.len()])?;
        let options = Evaluate { want, ..Evaluate::default() };
        let mut found = self.energy.evaluate(&batch.closed(false), options, &Device::cpu())?.remove(0);
        let last = found.gradient.len() - D;
        found.gradient[..D].fill(0.0);
        found.gradient[last..].fill(0.0);
        Ok(found)
    }

    /// The iterate at these vertices. `None` if a number is not finite.
    fn iterate<const D: usize>(&self, product: InnerProduct, vertices: Vec<Vector<D>>) -> Result<Option<Here<D>>> {
        let found = self.evaluate(&vertices, Want::Gradient)?;
        let gradient = found.gradient.as_chunks::<D>().0.to_vec();
        let z = match product {
            InnerProduct::Ordinary => gradient.clone(),
            InnerProduct::Sobolev => sobolev_gradient(&edges(&vertices), &gradient),
        };
        let square = dot(&gradient, &z);
        // Rounding may make the square negative at a minimum.
        let square = if square < 0.0 && -square <= self.tolerance * self.tolerance { 0.0 } else { square };
        let here = Here { energy: found.value, norm: square.sqrt(), vertices, gradient, z };
        Ok((here.energy.is_finite() && here.norm.is_finite()).then_some(here))
    }

    /// Descent along gradients.
    fn descend<const D: usize>(
        &self,
        product: InnerProduct,
        step: Step,
        direction: Direction,
        vertices: &[Vector<D>],
        mut observe: impl FnMut(Iterate<'_, D>),
    ) -> Result<Minimised<D>> {
        let Some(mut here) = self.iterate(product, vertices.to_vec())? else {
            return Ok(Here::unknown(vertices).end(Ending::Broken, 0));
        };
        let mut descent = Descent { p: vec![[0.0; D]; vertices.len()], slope: 0.0, alpha: 1.0, before: None };
        for iteration in 0.. {
            observe(Iterate {
                iteration,
                energy: here.energy,
                length: edges(&here.vertices).iter().sum(),
                vertices: &here.vertices,
            });
            if here.norm <= self.tolerance {
                return Ok(here.end(Ending::Converged, iteration));
            }
            if iteration >= self.max_iterations {
                return Ok(here.end(Ending::Exhausted, iteration));
            }
            let is_steepest = descent.turn(&here, direction == Direction::Steepest || iteration == 0);
            let next = match step {
                Step::Constant(alpha) => here.moved(&descent.p, alpha),
                Step::Search => {
                    let mut found = self.search(&here, &mut descent)?;
                    if found.is_none() && !is_steepest {
                        descent.turn(&here, true);
                        descent.alpha = 1.0;
                        found = self.search(&here, &mut descent)?;
                    }
                    let Some(found) = found else { return Ok(here.end(Ending::Stalled, iteration)) };
                    found
                }
            };
            let Some(next) = self.iterate(product, next)? else {
                return Ok(here.end(Ending::Broken, iteration));
            };
            let rises = next.energy >= here.energy && next.norm > self.tolerance;
            if rises && matches!(step, Step::Constant(_)) {
                return Ok(here.end(Ending::Stalled, iteration));
            }
            descent.before = Some(here);
            here = next;
        }
        unreachable!("iterations are counted")
    }

    /// The vertices where a line search along the direction ends. `None` if it finds no step.
    fn search<const D: usize>(&self, here: &Here<D>, descent: &mut Descent<D>) -> Result<Option<Vec<Vector<D>>>> {
        let mut search = LineSearch::new(here.energy, descent.slope, descent.alpha);
        loop {
            let vertices = here.moved(&descent.p, search.alpha);
            let found = self.evaluate(&vertices, Want::Gradient)?;
            match search.judge(found.value, dot(found.gradient.as_chunks().0, &descent.p)) {
                Trial::Taken => {
                    descent.alpha = search.alpha;
                    return Ok(Some(vertices));
                }
                Trial::Again => {}
                Trial::Failed => return Ok(None),
            }
        }
    }

    /// Newton's method with full steps.
    fn newton<const D: usize>(
        &self,
        vertices: &[Vector<D>],
        mut observe: impl FnMut(Iterate<'_, D>),
    ) -> Result<Minimised<D>> {
        let mut here = Here::unknown(vertices);
        for iteration in 0.. {
            let found = self.evaluate(&here.vertices, Want::Blocks)?;
            if !(found.value.is_finite() && found.gradient.iter().all(|g| g.is_finite())) {
                return Ok(here.end(Ending::Broken, iteration));
            }
            (here.energy, here.norm) = (found.value, f64::NAN);
            observe(Iterate {
                iteration,
                energy: here.energy,
                length: edges(&here.vertices).iter().sum(),
                vertices: &here.vertices,
            });
            let mut hessian = inner_hessian::<D>(&found.hessian, vertices.len());
            let largest = hessian.largest();
            if is_singular(hessian.factor(), largest, D * vertices.len()) {
                return Ok(here.end(Ending::Singular, iteration));
            }
            let gradient = &found.gradient[D..found.gradient.len() - D];
            let mut p: Vec<f64> = gradient.iter().map(|g| -g).collect();
            hessian.solve(&mut p);
            let decrement = -p.iter().zip(gradient).map(|(p, g)| p * g).sum::<f64>();
            here.norm = decrement.max(0.0).sqrt();
            if here.norm <= self.tolerance {
                return Ok(here.end(Ending::Converged, iteration));
            }
            if iteration >= self.max_iterations {
                return Ok(here.end(Ending::Exhausted, iteration));
            }
            here.vertices[1..].as_flattened_mut().iter_mut().zip(&p).for_each(|(x, p)| *x += p);
        }
        unreachable!("iterations are counted")
    }
}

/// The Hessian over the inner vertices, from its [blocks](Want::Blocks).
fn inner_hessian<const D: usize>(blocks: &[f64], vertices: usize) -> Banded {
    let mut hessian = Banded::new(D * (vertices - 2), D * MOST_EDGES + D - 1);
    for (k, block) in blocks.chunks_exact(D * D).enumerate() {
        let (vertex, next) = (k / (MOST_EDGES + 1), k / (MOST_EDGES + 1) + k % (MOST_EDGES + 1));
        if vertex == 0 || next + 1 >= vertices {
            continue;
        }
        for (entry, value) in block.iter().enumerate() {
            let (row, column) = (D * (next - 1) + entry % D, D * (vertex - 1) + entry / D);
            if row >= column {
                hessian[(row, column)] = *value;
            }
        }
    }
    hessian
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

/// L⁻¹g for a curve with these edges, whose ends are held.
///
/// L is the matrix of a row of resistors. Edges have conductance 1/Δs, and both ends are grounded.
/// It is eliminated from one end. The pivot of a vertex is its connection to ground so far plus the
/// edge ahead. Pivots are made of sums, products and quotients of positive numbers only, so each has
/// a small relative error however many vertices there are. Pivots by subtraction lose the factor m²
/// of the condition.
fn sobolev_gradient<T: Real, const D: usize>(edges: &[T], gradient: &[[T; D]]) -> Vec<[T; D]> {
    let last = edges.len();
    let mut inverse = vec![T::ZERO; last + 1];
    // The connection of a vertex to ground through those before it.
    let mut ground = T::ONE / edges[0];
    for row in 1..last {
        let ahead = T::ONE / edges[row];
        inverse[row] = T::ONE / (ground + ahead);
        ground = ahead * (ground * inverse[row]);
    }
    let mut z = gradient.to_vec();
    for row in 1..last {
        let (before, here) = (z[row - 1], z[row]);
        let passed = inverse[row - 1] / edges[row - 1];
        z[row] = std::array::from_fn(|c| here[c] + passed * before[c]);
    }
    (z[0], z[last]) = ([T::ZERO; D], [T::ZERO; D]);
    for row in (1..last).rev() {
        let (here, after) = (z[row], z[row + 1]);
        z[row] = std::array::from_fn(|c| inverse[row] * (here[c] + after[c] / edges[row]));
    }
    z
}

fn edges<const D: usize>(vertices: &[Vector<D>]) -> Vec<f64> {
    let square = |pair: &[Vector<D>]| (0..D).map(|c| (pair[1][c] - pair[0][c]).powi(2)).sum::<f64>();
    vertices.windows(2).map(|pair| square(pair).sqrt()).collect()
}

fn dot<const D: usize>(a: &[Vector<D>], b: &[Vector<D>]) -> f64 {
    a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| a * b).sum()
}

/// A curve on the way, with its gradient in the inner product.
struct Here<const D: usize> {
    vertices: Vec<Vector<D>>,
    energy: f64,
    gradient: Vec<Vector<D>>,
    z: Vec<Vector<D>>,
    /// √(g·z)
    norm: f64,
}

impl<const D: usize> Here<D> {
    /// A curve before its energy is known.
    fn unknown(vertices: &[Vector<D>]) -> Self {
        let none = Vec::new;
        Here { vertices: vertices.to_vec(), energy: f64::NAN, gradient: none(), z: none(), norm: f64::NAN }
    }

    /// The vertices after a step along p.
    fn moved(&self, p: &[Vector<D>], alpha: f64) -> Vec<Vector<D>> {
        let mut vertices = self.vertices.clone();
        vertices.as_flattened_mut().iter_mut().zip(p.as_flattened()).for_each(|(x, p)| *x += alpha * p);
        vertices
    }

    fn end(self, ending: Ending, iterations: u32) -> Minimised<D> {
        let length = edges(&self.vertices).iter().sum();
        Minimised { ending, vertices: self.vertices, energy: self.energy, length, gradient_norm: self.norm, iterations }
    }
}

/// The direction of a descent, and the last step along it.
struct Descent<const D: usize> {
    p: Vec<Vector<D>>,
    /// g·p where the direction starts.
    slope: f64,
    alpha: f64,
    /// The curve before.
    before: Option<Here<D>>,
}

impl<const D: usize> Descent<D> {
    /// Turns p to −z + βp. Returns whether β is 0, which `steepest` asks for.
    fn turn(&mut self, here: &Here<D>, steepest: bool) -> bool {
        let square = here.norm * here.norm;
        let slope = dot(&here.gradient, &self.p);
        let change = slope - self.slope;
        let beta = match &self.before {
            Some(before) if !steepest && change > 0.0 => {
                f64::min((square - dot(&here.gradient, &before.z)) / change, square / change)
            }
            _ => 0.0,
        };
        let downwards = beta * slope - square < -DOWNWARDS * square;
        let beta = if beta > 0.0 && beta.is_finite() && downwards { beta } else { 0.0 };
        let z = here.z.as_flattened();
        self.p.as_flattened_mut().iter_mut().zip(z).for_each(|(p, z)| *p = beta * *p - z);
        self.slope = beta * slope - square;
        beta == 0.0
    }
}

/// A conjugate direction must lead down by at least this fraction of g·z.
///
/// Otherwise −z is taken.
const DOWNWARDS: f64 = 0.01;

#[cfg(test)]
mod tests;
