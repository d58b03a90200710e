//! The energy, gradient and Hessian of given curves.
//!
//! Nothing is fitted. The points of a batch are the vertices.

use super::edges::Edges;
use super::energy::{Anchor, Energy, TORSION_CURVATURE, of_spans};
use super::hessian::{BLOCKS, BlockHessian, dense};
use crate::batch::{CurveBatch, Unfitted};
use crate::bounds::Bounds;
use crate::error::{Error, Result};
use crate::linalg::scalar::{Vector, subtract};
use crate::linalg::{Lanes, Scalar, has_wide_registers};
use crate::parallel;
use crate::sort;
use crate::status::CurveStatus;

/// Curves evaluated side by side on the CPU: as many as an AVX2 register holds f64 numbers.
const LANES: usize = 4;

/// The options of an evaluation.
#[derive(Clone, Copy, Debug, Default)]
pub struct Evaluate<'a> {
    /// What to compute.
    ///
    /// Values and gradients by default.
    pub want: Want<'a>,
    /// The data points of [`attachment`](super::attachment), with their weights, and of
    /// [`tautness`](super::tautness), for each curve.
    ///
    /// Other energies need none. If a curve has N times as many edges as its data points have
    /// spans, data point k is at vertex k N.
    pub targets: Option<&'a CurveBatch>,
    /// ε of [`torsion`](super::torsion), a curvature in 1/length.
    ///
    /// By default it is [`TORSION_CURVATURE`] over the diagonal of the bounding box of each curve's
    /// vertices.
    pub torsion_curvature: Option<f64>,
    /// The regularisation of fair curves.
    ///
    /// If given, it is part of all results.
    #[doc(hidden)]
    pub regularisation: Option<SpacingRegularisation<'a>>,
}

/// What to compute for every curve.
#[derive(Clone, Copy, Debug, Default)]
#[non_exhaustive]
pub enum Want<'a> {
    /// The value only.
    Value,
    /// The value, and the derivative along this direction.
    ///
    /// The direction has the layout of the batch's coordinates.
    Slope(&'a [f64]),
    /// The value and the gradient.
    #[default]
    Gradient,
    /// The value, the gradient, and the Hessian as a full matrix.
    Hessian,
    /// The value, the gradient, and the nonzero blocks of the Hessian.
    Blocks,
}

/// The regularisation that makes edges between data points equally long.
#[derive(Clone, Copy, Debug)]
pub struct SpacingRegularisation<'a> {
    /// The weight of the regularisation for every curve.
    pub weights: &'a [f64],
    /// For every vertex of the batch, whether it is a data point.
    pub is_data: &'a [bool],
}

/// The value and derivatives of an energy at one curve.
///
/// Derivatives that were not requested are empty, and the slope is then 0. If there is a
/// [`problem`](Self::problem), the requested numbers are NaN.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Evaluation {
    /// The weighted sum of energies.
    pub value: f64,
    /// The derivative along the direction.
    pub slope: f64,
    /// The derivatives with respect to the coordinates of the vertices, in the batch's order.
    pub gradient: Vec<f64>,
    /// The second derivatives.
    ///
    /// With [`Want::Hessian`] this is the full matrix, row by row. It has as many rows and columns
    /// as the gradient has entries.
    ///
    /// With [`Want::Blocks`] there are [`MOST_EDGES`](super::MOST_EDGES) + 1 blocks of D × D
    /// numbers for each vertex, each row by row. The first block couples the vertex with itself.
    /// The others couple it with the next vertices, modulo the number of vertices of a closed
    /// curve.
    pub hessian: Vec<f64>,
    /// Why there is no value.
    pub problem: Option<Unfitted>,
}

impl Want<'_> {
    pub(super) fn has_gradient(self) -> bool {
        !matches!(self, Want::Value | Want::Slope(_))
    }

    pub(super) fn has_hessian(self) -> bool {
        matches!(self, Want::Hessian | Want::Blocks)
    }
}

