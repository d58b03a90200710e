//! Tests of segments that are followed as their ends turn, against those that nested roots find
//! independently.

use super::*;
use crate::scf::problem::Ends;

/// Follows random segments as their angles change by up to `far`. Returns the share that was
/// followed, the share of those that differ from the curves of the roots, and the largest
/// difference of the others' costs.
fn followed(ends: Ends, far: f64, count: usize) -> [f64; 3] {
    let mut rng = StdRng::seed_from_u64(31);
    let (mut tried, mut followed, mut others, mut largest) = (0, 0, 0, 0f64);
    for _ in 0..count {
        let (angles, nu, tension) = random_input(&mut rng);
        let law = TensionLaw::new(nu);
        let span = TensionSpan { chord: 1.0, tension, ends };
        let turned = angles.map(|angle| (angle + rng.random_range(-far..far)).clamp(-PI, PI));
        let (Some(here), Some(there)) = (span.segment(&law, angles), span.segment(&law, turned)) else { continue };
        // Loops between two inflections are not followed.
        if matches!(here.shape.course, Course::Around(_)) {
            continue;
        }
        tried += 1;
        let Some(near) = span.segment_by(&law, turned, Some(&here.shape)) else { continue };
        followed += 1;
        let end = near.place_again();
        let what = format!("{turned:?} from {angles:?}, nu {nu}, tension {tension}");
        assert_near((end[0] - 1.0).hypot(end[1]), 0.0, 1e-11 * near.length.max(1.0), &what);
        let off = (near.cost() / there.cost() - 1.0).abs();
        if off > 1e-6 { others += 1 } else { largest = largest.max(off) }
    }
    [f64::from(followed) / f64::from(tried), f64::from(others) / f64::from(followed), largest]
}

#[test]
fn segments_are_followed_as_their_ends_turn_and_are_those_of_the_roots() {
    for (ends, far, least, most) in [
        (Ends::Directed, 1e-3, 0.98, 5e-3),
        (Ends::Directed, 0.1, 0.92, 0.01),
        (Ends::FreeEnd, 1e-3, 0.98, 5e-3),
        (Ends::FreeStart, 0.1, 0.92, 0.01),
    ] {
        let [share, others, largest] = followed(ends, far, 500);
        println!(
            "{ends:?}, by {far}: {share:.3} followed, {others:.4} of them to another curve, costs {largest:.1e} apart"
        );
        assert!(share > least && others < most, "{ends:?}, by {far}: {share} followed, {others} another curve");
        assert!(largest < 1e-11, "{ends:?}, by {far}: costs {largest:e} apart");
    }
}

#[test]
fn angles_without_digits_beside_the_chord_have_a_straight_segment() {
    for (a, b) in [(9.4e-37, -4.8e-44), (-4.8e-44, 7.6e-51), (-4.1e-28, 2.8e-44), (1e-12, 1e-30)] {
        let segment = TensionSegment::between(1.0, [a, b], 20.0, 2.6e15).unwrap();
        assert_near(segment.cost() / 2.6e15, 1.0, 1e-14, &format!("({a}, {b})"));
        assert_near(segment.flat_length(), 1.0, 1e-11, &format!("({a}, {b})"));
    }
}
