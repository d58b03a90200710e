//! Energies, gradients and Hessians of given curves: nothing is fitted, the points of a batch are the vertices.

use rayon::prelude::*;

use super::edges::Edges;
use super::energy::{Energy, Functional, TORSION_CURVATURE};
use super::hessian::BlockHessian;
use crate::batch::{CurveBatch, Problem};
use crate::error::{Error, Result};
use crate::linalg::scalar::{Vector, subtract};
use crate::report::CurveStatus;

/// What an evaluation needs besides the curves.
#[derive(Clone, Copy, Debug, Default)]
pub struct Evaluate<'a> {
    /// The data points of [`attachment`](super::attachment), with their weights, for each curve. A curve whose edges are N
    /// times the spans between its data points has data point k at vertex k N. Only attachment needs them.
    pub targets: Option<&'a CurveBatch>,
    /// ε of [`torsion`](super::torsion), a curvature in 1/length. By default [`TORSION_CURVATURE`] over the diagonal of the
    /// bounding box of each curve's vertices.
    pub torsion_curvature: Option<f64>,
}

/// Value and derivatives of an energy at one curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// The weighted sum of energies; NaN where there is a problem.
    pub value: f64,
    /// Its derivatives by the coordinates of the vertices, in the batch's order; NaN where there is a problem.
    pub gradient: Vec<f64>,
    /// Its second derivatives, row after row: as many rows and columns as the gradient has entries. Empty where not asked
    /// for; NaN where there is a problem.
    pub hessian: Vec<f64>,
    /// Why there is no value.
    pub problem: Option<Problem>,
}

impl Energy {
    /// The energy and its gradient at every curve of the batch, whose points are the vertices, in f64 on all threads of the
    /// CPU. Energies of two or three edges are 0 on curves of fewer.
    ///
    /// A curve with a problem of its own, with two neighbouring vertices at one place (a tangent is wanted there), closed with
    /// fewer than three vertices, or whose data points do not go with its vertices has NaN and a [`Problem`].
    ///
    /// ```
    /// use faircurve::{CurveBatch, discrete::{Evaluate, bending, length}};
    /// let corner = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
    /// let batch = CurveBatch::from_slices(&[&corner[..]])?;
    /// let found = (bending(2.0) + 0.5 * length()).evaluate(&batch, Evaluate::default())?;
    /// // |K|² Δa with |K| = √2, Δa = 1, and half the length 2.
    /// assert!((found[0].value - 3.0).abs() < 1e-15);
    /// assert_eq!(found[0].gradient.len(), 6);
    /// # Ok::<(), faircurve::Error>(())
    /// ```
    ///
    /// # Errors
    /// A weight that is negative or not finite, an exponent below 1, a custom energy of other than 1, 2 or 3 edges;
    /// attachment without targets, targets of another dimension or number of curves; a torsion curvature that is not positive.
    pub fn evaluate(&self, batch: &CurveBatch, options: Evaluate) -> Result<Vec<Evaluation>> {
        self.run(batch, options, false)
    }

    /// The same with the Hessian of every curve.
    ///
    /// # Errors
    /// As [`evaluate`](Self::evaluate).
    pub fn evaluate_with_hessian(&self, batch: &CurveBatch, options: Evaluate) -> Result<Vec<Evaluation>> {
        self.run(batch, options, true)
    }

    fn run(&self, batch: &CurveBatch, options: Evaluate, hessian: bool) -> Result<Vec<Evaluation>> {
        self.check()?;
        options.validate(self, batch)?;
        let curve = |i: usize| {
            let found = match batch.dimension() {
                2 => self.at::<2>(batch, i, options, hessian),
                _ => self.at::<3>(batch, i, options, hessian),
            };
            found.unwrap_or_else(|problem| {
                let entries = batch.points(i).len();
                Evaluation {
                    value: f64::NAN,
                    gradient: vec![f64::NAN; entries],
                    hessian: vec![f64::NAN; if hessian { entries * entries } else { 0 }],
                    problem: Some(problem),
                }
            })
        };
        Ok((0..batch.len()).into_par_iter().map(curve).collect())
    }

    fn at<const D: usize>(
        &self,
        batch: &CurveBatch,
        i: usize,
        options: Evaluate,
        hessian: bool,
    ) -> Result<Evaluation, Problem> {
        let points: Vec<Vector<f64, D>> = vectors(batch, i);
        let base = edges(batch, i, &points)?;
        let attached = match options.targets.filter(|_| self.is_attached()) {
            Some(targets) => attached::<D>(batch, targets, i)?,
            None => vec![],
        };
        let closed = batch.is_closed(i) && !points.is_empty();
        let mut edges = Edges::<f64, D>::new(closed, &[&base], &[&vec![false; points.len().max(1)]]);
        if let Some(curvature) = options.torsion_curvature {
            edges.set_torsion_curvature(0, curvature);
        } else if !base.is_empty() {
            edges.set_torsion_curvature(0, TORSION_CURVATURE / size(&points));
        }
        let zero = vec![[0.0; D]; edges.rows()];
        edges.place(&zero);
        edges.clear();
        let mut value = 0.0;
        let mut gradient = zero;
        for (weight, functional) in self.terms() {
            value += edges.add(*weight, functional);
        }
        let mut blocks = hessian.then(|| BlockHessian::new(&edges));
        if let Some(blocks) = &mut blocks {
            blocks.assemble(&edges, self.terms().iter().map(|(weight, functional)| (*weight, functional)), None);
        }
        edges.gradient(&vec![1.0; edges.rows()], &mut gradient);
        for (weight, _) in self.terms().iter().filter(|(_, functional)| matches!(functional, Functional::Attachment)) {
            for &(vertex, target, w) in &attached {
                let w = weight * w;
                for c in 0..D {
                    let away = points[vertex][c] - target[c];
                    value += 0.5 * w * away * away;
                    gradient[vertex][c] += w * away;
                }
                if let Some(blocks) = &mut blocks {
                    blocks.add_diagonal(vertex, w);
                }
            }
        }
        gradient.truncate(points.len());
        Ok(Evaluation {
            value,
            gradient: gradient.concat(),
            hessian: blocks.filter(|_| !points.is_empty()).map_or(vec![], |blocks| blocks.dense(0)),
            problem: None,
        })
    }

