//! [`Divided`]: strokes that could not be fitted, divided into their arcs.
//!
//! The coast of a continent is one stroke, which a single bad place would leave unfitted.

use std::sync::Arc;

use super::Topology;
use super::tight::polylines;
use crate::batch::{CurveBatch, Piece};
use crate::curve::{Curve, Sampling};
use crate::report::{CurveSet, Fit};

/// Strokes that could not be fitted, arc by arc: [`Topology::divide`].
pub struct Divided {
    topology: Arc<Topology>,
    arcs: CurveBatch,
    /// Number of divided strokes.
    count: usize,
    /// The origin of every stroke.
    places: Vec<Place>,
}

#[derive(Clone, Copy)]
enum Place {
    /// The fit of the original strokes.
    Before(usize),
    /// The fit of the arcs.
    Arcs(usize),
}

impl Topology {
    /// Divides the strokes of several arcs that could not be fitted, if there are any.
    ///
    /// Their arcs are to be fitted one by one, with corners at junctions.
    ///
    /// # Panics
    /// If the fit is not of the [`strokes`](Self::strokes).
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
    /// Number of divided strokes.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The arcs to fit.
    pub fn arcs(&self) -> &CurveBatch {
        &self.arcs
    }

    /// The topology with divided strokes and their fit, from the fit `before` and the fit of the
    /// [`arcs`](Self::arcs).
    ///
    /// # Panics
    /// If a fit has another number of curves.
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
