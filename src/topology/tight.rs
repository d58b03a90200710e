//! [`Tight`]: curves with some spans replaced by cubics.

use glam::DVec3;
use rustc_hash::FxHashMap;

use crate::batch::CurveBatch;
use crate::curve::{Curve, Jet, Sampling};
use crate::motion::Motion;
use crate::parallel;
use crate::report::{CurveSet, Fit};
use crate::surface::Globe;

/// Roundings of the largest coordinate by which handles on a chord miss it.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Strokes with some spans replaced by cubics.
pub(super) struct Tightened {
    pub fit: Fit,
    pub cubics: FxHashMap<u32, FxHashMap<u32, [DVec3; 4]>>,
    pub batch: CurveBatch,
}

impl CurveSet for Tightened {
    fn curve(&self, i: usize) -> Box<dyn Curve + '_> {
        let curve = self.fit.curve(i);
        match self.cubics.get(&(i as u32)) {
            None => curve,
            Some(cubics) => Box::new(Tight { curve, cubics }),
        }
    }

    fn polylines(&self, sampling: Sampling) -> CurveBatch {
        polylines(self, &self.batch, sampling)
    }
}

/// The samples of curves, each from its own [`Curve`].
pub(super) fn polylines(curves: &impl CurveSet, batch: &CurveBatch, sampling: Sampling) -> CurveBatch {
    let d = batch.dimension();
    let samples = parallel::map(batch.len(), 1, |i| {
        let curve = curves.curve(i);
        let at = |span: usize, u: f64| {
            curve.knots().get(span).map_or(0.0, |knot| knot + if u > 0.0 { u * curve.pace(span) } else { 0.0 })
        };
        let sites = curve.sites(sampling);
        let coords = sites.iter().flat_map(|&(span, u)| curve.jet(span, u).point.to_array().into_iter().take(d));
        (coords.collect(), sites.iter().map(|&(span, u)| at(span, u)).collect())
    });
    let closing = |i: usize, last: f64| curves.curve(i).domain().1 - last;
    CurveBatch::samples_of(batch, d, samples, closing)
}

/// A curve with some spans replaced by cubics.
pub(super) struct Tight<'a> {
    pub curve: Box<dyn Curve + 'a>,
    pub cubics: &'a FxHashMap<u32, [DVec3; 4]>,
}

impl Tight<'_> {
    fn cubic(&self, span: usize) -> Option<&[DVec3; 4]> {
        self.cubics.get(&(span as u32))
    }
}

/// Whether a cubic is its chord, run through evenly.
fn is_chord(&[p, q, r, s]: &[DVec3; 4]) -> bool {
    let chord = s - p;
    let off = (3.0 * (q - p) - chord).abs().max((3.0 * (s - r) - chord).abs());
    off.max_element() <= ROUNDING * (p.abs().max(s.abs())).max_element()
}

impl Curve for Tight<'_> {
    fn dimension(&self) -> usize {
        self.curve.dimension()
    }

    fn is_closed(&self) -> bool {
        self.curve.is_closed()
    }

    fn knots(&self) -> &[f64] {
        self.curve.knots()
    }

    fn is_fitted(&self) -> bool {
        self.curve.is_fitted()
    }

    fn globe(&self) -> Option<Globe> {
        self.curve.globe()
    }

    fn pace(&self, span: usize) -> f64 {
        self.curve.pace(span)
    }

    fn jet(&self, span: usize, u: f64) -> Jet {
        let Some(&[p, q, r, s]) = self.cubic(span) else { return self.curve.jet(span, u) };
        let (a, b, c) = (3.0 * (q - p), 3.0 * (p - 2.0 * q + r), (s - p) - 3.0 * (r - q));
        let point = match u {
            0.0 => p,
            1.0 => s,
            _ => p + (a + (b + c * u) * u) * u,
        };
        let pace = self.pace(span);
        Jet {
            point,
            first: (a + (2.0 * b + 3.0 * c * u) * u) / pace,
            second: (2.0 * b + 6.0 * c * u) / (pace * pace),
            third: 6.0 * c / (pace * pace * pace),
        }
    }

    /// A span at its chord keeps its data points. Others have samples where a tolerance asks for them.
    fn is_fixed(&self, span: usize) -> bool {
        let before = span.checked_sub(1).unwrap_or(self.spans() - 1);
        [span, before].into_iter().filter_map(|span| self.cubic(span)).any(is_chord) || self.curve.is_fixed(span)
    }

    fn pieces(&self, span: usize) -> usize {
        self.cubic(span).map_or_else(|| self.curve.pieces(span), |_| 1)
    }

    fn motion(&self, span: usize, piece: usize) -> Option<Motion> {
        match self.cubic(span) {
            // A cubic of longitudes and latitudes is no motion on the ground.
            Some(&cubic) => self.curve.globe().is_none().then(|| Motion::of_bezier(cubic)),
            None => self.curve.motion(span, piece),
        }
    }
}
