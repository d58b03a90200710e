//! [`Motion`]: a smooth piece of a curve whose velocity is quadratic. Its length, and its largest curvature.

use glam::DVec3;

use crate::arclength;

/// Velocity and acceleration along a piece, by its fraction v (0 … 1): V(v) = V₀ + v V₁ + v² V₂ and A(v) = A₀ + v A₁.
///
/// Of a cubic A is V′. A curve with a curvature of its own may have another: κ = |V × A| / |V|³.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// V₀, V₁, V₂
    pub velocity: [DVec3; 3],
    /// A₀, A₁
    pub acceleration: [DVec3; 2],
}

/// Degree of the polynomial whose roots are where the curvature is stationary, and one more.
const STATIONARY: usize = 10;

/// Speeds below this part of the largest are looked at from where they are least.
const SLOW: f64 = 0.01;

/// Turns below this part of |V||A| are rounding.
const STRAIGHT: f64 = 16.0 * f64::EPSILON;

/// Squares and cubes of such numbers, and products of some, are normal.
const MODERATE: std::ops::Range<f64> = 1e-20..1e20;

impl Motion {
    /// Of a cubic p₀ + v (a + v (b + v c)).
    #[inline(always)]
    pub fn of_cubic(a: DVec3, b: DVec3, c: DVec3) -> Self {
        Motion { velocity: [a, 2.0 * b, 3.0 * c], acceleration: [2.0 * b, 6.0 * c] }
    }

    /// Of a cubic Bézier.
    pub fn of_bezier([p, q, r, s]: [DVec3; 4]) -> Self {
        Motion::of_cubic(3.0 * (q - p), 3.0 * (p - 2.0 * q + r), (s - p) - 3.0 * (r - q))
    }

    #[inline(always)]
    fn velocity_at(&self, v: f64) -> DVec3 {
        let [a, b, c] = self.velocity;
        a + v * (b + v * c)
    }

    /// |V(v)|
    #[inline(always)]
    pub fn speed(&self, v: f64) -> f64 {
        self.velocity_at(v).length()
    }

    /// |κ(v)|; 0 where V vanishes.
    #[inline(always)]
    fn curvature(&self, v: f64) -> f64 {
        let velocity = self.velocity_at(v);
        let turn = velocity.cross(self.acceleration[0] + v * self.acceleration[1]).length();
        let speed = velocity.length();
        if speed == 0.0 { 0.0 } else { turn / (speed * speed * speed) }
    }

    /// The largest of `known` and of |κ| at both ends and in the middle.
    #[inline(always)]
    pub(crate) fn curvature_seen(&self, known: f64) -> f64 {
        // What is out of range waits for the search.
        if !MODERATE.contains(&self.size()) {
            return known;
        }
        known.max(self.curvature(0.0)).max(self.curvature(0.5)).max(self.curvature(1.0))
    }

    /// Largest coordinate of any coefficient.
    #[inline(always)]
    fn size(&self) -> f64 {
        let ([a, b, c], [d, e]) = (self.velocity, self.acceleration);
        a.abs().max(b.abs()).max(c.abs()).max(d.abs()).max(e.abs()).max_element()
    }

    fn scaled(&self, by: f64) -> Self {
        Motion { velocity: self.velocity.map(|v| v * by), acceleration: self.acceleration.map(|a| a * by) }
    }

    /// Arc length, to 1e-9 of itself.
    #[inline(always)]
    pub fn length(&self) -> f64 {
        let size = self.size();
        if !MODERATE.contains(&size) {
            return self.length_of_size(size);
        }
        arclength::span_length(|v| self.speed(v))
    }

    #[cold]
    fn length_of_size(&self, size: f64) -> f64 {
        if size == 0.0 || !size.is_finite() {
            return size;
        }
        // In two steps: one factor might be out of range.
        let scaled = self.scaled(size.sqrt().recip()).scaled(size.sqrt().recip());
        arclength::span_length(|v| scaled.speed(v)) * size
    }

    /// The largest of `known` and of |κ| on the piece, to 1e-9 of itself, but for what rounding of the coefficients does near cusps. Infinite at a
    /// cusp, where V vanishes and the piece is not straight.
    ///
    /// κ² = N/q³ with N = |V × A|² and q = |V|² is stationary where N′q − 3Nq′ = 0. All roots of that polynomial are found, by
    /// the changes of sign of its Bernstein coefficients; in pieces that come near a cusp from the least speed on, so that it keeps its digits.
    #[inline(always)]
    pub fn max_curvature(&self, known: f64) -> f64 {
        let size = self.size();
        if !MODERATE.contains(&size) {
            return self.max_curvature_of_size(known, size);
        }
        if self.bound() <= known { known } else { self.largest_curvature(known) }
    }

    #[cold]
    fn max_curvature_of_size(&self, known: f64, size: f64) -> f64 {
        if size == 0.0 || !size.is_finite() {
            return known;
        }
        let scaled = self.scaled(size.sqrt().recip()).scaled(size.sqrt().recip());
        known.max(scaled.max_curvature(0.0) / size)
    }

