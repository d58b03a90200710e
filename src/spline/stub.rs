//! Temporary.
use super::knots::Knots;
use crate::batch::CurveBatch;
use crate::curve::*;
use crate::report::CurveSet;
use std::borrow::Cow;
pub(crate) struct Stub {
    pub knots: Knots,
    pub second: Vec<f64>,
    pub batch: CurveBatch,
}
struct One<'a>(&'a Stub, usize);
impl CurveSet for Stub {
    fn curve(&self, i: usize) -> Box<dyn Curve + '_> {
        if self.knots.range(i).is_empty() {
            Box::new(Polygon {
                coords: self.batch.points(i),
                dimension: self.batch.dimension(),
                closed: self.batch.is_closed(i),
            })
        } else {
            Box::new(One(self, i))
        }
    }
    fn polylines(&self, _: Sampling) -> CurveBatch {
        todo!()
    }
}
impl Curve for One<'_> {
    fn dimension(&self) -> usize {
        self.0.knots.dimension
    }
    fn is_closed(&self) -> bool {
        self.0.knots.closed[self.1]
    }
    fn knots(&self) -> Cow<'_, [f64]> {
        Cow::Borrowed(self.0.knots.t(self.1))
    }
    fn jet(&self, span: usize, u: f64) -> Jet {
        let d = self.0.knots.dimension;
        let r = self.0.knots.range(self.1);
        let at = |a: &[f64], k: usize| vector(&a[(r.start + k) * d..(r.start + k + 1) * d]);
        let t = self.0.knots.t(self.1);
        let h = t[span + 1] - t[span];
        let (a, b) = (at(&self.0.knots.values, span), at(&self.0.knots.values, span + 1));
        let (m, q) = (at(&self.0.second, span), at(&self.0.second, span + 1));
        let v = 1.0 - u;
        let point = if u == 0.0 {
            a
        } else if u == 1.0 {
            b
        } else {
            a * v + b * u + (m * (v * v * v - v) + q * (u * u * u - u)) * (h * h / 6.0)
        };
        Jet {
            point,
            first: (b - a) / h + (m * (1.0 - 3.0 * v * v) + q * (3.0 * u * u - 1.0)) * (h / 6.0),
            second: m * v + q * u,
            third: (q - m) / h,
        }
    }
}