    fn is_attached(&self) -> bool {
        self.terms().iter().any(|(_, functional)| matches!(functional, Functional::Attachment))
    }
}

impl Evaluate<'_> {
    fn validate(&self, energy: &Energy, batch: &CurveBatch) -> Result<()> {
        if let Some(curvature) = self.torsion_curvature
            && !(curvature > 0.0 && curvature.is_finite())
        {
            let message = format!("the torsion curvature is {curvature}: give a positive, finite number in 1/length");
            return Err(Error::Argument(message));
        }
        match self.targets {
            _ if !energy.is_attached() => Ok(()),
            None => Err(Error::argument("attachment without data points: give them as targets")),
            Some(targets) if (targets.dimension(), targets.len()) != (batch.dimension(), batch.len()) => {
                let [found, wanted] =
                    [targets, batch].map(|batch| format!("{} {}-D curves", batch.len(), batch.dimension()));
                Err(Error::Argument(format!("targets of {found} for {wanted}: give a target curve for every curve")))
            }
            Some(_) => Ok(()),
        }
    }
}

fn vectors<const D: usize>(batch: &CurveBatch, i: usize) -> Vec<Vector<f64, D>> {
    batch.points(i).chunks_exact(D).map(|point| std::array::from_fn(|c| point[c])).collect()
}

fn degenerate(message: String) -> Problem {
    Problem { status: CurveStatus::Degenerate, message }
}

/// The edges of curve i, all of positive length.
fn edges<const D: usize>(
    batch: &CurveBatch,
    i: usize,
    points: &[Vector<f64, D>],
) -> Result<Vec<Vector<f64, D>>, Problem> {
    if let Some(problem) = batch.problem(i) {
        return Err(problem.clone());
    }
    let n = points.len();
    if batch.is_closed(i) && (1..3).contains(&n) {
        let what = format!("a closed curve of {n} vertices has no energy: give 3 at least, or mark it as open");
        return Err(degenerate(batch.sentence(i, 0, &what)));
    }
    let base: Vec<_> = (0..batch.spans(i)).map(|j| subtract(points[(j + 1) % n], points[j])).collect();
    // What underflows when squared has no direction either.
    let square = |edge: &Vector<f64, D>| edge.iter().map(|x| x * x).sum::<f64>();
    if let Some(j) = base.iter().position(|edge| !square(edge).is_normal()) {
        let length = square(&base[j]).sqrt();
        let what = format!(
            "the edge to the next vertex has length {length:e}, and so no tangent: remove one of two equal neighbours, \
             or scale the curve to a size near 1"
        );
        return Err(degenerate(batch.sentence(i, j, &what)));
    }
    Ok(base)
}

/// Vertices with data points: which, where, and of what weight.
fn attached<const D: usize>(
    batch: &CurveBatch,
    targets: &CurveBatch,
    i: usize,
) -> Result<Vec<(usize, Vector<f64, D>, f64)>, Problem> {
    if let Some(problem) = targets.problem(i) {
        return Err(problem.clone());
    }
    let (spans, edges, data) = (targets.spans(i), batch.spans(i), vectors::<D>(targets, i));
    let fits = targets.is_closed(i) == batch.is_closed(i)
        && data.is_empty() == (batch.count(i) == 0)
        && if spans == 0 { edges == 0 } else { edges % spans == 0 };
    if !fits {
        let kind = |batch: &CurveBatch| if batch.is_closed(i) { "a closed" } else { "an open" };
        let (curve, of) = (kind(batch), kind(targets));
        let what = format!(
            "{curve} curve of {edges} edges cannot be attached to the data points of {of} one of {spans} spans: \
             give both open or both closed, with a whole number of edges a span"
        );
        return Err(Problem { status: CurveStatus::Invalid, message: batch.sentence(i, 0, &what) });
    }
    let every = edges.checked_div(spans).unwrap_or(1);
    let weight = |k: usize| targets.weights(i).map_or(1.0, |weights| weights[k]);
    Ok(data.into_iter().enumerate().map(|(k, point)| (k * every, point, weight(k))).collect())
}

/// The diagonal of the bounding box.
fn size<const D: usize>(points: &[Vector<f64, D>]) -> f64 {
    let extent = |c: usize| {
        let all = points.iter().map(|point| point[c]);
        all.clone().fold(f64::NEG_INFINITY, f64::max) - all.fold(f64::INFINITY, f64::min)
    };
    (0..D).map(|c| extent(c).powi(2)).sum::<f64>().sqrt()
}
