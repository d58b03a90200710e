//! [`start`]: derivatives that keep every shape, for the search to begin with.
//!
//! A derivative within the turn of the polygon has the sides asked for, if those beside it are short enough. The turn is
//! divided so that the part towards a span is as large as the turn at its other end: a span to an almost straight point
//! has to leave almost straight. Beside a straight span the derivative is along it.

use super::mend::{Ahead, Begin, Freedom};
use super::span::{Span, Vector, cross, dot, length, minus, plus, times};

/// The least turn at the other end of a span that counts: below it both spans have equal parts.
const LEAST: f64 = 1e-12;

/// The part of the length allowed that a derivative takes.
const PART: f64 = 0.5;

/// The part of the slower pace beside a knot that a derivative keeps.
const PACE: f64 = 0.1;

/// Where the search for the derivatives of a curve begins. Those `given` are kept, and other ends are natural.
pub(super) fn start(spans: &[Span], closed: bool, given: [Option<Vector>; 2]) -> Begin {
    let count = spans.len();
    let knots = if closed { count } else { count + 1 };
    // The chords less what of them the given derivatives cover.
    let left: Vec<Vector> = (0..count)
        .map(|k| {
            let ends = [given[0].filter(|_| k == 0), given[1].filter(|_| k + 1 == count)];
            ends.into_iter().flatten().fold(spans[k].chord, |left, v| minus(left, times(spans[k].h / 3.0, v)))
        })
        .collect();
    let is_end = |knot: usize| !closed && (knot == 0 || knot == count);
    let before = |knot: usize| (knot + count - 1) % count;
    let turn = |knot: usize| {
        let [a, b] = [left[before(knot)], left[knot]];
        cross(a, b).atan2(dot(a, b))
    };
    let mut freedom = vec![Freedom::Fixed; knots];
    let mut v = vec![[0.0; 2]; knots];
    let mut paces = vec![0.0; knots];
    for knot in 0..knots {
        if is_end(knot) {
            v[knot] = given[usize::from(knot == count)].unwrap_or_default();
            continue;
        }
        // A corner, at which both spans end naturally.
        if spans[knot].knots[0].is_none() {
            continue;
        }
        let own = turn(knot);
        let pace = |span: usize| length(spans[span].chord) / spans[span].h;
        paces[knot] = pace(before(knot)).min(pace(knot));
        freedom[knot] = beside_lines(&spans[before(knot)], &spans[knot]);
        let weight = |other: usize, span: usize| {
            let beyond = if is_end(other) { own } else { turn(other) };
            let beyond = if beyond * own > 0.0 { beyond } else { own };
            length(spans[span].chord) * beyond.abs().max(LEAST)
        };
        let [back, ahead] = [weight(before(knot), before(knot)), weight((knot + 1) % knots, knot)];
        let [x, y] = left[before(knot)];
        let angle = y.atan2(x) + own * back / (back + ahead);
        let direction = match freedom[knot] {
            Freedom::Along(direction) => direction,
            _ => [angle.cos(), angle.sin()],
        };
        v[knot] = times(paces[knot] * (0.5 * own).cos().max(PACE), direction);
    }
    shorten(spans, &freedom, &mut v);
    let ahead = |knot: usize| {
        let is_asked = match freedom[knot] {
            Freedom::Fixed => false,
            Freedom::Along(_) => true,
            Freedom::Free => spans[knot].asked.ends[0] != 0.0,
        };
        let size = length(v[knot]);
        is_asked.then(|| Ahead { direction: times(1.0 / size, v[knot]), least: PART * size.min(PACE * paces[knot]) })
    };
    Begin { ahead: (0..knots).map(ahead).collect(), v, freedom }
}

/// How the derivative between two spans may change, of which both are straight only where the polygon goes straight on.
fn beside_lines(before: &Span, after: &Span) -> Freedom {
    match [before, after].map(|span| span.asked.straight.then(|| span.direction())) {
        [None, None] => Freedom::Free,
        [Some(direction), None] | [None, Some(direction)] => Freedom::Along(direction),
        [Some(a), Some(b)] => {
            let sum = plus(a, b);
            Freedom::Along(times(1.0 / length(sum), sum))
        }
    }
}

/// Shortens derivatives that reach beyond what those at the other ends of their spans allow.
fn shorten(spans: &[Span], freedom: &[Freedom], v: &mut [Vector]) {
    let mut parts = vec![1.0f64; v.len()];
    for span in spans {
        let [Some(first), Some(last)] = span.knots else { continue };
        let [a, b] = [first, last].map(|knot| times(span.h / 3.0, v[knot]));
        let twist = cross(a, b);
        for (side, knot, reach) in
            [(span.asked.ends[0], last, cross(a, span.chord)), (span.asked.ends[1], first, cross(span.chord, b))]
        {
            // f = a × C − a × b is of its sign for less than this part of b, and l for less than it of a.
            let most = reach / twist;
            if side != 0.0 && most > 0.0 {
                parts[knot] = parts[knot].min(PART * most);
            }
        }
    }
    let free = v.iter_mut().zip(parts).zip(freedom).filter(|(_, freedom)| **freedom != Freedom::Fixed);
    free.for_each(|((v, part), _)| *v = times(part, *v));
}
