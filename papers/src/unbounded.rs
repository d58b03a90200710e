//! The exact rule of a grid without borders, in closed form.
//!
//! [`UnboundedMask`] follows from the potential kernel of the square lattice.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{One, Signed, ToPrimitive, Zero};

/// The number rational + over_pi / π, exactly.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Closed {
    /// The part without π.
    pub rational: BigRational,
    /// The part over π.
    pub over_pi: BigRational,
}

impl Closed {
    fn of(rational: BigRational, over_pi: BigRational) -> Self {
        Closed { rational, over_pi }
    }

    /// Σ weight · number
    fn sum<'a>(terms: impl IntoIterator<Item = (i64, &'a Closed)>) -> Self {
        let zero = Closed::of(BigRational::zero(), BigRational::zero());
        terms.into_iter().fold(zero, |sum, (weight, x)| {
            let weight = BigRational::from_integer(weight.into());
            Closed::of(sum.rational + &weight * &x.rational, sum.over_pi + &weight * &x.over_pi)
        })
    }

    /// The nearest f64.
    ///
    /// π is taken to as many digits as are needed for 64 bits to remain after both parts have
    /// cancelled.
    pub fn value(&self) -> f64 {
        if self.over_pi.is_zero() {
            return to_f64(&self.rational);
        }
        let enough = (0..).find_map(|doublings| self.value_with(&Pi::to(256 << doublings)));
        enough.expect("a number with 1/π in it is not 0, so some number of digits tells its value")
    }

    /// The value, or `None` if π has too few digits for 64 bits.
    fn value_with(&self, pi: &Pi) -> Option<f64> {
        let part = &self.over_pi / &pi.value;
        let value = &self.rational + &part;
        let lost = part.abs() / BigRational::from_integer(BigInt::one() << pi.bits);
        let kept = BigRational::from_integer(BigInt::one() << 64);
        (self.over_pi.is_zero() || value.abs() >= lost * kept).then(|| to_f64(&value))
    }
}

fn to_f64(x: &BigRational) -> f64 {
    x.to_f64().expect("every rational is near some f64")
}

/// π to many digits.
struct Pi {
    value: BigRational,
    bits: u64,
}

impl Pi {
    /// By Machin's formula, 16 arctan 1/5 − 4 arctan 1/239, to this many binary places.
    fn to(bits: u64) -> Self {
        // Each term loses a unit in the last place, and there are fewer terms than bits.
        let guard = 16 + u64::from(bits.max(1).ilog2());
        let one = BigInt::one() << (bits + guard);
        let arctan_of_inverse = |x: u32| {
            let mut power = &one / x;
            let mut sum = power.clone();
            for k in 1.. {
                power /= x * x;
                if power.is_zero() {
                    break;
                }
                let term = &power / (2 * k + 1);
                sum = if k % 2 == 1 { sum - term } else { sum + term };
            }
            sum
        };
        let pi: BigInt = arctan_of_inverse(5) * 16 - arctan_of_inverse(239) * 4;
        Pi { value: BigRational::new(pi, one), bits }
    }
}

/// The potential kernel on 0 ≤ y ≤ x ≤ radius.
struct Potential(Vec<Vec<Closed>>);

impl Potential {
    /// Computes the kernel outward from the diagonal, where it is known.
    ///
    /// Each place is found from the equation of a place before it. In floating point every step
    /// would multiply errors by 3 + 2√2. These fractions have no errors.
    fn of_radius(radius: usize) -> Self {
        let whole = |x: i64| BigRational::from_integer(x.into());
        let mut columns = vec![vec![Closed::of(whole(0), whole(0))]];
        columns.push(vec![Closed::of(BigRational::new(1.into(), 4.into()), whole(0)), Closed::of(whole(0), whole(1))]);
        for x in 1..radius {
            let at = |x: usize, y: usize| -> &Closed { &columns[x.max(y)][x.min(y)] };
            let mut next: Vec<Closed> = (0..x)
                .map(|y| {
                    let below = at(x, y.abs_diff(1));
                    Closed::sum([(4, at(x, y)), (-1, at(x - 1, y)), (-1, at(x, y + 1)), (-1, below)])
                })
                .collect();
            // On the diagonal two pairs of neighbours are equal.
            next.push(Closed::sum([(2, at(x, x)), (-1, at(x, x - 1))]));
            let step = BigRational::new(1.into(), BigInt::from(2 * x + 1));
            next.push(Closed::of(whole(0), &at(x, x).over_pi + step));
            columns.push(next);
        }
        Potential(columns)
    }

    fn at(&self, x: isize, y: isize) -> &Closed {
        let (x, y) = (x.unsigned_abs(), y.unsigned_abs());
        &self.0[x.max(y)][x.min(y)]
    }

    /// −(4a(x) − a(x ± (2, 0)) − a(x ± (0, 2))).
    ///
    /// This is the potential of a coarse point with its four neighbours, which are every second
    /// point of the fine grid.
    fn mask(&self, x: isize, y: isize) -> Closed {
        Closed::sum([
            (-4, self.at(x, y)),
            (1, self.at(x + 2, y)),
            (1, self.at(x - 2, y)),
            (1, self.at(x, y + 2)),
            (1, self.at(x, y - 2)),
        ])
    }
}

