//! [`Arc`]: a piece of a universal curve placed between two points.
//!
//! Computed in f64 on the host. If the ends of a piece are close together, series of differences
//! keep the digits of its points.

use std::f64::consts::{FRAC_PI_2, PI};

use super::root::{CLOSE, Canonical, Piece, cheapest, from_inflection, second};
use super::universal::{DIFFERENCE_TERMS, DIFFERENCES, Universal};

/// A point of a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// The position, in units of the chord's length.
    pub point: [f64; 2],
    /// The angle of the tangent from the chord, in radians.
    pub angle: f64,
    /// The curvature, positive to the left, in 1/length.
    pub curvature: f64,
}

/// A segment between (0, 0) and (chord, 0): a piece of its universal curve, with its scale and
/// orientation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Arc {
    /// The length of the chord.
    pub chord: f64,
    /// T₀ and T₁, signed, of the canonical piece. Both are 0 if the segment is straight.
    pub range: [f64; 2],
    /// D, the canonical piece's chord.
    unit: f64,
    /// φ of the canonical piece.
    force: f64,
    /// −1 if the canonical piece is mirrored, else 1.
    mirrored: f64,
    /// Whether it runs from the other end.
    swapped: bool,
}

impl Arc {
    /// A straight segment.
    pub fn straight(chord: f64) -> Self {
        Arc { chord, range: [0.0; 2], unit: 0.0, force: 0.0, mirrored: 1.0, swapped: false }
    }

    /// The cheapest segment with these end angles.
    pub fn cheapest(curve: &Universal, chord: f64, [a, b]: [f64; 2]) -> Option<Self> {
        if a.abs().max(b.abs()) < f64::MIN_POSITIVE.sqrt() {
            return Some(Arc::straight(chord));
        }
        let canonical = Canonical::of(a, b);
        let (piece, found) = cheapest(curve, canonical.angles);
        (found > 0.0).then(|| Arc::of(&piece, &canonical, chord))
    }

    /// All segments with these end angles and at most one inflection, the cheapest first.
    pub fn stationary(curve: &Universal, chord: f64, [a, b]: [f64; 2]) -> Vec<Self> {
        let mut arcs: Vec<Arc> = Arc::cheapest(curve, chord, [a, b]).into_iter().collect();
        let canonical = Canonical::of(a, b);
        if let Some(first) = arcs.first().copied().filter(|first| !first.is_straight()) {
            arcs.extend(
                second(curve, canonical.angles, (-first.range[0]).max(0.0))
                    .map(|piece| Arc::of(&piece, &canonical, chord)),
            );
        }
        arcs
    }

    /// The segment that starts with a free direction and ends at the angle b. A segment with a free
    /// end is this one mirrored and reversed.
    pub fn free(curve: &Universal, chord: f64, b: f64) -> Option<Self> {
        if b.abs() < f64::MIN_POSITIVE.sqrt() {
            return Some(Arc::straight(chord));
        }
        let (piece, found) = from_inflection(curve, -b.abs());
        let canonical = Canonical { angles: [0.0, -b.abs()], mirrored: -b.signum(), swapped: -1.0 };
        // φ = b − π/2 + t₁
        let arc = Arc::of(&piece, &canonical, chord);
        (found > 0.0).then_some(Arc { force: -b.abs() - FRAC_PI_2 + piece.t[1], ..arc })
    }

    /// This segment from its other end: (a, b) becomes (−b, −a).
    pub fn reversed(self) -> Self {
        Arc { swapped: !self.swapped, ..self }
    }

    fn of(piece: &Piece<f64>, canonical: &Canonical<f64>, chord: f64) -> Self {
        Arc {
            chord,
            range: [piece.side * piece.t[0], piece.t[1]],
            unit: piece.chord,
            force: canonical.angles[0] - FRAC_PI_2 + piece.t[0],
            mirrored: canonical.mirrored,
            swapped: canonical.swapped > 0.0,
        }
    }

    /// Whether it has no curvature anywhere.
    pub fn is_straight(&self) -> bool {
        self.unit == 0.0
    }

    /// r, the unit of length of the universal curve.
    fn radius(&self) -> f64 {
        self.chord / self.unit
    }

    /// Arc length.
    pub fn length(&self, curve: &Universal) -> f64 {
        if self.is_straight() {
            return self.chord;
        }
        self.radius() * curve.length_between(self.range[0], self.range[1])
    }

