//! Arc length of smooth pieces, and its inverse.
//!
//! Lengths are Gauss quadratures. The error is estimated by the decay of the speed's Legendre
//! coefficients. The inverse takes safeguarded Newton steps.
//!
//! Relative errors are below 1e-9, also at and near cusps. The speed near a cusp is about
//! √(s²+c²u²), which no rule integrates well across u = 0. So a piece that is not smooth enough is
//! cut at the least speed and bisected towards it.

/// Nodes of the rule, and lanes of their sum.
const NODES: usize = 12;
const LANES: usize = 4;

/// The 12-point Gauss–Legendre rule on (−1, 1), positive half (Abramowitz & Stegun, table 25.4).
const GAUSS_12: [(f64, f64); NODES / 2] = [
    (0.125_233_408_511_468_9, 0.249_147_045_813_402_8),
    (0.367_831_498_998_180_2, 0.233_492_536_538_354_8),
    (0.587_317_954_286_617_4, 0.203_167_426_723_065_92),
    (0.769_902_674_194_304_7, 0.160_078_328_543_346_23),
    (0.904_117_256_370_474_9, 0.106_939_325_995_318_43),
    (0.981_560_634_246_719_3, 0.047_175_336_386_511_83),
];

/// Degrees of the Legendre coefficients for the error estimate: the last that the rule resolves.
const TAIL: [usize; 3] = [9, 10, 11];

/// The rule on (0, 1).
struct Rule {
    nodes: [f64; NODES],
    weights: [f64; NODES],
    /// Weights of the coefficients of [`TAIL`].
    tail: [[f64; NODES]; 3],
}

const RULE: Rule = Rule::new();

impl Rule {
    const fn new() -> Self {
        let mut rule = Rule { nodes: [0.0; NODES], weights: [0.0; NODES], tail: [[0.0; NODES]; 3] };
        let mut i = 0;
        while i < NODES {
            let (node, weight) = if i < NODES / 2 { GAUSS_12[NODES / 2 - 1 - i] } else { GAUSS_12[i - NODES / 2] };
            let x = if i < NODES / 2 { -node } else { node };
            (rule.nodes[i], rule.weights[i]) = (0.5 + 0.5 * x, 0.5 * weight);
            let mut j = 0;
            while j < TAIL.len() {
                rule.tail[j][i] = (2 * TAIL[j] + 1) as f64 * 0.5 * weight * legendre(TAIL[j], x);
                j += 1;
            }
            i += 1;
        }
        rule
    }
}

/// The Legendre polynomial of a degree.
const fn legendre(degree: usize, x: f64) -> f64 {
    let (mut before, mut here) = (1.0, x);
    let mut k = 1;
    while k < degree {
        let next = ((2 * k + 1) as f64 * x * here - k as f64 * before) / (k + 1) as f64;
        (before, here) = (here, next);
        k += 1;
    }
    here
}

/// The error of a piece, relative to the length of all pieces.
const TOLERANCE: f64 = 1e-11;

/// A piece whose speed falls below this fraction of its maximum may be near a cusp.
///
/// Near a cusp the coefficients first decay algebraically. The square of the last coefficient is
/// then no estimate of the error.
const SLOW: f64 = 0.1;

/// The most bisections towards a least speed. A piece of 2⁻²⁰ of the whole is about the square root
/// of the tolerance.
const MAX_HALVINGS: u32 = 40;

/// Golden-section steps of the search for the least speed.
///
/// A cut that misses the least speed by 1e-7 of a piece costs 1e-14 of its length.
const SEARCH: usize = 40;

/// A piece's length by the rule, and its error estimate.
struct Estimate {
    length: f64,
    /// The largest of the last coefficients.
    tail: f64,
    speeds: [f64; NODES],
}

impl Estimate {
    #[inline(always)]
    fn of(speed: &impl Fn(f64) -> f64, from: f64, to: f64) -> Self {
        let width = to - from;
        let mut speeds = [0.0; NODES];
        for (to, node) in speeds.iter_mut().zip(&RULE.nodes) {
            *to = speed(from + width * node);
        }
        let sum = |weights: &[f64; NODES]| {
            let mut sums = [0.0; LANES];
            for (speeds, weights) in speeds.as_chunks::<LANES>().0.iter().zip(weights.as_chunks::<LANES>().0) {
                for lane in 0..LANES {
                    sums[lane] += speeds[lane] * weights[lane];
                }
            }
            (sums[0] + sums[1]) + (sums[2] + sums[3])
        };
        let mut tail = 0.0_f64;
        for weights in &RULE.tail {
            tail = tail.max(sum(weights).abs());
        }
        Estimate { length: width * sum(&RULE.weights), tail: width * tail, speeds }
    }