    /// Nowhere on the piece is |κ| larger: by the control points of V × A and of V in the direction of its middle.
    #[inline(always)]
    fn bound(&self) -> f64 {
        let [a, b, c] = self.velocity;
        let controls = [a, a + 0.5 * b, a + b + c];
        let along = controls[0] + controls[1] + controls[2];
        let [p, q, r] = controls.map(|control| control.dot(along));
        let least = p.min(q).min(r) / along.length();
        let turns = cubic_controls(self.turns());
        let most = turns.iter().fold(0.0, |most: f64, turn| most.max(turn.length_squared()));
        // Rounding of both.
        if least > 0.0 { most.sqrt() / (least * least * least) * (1.0 + 1e-12) } else { f64::INFINITY }
    }

    /// Coefficients of V × A.
    #[inline(always)]
    fn turns(&self) -> [DVec3; 4] {
        let ([a, b, c], [d, e]) = (self.velocity, self.acceleration);
        [a.cross(d), a.cross(e) + b.cross(d), b.cross(e) + c.cross(d), c.cross(e)]
    }

    /// Whether what it turns is rounding.
    fn is_straight(&self) -> bool {
        let most = |vectors: &[DVec3]| vectors.iter().map(|v| v.length_squared()).fold(0.0, f64::max);
        most(&self.turns()) <= STRAIGHT * STRAIGHT * most(&self.velocity) * most(&self.acceleration)
    }

    #[inline(never)]
    fn largest_curvature(&self, known: f64) -> f64 {
        if self.is_straight() {
            return known;
        }
        let [a, b, c] = self.velocity;
        let along = a + 0.5 * b + c / 3.0;
        let least =
            [a, a + 0.5 * b, a + b + c].map(|control| control.dot(along)).into_iter().fold(f64::INFINITY, f64::min);
        if least > SLOW * along.length() * self.size() {
            return self.largest_from_an_end(known);
        }
        // q′
        let [p, q, r] = [a.dot(b), b.dot(b) + 2.0 * a.dot(c), 3.0 * b.dot(c)];
        let slope = bernstein([p, q, r, 2.0 * c.dot(c)]);
        let mut cuts = vec![0.0];
        sign_changes(&slope, true, (0.0, 1.0), MOST_HALVINGS, &mut |v| cuts.push(v));
        cuts.push(1.0);
        cuts.windows(2).fold(known, |known, pair| {
            let forward = self.speed(pair[0]) <= self.speed(pair[1]);
            let part = if forward { self.part(pair[0], pair[1]) } else { self.part(pair[1], pair[0]) };
            part.largest_from_an_end(known)
        })
    }

    /// The piece from one fraction to another, on a fraction of its own.
    fn part(&self, from: f64, to: f64) -> Self {
        let ([_, b, c], [d, e], width) = (self.velocity, self.acceleration, to - from);
        let velocity = [self.velocity_at(from), (b + 2.0 * from * c) * width, c * (width * width)];
        Motion {
            velocity: velocity.map(|v| v * width),
            acceleration: [d + from * e, width * e].map(|a| a * (width * width)),
        }
    }

    fn largest_from_an_end(&self, known: f64) -> f64 {
        let ([a, b, c], turns) = (self.velocity, self.turns());
        let mut squares = [0.0; 7];
        for (i, turn) in turns.iter().enumerate() {
            for (j, other) in turns.iter().enumerate() {
                squares[i + j] += turn.dot(*other);
            }
        }
        let speeds = [a.dot(a), 2.0 * a.dot(b), b.dot(b) + 2.0 * a.dot(c), 2.0 * b.dot(c), c.dot(c)];
        // A cusp: V vanishes, and the piece turns.
        if speeds[0] == 0.0 {
            return f64::INFINITY;
        }
        let mut condition = [0.0; STATIONARY];
        for (i, square) in squares.iter().enumerate() {
            for (j, speed) in speeds.iter().enumerate() {
                if i + j > 0 {
                    condition[i + j - 1] += (i as f64 - 3.0 * j as f64) * square * speed;
                }
            }
        }
        let mut largest = known.max(self.curvature(0.0)).max(self.curvature(1.0));
        let largest_at = &mut |v| largest = largest.max(self.curvature(v));
        sign_changes(&bernstein(condition), false, (0.0, 1.0), MOST_HALVINGS, largest_at);
        largest
    }
}

/// Control points of a cubic from its coefficients.
#[inline(always)]
fn cubic_controls([a, b, c, d]: [DVec3; 4]) -> [DVec3; 4] {
    [a, a + b / 3.0, a + (2.0 * b + c) / 3.0, a + b + c + d]
}

/// Halvings after which roots are one.
const MOST_HALVINGS: u32 = 32;

/// Steps that take any bracket of a root to rounding; most take ten.
const ROOT_STEPS: usize = 100;

