//! [`Divided`]: strokes without a curve, taken apart at their junctions.
//!
//! The coast of a continent is one stroke. A place of it where a method has no curve would leave all of it unfitted.

use std::sync::Arc;

use super::Topology;
use super::tight::polylines;
use crate::batch::{CurveBatch, Piece};
use crate::curve::{Curve, Sampling};
use crate::report::{CurveSet, Fit};

/// Strokes of several arcs that have no curve, arc by arc: [`Topology::divide`].
pub struct Divided {
    topology: Arc<Topology>,
    arcs: CurveBatch,
    /// Number of strokes that were taken apart.
    count: usize,
    /// Where every stroke is found.
    places: Vec<Place>,
}

#[derive(Clone, Copy)]
enum Place {
    /// In the fit of the strokes as they were.
    Before(usize),
    /// In the fit of the arcs.
    Arcs(usize),
}

impl Topology {
    /// Takes apart the strokes of several arcs that came out without a curve, if there are any.
    ///
    /// Each of their arcs is to be fitted as a curve of its own, which may have a corner at
    /// junctions.
    ///
    /// # Panics
    /// If the fit is of something else than the [`strokes`](Self::strokes).
    pub fn divide(&self, fit: &Fit) -> Option<Divided> {
        let strokes = &self.strokes;
        assert_eq!(fit.len(), strokes.arcs.len(), "a fit of the strokes");
        let apart = |stroke: usize| !fit.reports()[stroke].status.is_usable() && strokes.arcs[stroke].len() > 1;
        let count = (0..fit.len()).filter(|&stroke| apart(stroke)).count();
        if count == 0 {
            return None;
        }
        let divided = strokes.divided(&self.batch, &self.vertices, &self.arcs, apart);
        let mut arcs = Vec::new();
        let place = |(number, of): (usize, &Vec<u32>)| match strokes.places[of[0] as usize].stroke as usize {
            stroke if apart(stroke) => {
                let points = divided.batch.count(number);
                arcs.push(Piece { curve: number, first: 0, count: points, closed: false });
                Place::Arcs(arcs.len() - 1)
            }
            stroke => Place::Before(stroke),
        };
        let places = divided.arcs.iter().enumerate().map(place).collect();
        let arcs = divided.batch.cut(arcs);
        let topology = Arc::new(Topology { strokes: divided, ..self.clone() });
        Some(Divided { topology, arcs, count, places })
    }
}

impl Divided {
    /// Number of strokes that were taken apart.
    pub fn count(&self) -> usize {
        self.count
    }

    /// What is to be fitted: the arcs of these strokes.
    pub fn arcs(&self) -> &CurveBatch {
        &self.arcs
    }

    /// The topology whose strokes are what was fitted, and their fit: of the strokes that had a
    /// curve `before`, and of the [`arcs`](Self::arcs).
    ///
    /// # Panics
    /// If a fit is of something else.
    pub fn with(self, before: Fit, arcs: Fit) -> (Arc<Topology>, Fit) {
        assert_eq!(arcs.len(), self.arcs.len(), "a fit of the arcs");
        let Divided { topology, places, .. } = self;
        let report = |place: &Place| match *place {
            Place::Before(stroke) => before.reports()[stroke].clone(),
            Place::Arcs(arc) => arcs.reports()[arc].clone(),
        };
        let (reports, device) = (places.iter().map(report).collect(), before.device().clone());
        let batch = topology.strokes().clone();
        (topology, Fit::new(Both { before, arcs, places, batch }, reports, device))
    }
}

/// Curves of both fits.
struct Both {
    before: Fit,
    arcs: Fit,
    places: Vec<Place>,
    batch: CurveBatch,
}

impl CurveSet for Both {
    fn curve(&self, i: usize) -> Box<dyn Curve + '_> {
        match self.places[i] {
            Place::Before(stroke) => self.before.curve(stroke),
            Place::Arcs(arc) => self.arcs.curve(arc),
        }
    }

    fn polylines(&self, sampling: Sampling) -> CurveBatch {
        polylines(self, &self.batch, sampling)
    }
}
