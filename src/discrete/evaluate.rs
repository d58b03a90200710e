//! Energies, gradients and Hessians of given curves: nothing is fitted, the points of a batch are
//! the vertices.

use rayon::prelude::*;

use super::edges::Edges;
use super::energy::{Energy, TORSION_CURVATURE};
use super::hessian::BlockHessian;
use crate::batch::{CurveBatch, Problem};
use crate::error::{Error, Result};

use crate::linalg::scalar::{Vector, subtract};
use crate::linalg::{Lanes, Scalar, with_wide_registers};
use crate::status::CurveStatus;

/// Curves side by side on the CPU: one vector register of f64, as AVX2 has them.
const LANES: usize = 4;

/// What an evaluation needs besides the curves.
#[derive(Clone, Copy, Debug, Default)]
pub struct Evaluate<'a> {
    /// The data points of [`attachment`](super::attachment), with their weights, for each curve. A
    /// curve whose edges are N times the spans between its data points has data point k at vertex k
    /// N. Only attachment needs them.
    pub targets: Option<&'a CurveBatch>,
    /// ε of [`torsion`](super::torsion), a curvature in 1/length. By default [`TORSION_CURVATURE`]
    /// over the diagonal of the bounding box of each curve's vertices.
    pub torsion_curvature: Option<f64>,
}

/// Value and derivatives of an energy at one curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// The weighted sum of energies; NaN where there is a problem.
    pub value: f64,
    /// Its derivatives by the coordinates of the vertices, in the batch's order; NaN where there is
    /// a problem.
    pub gradient: Vec<f64>,
    /// Its second derivatives, row after row: as many rows and columns as the gradient has entries.
    /// Empty where not asked for; NaN where there is a problem.
    pub hessian: Vec<f64>,
    /// Why there is no value.
    pub problem: Option<Problem>,
}

impl Energy {
    /// The energy and its gradient at every curve of the batch, whose points are the vertices, in
    /// f64 on all threads of the CPU. Energies of two or three edges are 0 on curves of fewer.
    ///
    /// A curve with a problem of its own, with two neighbouring vertices at one place (a tangent is
    /// wanted there), closed with fewer than three vertices, or whose data points do not go with
    /// its vertices has NaN and a [`Problem`].
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
    /// A weight that is negative or not finite, an exponent below 1, a custom energy of other than
    /// 1, 2 or 3 edges; attachment without targets, targets of another dimension or number of
    /// curves; a torsion curvature that is not positive.
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
        let evaluating = Evaluating { energy: self, batch, options, hessian };
        // Curves of as many edges undergo the same operations, and none is idle in its lane. Dense
        // Hessians are most of their own cost: those curves go alone.
        let kind = |i: usize| (batch.is_closed(i), batch.count(i));
        let mut order: Vec<usize> = (0..batch.len()).collect();
        order.sort_by_key(|&i| kind(i));
        let alike = order.chunk_by(|&i, &j| kind(i) == kind(j));
        let groups: Vec<&[usize]> = alike.flat_map(|curves| curves.chunks(if hessian { 1 } else { LANES })).collect();
        let found: Vec<(usize, Evaluation)> = groups
            .into_par_iter()
            .flat_map_iter(|group| match batch.dimension() {
                2 => evaluating.group::<2>(group),
                _ => evaluating.group::<3>(group),
            })
            .collect();
        let mut evaluations: Vec<Option<Evaluation>> = vec![None; batch.len()];
        found.into_iter().for_each(|(i, evaluation)| evaluations[i] = Some(evaluation));
        Ok(evaluations.into_iter().map(|evaluation| evaluation.expect("every curve is in one group")).collect())
    }
}

/// One evaluation of a batch.
struct Evaluating<'a> {
    energy: &'a Energy,
    batch: &'a CurveBatch,
    options: Evaluate<'a>,
    hessian: bool,
}

/// A curve that can be evaluated.
struct Ready<'a, const D: usize> {
    i: usize,
    points: &'a [Vector<f64, D>],
    base: Vec<Vector<f64, D>>,
    /// Which vertices have data points, where, and of what weight.
    attached: Vec<(usize, Vector<f64, D>, f64)>,
}

