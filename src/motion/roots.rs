//! Places where polynomials change their sign, found by their Bernstein coefficients.

/// After this many halvings the roots in a part count as one.
pub(super) const MOST_HALVINGS: u32 = 32;

/// Steps that take any bracket of a root to rounding. Most brackets take ten.
const ROOT_STEPS: usize = 100;

/// Bernstein coefficients on 0 … 1 from power coefficients: b_k = Σⱼ C(k, j)/C(n, j) aⱼ.
pub(super) fn bernstein<const N: usize>(mut a: [f64; N]) -> [f64; N] {
    let mut binomial = 1.0;
    for (j, a) in a.iter_mut().enumerate() {
        *a /= binomial;
        binomial *= (N - 1 - j) as f64 / (j + 1) as f64;
    }
    // Repeated sums give the sums with binomial factors.
    for last in (0..N - 1).rev() {
        for k in last..N - 1 {
            a[k + 1] += a[k];
        }
    }
    a
}

/// Where a polynomial in Bernstein form on `from … to` changes its sign.
///
/// The change is from minus to plus (`rising`), or from plus to minus. Coefficients of one sign
/// have no root between. One change of sign has one root (Descartes' rule). A part with more
/// changes is halved.
pub(super) fn sign_changes<const N: usize>(
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
            // `right` now has the right half's coefficients.
            let middle = 0.5 * (from + to);
            if left[N - 1] == 0.0 {
                found(middle);
            }
            sign_changes(&left, rising, (from, middle), halvings - 1, found);
            sign_changes(&right, rising, (middle, to), halvings - 1, found);
        }
    }
}

/// The root in 0 … 1 of a polynomial whose Bernstein coefficients change their sign once.
///
/// The method is regula falsi. The end that stays counts half (the Illinois rule). Where that is
/// slow it bisects.
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