    /// ∫|κ|^ν ds
    pub fn cost(&self, curve: &Universal) -> f64 {
        if self.is_straight() {
            return 0.0;
        }
        self.radius().powf(1.0 - curve.exponent) * curve.along_between(self.range[0], self.range[1])
    }

    /// The direction of the force, from the chord; 0 if the segment is straight.
    pub fn force_direction(&self) -> f64 {
        self.turned(self.force)
    }

    /// Converts an angle of the canonical piece into one of the segment.
    fn turned(&self, angle: f64) -> f64 {
        if self.swapped { -self.mirrored * angle } else { self.mirrored * angle }
    }

    /// Whether the curvature changes sign inside.
    pub fn has_inflection(&self) -> bool {
        self.range[0] < 0.0
    }

    /// T at the fraction u of the arc length from the segment's start.
    fn at_fraction(&self, curve: &Universal, u: f64) -> f64 {
        let [from, to] = self.range;
        let u = if self.swapped { 1.0 - u } else { u };
        if u <= 0.0 {
            return from;
        }
        if u >= 1.0 {
            return to;
        }
        curve.at_length(from, to, u)
    }

    /// The values of T at which the tangent has this angle from the chord: none, one or two, in
    /// order.
    pub fn at_angle(&self, angle: f64) -> Vec<f64> {
        if self.is_straight() {
            return Vec::new();
        }
        // θ = φ + π/2 − |T|, both canonical.
        let distance = self.force + FRAC_PI_2 - self.turned(angle);
        let [from, to] = self.range;
        // No tangent lies beyond that of the inflection. The end angles themselves are rounded.
        let rounding = 4.0 * PI * f64::EPSILON;
        let ends = |t: f64| {
            if (t - from).abs() <= rounding {
                from
            } else if (t - to).abs() <= rounding {
                to
            } else {
                t
            }
        };
        let distance = if distance.abs() <= rounding { 0.0 } else { distance };
        let mut places: Vec<f64> = [-distance, distance]
            .into_iter()
            .map(ends)
            .filter(|t| distance >= 0.0 && (from..=to).contains(t))
            .collect();
        places.dedup();
        if self.swapped {
            places.reverse();
        }
        places
    }

    /// The site at T.
    pub fn site(&self, curve: &Universal, t: f64) -> Site {
        let from = self.range[0];
        let radius = self.radius();
        let (along, across) = (radius * curve.along_between(from, t), radius * curve.across_between(from, t));
        let (sine, cosine) = self.force.sin_cos();
        let (x, y) = (along * cosine - across * sine, along * sine + across * cosine);
        let curvature = -t.signum() * t.abs().sin().max(0.0).powf(1.0 / curve.exponent) / radius;
        Site {
            point: [if self.swapped { self.chord - x } else { x }, self.mirrored * y],
            angle: self.turned(self.force + FRAC_PI_2 - t.abs()),
            curvature: if t == 0.0 { 0.0 } else { self.mirrored * curvature },
        }
    }

    /// The site at the fraction u of the arc length, and dκ/ds there.
    pub fn at(&self, curve: &Universal, u: f64) -> (Site, f64) {
        if self.is_straight() {
            return (Site { point: [u * self.chord, 0.0], angle: 0.0, curvature: 0.0 }, 0.0);
        }
        let t = self.at_fraction(curve, u);
        let mut site = self.site(curve, t);
        // Both ends are exact.
        if u <= 0.0 || u >= 1.0 {
            site.point = [if u <= 0.0 { 0.0 } else { self.chord }, 0.0];
        }
        let (sine, cosine) = t.abs().sin_cos();
        // |κ|^ν = c cos ψ gives κ′ = −c sin ψ |κ|^{2−ν}/ν, infinite at inflections for ν > 2.
        let slope = -cosine * sine.powf(2.0 / curve.exponent - 1.0) / (curve.exponent * self.radius() * self.radius());
        let slope = if self.swapped { -slope } else { slope };
        (site, if slope.is_finite() { self.mirrored * slope } else { 0.0 })
    }

    /// The largest |κ|. |κ|^ν is proportional to sin |T|.
    pub fn max_curvature(&self, curve: &Universal) -> f64 {
        if self.is_straight() {
            return 0.0;
        }
        let [from, to] = self.range;
        let over_the_top = (from..=to).contains(&FRAC_PI_2) || (from..=to).contains(&-FRAC_PI_2);
        let largest = if over_the_top { 1.0 } else { from.abs().sin().max(to.abs().sin()).max(0.0) };
        largest.powf(1.0 / curve.exponent) / self.radius()
    }