/// The potential kernel a(x, y) of the square lattice, which grows like ln |x| / 2π.
///
/// It has La = −δ with L = 4 −1 −1 −1 −1, and a(0, 0) = 0. Further a(1, 0) = ¼, and a(n, n) = (1 +
/// ⅓ + ⅕ + … + 1/(2n − 1)) / π. All other values follow from symmetry and La = 0. See F. Spitzer,
/// Principles of Random Walk, §15, whose kernel is 4a.
///
/// It takes about a tenth of a second at a distance of 64, and ten times as long at twice that.
pub fn potential(x: isize, y: isize) -> Closed {
    Potential::of_radius(x.unsigned_abs().max(y.unsigned_abs()).max(1)).at(x, y).clone()
}

/// The entry of the exact rule of a grid without borders: 4 − 8/π at 0, 3 − 8/π beside it.
///
/// The fine point is this far from the place of the coarse one, in fine steps. See
/// [`UnboundedMask`] for many entries.
pub fn unbounded_weight(x: isize, y: isize) -> Closed {
    Potential::of_radius(x.unsigned_abs().max(y.unsigned_abs()) + 2).mask(x, y)
}

/// The exact mask s of a grid without borders, up to a radius.
///
/// Ls is 4 −1 −1 −1 −1 on every second point, and 0 elsewhere.
///
/// The Fourier transform of s is Λ(2ξ)/Λ(ξ) with Λ(ξ) = 4 − 2 cos ξ₁ − 2 cos ξ₂. At 0 it is 4 −
/// (ξ₁⁴ + ξ₂⁴)/|ξ|² + …. Its kink −|ξ|² cos 4θ / 4 makes the mask fall like −(6/π) cos 4φ / |x|⁴,
/// which is a power and not an exponential. Out to 64, |s(x)| |x|⁴ is at most 2.74, at (3, 0).
#[derive(Clone, Debug, PartialEq)]
pub struct UnboundedMask {
    radius: usize,
    /// Entries with 0 ≤ j ≤ i ≤ radius, row after row.
    weights: Vec<f64>,
}

impl UnboundedMask {
    /// All entries with |i|, |j| ≤ radius, each rounded from its closed form.
    ///
    /// At radius 64 this takes about half a second.
    pub fn of_radius(radius: usize) -> Self {
        let potential = Potential::of_radius(radius + 2);
        let places = (0..=radius as isize).flat_map(|i| (0..=i).map(move |j| (i, j)));
        let closed: Vec<Closed> = places.map(|(i, j)| potential.mask(i, j)).collect();
        // Five or six bits cancel in each step.
        let pi = Pi::to(128 + 6 * radius as u64);
        let value = |x: &Closed| x.value_with(&pi).unwrap_or_else(|| x.value());
        UnboundedMask { radius, weights: closed.iter().map(value).collect() }
    }

    /// The radius up to which entries are known.
    pub fn radius(&self) -> usize {
        self.radius
    }

    /// The entry for a fine point this far from the place of a coarse one, in fine steps.
    ///
    /// It is 0 beyond the radius, where the true entry is about −(6/π) cos 4φ / |x|⁴.
    pub fn weight(&self, i: isize, j: isize) -> f64 {
        let (i, j) = (i.unsigned_abs(), j.unsigned_abs());
        let (far, near) = (i.max(j), i.min(j));
        if far > self.radius { 0.0 } else { self.weights[far * (far + 1) / 2 + near] }
    }
}

/// The entry of the exact rule of a bounded grid of n × m intervals.
///
/// It is for a fine point i, j (0 ≤ i ≤ 2n, 0 ≤ j ≤ 2m) and a coarse point a, b. It is the sum of
/// the unbounded mask over all images of the coarse point. Along the first axis the images are a +
/// 2nt and −a + 2nt, and likewise along the second.
///
/// Images beyond the mask's radius R are left out. Once R is several times n and m, entries
/// therefore come out larger by about 1 / (2π nm R²). The error is half of that for coarse points
/// on a border, and a quarter at a corner. [`Rule::Exact`](faircurve::laplacian::Rule::Exact) has no
/// such error.
pub fn reflected(mask: &UnboundedMask, fine: [usize; 2], coarse: [usize; 2], intervals: [usize; 2]) -> f64 {
    let [first, second] = [0, 1].map(|axis| images(fine[axis], coarse[axis], intervals[axis], mask.radius));
    first.iter().flat_map(|&i| second.iter().map(move |&j| mask.weight(i, j))).sum()
}

/// The distances from a fine point to all images of a coarse one, in fine steps, up to a radius.
fn images(fine: usize, coarse: usize, intervals: usize, radius: usize) -> Vec<isize> {
    let [fine, place, period] = [fine, 2 * coarse, 4 * intervals].map(|x| x as isize);
    // Points on a border are their own images there.
    let starts = if place % (period / 2) == 0 { vec![place] } else { vec![place, -place] };
    let radius = radius as isize;
    let of_start = |start: isize| {
        let first = (fine - radius - start).div_euclid(period);
        let last = (fine + radius - start).div_euclid(period);
        (first..=last).map(move |turn| fine - start - turn * period).filter(move |distance| distance.abs() <= radius)
    };
    starts.into_iter().flat_map(of_start).collect()
}