    /// Whether the estimate is good enough, relative to the length of all pieces.
    ///
    /// Coefficients of a smooth speed decay as ρ⁻ᵏ. The rule's error is about coefficient 24, far
    /// below the square of coefficient 9.
    #[inline(always)]
    fn is_good(&self, whole: f64) -> bool {
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        for &speed in &self.speeds {
            least = if speed < least { speed } else { least };
            most = if speed > most { speed } else { most };
        }
        let smooth = least >= SLOW * most && self.tail * self.tail <= TOLERANCE * whole * self.length;
        smooth || self.tail <= TOLERANCE * whole
    }

    /// The fraction of the least speed, if it is inside the piece and far below the largest speed.
    #[cold]
    fn slowest(&self, speed: &dyn Fn(f64) -> f64, from: f64, to: f64) -> Option<f64> {
        let at = |k: usize| {
            if k == 0 {
                from
            } else if k > NODES {
                to
            } else {
                from + (to - from) * RULE.nodes[k - 1]
            }
        };
        let k = (0..NODES).min_by(|&i, &j| self.speeds[i].total_cmp(&self.speeds[j]))?;
        let most = self.speeds.iter().fold(0.0, |most: f64, speed| most.max(*speed));
        let at_an_end = k == 0 && speed(from) <= self.speeds[0] || k + 1 == NODES && speed(to) <= self.speeds[k];
        if at_an_end || self.speeds[k] >= SLOW * most {
            return None;
        }
        let (mut low, mut high) = (at(k), at(k + 2));
        const GOLDEN: f64 = 0.618_033_988_749_894_8;
        let (mut a, mut b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        let (mut speed_a, mut speed_b) = (speed(a), speed(b));
        for _ in 0..SEARCH {
            if speed_a < speed_b {
                (high, b, speed_b) = (b, a, speed_a);
                a = high - GOLDEN * (high - low);
                speed_a = speed(a);
            } else {
                (low, a, speed_a) = (a, b, speed_b);
                b = low + GOLDEN * (high - low);
                speed_b = speed(b);
            }
        }
        let found = 0.5 * (low + high);
        let margin = 1e-6 * (to - from);
        (found > from + margin && found < to - margin).then_some(found)
    }
}

#[cold]
fn refined(speed: &dyn Fn(f64) -> f64, (from, to): (f64, f64), estimate: &Estimate, whole: f64, halvings: u32) -> f64 {
    let middle = estimate.slowest(speed, from, to).unwrap_or(0.5 * (from + to));
    let part = |from: f64, to: f64| {
        let estimate = Estimate::of(&speed, from, to);
        // NaN ends the recursion too.
        if halvings == 0 || estimate.is_good(whole) || !estimate.length.is_finite() {
            return estimate.length;
        }
        refined(speed, (from, to), &estimate, whole, halvings - 1)
    };
    part(from, middle) + part(middle, to)
}

/// ∫ speed(u) du over the fractions `from … to` of a span.
#[inline(always)]
fn partial_length(speed: &impl Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    let estimate = Estimate::of(speed, from, to);
    if estimate.is_good(estimate.length) || !estimate.length.is_finite() {
        return estimate.length;
    }
    refined(speed, (from, to), &estimate, estimate.length, MAX_HALVINGS)
}

/// The 6-point Gauss–Legendre rule on (−1, 1), positive half (Abramowitz & Stegun, table 25.4).
const GAUSS_6: [(f64, f64); 3] = [
    (0.238_619_186_083_196_9, 0.467_913_934_572_691),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_35),
];

/// Length of a piece of almost constant speed, by six speeds.
#[inline(always)]
pub(crate) fn steady_length(speed: impl Fn(f64) -> f64) -> f64 {
    let mut sum = 0.0;
    for (node, weight) in GAUSS_6 {
        sum += 0.5 * weight * (speed(0.5 - 0.5 * node) + speed(0.5 + 0.5 * node));
    }
    sum
}

/// Length of a smooth span from |dp/du| at its fractions 0 … 1, to a relative error of 1e-9.
#[inline(always)]
pub fn span_length(speed: impl Fn(f64) -> f64) -> f64 {
    partial_length(&speed, 0.0, 1.0)
}

/// The fraction of a smooth span at which the arc length from its start is `target`.
///
/// `length` is the length of the whole span. The result is good to 1e-9 of that length.
#[inline(always)]
pub fn fraction_at(speed: impl Fn(f64) -> f64, length: f64, target: f64) -> f64 {
    /// The error of the result, relative to the length.
    const CLOSE: f64 = 1e-10;
    let (mut low, mut high) = (0.0, 1.0);
    let mut u = target / length;
    for _ in 0..60 {
        let excess = partial_length(&speed, 0.0, u) - target;
        if excess.abs() <= CLOSE * length {
            break;
        }
        if excess > 0.0 {
            high = u
        } else {
            low = u
        }
        let newton = u - excess / speed(u);
        // A Newton step inside the bracket, else bisection (near a cusp).
        u = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
    }
    u
}
