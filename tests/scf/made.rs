//! Smooth connection segments made by quadrature are found again from their chord and end angles.

use std::f64::consts::{FRAC_PI_2, PI};

use faircurve::scf::Segment;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;

use crate::universal::{Known, Reference};

/// Where on the universal curve a piece is, from every corner of the possible.
fn random_piece(rng: &mut StdRng) -> [f64; 2] {
    let [u, v] = [(); 2].map(|_| rng.random_range(0.0..PI));
    let small = 10.0_f64.powf(-rng.random_range(0.0..4.0));
    match rng.random_range(0..6) {
        0 => [u.min(v), u.max(v)],
        1 => [-u, v],
        // Nearly flat.
        2 => [small * u.min(v), small * u.max(v)],
        3 => [-small * u, small * v],
        // Nearly circular.
        4 => [u, u + small * (PI - u)],
        // With nearly everything between two inflections.
        _ => [small * u, PI - 0.1 * small * v],
    }
}

/// A segment that is known, laid over a chord, maybe mirrored and reversed.
struct Made {
    known: Known,
    chord: f64,
    angles: [f64; 2],
    force: f64,
    /// |κ|^ν sgn κ at both ends, 1 at most.
    bends: [f64; 2],
}

impl Made {
    fn random(reference: &Reference, rng: &mut StdRng) -> Option<Self> {
        let t = random_piece(rng);
        // Nothing is left of an interval that rounding closes.
        if t[1] - t[0] < 1e-5 || t[1] >= PI {
            return None;
        }
        let known = reference.piece(t);
        let mirrored = if rng.random_bool(0.5) { -1.0 } else { 1.0 };
        let reversed = rng.random_bool(0.5);
        let (mut angles, mut bends) = (known.angles.map(|x| mirrored * x), t.map(|t| mirrored * reference.bend(t)));
        if reversed {
            angles.reverse();
            bends = [-bends[1], -bends[0]];
        }
        let chord = 10.0_f64.powf(rng.random_range(-2.0..2.0));
        Some(Made { known, chord, angles, force: mirrored * known.force, bends })
    }
}

/// Rounding of the end angles: of their sums of numbers up to π, and of the chord's direction,
/// since displacements are differences: of J, which is T₁ at most, and of moments over q, which
/// near π have lost the digits of π − T.
fn angle_rounding(reference: &Reference, known: &Known) -> f64 {
    let moment = known.t.iter().map(|t| t.abs().sin().powf(reference.q)).fold(0.0, f64::max);
    let late = known.t.iter().filter(|t| t.abs() > FRAC_PI_2);
    let lost: f64 = late.map(|t| PI * t.cos().abs() * t.abs().sin().powf(reference.q - 1.0)).sum();
    16.0 * (1.0 + (moment / reference.q + known.t[1] + lost) / known.chord()) * f64::EPSILON
}

/// Near a fold, where two segments with an inflection meet, T moves with the root of what the
/// angles move.
const FOLD: f64 = 1e-6;

/// Differences of cost, force direction and ends from those made, in units of what rounding may do.
fn differences(reference: &Reference, made: &Made, segment: &Segment) -> [f64; 3] {
    let Made { known, chord, .. } = made;
    let nu = reference.nu;
    let unit = known.chord();
    let of_angles = angle_rounding(reference, known);
    // A power ν of some roundings.
    let rounding = (64.0 + 16.0 * nu) * f64::EPSILON;
    let wanted = reference.cost(known, *chord);
    // The derivatives of the cost in the angles are ν times the moments, of the unit chord D^{ν−1}
    // sin^q: through folds, too.
    let moments: f64 = known.t.iter().map(|t| t.abs().sin().powf(reference.q)).sum();
    let of_cost = rounding + of_angles * nu * moments / known.along;
    let most = if known.t[0] < 0.0 { FOLD } else { f64::INFINITY };
    // T comes from a ratio of moments, to the power 1/q, and of nearly equal ones where T₀ and T₁
    // are near each other.
    let of_power = 16.0 * (1.0 + 1.0 / (reference.q * (known.t[1] - known.t[0]))) * f64::EPSILON;
    let moved = reference.sensitivity(known, of_angles).map(|moved| moved.min(most) + of_power);
    let of_force = of_angles + moved[0].min(moved[1]);
    // ln D by T₀ and T₁.
    let stretch: f64 = known
        .t
        .iter()
        .zip(moved)
        .map(|(t, moved)| {
            let (sine, cosine) = t.abs().sin_cos();
            let along = known.along * sine.powf(reference.q);
            (along.abs() + (known.across * cosine * sine.powf(reference.q - 1.0)).abs()) / (unit * unit) * moved
        })
        .sum();
    let order = if made.bends[0].abs() == known.t[0].abs().sin() { [0, 1] } else { [1, 0] };
    let curvatures = segment.curvatures();
    let of_ends = (0..2).map(|end| {
        let bend = (curvatures[end].abs() * chord / unit).powf(nu) * curvatures[end].signum();
        let t = known.t[order[end]];
        let allowed = moved[order[end]] + (rounding + 2.0 * nu * stretch) * t.abs().sin();
        (bend - made.bends[end]).abs() / allowed
    });
    [
        // Powers of 100 leave the range of numbers.
        if wanted < 1e-290 { 0.0 } else { (segment.cost() / wanted - 1.0).abs() / of_cost },
        (segment.force_direction() - made.force).abs() / of_force,
        of_ends.fold(0.0, f64::max),
    ]
}

