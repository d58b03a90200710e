//! Second derivatives of the cost by the end angles, by implicit differentiation of the closure of
//! the chord.
//!
//! At an end with (ν − 1)|κ|^ν = f the first derivative is ±ν(f/(ν − 1))^q, and its change is ±ρ
//! df. The change of f follows from the change of the pull, and that from the condition that the
//! arcs still close the chord. If the curve passes an inflection, the unknowns are the logarithm of
//! t, with |P|² = λ² + t², and the overshoot in a scale in which the closure is smooth even if the
//! inflection lies at the end itself. Every integral keeps the weight of the radius of curvature.
//! With a straight piece the pull is λ along it, and the two arcs do not affect each other. The
//! direction of the piece is the only unknown, and everything is elementary.
//!
//! For ν > 2 second derivatives fall to 0 as an end's curvature does next to a straight piece. For
//! ν < 2 they grow without bound as the whole segment becomes straight.

use super::quadrature::{Integrals, Law, Pull};
use super::shape::{Course, Shape};

/// The angles at which the second derivatives of a straight segment are taken. At 0 they are
/// infinite for ν < 2 and 0 for ν > 2.
pub(super) const STRAIGHT: f64 = 1e-7;

/// The solutions of two linear equations `rows`·x = `right` for two right-hand sides, with scaled
/// columns.
pub(super) fn solve([[a, b], [c, d]]: [[f64; 2]; 2], right: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let scale = [a.abs().max(c.abs()), b.abs().max(d.abs())];
    let ([a, c], [b, d]) = ([a, c].map(|x| x / scale[0]), [b, d].map(|x| x / scale[1]));
    let determinant = a * d - b * c;
    right.map(|[e, f]| [(e * d - b * f) / determinant / scale[0], (a * f - e * c) / determinant / scale[1]])
}

/// The closure of the chord for a shape with one inflection.
///
/// `side` is 1 if the inflection lies inside, −1 if it lies beyond the upper end, and 0 if the
/// upper end is free.
pub(super) struct Inflected {
    /// The arcs from the inflection to the lower and to the upper end.
    pub far: Integrals<2>,
    pub near: Integrals<2>,
    /// The radius of curvature at the lower end.
    pub radius: f64,
    /// |do/dv| of the overshoot o. In v the ends of both arcs move smoothly through the inflection.
    pub scale: f64,
    /// The radius of curvature at the upper end, times `scale`; 0 if it is free.
    pub scaled_radius: f64,
    /// The derivatives of the displacements along and across by ln t and v.
    pub rows: [[f64; 2]; 2],
}

impl Inflected {
    pub fn new(law: &Law, t: f64, side: f64, &Shape { pull, axis, ends: [long, short], .. }: &Shape) -> Self {
        let [far, near] = [long, short].map(|x| law.growth(t, x));
        let (sine, cosine) = axis.sin_cos();
        let radius = 1.0 / law.curvature(pull, long);
        let slope = if short > 0.0 { law.excess(pull, short) / short } else { t };
        let [scale, moved, scaled_radius] = if side == 0.0 {
            [1.0, 1.0, 0.0]
        } else {
            let scale = short.powf(1.0 / law.nu);
            [scale, side * scale, ((law.nu - 1.0) / slope).powf(1.0 / law.nu)]
        };
        let along = (radius * long.cos() + sine) * moved + scaled_radius * short.cos();
        let across = (radius * long.sin() - cosine) * moved + scaled_radius * short.sin();
        let rows =
            [[far.changes[0] + side * near.changes[0], along], [far.changes[1] + side * near.changes[1], across]];
        Inflected { far, near, radius, scale, scaled_radius, rows }
    }
}

impl Shape {
    /// ∂²cost/∂low², ∂²/∂low∂high and ∂²/∂high² for end angles `low` and `high`.
    pub(super) fn hessian(&self, law: &Law, low: f64, high: f64) -> [f64; 3] {
        match (self.pull, self.course) {
            (Pull::Below(_), _) => self.below(law),
            (Pull::Critical, _) => self.flat(law, low, high),
            (Pull::Above(t), Course::Around(_)) => self.around(law, t),
            (Pull::Above(t), course) => self.above(law, t, if course == Course::Direct { -1.0 } else { 1.0 }),
        }
    }

    /// The second derivative by the only angle of a segment with a free upper end.
    pub(super) fn hessian_of_free(&self, law: &Law, low: f64) -> f64 {
        let long = self.ends[0].abs();
        let (sine, cosine) = long.sin_cos();
        let Pull::Above(t) = self.pull else {
            let turned = 1.0 / law.curvature(self.pull, long) * sine;
            let stiffness = turned - self.axis.cos();
            return law.tension * turned * (1.0 - turned / stiffness);
        };
        debug_assert!(low <= self.axis);
        let Inflected { radius, rows, .. } = Inflected::new(law, t, 0.0, self);
        let [[grown, turned], _] = solve(rows, [[radius * cosine, radius * sine], [0.0; 2]]);
        -radius * (t * sine * grown + (law.tension * sine + t * cosine) * (turned - 1.0))
    }

