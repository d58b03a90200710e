//! Tests of the quadrature of arcs against independent sums.

use super::*;
use crate::scf::tension::quadrature::{Law, Pull, Rule};

#[test]
fn a_rule_integrates_its_weight_times_powers_exactly() {
    for beta in [0.0, -0.05, -0.5, -2.0 / 3.0, -0.8333, -0.9] {
        let rule = Rule::for_weight(beta);
        for degree in 0..32 {
            // The rule's weights are divided by x^β.
            let got: f64 = rule.nodes().map(|(x, weight)| weight * x.powf(beta) * x.powi(degree)).sum();
            let wanted = 1.0 / (degree as f64 + beta + 1.0);
            assert_near(got / wanted, 1.0, 1e-12, &format!("x^{beta} x^{degree}"));
        }
    }
}

/// ∫ f over 0 … length by the double exponential rule, with exact distances from 0.
fn double_exponential(f: impl Fn(f64) -> f64, length: f64) -> f64 {
    let step = 1.0 / 128.0;
    (-900..=900)
        .map(|index| {
            let t = index as f64 * step;
            let s = 0.5 * PI * t.sinh();
            // x = length/(1 + e^{−2s})
            let x = length / (1.0 + (-2.0 * s).exp());
            let slope = length * 0.25 * PI * t.cosh() / s.cosh().powi(2);
            if x > 1e-150 && slope > 0.0 && x < length { step * f(x) * slope } else { 0.0 }
        })
        .sum()
}

#[test]
fn arcs_are_good_to_twelve_digits_from_an_inflection_on_and_near_the_critical_pull() {
    for nu in [1.2, 1.5, 2.0, 2.5, 4.0, 20.0] {
        let law = Law::new(nu, 0.7);
        let mut pulls = vec![Pull::Below(1.0), Pull::Below(0.5), Pull::Below(1e-3), Pull::Below(1e-7)];
        pulls.extend([1e-4, 1e-2, 0.3, 5.0, 1e6].map(Pull::Above));
        if nu > 2.0 {
            pulls.push(Pull::Critical);
        }
        for pull in pulls {
            for to in [1e-6, 0.02, 0.9, 2.5] {
                let got = law.arc(pull, 0.0, to);
                let radius = |x: f64| 1.0 / law.curvature(pull, x);
                // Split where the scale of the curvature changes, which the reference does not
                // detect.
                let scale = match pull {
                    Pull::Below(gap) => (2.0 * gap).sqrt(),
                    _ => 2.0 * law.opening(pull),
                };
                let mut ends = vec![0.0, to];
                ends.extend((-2..12).map(|k| scale * 4f64.powi(k)).filter(|end| *end > 0.0 && *end < to));
                ends.sort_by(f64::total_cmp);
                for (index, part) in [|_: f64| 1.0, f64::cos, f64::sin].into_iter().enumerate() {
                    let wanted: f64 = ends
                        .windows(2)
                        .map(|w| double_exponential(|x| part(w[0] + x) * radius(w[0] + x), w[1] - w[0]))
                        .sum();
                    let what = format!("nu {nu}, {pull:?}, to {to}, part {index}");
                    assert_near(got[index] / got[0], wanted / got[0], 1e-12, &what);
                }
            }
        }
    }
}

#[test]
fn the_displacement_across_the_pull_is_the_elementary_one() {
    let mut rng = StdRng::seed_from_u64(3);
    for _ in 0..500 {
        let nu = rng.random_range(1.2..20.0);
        let law = Law::new(nu, 1.3);
        let (from, to) = (rng.random_range(-3.0..0.0), rng.random_range(0.0..3.0));
        let pull = Pull::Below(10f64.powf(rng.random_range(-12.0..0.0)));
        let [length, _, across] = law.arc(pull, from, to);
        let power = |x: f64| law.excess(pull, x).powf(law.q);
        let wanted = law.factor * (power(to) - power(from)) / (law.q * law.strength(pull).max(1e-300));
        if law.strength(pull) > 1e-3 {
            assert_near(across / length, wanted / length, 1e-11, &format!("nu {nu}, {pull:?}, {from} … {to}"));
        }
    }
}
