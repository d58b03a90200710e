use super::*;
use crate::scf::problem::Ends;

fn span(tension: f64, ends: Ends) -> TensionSpan {
    TensionSpan { chord: 1.0, tension, ends }
}

#[test]
fn second_derivatives_are_those_of_the_moments() {
    let mut rng = StdRng::seed_from_u64(23);
    let mut worst: [f64; 6] = [0.0; 6];
    let (mut counts, mut jumps) = ([0; 6], 0);
    for _ in 0..2000 {
        let (angles, nu, tension) = random_input(&mut rng);
        let law = TensionLaw::new(nu);
        let span = span(tension, Ends::Directed);
        let here = span.segment(&law, angles).unwrap();
        let kind = match (here.shape.course, here.shape.pull) {
            (Course::Direct, Pull::Below(_)) => 0,
            (Course::Direct, _) => 1,
            (Course::Through(_), Pull::Critical) if here.shape.ends[1] > 0.0 => 2,
            (Course::Through(_), Pull::Critical) => 3,
            (Course::Through(_), _) => 4,
            (Course::Around(_), _) => 5,
        };
        let found = span.evaluate(&law, angles, &mut Near::default());
        assert_eq!(found.exists, 1.0);
        let step = 1e-4;
        let difference = |axis: usize| -> Option<[f64; 2]> {
            let at = |h: f64| {
                let mut angles = angles;
                angles[axis] += h;
                let segment = span.segment(&law, angles)?;
                let same = std::mem::discriminant(&segment.shape.course) == std::mem::discriminant(&here.shape.course)
                    && std::mem::discriminant(&segment.shape.pull) == std::mem::discriminant(&here.shape.pull);
                let [first, last] = segment.moments();
                same.then_some([-nu * first, nu * last])
            };
            let slope = |step: f64| {
                let (p, m) = (at(step)?, at(-step)?);
                Some([0, 1].map(|k| (p[k] - m[k]) / (2.0 * step)))
            };
            let (near, far) = (slope(step)?, slope(2.0 * step)?);
            Some([0, 1].map(|k| (4.0 * near[k] - far[k]) / 3.0))
        };
        let (Some(first), Some(last)) = (difference(0), difference(1)) else { continue };
        let [aa, ab, bb] = found.hessian;
        let size = aa.abs().max(bb.abs()).max(ab.abs());
        let off = [(aa, first[0]), (ab, first[1]), (ab, last[0]), (bb, last[1])]
            .into_iter()
            .map(|(got, wanted)| (got - wanted).abs() / size)
            .fold(0.0, f64::max);
        // A jump between two loops within the difference's steps is not a derivative.
        if kind == 5 && off > 1e-3 {
            jumps += 1;
            continue;
        }
        counts[kind] += 1;
        worst[kind] = worst[kind].max(off);
    }
    println!("{counts:?} {worst:?}, {jumps} jumps");
    assert!(counts.iter().all(|&count| count > 8), "{counts:?}");
    // With steps of 1e-4, fourth-order differences have errors of about 1e-6 next to a singular
    // end.
    assert!(worst.iter().all(|&off| off < 1e-5) && jumps < 5, "{worst:?}, {jumps} jumps");
}

#[test]
fn a_free_end_has_no_moment_and_the_derivatives_are_those_of_the_cost() {
    let mut rng = StdRng::seed_from_u64(29);
    let (mut solved, mut flats) = (0, 0);
    for _ in 0..1000 {
        let ([_, b], nu, tension) = random_input(&mut rng);
        let law = TensionLaw::new(nu);
        let span = span(tension, Ends::FreeStart);
        let what = format!("{b}, nu {nu}, tension {tension}");
        let Some(segment) = span.segment(&law, [0.0, b]) else {
            // Larger turns from a free end are loops, which need a tension to hold them.
            assert!(b.abs() > 1.3, "{what}");
            continue;
        };
        flats += usize::from(segment.flat_length() > 0.0);
        let found = span.evaluate(&law, [0.0, b], &mut Near::default());
        let at = |h: f64| span.segment(&law, [0.0, b + h]).map(|s| [s.cost(), nu * s.moments()[1]]);
        let slope = |step: f64| {
            let (after, before) = (at(step)?, at(-step)?);
            Some([0, 1].map(|k| (after[k] - before[k]) / (2.0 * step)))
        };
        let (Some(near), Some(far)) = (slope(1e-4), slope(2e-4)) else { continue };
        let [cost, moment] = [0, 1].map(|k| (4.0 * near[k] - far[k]) / 3.0);
        assert_near(segment.moments()[0] / segment.moments()[1], 0.0, 1e-9, &what);
        assert_near((cost - found.gradient[1]) / (nu * segment.cost()), 0.0, 1e-8, &what);
        assert_near(moment / found.hessian[2], 1.0, 1e-5, &what);
        // With the other end free the segment is the same from the other side.
        let other = TensionSpan { ends: Ends::FreeEnd, ..span }.evaluate(&law, [b, 0.0], &mut Near::default());
        assert_near(other.cost / found.cost, 1.0, 1e-12, &what);
        assert_near(other.gradient[0] / found.gradient[1], 1.0, 1e-9, &what);
        assert_near(other.hessian[0] / found.hessian[2], 1.0, 1e-6, &what);
        solved += 1;
    }
    println!("{solved} solved, {flats} with a straight piece");
    assert!(solved > 600 && flats > 50);
}
