//! [`At`]: an energy at given curves, with everything that it may depend on, and what devices find there.

use super::edges::Edges;
use super::energy::{Energy, TORSION_CURVATURE};
use super::hessian::{BlockHessian, COUPLED};
use crate::batch::CurveBatch;
use crate::linalg::scalar::{Vector, dot, scale};

/// Data points that vertices are attached to.
#[derive(Clone, Copy, Debug)]
pub struct Attachments<'a> {
    /// A point for every vertex of the batch.
    pub points: &'a [f64],
    /// A weight for every vertex; 0 where there is no data point.
    pub weights: &'a [f64],
}

/// The gauge that keeps edges between data points equal.
#[derive(Clone, Copy, Debug)]
pub struct GaugeOf<'a> {
    /// A weight for every curve.
    pub weights: &'a [f64],
    /// Of every vertex of the batch, whether it is a data point.
    pub is_data: &'a [bool],
}

/// An energy at curves whose vertices are the points of a batch.
#[derive(Clone, Copy, Debug)]
pub struct At<'a> {
    /// The energy.
    pub energy: &'a Energy,
    /// The vertices.
    pub batch: &'a CurveBatch,
    /// The gauge, if it is wanted.
    pub gauge: Option<GaugeOf<'a>>,
    /// What [`attachment`](super::attachment) attaches to; without it, to nothing.
    pub attachments: Option<Attachments<'a>>,
}

/// What a kernel finds of every curve.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// One energy a curve, the gauge left out.
    pub energies: Vec<f64>,
    /// Its gauge.
    pub gauges: Vec<f64>,
    /// The derivative of both along a direction.
    pub slopes: Vec<f64>,
    /// The gradient of both, laid out as the batch's coordinates are.
    pub gradients: Vec<f64>,
    /// Four blocks of D × D numbers a vertex, row after row: with itself and with its next three,
    /// modulo the number of vertices of a closed curve.
    pub hessians: Vec<f64>,
}

/// What is wanted of every curve.
#[derive(Clone, Copy, Debug)]
pub enum Want<'a> {
    /// Energies alone.
    Value,
    /// And slopes along this direction, laid out as the batch's coordinates are.
    Slope(&'a [f64]),
    /// Energies and gradients.
    Gradient,
    /// Hessians alone.
    Hessian,
}

impl Want<'_> {
    /// The kernel's entry point.
    pub(super) fn entry(self) -> &'static str {
        match self {
            Want::Value => "value",
            Want::Slope(_) => "slope",
            Want::Gradient => "gradient",
            Want::Hessian => "hessian",
        }
    }
}

impl Found {
    /// What is found of curves where nothing is computed: zeros at vertices, and of curves 0 or NaN.
    pub(super) fn new(at: &At<'_>, want: Want<'_>) -> Self {
        let (points, d) = (at.batch.total_points(), at.batch.dimension());
        let mut found = Found::default();
        if let Want::Hessian = want {
            found.hessians = vec![0.0; points * (COUPLED + 1) * d * d];
            return found;
        }
        for numbers in [&mut found.energies, &mut found.gauges, &mut found.slopes] {
            *numbers = (0..at.batch.len()).map(|i| if at.is_nothing(i) { 0.0 } else { f64::NAN }).collect();
        }
        if let Want::Gradient = want {
            found.gradients = vec![0.0; points * d];
        }
        found
    }
}