#[test]
fn a_million_segments_made_by_quadrature_are_found_again() {
    const EXPONENTS: u64 = 2000;
    const EACH: usize = 500;
    let of_exponent = |number: u64| {
        let mut rng = StdRng::seed_from_u64(number);
        let nu = match number {
            0 => 1.01,
            1 => 2.0,
            2 => 100.0,
            _ => 1.05 * (60.0_f64 / 1.05).powf(rng.random_range(0.0..1.0)),
        };
        let reference = Reference::new(nu);
        let (mut lost, mut folds, mut made_of_all, mut cheapest) = (Vec::new(), 0, 0, 0);
        let mut worst = [0.0_f64; 3];
        while made_of_all < EACH {
            let Some(made) = Made::random(&reference, &mut rng) else { continue };
            made_of_all += 1;
            let all = Segment::stationary(made.chord, made.angles, nu);
            let each: Vec<[f64; 3]> = all.iter().map(|segment| differences(&reference, &made, segment)).collect();
            let largest = |d: &[f64; 3]| d.iter().copied().fold(0.0, f64::max);
            let nearest = (0..each.len()).min_by(|&i, &j| largest(&each[i]).total_cmp(&largest(&each[j])));
            match nearest {
                Some(k) if largest(&each[k]) <= 1.0 => {
                    worst = std::array::from_fn(|i| worst[i].max(each[k][i]));
                    cheapest += usize::from(k == 0);
                    assert!(all[0].cost() <= all[k].cost() * (1.0 + 1e-9), "ν = {nu}: {:?}", made.known);
                }
                // Rounding may part a curve from the edge of what exists.
                None if reference
                    .sensitivity(&made.known, angle_rounding(&reference, &made.known))
                    .iter()
                    .any(|&moved| moved > FOLD) =>
                {
                    folds += 1
                }
                _ => lost.push(format!(
                    "ν = {nu}: {:?} over {:?} among {} with {:?}",
                    made.known,
                    made.angles,
                    all.len(),
                    nearest.map(|k| each[k])
                )),
            }
        }
        (lost, folds, cheapest, worst)
    };
    let all: Vec<_> = (0..EXPONENTS).into_par_iter().map(of_exponent).collect();
    let lost: Vec<&String> = all.iter().flat_map(|(lost, ..)| lost).collect();
    let folds: usize = all.iter().map(|(_, folds, ..)| folds).sum();
    let cheapest: usize = all.iter().map(|(_, _, cheapest, _)| cheapest).sum();
    let worst = all.iter().fold([0.0_f64; 3], |worst, one| std::array::from_fn(|k| worst[k].max(one.3[k])));
    println!(
        "{} lost, {folds} at folds, {cheapest} the cheapest of their angles; differences {worst:.2?} of those allowed",
        lost.len()
    );
    lost.iter().take(60).for_each(|lost| println!("{lost}"));
    assert!(lost.is_empty(), "{} lost", lost.len());
    assert!(folds <= 10, "{folds} at folds");
    assert!(cheapest > 500_000, "{cheapest}");
}
