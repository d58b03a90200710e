//! [`Segment`]: one smooth connection function.

use std::sync;

use super::arc::{Arc, Site};
use super::curves::{Chain, ChainCurve};
use super::universal::Universal;

/// The curve of least ∫|κ|^ν ds between two points with given tangents: the segment of Alon and
/// Bergmann.
///
/// In the frame of its chord it runs from (0, 0) to (chord, 0), with end tangents at the angles a
/// and b from the chord. Its curvature satisfies |κ|^ν = c cos ψ, with the angle ψ of the tangent
/// from the direction of a force. It is therefore a piece of one universal curve per ν, with at
/// most one inflection. Costs and points have relative errors of about 1e-13.
///
/// Not every pair of angles has a minimiser: if a − b is π or more, and for larger ν well before,
/// curves become ever larger and cheaper. A segment is the cheapest of the stationary curves with
/// at most one inflection, and a local minimum. A curve with more inflections turns by π from one
/// to the next, which no minimiser does.
///
/// κ = 0 only at single points, for every ν. For ν > 2 the curvature has an infinite slope there.
///
/// ```
/// use faircurve::scf::Segment;
///
/// let quarter = std::f64::consts::FRAC_PI_2;
/// let arch = Segment::between(2.0, [quarter, -quarter], 2.0).unwrap();
/// // Bernoulli's rectangular elastica: cost · chord = (2π/ϖ)², length/chord = ϖ²/π.
/// assert!((arch.cost() * 2.0 - 5.742160088369037).abs() < 1e-12);
/// // At half a turn lengths go with the root of the angles, and those are rounded.
/// assert!((arch.length() / 2.0 - 2.188439615226477).abs() < 1e-6);
/// // Turning by 180° and more has no minimiser.
/// assert!(Segment::between(2.0, [1.7, -1.7], 2.0).is_none());
/// ```
#[derive(Clone, Debug)]
pub struct Segment {
    arc: Arc,
    curve: sync::Arc<Universal>,
}

impl Segment {
    /// The cheapest segment over a chord of this length, for end tangents at these angles from it
    /// (radians, from −π to π) and ν > 1.
    ///
    /// `None` if there is no minimiser, the chord is not positive, ν is not above 1, or a number is
    /// not finite.
    pub fn between(chord: f64, angles: [f64; 2], exponent: f64) -> Option<Self> {
        let curve = universal(chord, angles, exponent)?;
        Some(Segment { arc: Arc::cheapest(&curve, chord, angles)?, curve })
    }

    /// All stationary segments with at most one inflection, the cheapest first. There are at most
    /// two.
    pub fn stationary(chord: f64, angles: [f64; 2], exponent: f64) -> Vec<Self> {
        let Some(curve) = universal(chord, angles, exponent) else { return Vec::new() };
        let segment = |arc: Arc| Segment { arc, curve: curve.clone() };
        Arc::stationary(&curve, chord, angles).into_iter().map(segment).collect()
    }

    /// ν
    pub fn exponent(&self) -> f64 {
        self.curve.exponent
    }

    /// ∫|κ|^ν ds, in length^{1−ν}.
    pub fn cost(&self) -> f64 {
        self.arc.cost(&self.curve)
    }

    /// The arc length.
    pub fn length(&self) -> f64 {
        self.arc.length(&self.curve)
    }

    /// The direction φ of the force, from the chord: |κ|^ν is proportional to cos(θ − φ). 0 if the
    /// segment is straight.
    pub fn force_direction(&self) -> f64 {
        self.arc.force_direction()
    }

    /// Whether the curvature changes sign inside.
    pub fn has_inflection(&self) -> bool {
        self.arc.has_inflection()
    }

    /// The curvatures at both ends, positive to the left.
    pub fn curvatures(&self) -> [f64; 2] {
        self.arc.curvatures(&self.curve)
    }

    /// The bending moments |κ|^{ν−1} sgn κ at both ends. The cost's derivatives by the end angles
    /// are −ν and ν times these.
    pub fn moments(&self) -> [f64; 2] {
        self.curvatures().map(|curvature| curvature.signum() * curvature.abs().powf(self.curve.exponent - 1.0))
    }

    /// The site at an arc length from the start, clamped to the segment.
    #[doc(hidden)]
    pub fn at(&self, arc_length: f64) -> Site {
        self.arc.at(&self.curve, (arc_length / self.length()).clamp(0.0, 1.0)).0
    }

    /// The sites at which the tangent has this angle from the chord: none, one, or two if the
    /// segment has an inflection.
    #[doc(hidden)]
    pub fn at_angle(&self, angle: f64) -> Vec<Site> {
        self.arc.at_angle(angle).into_iter().map(|t| self.arc.site(&self.curve, t)).collect()
    }

    /// The points of a polyline within `tolerance` (in units of the chord, > 0) of the segment,
    /// including both ends. Points are denser where it curves more.
    pub fn polyline(&self, tolerance: f64) -> Vec<[f64; 2]> {
        let length = self.length();
        let mut points = vec![[0.0, 0.0]];
        // Between two tangents, an arc of length s that turns by τ deviates by at most s |τ|/8 from
        // its chord, and by s²κ/8 for the largest curvature κ.
        let mut pending = vec![(0.0, 1.0, MOST_HALVINGS)];
        while let Some((from, to, halvings)) = pending.pop() {
            let middle = 0.5 * (from + to);
            let most =
                (0..=4).map(|k| self.arc.at(&self.curve, from + 0.25 * f64::from(k) * (to - from)).0.curvature.abs());
            let step = (to - from) * length;
            if halvings > 0 && step * step * most.fold(0.0, f64::max) / 8.0 > tolerance {
                pending.push((middle, to, halvings - 1));
                pending.push((from, middle, halvings - 1));
            } else {
                points.push(self.arc.at(&self.curve, to).0.point);
            }
        }
        points
    }

    /// The control points of G¹ cubic Béziers within `tolerance` (in units of the chord, > 0) of
    /// the segment: see [`Curve::beziers`](crate::Curve::beziers).
    pub fn beziers(&self, tolerance: f64) -> Vec<[[f64; 2]; 4]> {
        let chain = Chain::one(self.arc, &self.curve);
        let universal = std::slice::from_ref(&*self.curve);
        let curve = ChainCurve { chain: &chain, universal, closed: false };
        let flat = |p: glam::DVec3| [p.x, p.y];
        crate::Curve::beziers(&curve, tolerance).into_iter().map(|piece| piece.map(flat)).collect()
    }
}

/// The most halvings: 2¹⁶ points are more than any tolerance above rounding needs.
const MOST_HALVINGS: u32 = 16;

fn universal(chord: f64, angles: [f64; 2], exponent: f64) -> Option<sync::Arc<Universal>> {
    let sound = chord > 0.0
        && chord.is_finite()
        && exponent > 1.0
        && exponent.is_finite()
        && angles.iter().all(|angle| angle.abs() <= std::f64::consts::PI);
    sound.then(|| sync::Arc::new(Universal::new(exponent)))
}