impl At<'_> {
    /// Whether there is something to compute: at least an edge (three on closed curves), and none
    /// without a direction.
    pub(super) fn is_evaluated(&self, i: usize) -> bool {
        let (d, count) = (self.batch.dimension(), self.batch.count(i));
        let least = if self.batch.is_closed(i) { 3 } else { 2 };
        let points = self.batch.points(i);
        let square = |j: usize| {
            let next = (j + 1) % count;
            (0..d).map(|c| points[next * d + c] - points[j * d + c]).map(|x| x * x).sum::<f64>()
        };
        count >= least
            && points.iter().all(|x| x.is_finite())
            && (0..self.batch.spans(i)).all(|j| square(j).is_normal())
    }

    /// Whether a curve has no edge and no problem: its energies are 0.
    pub(super) fn is_nothing(&self, i: usize) -> bool {
        let least = if self.batch.is_closed(i) { 0 } else { 1 };
        self.batch.count(i) <= least && self.batch.points(i).iter().all(|x| x.is_finite())
    }

    /// ε of torsion, in the units of the input: over the diagonal of the curve's bounding box.
    pub(super) fn torsion_curvature(&self, i: usize) -> f64 {
        let d = self.batch.dimension();
        let diagonal = (0..d).map(|c| self.extent(i, c)).fold(0.0, f64::hypot);
        if diagonal > 0.0 { TORSION_CURVATURE / diagonal } else { TORSION_CURVATURE }
    }

    fn extent(&self, i: usize, c: usize) -> f64 {
        let axis = || self.batch.points(i).iter().skip(c).step_by(self.batch.dimension());
        let low = axis().fold(f64::INFINITY, |low, &x| low.min(x));
        let high = axis().fold(f64::NEG_INFINITY, |high, &x| high.max(x));
        high - low
    }

    /// Half the largest extent of a curve, 1 where there is none: the unit of its coordinates on a
    /// device.
    pub(super) fn size(&self, i: usize) -> f64 {
        let size = (0..self.batch.dimension()).map(|c| 0.5 * self.extent(i, c)).fold(0.0, f64::max);
        if size > 0.0 && size.is_finite() { size } else { 1.0 }
    }

    /// The weight of a curve's gauge.
    pub(super) fn gauge(&self, i: usize) -> f64 {
        self.gauge.map_or(0.0, |gauge| gauge.weights[i])
    }

    /// The same as [`evaluate`](super::evaluate_gpu::evaluate) does, on the CPU in f64.
    pub fn on_cpu(&self, want: Want<'_>) -> Found {
        let mut found = Found::new(self, want);
        for i in (0..self.batch.len()).filter(|&i| self.is_evaluated(i)) {
            match self.batch.dimension() {
                2 => self.curve_on_cpu::<2>(i, want, &mut found),
                _ => self.curve_on_cpu::<3>(i, want, &mut found),
            }
        }
        found
    }

    fn curve_on_cpu<const D: usize>(&self, i: usize, want: Want<'_>, found: &mut Found) {
        let (batch, count) = (self.batch, self.batch.count(i));
        let first = batch.offsets()[i];
        let at = |numbers: &[f64], v: usize| -> Vector<f64, D> { std::array::from_fn(|c| numbers[v * D + c]) };
        let difference =
            |a: Vector<f64, D>, b: Vector<f64, D>| -> Vector<f64, D> { std::array::from_fn(|c| a[c] - b[c]) };
        let vertices = batch.points(i);
        let base: Vec<Vector<f64, D>> =
            (0..batch.spans(i)).map(|j| difference(at(vertices, (j + 1) % count), at(vertices, j))).collect();
        let is_data: Vec<bool> =
            (first..first + count).map(|v| self.gauge.is_some_and(|gauge| gauge.is_data[v])).collect();
        let mut edges = Edges::<f64, D>::new(batch.is_closed(i), &[&base], &[&is_data]);
        edges.set_torsion_curvature(0, self.torsion_curvature(i));
        let zero = vec![[0.0; D]; edges.rows()];
        edges.place(&zero);
        let gauge = self.gauge.map(|gauge| gauge.weights[i]);
        let attached = self.energy.attachment_weight();
        let attachment = |v: usize| -> (Vector<f64, D>, f64) {
            self.attachments.map_or(([0.0; D], 0.0), |attachments| {
                (
                    difference(at(vertices, v), at(attachments.points, first + v)),
                    attached * attachments.weights[first + v],
                )
            })
        };
        if let Want::Hessian = want {
            let mut hessian = BlockHessian::new(&edges);
            hessian.assemble(
                &edges,
                self.energy.terms().iter().map(|(weight, functional)| (*weight, functional)),
                gauge.map(|weight| (2, weight)),
            );
            (0..count).for_each(|v| hessian.add_diagonal(v, attachment(v).1));
            for v in 0..count {
                let to = &mut found.hessians[(first + v) * (COUPLED + 1) * D * D..][..(COUPLED + 1) * D * D];
                to.iter_mut().zip(hessian.blocks()[v].iter().flatten().flatten()).for_each(|(to, x)| *to = *x);
            }
            return;
        }
        edges.clear();
        let mut energy: f64 =
            self.energy.terms().iter().map(|(weight, functional)| edges.add(*weight, functional)).sum();
        found.gauges[i] = gauge.map_or(0.0, |weight| edges.add_gauge(2, weight));
        let mut g = zero;
        edges.gradient(&vec![1.0; edges.rows()], &mut g);
        found.slopes[i] = 0.0;
        for (v, g) in g.iter_mut().enumerate().take(count) {
            let (offset, weight) = attachment(v);
            energy += 0.5 * weight * dot(offset, offset);
            let pull = scale(weight, offset);
            (0..D).for_each(|c| g[c] += pull[c]);
            match want {
                Want::Slope(p) => found.slopes[i] += dot(*g, at(p, first + v)),
                Want::Gradient => found.gradients[(first + v) * D..][..D].copy_from_slice(g),
                _ => {}
            }
        }
        found.energies[i] = energy;
    }
}