/// Bernstein coefficients on 0 … 1 from those of powers: b_k = Σⱼ C(k, j)/C(n, j) aⱼ.
fn bernstein<const N: usize>(mut a: [f64; N]) -> [f64; N] {
    let mut binomial = 1.0;
    for (j, a) in a.iter_mut().enumerate() {
        *a /= binomial;
        binomial *= (N - 1 - j) as f64 / (j + 1) as f64;
    }
    // Sums of sums are the sums by binomials.
    for last in (0..N - 1).rev() {
        for k in last..N - 1 {
            a[k + 1] += a[k];
        }
    }
    a
}

/// Where a polynomial in Bernstein form on `from … to` changes its sign from minus to plus (`rising`), or from plus to minus.
///
/// Coefficients of one sign have no root between, one change of sign one root (Descartes' rule); what has more is halved.
fn sign_changes<const N: usize>(
    b: &[f64; N],
    rising: bool,
    (from, to): (f64, f64),
    halvings: u32,
    found: &mut dyn FnMut(f64),
) {
    let mut signs = b.iter().filter(|x| **x != 0.0).map(|x| *x > 0.0);
    let Some(first) = signs.next() else { return };
    let (changes, _) = signs.fold((0, first), |(changes, before), sign| (changes + u32::from(sign != before), sign));
    match changes {
        0 => {}
        1 if first == rising => {}
        1 => found(from + (to - from) * root(b)),
        _ if halvings == 0 => found(0.5 * (from + to)),
        _ => {
            let (mut left, mut right) = ([0.0; N], *b);
            for (k, left) in left.iter_mut().enumerate() {
                *left = right[0];
                for i in 0..N - 1 - k {
                    right[i] = 0.5 * (right[i] + right[i + 1]);
                }
            }
            // What is left of column i is the right half's coefficient i.
            let middle = 0.5 * (from + to);
            if left[N - 1] == 0.0 {
                found(middle);
            }
            sign_changes(&left, rising, (from, middle), halvings - 1, found);
            sign_changes(&right, rising, (middle, to), halvings - 1, found);
        }
    }
}

/// The root in 0 … 1 of a polynomial whose Bernstein coefficients change their sign once: regula falsi, the end that stays counting half (the
/// Illinois rule), and bisection where that is slow.
fn root<const N: usize>(b: &[f64; N]) -> f64 {
    let mut scaled = *b;
    let mut binomial = 1.0;
    for (k, b) in scaled.iter_mut().enumerate() {
        *b *= binomial;
        binomial *= (N - 1 - k) as f64 / (k + 1) as f64;
    }
    let value = |x: f64| {
        let y = 1.0 - x;
        let (sum, scale) = match x <= 0.5 {
            true => (scaled.iter().rev().fold(0.0, |sum, b| sum * (x / y) + b), y),
            false => (scaled.iter().fold(0.0, |sum, b| sum * (y / x) + b), x),
        };
        sum * scale.powi(N as i32 - 1)
    };
    let (mut low, mut high) = (0.0, 1.0);
    let (mut at_low, mut at_high) = (b[0], b[N - 1]);
    let mut x = 0.5;
    for step in 0..ROOT_STEPS {
        let here = value(x);
        let sign = if at_low != 0.0 { at_low.signum() } else { -at_high.signum() };
        if here == 0.0 {
            return x;
        }
        if here.signum() == sign {
            (low, at_low, at_high) = (x, here, 0.5 * at_high);
        } else {
            (high, at_high, at_low) = (x, here, 0.5 * at_low);
        }
        if high - low <= 4.0 * f64::EPSILON * high {
            break;
        }
        let secant = low + (high - low) * (at_low / (at_low - at_high));
        x = if step % 4 != 3 && secant > low && secant < high { secant } else { 0.5 * (low + high) };
    }
    x
}

/// The largest |κ| of a smooth piece of any kind, of which only curvature and speed at its fractions are known: looked for at [`PLACES`]
/// places and at the least speed, and followed to the top where it is largest among its neighbours.
pub(crate) fn searched_curvature(curvature: impl Fn(f64) -> f64) -> f64 {
    /// Places; a Bézier of degree 30 has a curvature with some ten tops.
    const PLACES: usize = 128;
    /// Steps to 1e-9 of the distance of two places, where tops are flat to 1e-16.
    const STEPS: usize = 45;
    const GOLDEN: f64 = 0.618_033_988_749_894_8;
    let at = |k: usize| k as f64 / PLACES as f64;
    let values: Vec<f64> = (0..=PLACES).map(|k| curvature(at(k))).collect();
    let mut largest = values.iter().copied().fold(0.0, f64::max);
    for k in 0..=PLACES {
        let (before, after) = (k.saturating_sub(1), (k + 1).min(PLACES));
        if !(values[k] >= values[before] && values[k] >= values[after]) {
            continue;
        }
        let (mut low, mut high) = (at(before), at(after));
        for _ in 0..STEPS {
            let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
            let (at_a, at_b) = (curvature(a), curvature(b));
            largest = largest.max(at_a).max(at_b);
            if at_a > at_b { high = b } else { low = a }
        }
    }
    largest
}