/// One evaluation of a batch.
#[derive(Clone, Copy)]
pub(super) struct Evaluating<'a> {
    pub energy: &'a Energy,
    pub batch: &'a CurveBatch,
    pub options: Evaluate<'a>,
}

/// A curve that can be evaluated.
pub(super) struct PreparedCurve<'a, const D: usize> {
    pub i: usize,
    pub points: &'a [Vector<f64, D>],
    pub base: Vec<Vector<f64, D>>,
    /// The vertex index, the position and the weight of every data point.
    pub attached: Vec<(usize, Vector<f64, D>, f64)>,
    /// ε of torsion.
    pub torsion_curvature: f64,
    /// 1/w² of every edge, where w is the width of its span; empty if the energy contains no
    /// tautness.
    pub taut: Vec<f64>,
}

impl<'a> Evaluating<'a> {
    pub(super) fn ready<const D: usize>(&self, i: usize) -> Result<PreparedCurve<'a, D>, Unfitted> {
        let points = self.batch.points(i).as_chunks::<D>().0;
        let base = edges(self.batch, i, points)?;
        let data = match self.options.targets.filter(|_| self.energy.is_attached() || self.energy.is_taut()) {
            Some(targets) => attached::<D>(self.batch, targets, i)?,
            None => vec![],
        };
        let taut = if self.energy.is_taut() { self.taut(i, &data, base.len()) } else { vec![] };
        let attached = if self.energy.is_attached() { data } else { vec![] };
        let own = if base.is_empty() {
            TORSION_CURVATURE
        } else {
            TORSION_CURVATURE / Bounds::of(points.iter().copied()).diagonal()
        };
        let torsion_curvature = self.options.torsion_curvature.unwrap_or(own);
        Ok(PreparedCurve { i, points, taut, base, attached, torsion_curvature })
    }

    /// 1/w² of every edge of curve `i`. Spans lie between the data points, or without targets
    /// between the vertices.
    fn taut<const D: usize>(&self, i: usize, data: &[(usize, Vector<f64, D>, f64)], edges: usize) -> Vec<f64> {
        let vertices = self.batch.points(i).as_chunks::<D>().0.iter().copied();
        let (points, rows): (Vec<_>, Vec<usize>) = match self.options.targets {
            Some(_) => data.iter().map(|&(row, point, _)| (point, row)).unzip(),
            None => vertices.zip(0..).unzip(),
        };
        // The last edge ends at the last point of an open curve, and at the first of a closed one.
        let rows: Vec<u32> = rows.into_iter().filter(|&row| row < edges).chain([edges]).map(|row| row as u32).collect();
        of_spans(&points, &rows, self.batch.is_closed(i), 1.0)
    }

    pub(super) fn nothing(&self, i: usize, problem: Unfitted) -> Evaluation {
        let (entries, d, want) = (self.batch.points(i).len(), self.batch.dimension(), self.options.want);
        let numbers = |count: usize| vec![f64::NAN; count];
        Evaluation {
            value: f64::NAN,
            slope: if let Want::Slope(_) = want { f64::NAN } else { 0.0 },
            gradient: numbers(if want.has_gradient() { entries } else { 0 }),
            hessian: numbers(match want {
                Want::Hessian => entries * entries,
                Want::Blocks => entries * d * BLOCKS,
                _ => 0,
            }),
            problem: Some(problem),
        }
    }

    /// The weight of a curve's regularisation.
    pub fn regularisation(&self, i: usize) -> Option<f64> {
        self.options.regularisation.map(|regularisation| regularisation.weights[i])
    }

    /// Which vertices of a curve are data points for the regularisation.
    pub fn is_data(&self, i: usize) -> Option<&'a [bool]> {
        let offsets = self.batch.offsets();
        self.options.regularisation.map(|regularisation| &regularisation.is_data[offsets[i]..offsets[i + 1]])
    }

    /// The direction at a curve, if a slope is wanted.
    pub fn direction<const D: usize>(&self, i: usize) -> Option<&'a [Vector<f64, D>]> {
        let offsets = self.batch.offsets();
        match self.options.want {
            Want::Slope(direction) => Some(&direction.as_chunks().0[offsets[i]..offsets[i + 1]]),
            _ => None,
        }
    }

    /// The Hessian in the wanted layout, from its blocks.
    pub fn hessian<const D: usize>(&self, i: usize, blocks: Vec<f64>) -> Vec<f64> {
        match self.options.want {
            Want::Hessian => dense::<_, D>(self.batch.is_closed(i), &blocks),
            _ => blocks,
        }
    }

    pub(super) fn on_cpu<const D: usize>(&self, curves: &[&PreparedCurve<'_, D>]) -> Vec<Evaluation> {
        // Curves with the same number of edges share lanes, so that no lane is idle. A Hessian
        // dominates the cost of its curve, so a curve with a Hessian is alone.
        let kind = |k: usize| (self.batch.is_closed(curves[k].i), curves[k].points.len());
        let order = sort::order(curves.len(), &|j, k| kind(j).cmp(&kind(k)));
        let lanes = if self.options.want.has_hessian() { 1 } else { LANES };
        let groups: Vec<&[usize]> =
            order.chunk_by(|&j, &k| kind(j) == kind(k)).flat_map(|alike| alike.chunks(lanes)).collect();
        let of_group = |group: &[usize]| -> Vec<(usize, Evaluation)> {
            let curves: Vec<&PreparedCurve<D>> = group.iter().map(|&k| curves[k]).collect();
            let found = if 4 * curves.len() > LANES && has_wide_registers() {
                self.evaluate::<Lanes<f64, LANES>, D>(&curves)
            } else {
                curves.iter().flat_map(|curve| self.evaluate::<f64, D>(&[curve])).collect()
            };
            group.iter().copied().zip(found).collect()
        };
        let mut found: Vec<(usize, Evaluation)> = parallel::of(groups, of_group).into_iter().flatten().collect();
        sort::by(&mut found, |a, b| a.0.cmp(&b.0));
        found.into_iter().map(|(_, evaluation)| evaluation).collect()
    }

    /// Evaluates up to S::LANES curves side by side.
    ///
    /// Spare lanes repeat the first curve.
    fn evaluate<S: Scalar<Number = f64>, const D: usize>(&self, curves: &[&PreparedCurve<D>]) -> Vec<Evaluation> {
        let lane = |l: usize| curves[if l < curves.len() { l } else { 0 }];
        let count = curves[0].points.len();
        let closed = self.batch.is_closed(curves[0].i) && count > 0;
        let bases: Vec<&[Vector<f64, D>]> = (0..S::LANES).map(|l| &lane(l).base[..]).collect();
        let is_data = |l: usize, v: usize| self.is_data(lane(l).i).is_some_and(|data| data[v]);
        let mut edges = Edges::<S, D>::new(closed, &bases, |l, v| if is_data(l, v) { 0.0 } else { 1.0 });
        for l in 0..S::LANES {
            edges.set_torsion_curvature(l, lane(l).torsion_curvature);
            edges.set_taut(l, &lane(l).taut);
        }
        let zero = vec![[S::ZERO; D]; edges.rows()];
        edges.place(&zero);
        edges.clear();
        let mut values = S::ZERO;
        let mut gradients = zero;
        for (weight, functional) in self.energy.terms() {
            values += edges.add(S::of(*weight), functional);
        }
        let regularisation = self.options.regularisation.map(|regularisation| {
            let mut weights = S::ZERO;
            (0..S::LANES).for_each(|l| weights.set_lane(l, regularisation.weights[lane(l).i]));
            (2, weights)
        });
        if let Some((order, weights)) = regularisation {
            values += edges.add_regularisation(order, weights);
        }
        // Hessians are large, so curves with Hessians are alone.
        let mut blocks = (S::LANES == 1 && self.options.want.has_hessian()).then(|| BlockHessian::new(&edges));
        if let Some(blocks) = &mut blocks {
            let terms = self.energy.terms().iter().map(|(weight, functional)| (S::of(*weight), functional));
            blocks.assemble(&edges, &terms.collect::<Vec<_>>(), regularisation);
        }
        edges.gradient(&vec![S::ONE; edges.rows()], &mut gradients);
        let weight = self.energy.attachment_weight();
        let finish = |(l, curve): (usize, &&PreparedCurve<D>)| {
            let mut value = values.lane(l);
            let mut gradient: Vec<Vector<f64, D>> = gradients[..count].iter().map(|g| g.map(|x| x.lane(l))).collect();
            for &(vertex, target, w) in &curve.attached {
                let w = weight * w;
                for c in 0..D {
                    let away = curve.points[vertex][c] - target[c];
                    value += 0.5 * w * away * away;
                    gradient[vertex][c] += w * away;
                }
                if let Some(blocks) = &mut blocks {
                    let anchor = Anchor { spring: S::of(w), ..Anchor::NONE };
                    blocks.add_block(vertex, anchor.hessian([S::ZERO; D]));
                }
            }
            let along = |direction: &[Vector<f64, D>]| {
                direction.iter().flatten().zip(gradient.iter().flatten()).map(|(p, g)| p * g).sum()
            };
            let slope = self.direction::<D>(curve.i).map_or(0.0, along);
            let blocks = blocks.as_ref().filter(|_| count > 0).map_or(vec![], |blocks| blocks.lane(l));
            let hessian = self.hessian::<D>(curve.i, blocks);
            let gradient = if self.options.want.has_gradient() { gradient.concat() } else { vec![] };
            Evaluation { value, slope, gradient, hessian, problem: None }
        };
        curves.iter().enumerate().map(finish).collect()
    }
}

