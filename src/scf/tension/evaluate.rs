//! Evaluates segments under tension for a search of the directions: cost, gradient and Hessian of
//! many segments with the same exponent.

use super::hessian::STRAIGHT;
use super::quadrature::{Law, Pull};
use super::shape::{Course, Shape};
use super::solve::near::smoothed;
use super::{Frame, PI, TensionSegment};
use crate::scf::evaluation::Evaluation;
use crate::scf::problem::Ends;

/// The quadrature rules of an exponent, computed once.
#[derive(Clone, Debug)]
pub(crate) struct TensionLaw(Law);

impl TensionLaw {
    pub fn new(exponent: f64) -> Self {
        TensionLaw(Law::new(exponent, 1.0))
    }

    pub fn exponent(&self) -> f64 {
        self.0.nu
    }

    /// The numbers of the kernel's block.
    pub fn packed(&self) -> Vec<f64> {
        self.0.packed()
    }
}

/// The kinds of shapes that the kernel follows, by its codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Followed {
    Nothing,
    Below,
    Flat,
    Above,
    FreeFlat,
    FreeAbove,
}

/// The last solution for a span, if any.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Near {
    shape: Option<Shape>,
    /// The angles and the evaluation there.
    found: Option<([f64; 2], Evaluation<f64>)>,
}

impl Near {
    /// The kind of the known shape and its two unknowns, in the kernel's format.
    pub fn packed(&self, law: &TensionLaw, &TensionSpan { tension, ends, .. }: &TensionSpan) -> [f64; 3] {
        let nothing = (Followed::Nothing, 0.0, 0.0);
        let (kind, first, second) = self.shape.map_or(nothing, |shape| {
            let Shape { pull, axis, course, ends: [low, high], .. } = shape;
            match (pull, course, ends) {
                (_, _, Ends::Straight) | (_, Course::Around(_), _) => nothing,
                // For ν ≤ 2 only straight segments have a straight piece.
                (Pull::Critical, ..) if law.0.nu <= 2.0 => nothing,
                (Pull::Below(gap), _, Ends::Directed) => (Followed::Below, gap, axis),
                (Pull::Critical, _, Ends::Directed) => (Followed::Flat, 0.0, axis),
                (Pull::Above(t), Course::Direct, Ends::Directed) => {
                    (Followed::Above, t / tension, smoothed(&law.0, -high))
                }
                (Pull::Above(t), Course::Through(_), Ends::Directed) => {
                    (Followed::Above, t / tension, smoothed(&law.0, high))
                }
                (Pull::Below(_), ..) => nothing,
                (Pull::Critical, ..) => (Followed::FreeFlat, 0.0, low.abs()),
                (Pull::Above(t), ..) => (Followed::FreeAbove, t / tension, low),
            }
        });
        [f64::from(kind as u8), first, second]
    }
}

/// A span whose end tangents a search turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TensionSpan {
    pub chord: f64,
    /// λ·chord^ν: λ on a chord of 1.
    pub tension: f64,
    pub ends: Ends,
}

impl TensionSpan {
    /// Its chord in the unit in which λ is 1, and the unit of costs there for a chord of 1.
    pub fn units(&self, law: &TensionLaw) -> [f64; 2] {
        [self.tension.powf(1.0 / law.0.nu), self.tension.powf(law.0.q)]
    }

    fn frame(&self, law: &TensionLaw, angles: [f64; 2]) -> Option<Frame> {
        if !angles.iter().all(|angle| angle.abs() <= PI) || !self.tension.is_normal() {
            return None;
        }
        Some(Frame::of(self.chord, angles, law.0.under(self.tension)))
    }

    /// The segment with these end angles. The angle of a free end is ignored.
    pub fn segment(&self, law: &TensionLaw, angles: [f64; 2]) -> Option<TensionSegment> {
        self.segment_by(law, angles, None)
    }

    /// The segment of the same kind as a known one and near it. If none exists, as
    /// [`segment`](Self::segment).
    pub fn segment_near(&self, law: &TensionLaw, angles: [f64; 2], known: &Near) -> Option<TensionSegment> {
        let near = known.shape.and_then(|shape| self.segment_by(law, angles, Some(&shape)));
        near.or_else(|| self.segment(law, angles))
    }