    /// Curvatures at both ends.
    pub fn curvatures(&self, curve: &Universal) -> [f64; 2] {
        if self.is_straight() {
            return [0.0; 2];
        }
        let [first, last] = self.range.map(|t| self.site(curve, t).curvature);
        if self.swapped { [last, first] } else { [first, last] }
    }
}

impl Universal {
    /// The midpoint and half of [from, to], if both are on one side of the inflection at 0 and
    /// close together. Differences are then taken from series, at the distances from 0.
    fn close(&self, from: f64, to: f64) -> Option<(f64, f64)> {
        let (middle, half) = (0.5 * (from + to).abs(), 0.5 * (to - from));
        (from * to > 0.0 && half < CLOSE * middle.min(PI - middle)).then_some((middle, half))
    }

    /// Σₖ h²ᵏ Σⱼ cₖⱼ weight(j) sin^{−2j} m
    fn series(&self, coefficients: &[f64; DIFFERENCE_TERMS], m: f64, h: f64, weight: impl Fn(f64) -> f64) -> f64 {
        let x = m.sin().powi(-2);
        let row =
            |k: usize| (0..=k).rev().fold(0.0, |sum, j| sum * x + coefficients[k * (k + 1) / 2 + j] * weight(j as f64));
        (0..DIFFERENCES).rev().fold(0.0, |sum, k| sum * h * h + row(k))
    }

    /// J(to) − J(from), J odd.
    pub fn along_between(&self, from: f64, to: f64) -> f64 {
        match self.close(from, to) {
            Some((m, h)) => 2.0 * h * m.sin().powf(self.q) * self.series(&self.differences, m, h, |_| 1.0),
            None => to.signum() * self.moment_along(to.abs()).1 - from.signum() * self.moment_along(from.abs()).1,
        }
    }

    /// (S(to) − S(from))/q, S odd.
    pub fn across_between(&self, from: f64, to: f64) -> f64 {
        match self.close(from, to) {
            Some((m, h)) => {
                let series = self.series(&self.differences, m, h, |j| 1.0 - 2.0 * j / self.q);
                2.0 * h * m.sin().powf(self.q) / m.tan() * series
            }
            None => {
                (to.signum() * self.moment_along(to.abs()).0 - from.signum() * self.moment_along(from.abs()).0) / self.q
            }
        }
    }

    /// L(to) − L(from), L odd.
    pub fn length_between(&self, from: f64, to: f64) -> f64 {
        match self.close(from, to) {
            Some((m, h)) => 2.0 * h * m.sin().powf(self.q - 1.0) * self.series(&self.length_differences, m, h, |_| 1.0),
            None => to.signum() * self.length_at(to.abs()) - from.signum() * self.length_at(from.abs()),
        }
    }

    /// T at the fraction u of the length from `from` to `to`, by a bracketed Newton method in w =
    /// sgn T |T|^q. Near the inflection the length is almost proportional to w.
    pub fn at_length(&self, from: f64, to: f64, u: f64) -> f64 {
        /// The most Newton steps. They converge quadratically from a start good to a few per cent,
        /// and brackets catch the rest.
        const STEPS: usize = 60;
        let signed = |t: f64| t.signum() * self.power(t.abs());
        let target = u * self.length_between(from, to);
        let (mut low, mut high) = (from, to);
        let (w, w_end) = (signed(from), signed(to));
        let unsigned = |w: f64| w.signum() * self.root(w.abs());
        let mut t = unsigned(w + u * (w_end - w)).clamp(from, to);
        for _ in 0..STEPS {
            // The remainder, from the nearer end.
            let left = target - self.length_between(from, t);
            if left > 0.0 {
                low = t
            } else {
                high = t
            }
            let folded = t.abs();
            // dL/dw = sin^{q−1} T · T^{1−q}/q
            let slope = (folded.sin() / folded).powf(self.q - 1.0) / self.q;
            let slope = if folded > 0.0 { slope } else { 1.0 / self.q };
            let next = unsigned(signed(t) + left / slope);
            let next = if next > low && next < high { next } else { unsigned(0.5 * (signed(low) + signed(high))) };
            // In w, since lengths near an inflection are a power of T.
            if (signed(next) - signed(t)).abs() <= 2.0 * f64::EPSILON * (w_end - w) {
                return next;
            }
            t = next;
        }
        t
    }
}