impl Evaluate<'_> {
    pub(super) fn validate(&self, energy: &Energy, batch: &CurveBatch) -> Result<()> {
        if let Some(curvature) = self.torsion_curvature
            && !(curvature > 0.0 && curvature.is_finite())
        {
            let message = format!("the torsion curvature is {curvature}: give a positive, finite number in 1/length");
            return Err(Error::Argument(message));
        }
        if let Want::Slope(direction) = self.want
            && direction.len() != batch.coords().len()
        {
            let (found, wanted) = (direction.len(), batch.coords().len());
            return Err(Error::Argument(format!("a direction of {found} numbers for {wanted} coordinates")));
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

fn degenerate(message: String) -> Unfitted {
    Unfitted { status: CurveStatus::Degenerate, message }
}

/// The edges of curve `i`, all of positive length.
fn edges<const D: usize>(
    batch: &CurveBatch,
    i: usize,
    points: &[Vector<f64, D>],
) -> Result<Vec<Vector<f64, D>>, Unfitted> {
    if let Some(problem) = batch.problem(i) {
        return Err(problem.clone());
    }
    let n = points.len();
    if batch.is_closed(i) && (1..3).contains(&n) {
        let what = format!("a closed curve of {n} vertices has no energy: give 3 at least, or mark it as open");
        return Err(degenerate(batch.sentence(i, 0, &what)));
    }
    let base: Vec<_> = (0..batch.spans(i)).map(|j| subtract(points[(j + 1) % n], points[j])).collect();
    // An edge whose square underflows has no direction either.
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

/// The vertex index, the position and the weight of every data point.
fn attached<const D: usize>(
    batch: &CurveBatch,
    targets: &CurveBatch,
    i: usize,
) -> Result<Vec<(usize, Vector<f64, D>, f64)>, Unfitted> {
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
        return Err(Unfitted { status: CurveStatus::Invalid, message: batch.sentence(i, 0, &what) });
    }
    let every = edges.checked_div(spans).unwrap_or(1);
    let weight = |k: usize| targets.weights(i).map_or(1.0, |weights| weights[k]);
    Ok(data.iter().enumerate().map(|(k, &point)| (k * every, point, weight(k))).collect())
}