    /// Between two angles, with a pull below the tension: no inflection.
    fn below(&self, law: &Law) -> [f64; 3] {
        let [low, high] = self.ends;
        let [aa, ab, bb] = law.compliance(self.pull, low, high).changes;
        let strength = law.strength(self.pull);
        // ρT at both ends, in the frame of the pull.
        let [first, last] = self.ends.map(|x| {
            let radius = 1.0 / law.curvature(self.pull, x);
            [radius * x.cos(), radius * x.sin()]
        });
        // Scaled by the diagonal, because near the critical pull the strength hardly changes.
        let scale = [aa.sqrt(), bb.sqrt()];
        let share = ab / scale[0] / scale[1];
        let product = |u: [f64; 2], v: [f64; 2]| {
            let [u, v] = [u, v].map(|w| [w[0] / scale[0], w[1] / scale[1]]);
            (u[0] * v[0] - share * (u[0] * v[1] + u[1] * v[0]) + u[1] * v[1]) / (1.0 - share * share)
        };
        [product(first, first) - strength * first[1], -product(first, last), product(last, last) + strength * last[1]]
    }

    /// With a straight piece.
    fn flat(&self, law: &Law, low: f64, high: f64) -> [f64; 3] {
        // ρ sin x at both ends, for the distances x from the piece's angle; 0 if an end has that
        // angle.
        let [first, last] = self.ends.map(|x| {
            let x = x.abs();
            if x > 0.0 { x.sin() / law.curvature(self.pull, x) } else { 0.0 }
        });
        debug_assert!(low <= high);
        let stiffness = first + last - self.axis.cos();
        let tension = law.tension;
        [
            tension * first * (1.0 - first / stiffness),
            -tension * first * last / stiffness,
            tension * last * (1.0 - last / stiffness),
        ]
    }

    /// One inflection: inside for `side` = 1, beyond the upper end for −1.
    fn above(&self, law: &Law, t: f64, side: f64) -> [f64; 3] {
        let ([long, short], omega, tension) = (self.ends, self.axis, law.tension);
        let (sine, cosine) = omega.sin_cos();
        let ((sine_long, cosine_long), (sine_short, cosine_short)) = (long.sin_cos(), short.sin_cos());
        let Inflected { radius, scale, scaled_radius, rows, .. } = Inflected::new(law, t, side, self);
        let (right, up) = (radius * cosine_long, radius * sine_long);
        let radius_sine = if short > 0.0 { scaled_radius / scale * sine_short } else { 0.0 };
        let overshoot = side * scale;
        let changes = solve(rows, [[right, up], [-right - sine, cosine - up]]);
        let at_low = |[grown, moved]: [f64; 2], turned: f64| {
            radius * (t * sine_long * grown + (tension * sine_long + t * cosine_long) * (turned + overshoot * moved))
        };
        let at_high = |[grown, moved]: [f64; 2]| {
            radius_sine * t * grown + (tension * sine_short + t * cosine_short) * side * scaled_radius * moved
        };
        let [low, high] = changes;
        [-at_low(low, -1.0), -at_low(high, 1.0), -side * at_high(high)]
    }

    /// Two inflections, one beyond either end.
    fn around(&self, law: &Law, t: f64) -> [f64; 3] {
        let (opening, tension) = (law.opening(self.pull), law.tension);
        let strength = law.strength(self.pull);
        let half = std::f64::consts::PI - opening;
        let direction = self.axis + opening;
        // Per unit of ln t.
        let opened = t * tension / (strength * strength);
        let ends = self.ends.map(|x| x.max(f64::MIN_POSITIVE));
        let radius = |x: f64| 1.0 / law.curvature(self.pull, x);
        let [lower, upper] = ends.map(radius);
        let along = |x: f64| {
            let Integrals { arc: [_, c, d], changes: [a, b] } = law.growth(t, x);
            let (sine, cosine) = opening.sin_cos();
            a * cosine - b * sine - (c * sine + d * cosine) * opened
        };
        let [at_lower, at_upper] = ends;
        let slope = |x: f64| tension * x.sin() + t * x.cos();
        let moved = |x: f64| (x + opening).cos();
        let grown = along(at_lower) + along(at_upper) + 2.0 * (along(half) + radius(half) * opened);
        let (sine, cosine) = direction.sin_cos();
        // The unknowns are ln t and the upper inflection's angle. The lower one's follows it, and
        // gains twice the opening.
        let rows = [
            [
                grown - 2.0 * lower * moved(at_lower) * opened + sine * opened,
                upper * moved(at_upper) - lower * moved(at_lower) + sine,
            ],
            [
                lower * (t * at_lower.sin() - 2.0 * slope(at_lower) * opened) - upper * t * at_upper.sin()
                    + strength * cosine * opened
                    + sine * t * t / strength,
                -lower * slope(at_lower) - upper * slope(at_upper) + strength * cosine,
            ],
        ];
        let right =
            [[-lower * moved(at_lower), -lower * slope(at_lower)], [upper * moved(at_upper), -upper * slope(at_upper)]];
        let [low, high] = solve(rows, right);
        let change_lower = |[grown, turned]: [f64; 2], end: f64| {
            lower * (t * at_lower.sin() * grown + slope(at_lower) * (end - turned - 2.0 * opened * grown))
        };
        let change_upper =
            |[grown, turned]: [f64; 2]| upper * (t * at_upper.sin() * grown + slope(at_upper) * (turned - 1.0));
        [change_lower(low, 1.0), change_lower(high, 0.0), -change_upper(high)]
    }
}