impl Evaluating<'_> {
    /// Curves that are all open or all closed and of as many vertices, with their numbers.
    fn group<const D: usize>(&self, group: &[usize]) -> Vec<(usize, Evaluation)> {
        let (mut found, mut ready) = (Vec::with_capacity(group.len()), Vec::with_capacity(group.len()));
        for &i in group {
            match self.ready::<D>(i) {
                Ok(curve) => ready.push(curve),
                Err(problem) => found.push((i, self.nothing(i, problem))),
            }
        }
        let wide = Vectorised { evaluating: self, curves: &ready };
        let alone = self.hessian || 4 * ready.len() <= LANES;
        match if alone { Err(wide) } else { with_wide_registers(wide) } {
            Ok(mut evaluations) => found.append(&mut evaluations),
            Err(_) => ready.iter().for_each(|curve| found.append(&mut self.evaluate_one(curve))),
        }
        found
    }

    fn ready<const D: usize>(&self, i: usize) -> Result<Ready<'_, D>, Problem> {
        let points = self.batch.points(i).as_chunks::<D>().0;
        let base = edges(self.batch, i, points)?;
        let attached = match self.options.targets.filter(|_| self.energy.is_attached()) {
            Some(targets) => attached::<D>(self.batch, targets, i)?,
            None => vec![],
        };
        Ok(Ready { i, points, base, attached })
    }

    fn nothing(&self, i: usize, problem: Problem) -> Evaluation {
        let entries = self.batch.points(i).len();
        Evaluation {
            value: f64::NAN,
            gradient: vec![f64::NAN; entries],
            hessian: vec![f64::NAN; if self.hessian { entries * entries } else { 0 }],
            problem: Some(problem),
        }
    }

    #[inline(never)]
    fn evaluate_one<const D: usize>(&self, curve: &Ready<D>) -> Vec<(usize, Evaluation)> {
        self.evaluate::<f64, D>(std::slice::from_ref(curve))
    }

    /// Up to S::LANES curves side by side; lanes to spare repeat the first.
    #[inline(always)]
    fn evaluate<S: Scalar<Number = f64>, const D: usize>(&self, curves: &[Ready<D>]) -> Vec<(usize, Evaluation)> {
        let lane = |l: usize| &curves[if l < curves.len() { l } else { 0 }];
        let count = curves[0].points.len();
        let closed = self.batch.is_closed(curves[0].i) && count > 0;
        let bases: Vec<&[Vector<f64, D>]> = (0..S::LANES).map(|l| &lane(l).base[..]).collect();
        let free = vec![false; count.max(1)];
        let mut edges = Edges::<S, D>::new(closed, &bases, &vec![&free[..]; S::LANES]);
        for l in 0..S::LANES {
            if let Some(curvature) = self.options.torsion_curvature {
                edges.set_torsion_curvature(l, curvature);
            } else if !lane(l).base.is_empty() {
                edges.set_torsion_curvature(l, TORSION_CURVATURE / size(lane(l).points));
            }
        }
        let zero = vec![[S::ZERO; D]; edges.rows()];
        edges.place(&zero);
        edges.clear();
        let mut values = S::ZERO;
        let mut gradients = zero;
        for (weight, functional) in self.energy.terms() {
            values += edges.add(S::of(*weight), functional);
        }
        // Hessians are large: their curves come alone.
        let mut blocks = (S::LANES == 1 && self.hessian).then(|| BlockHessian::new(&edges));
        if let Some(blocks) = &mut blocks {
            let terms = self.energy.terms().iter();
            blocks.assemble_apart(&edges, terms.map(|(weight, functional)| (S::of(*weight), functional)), None);
        }
        edges.gradient(&vec![S::ONE; edges.rows()], &mut gradients);
        let weight = self.energy.attachment_weight();
        let finish = |(l, curve): (usize, &Ready<D>)| {
            let mut value = values.lane(l);
            let mut gradient = Vec::with_capacity(D * count);
            gradients[..count].iter().for_each(|g| gradient.extend(g.map(|x| x.lane(l))));
            for &(vertex, target, w) in &curve.attached {
                let w = weight * w;
                for c in 0..D {
                    let away = curve.points[vertex][c] - target[c];
                    value += 0.5 * w * away * away;
                    gradient[D * vertex + c] += w * away;
                }
                if let Some(blocks) = &mut blocks {
                    blocks.add_diagonal(vertex, S::of(w));
                }
            }
            let hessian = blocks.as_ref().filter(|_| count > 0).map_or(vec![], |blocks| blocks.dense(l));
            (curve.i, Evaluation { value, gradient, hessian, problem: None })
        };
        curves.iter().enumerate().map(finish).collect()
    }
}

