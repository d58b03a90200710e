//! Line search: a bracket by doubling, then R. P. Brent's minimisation without derivatives.
//!
//! Source: R. P. Brent, *Algorithms for Minimization without Derivatives*, 1973, chapter 5.

/// The first trial step, as in the published program.
const FIRST: f64 = 1e-5;

/// The most doublings or quarterings of a bracket.
const MOST_TRIALS: u32 = 200;

/// The most steps of the minimisation.
///
/// Golden-section steps alone would gain 10⁻⁸ in 40.
const MOST_STEPS: u32 = 100;

/// The relative accuracy of the step.
///
/// Over √ε of the step φ is flat at its minimum, to rounding.
const TOLERANCE: f64 = 1.5e-8;

/// A step > 0 that lowers `energy` to a minimum along the line, and the energy there.
///
/// `start` is the energy at 0. `None` where no step lowers it.
pub(super) fn minimise(energy: impl Fn(f64) -> f64, start: f64) -> Option<(f64, f64)> {
    let mut step = FIRST;
    let mut here = energy(step);
    // The published program would stop here. The curve is too large for its first step, or almost
    // at its minimum.
    for _ in 0..MOST_TRIALS {
        if here < start {
            break;
        }
        step *= 0.25;
        here = energy(step);
    }
    let lower = here < start;
    if !lower {
        return None;
    }
    let (mut low, mut middle, mut high) = (0.0, step, 2.0 * step);
    let mut ahead = energy(high);
    for _ in 0..MOST_TRIALS {
        // The comparison is false for NaN, which a step too far may give.
        let falls = ahead < here;
        if !falls {
            break;
        }
        (low, middle, high) = (middle, high, 2.0 * high);
        (here, ahead) = (ahead, energy(high));
    }
    let (best, value) = brent(&energy, low, high);
    Some(if value < here { (best, value) } else { (middle, here) })
}

fn brent(energy: &impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> (f64, f64) {
    let golden = 0.5 * (3.0 - 5f64.sqrt());
    let mut x = low + golden * (high - low);
    let mut at_x = energy(x);
    // The second and third best, and the last two moves.
    let (mut w, mut at_w, mut v, mut at_v) = (x, at_x, x, at_x);
    let (mut last, mut before) = (0.0f64, 0.0f64);
    for _ in 0..MOST_STEPS {
        let middle = 0.5 * (low + high);
        let least = TOLERANCE * x.abs() + f64::MIN_POSITIVE;
        if (x - middle).abs() <= 2.0 * least - 0.5 * (high - low) {
            break;
        }
        let mut step = None;
        if before.abs() > least {
            // The vertex of the parabola through the three best. It is taken where it lies inside,
            // and moves less than half as far as the move before the last.
            let r = (x - w) * (at_x - at_v);
            let q = (x - v) * (at_x - at_w);
            let p = (x - v) * q - (x - w) * r;
            let q = 2.0 * (q - r);
            let (p, q) = (if q > 0.0 { -p } else { p }, q.abs());
            if p.abs() < (0.5 * q * before).abs() && p > q * (low - x) && p < q * (high - x) {
                let move_by = p / q;
                let near_end = (x + move_by - low) < 2.0 * least || (high - x - move_by) < 2.0 * least;
                step = Some(if near_end { least.copysign(middle - x) } else { move_by });
                before = last;
            }
        }
        let step = step.unwrap_or_else(|| {
            before = if x >= middle { low - x } else { high - x };
            golden * before
        });
        last = step;
        let u = if step.abs() >= least { x + step } else { x + least.copysign(step) };
        let at_u = energy(u);
        if at_u <= at_x {
            if u >= x {
                low = x
            } else {
                high = x
            }
            (v, at_v, w, at_w, x, at_x) = (w, at_w, x, at_x, u, at_u);
        } else {
            if u < x {
                low = u
            } else {
                high = u
            }
            if at_u <= at_w || w == x {
                (v, at_v, w, at_w) = (w, at_w, u, at_u);
            } else if at_u <= at_v || v == x || v == w {
                (v, at_v) = (u, at_u);
            }
        }
    }
    (x, at_x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_minimum_is_found_however_far_it_is_from_the_first_step() {
        for minimum in [3e-12, 1e-5, 0.3434, 285.7, 4e9] {
            let energy = |x: f64| (x / minimum - 1.0).powi(2) + 0.1 * (x / minimum - 1.0).powi(4);
            let (step, value) = minimise(energy, energy(0.0)).unwrap();
            assert!((step / minimum - 1.0).abs() < 1e-7 && value < 1e-14, "{minimum}: {step} {value}");
        }
    }

    #[test]
    fn a_line_that_goes_uphill_has_no_step() {
        assert_eq!(minimise(|x| 1.0 + x, 1.0), None);
        assert_eq!(minimise(|_| f64::NAN, 1.0), None);
    }
}
