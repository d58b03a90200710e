//! Outliers: fixes off the way on which the fixes before and after them lie.

use glam::DVec3;

/// A fix is an outlier if it is off by this many times the median. For normal noise in two directions that is
/// 5 times the noise.
const FAR: f64 = 7.0;

/// The median counts the whole track, or this many fixes on each side if that is more.
const BESIDE: usize = 5;

/// Which fixes of a track are outliers.
///
/// A fix is off by the least of three distances, each in units of its noise: from the line in time through the
/// two fixes before it, through the two after it, and through its neighbours. At a sharp turn one of them is
/// small. The fix that is off the most among its neighbours goes first, since it spoils theirs.
pub(super) fn outliers(places: &[DVec3], t: &[f64]) -> Vec<bool> {
    let mut far = vec![false; places.len()];
    loop {
        let kept: Vec<usize> = (0..places.len()).filter(|&k| !far[k]).collect();
        let off: Vec<f64> = (0..kept.len()).map(|k| off_by(k, &kept, places, t)).collect();
        let all = median(&off);
        let is_far = |k: &usize| {
            let (from, to) = (k.saturating_sub(BESIDE), (k + BESIDE + 1).min(off.len()));
            let neighbours = &off[k.saturating_sub(1)..(k + 2).min(off.len())];
            off[*k] > FAR * all.max(median(&off[from..to])) && neighbours.iter().all(|other| *other <= off[*k])
        };
        let found: Vec<usize> = (0..kept.len()).filter(is_far).collect();
        if found.is_empty() {
            return far;
        }
        found.iter().for_each(|&k| far[kept[k]] = true);
    }
}

/// How far a fix is off, in units of noise.
fn off_by(k: usize, kept: &[usize], places: &[DVec3], t: &[f64]) -> f64 {
    let from_line = |a: Option<usize>, b: usize| {
        let (&a, &b, own) = (kept.get(a?)?, kept.get(b)?, kept[k]);
        let share = (t[own] - t[a]) / (t[b] - t[a]);
        let noise = (1.0 + share * share + (1.0 - share) * (1.0 - share)).sqrt();
        Some(places[own].distance(places[a].lerp(places[b], share)) / noise).filter(|off| off.is_finite())
    };
    let lines = [
        from_line(k.checked_sub(2), k.wrapping_sub(1)),
        from_line(Some(k + 1), k + 2),
        from_line(k.checked_sub(1), k + 1),
    ];
    lines.into_iter().flatten().fold(f64::INFINITY, f64::min)
}

/// The median of the positive numbers. Fixes of a thing at rest are not off at all.
fn median(numbers: &[f64]) -> f64 {
    let mut numbers: Vec<f64> = numbers.iter().copied().filter(|x| *x > 0.0).collect();
    let middle = numbers.len() / 2;
    if numbers.is_empty() { f64::INFINITY } else { *numbers.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

#[cfg(test)]
mod tests {
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::*;

    fn found(places: &[DVec3]) -> Vec<usize> {
        let t: Vec<f64> = (0..places.len()).map(|k| k as f64).collect();
        let far = outliers(places, &t);
        (0..far.len()).filter(|&k| far[k]).collect()
    }

    #[test]
    fn outliers_are_found_and_sharp_turns_are_not() {
        let seed = 12;
        println!("seed {seed}");
        let mut rng = StdRng::seed_from_u64(seed);
        let (mut place, mut places) = (DVec3::ZERO, vec![]);
        for k in 0..90 {
            // Right angles after every 20 steps.
            place += 30.0 * [DVec3::X, DVec3::Y][k / 20 % 2];
            let mut noise = || rng.random_range(-1.0..1.0);
            places.push(place + DVec3::new(noise(), noise(), 0.0));
        }
        assert!(found(&places).is_empty());
        for (k, off) in [(0, -25.0), (33, 20.0), (50, 40.0), (51, 35.0), (89, 60.0)] {
            places[k] += off * DVec3::new(0.6, -0.8, 0.0);
        }
        assert_eq!(found(&places), [0, 33, 50, 51, 89]);
    }

    #[test]
    fn a_thing_that_rests_and_goes_on_has_no_outliers() {
        let way = |k: i32| DVec3::new(f64::from((k - 30).clamp(0, 20).pow(2)), 0.0, 0.0);
        assert!(found(&(0..60).map(way).collect::<Vec<_>>()).is_empty());
        assert!(found(&[DVec3::X; 4]).is_empty() && found(&[]).is_empty());
    }
}