    /// Whether a segment of the same kind as a known one is found near it.
    #[cfg(test)]
    pub fn is_followed(&self, law: &TensionLaw, angles: [f64; 2], known: &Near) -> bool {
        known.shape.is_some_and(|shape| self.segment_by(law, angles, Some(&shape)).is_some())
    }

    pub(super) fn segment_by(
        &self,
        law: &TensionLaw,
        [a, b]: [f64; 2],
        known: Option<&Shape>,
    ) -> Option<TensionSegment> {
        match self.ends {
            Ends::Directed => {
                let frame = self.frame(law, [a, b])?;
                known.map_or_else(|| frame.solved(), |shape| frame.segment(frame.solver().near(shape)?))
            }
            Ends::FreeStart | Ends::FreeEnd => {
                let (given, end) = if self.ends == Ends::FreeStart { (b, 0) } else { (a, 1) };
                // Mirrored so that the free end has the greater angle.
                let mut frame = self.frame(law, [given; 2])?;
                let mut solver = frame.solver();
                solver.low = -given.abs();
                let shape = known.map_or_else(|| solver.free(), |shape| solver.near_free(shape))?;
                frame.mirror = if given > 0.0 { -1.0 } else { 1.0 };
                frame.angles = [-given.abs(); 2];
                frame.angles[end] = shape.axis;
                frame.segment(shape)
            }
            Ends::Straight => self.frame(law, [0.0; 2])?.solved(),
        }
    }

    /// The cost and derivatives on a chord of 1, under the tension λ·chord^ν, near the last
    /// solution if possible.
    pub fn evaluate(&self, law: &TensionLaw, angles: [f64; 2], known: &mut Near) -> Evaluation<f64> {
        if let Some((_, found)) = known.found.filter(|(before, _)| *before == angles) {
            return found;
        }
        let segment = self.segment_near(law, angles, known);
        if let Some(segment) = &segment {
            known.shape = Some(segment.shape);
        }
        let found = segment.map(|segment| {
            let mut hessian = segment.hessian(self.ends);
            if self.ends != Ends::Straight && angles.iter().all(|angle| angle.abs() < STRAIGHT) {
                let bent = self.segment(law, [STRAIGHT, -STRAIGHT]);
                hessian = bent.map_or([f64::NAN; 3], |bent| bent.hessian(self.ends));
            }
            let [first, last] = segment.moments();
            let nu = law.exponent();
            let scale = self.chord.powf(nu - 1.0);
            let gradient = match self.ends {
                Ends::Directed => [-nu * first, nu * last],
                Ends::FreeStart => [0.0, nu * last],
                Ends::FreeEnd => [-nu * first, 0.0],
                Ends::Straight => [0.0; 2],
            };
            Evaluation { cost: scale * segment.cost(), gradient: gradient.map(|g| scale * g), hessian, exists: 1.0 }
        });
        let sound = |found: &Evaluation<f64>| {
            [found.cost].iter().chain(&found.gradient).chain(&found.hessian).all(|x| x.is_finite())
        };
        let found = found.filter(sound).unwrap_or(Evaluation::missing());
        known.found = Some((angles, found));
        found
    }
}

impl TensionSegment {
    /// The second derivatives on a chord of 1 by the end angles: first, both, last.
    pub(super) fn hessian(&self, ends: Ends) -> [f64; 3] {
        let [first, last] = self.angles;
        match ends {
            Ends::Straight => [0.0; 3],
            Ends::FreeStart => [0.0, 0.0, self.shape.hessian_of_free(&self.law, last)],
            Ends::FreeEnd => [self.shape.hessian_of_free(&self.law, first), 0.0, 0.0],
            Ends::Directed => {
                let [low, both, high] = self.shape.hessian(&self.law, first.min(last), first.max(last));
                if first <= last { [low, both, high] } else { [high, both, low] }
            }
        }
    }
}