/// [`Evaluating::evaluate`] in lanes.
struct Vectorised<'a, const D: usize> {
    evaluating: &'a Evaluating<'a>,
    curves: &'a [Ready<'a, D>],
}

impl<const D: usize> pulp::WithSimd for Vectorised<'_, D> {
    type Output = Vec<(usize, Evaluation)>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Self::Output {
        self.evaluating.evaluate::<Lanes<f64, LANES>, D>(self.curves)
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
    let (spans, edges, data) = (targets.spans(i), batch.spans(i), targets.points(i).as_chunks::<D>().0);
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
    Ok(data.iter().enumerate().map(|(k, &point)| (k * every, point, weight(k))).collect())
}

/// The diagonal of the bounding box.
fn size<const D: usize>(points: &[Vector<f64, D>]) -> f64 {
    let extent = |c: usize| {
        let all = points.iter().map(|point| point[c]);
        all.clone().fold(f64::NEG_INFINITY, f64::max) - all.fold(f64::INFINITY, f64::min)
    };
    (0..D).map(|c| extent(c).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::{attachment, bending, length, tension, torsion, variation};
    use super::*;

    #[test]
    fn a_curve_of_a_batch_has_the_bits_of_the_curve_alone() {
        let counts = [9, 9, 1, 9, 0, 9, 17, 9, 9, 2, 9, 9, 9, 9, 17, 9, 9, 9, 3, 9, 9, 9];
        for (dimension, energy) in [
            (2, bending(2.0)),
            (2, 0.7 * bending(2.5) + 0.3 * tension() + 2.0 * attachment()),
            (3, length() + bending(3.0) + variation() + torsion()),
        ] {
            let mut offsets = vec![0];
            counts.iter().for_each(|count| offsets.push(offsets[offsets.len() - 1] + count));
            let wave = |k: usize| (k as f64 * 0.618).fract() + (k / dimension) as f64 * 0.3;
            let mut coords: Vec<f64> = (0..dimension * offsets[counts.len()]).map(wave).collect();
            // Two neighbours of others in their lanes that have no value.
            coords[dimension * offsets[3]] = f64::NAN;
            let repeated = dimension * (offsets[7] + 2);
            coords.copy_within(repeated..repeated + dimension, repeated + dimension);
            let closed = (0..counts.len()).map(|i| i % 3 == 0 && counts[i] > 2).collect();
            let batch = CurveBatch::from_ragged(dimension, coords, offsets).unwrap().closed_each(closed).unwrap();
            let targets = batch.with_points(batch.coords().iter().map(|x| x.sin()).collect(), batch.offsets().to_vec());
            let options = Evaluate { targets: Some(&targets), ..Evaluate::default() };
            let together = energy.evaluate(&batch, options).unwrap();
            let bits = |found: &Evaluation| -> Vec<u64> {
                [found.value].iter().chain(&found.gradient).map(|x| x.to_bits()).collect()
            };
            for (i, found) in together.iter().enumerate() {
                let target = targets.select(&[i]);
                let options = Evaluate { targets: Some(&target), ..options };
                let alone = energy.evaluate(&batch.select(&[i]), options).unwrap().remove(0);
                assert_eq!(bits(found), bits(&alone), "{energy}, curve {i}");
                assert_eq!(found.problem.is_some(), [3, 7].contains(&i), "{energy}, curve {i}: {:?}", found.problem);
            }
        }
    }
}
