//! [`start`]: feasible derivatives, from which the interior-point method begins.
//!
//! A derivative within the turn of the polygon keeps the required sides if its neighbours are short
//! enough. The turn is divided in proportion to the turns at the other ends of the two spans: a
//! span to an almost straight point has to leave almost straight. At a straight span the derivative
//! is along it.

use glam::DVec2;

use super::mend::{Freedom, LowerBound, StartPoint};
use super::span::{Span, length};

/// Smaller turns at the other end of a span count as this: both spans have equal parts.
const LEAST: f64 = 1e-12;

/// The share of its largest feasible length that a derivative takes.
const PART: f64 = 0.5;

/// The share of the slower pace at a knot that a derivative keeps.
const PACE: f64 = 0.1;

/// The first derivatives of a curve. Those `given` are kept, and other ends are natural.
pub(super) fn start(spans: &[Span], closed: bool, given: [Option<DVec2>; 2]) -> StartPoint {
    let count = spans.len();
    let knots = if closed { count } else { count + 1 };
    // The chords without the parts that the given derivatives cover.
    let left: Vec<DVec2> = (0..count)
        .map(|k| {
            let ends = [given[0].filter(|_| k == 0), given[1].filter(|_| k + 1 == count)];
            ends.into_iter().flatten().fold(spans[k].chord, |left, v| left - spans[k].h / 3.0 * v)
        })
        .collect();
    let is_end = |knot: usize| !closed && (knot == 0 || knot == count);
    let before = |knot: usize| (knot + count - 1) % count;
    let turn = |knot: usize| {
        let [a, b] = [left[before(knot)], left[knot]];
        a.perp_dot(b).atan2(a.dot(b))
    };
    let mut freedom = vec![Freedom::Fixed; knots];
    let mut v = vec![DVec2::ZERO; knots];
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
        let from = left[before(knot)];
        let angle = from.y.atan2(from.x) + own * back / (back + ahead);
        let direction = match freedom[knot] {
            Freedom::Along(direction) => direction,
            _ => DVec2::new(angle.cos(), angle.sin()),
        };
        v[knot] = paces[knot] * (0.5 * own).cos().max(PACE) * direction;
    }
    shorten(spans, &freedom, &mut v);
    let bound = |knot: usize| {
        let is_asked = match freedom[knot] {
            Freedom::Fixed => false,
            Freedom::Along(_) => true,
            Freedom::Free => spans[knot].asked.ends[0] != 0.0,
        };
        let size = length(v[knot]);
        is_asked.then(|| LowerBound { direction: 1.0 / size * v[knot], least: PART * size.min(PACE * paces[knot]) })
    };
    StartPoint { bounds: (0..knots).map(bound).collect(), v, freedom }
}

/// How the derivative between two spans may change. Both are straight only where the polygon goes
/// straight on.
fn beside_lines(before: &Span, after: &Span) -> Freedom {
    match [before, after].map(|span| span.asked.straight.then(|| span.direction())) {
        [None, None] => Freedom::Free,
        [Some(direction), None] | [None, Some(direction)] => Freedom::Along(direction),
        [Some(a), Some(b)] => {
            let sum = a + b;
            Freedom::Along(1.0 / length(sum) * sum)
        }
    }
}

/// Shortens derivatives that are too long for the derivatives at the other ends of their spans.
fn shorten(spans: &[Span], freedom: &[Freedom], v: &mut [DVec2]) {
    let mut parts = vec![1.0f64; v.len()];
    for span in spans {
        let [Some(first), Some(last)] = span.knots else { continue };
        let [a, b] = [first, last].map(|knot| span.h / 3.0 * v[knot]);
        let twist = a.perp_dot(b);
        for (side, knot, reach) in
            [(span.asked.ends[0], last, a.perp_dot(span.chord)), (span.asked.ends[1], first, span.chord.perp_dot(b))]
        {
            // f = a × C − a × b is of its sign for less than this part of b, and l for less than it
            // of a.
            let most = reach / twist;
            if side != 0.0 && most > 0.0 {
                parts[knot] = parts[knot].min(PART * most);
            }
        }
    }
    for (knot, part) in parts.into_iter().enumerate() {
        if freedom[knot] != Freedom::Fixed {
            v[knot] *= part;
        }
    }
}
