//! Longitudes that jump at the antimeridian.
//!
//! ±360 is added, so that neighbours stay near and no curve tears.

/// A jump of more than half a turn between neighbours is a crossing of the antimeridian.
const HALF_TURN: f64 = 180.0;
const TURN: f64 = 360.0;

/// The latitude of a pole.
pub(super) const POLE: f64 = 90.0;

/// Conversions between formats leave errors of this size, in degrees. It is 0.1 mm on the ground.
const ROUNDING: f64 = 1e-9;

/// Whether a longitude is within ±180, up to rounding.
pub(super) fn within_half_turn(x: f64) -> bool {
    x.abs() <= HALF_TURN + ROUNDING || x.is_nan()
}

/// Whether the numbers can be longitudes and latitudes in degrees.
///
/// Projected coordinates jump by 180 m without any antimeridian to cross.
pub(super) fn is_geographic(points: &[f64], stride: usize) -> bool {
    points.chunks_exact(stride).all(|point| point[0].abs() <= TURN && point[1].abs() <= POLE + ROUNDING)
}

/// Sets a number that equals ±`limit` up to rounding to ±`limit`.
fn settled(x: f64, limit: f64) -> f64 {
    if (x.abs() - limit).abs() <= ROUNDING { limit.copysign(x) } else { x }
}

/// Moves points that miss the antimeridian or a pole by rounding onto it.
pub(super) fn settle(points: &mut [f64], stride: usize) {
    for point in points.chunks_exact_mut(stride) {
        point[0] = settled(point[0], HALF_TURN);
        point[1] = settled(point[1], POLE);
    }
}

/// Moves a longitude that misses an odd multiple of 180 by rounding onto it.
pub(super) fn settled_on_turns(x: f64) -> f64 {
    let nearest = TURN * ((x - HALF_TURN) / TURN).round() + HALF_TURN;
    if (x - nearest).abs() <= ROUNDING { nearest } else { x }
}

/// As [`is_geographic`], for points of which some are NaN.
pub(super) fn are_geographic(points: &[f64], stride: usize) -> bool {
    points.chunks_exact(stride).all(|point| point[0].is_nan() || point[1].is_nan() || is_geographic(point, stride))
}

/// The number of whole turns to add to every point `k`.
///
/// `None` if no neighbours are more than 180 apart.
///
/// The first entry is 0, so the first point keeps its value. A ring (last point = first point) that
/// winds round a pole is the exception. It is moved by whole turns so that its middle lies within
/// ±180. The last entry of a ring less the first tells how often it winds.
///
/// Turns are whole numbers. So x + 360·turns carries one rounding, and a ring that comes back to
/// its first point comes back to its bits.
pub(super) fn turns(points: &[f64], stride: usize) -> Option<Vec<f64>> {
    // An edge along a pole is the frame of a map, and may be as long as a whole turn.
    let jump = |a: &[f64], b: &[f64]| {
        let along_pole = a[1] == b[1] && a[1].abs() == POLE;
        if (a[0] - b[0]).abs() > HALF_TURN && !along_pole { ((a[0] - b[0]) / TURN).round() } else { 0.0 }
    };
    let points: Vec<&[f64]> = points.chunks_exact(stride).collect();
    points.windows(2).any(|pair| jump(pair[0], pair[1]) != 0.0).then(|| {
        let x = |k: usize| points[k][0];
        let mut turn = 0.0;
        let later = points.windows(2).map(|pair| {
            turn += jump(pair[0], pair[1]);
            turn
        });
        let mut turns: Vec<f64> = std::iter::once(0.0).chain(later).collect();
        let last = turns[turns.len() - 1];
        let middle = x(0) + 0.5 * TURN * last;
        if last != 0.0 && x(0) == x(points.len() - 1) && middle.abs() > HALF_TURN {
            let shift = (middle / TURN).round();
            turns.iter_mut().for_each(|turn| *turn -= shift);
        }
        turns
    })
}

/// Carries the longitudes of all curves past ±180 where they cross it. Returns the curves that
/// cross, and those of them that wind round a pole.
pub(super) fn unwrap(coords: &mut [f64], stride: usize, offsets: &[usize]) -> (Vec<usize>, Vec<usize>) {
    let (mut unwrapped, mut round_pole) = (Vec::new(), Vec::new());
    for (i, ends) in offsets.windows(2).enumerate() {
        let points = &mut coords[ends[0] * stride..ends[1] * stride];
        if !is_geographic(points, stride) {
            continue;
        }
        let Some(turns) = turns(points, stride) else { continue };
        if points[..stride] == points[points.len() - stride..] && winds(&turns) {
            round_pole.push(i);
        }
        apply(points, stride, &turns);
        unwrapped.push(i);
    }
    (unwrapped, round_pole)
}

/// Whether a ring with these turns winds round a pole.
pub(super) fn winds(turns: &[f64]) -> bool {
    turns.first() != turns.last()
}

/// The mean latitude of some points.
pub(super) fn mean_latitude(points: &[f64], stride: usize) -> f64 {
    let count = (points.len() / stride) as f64;
    points.chunks_exact(stride).map(|point| point[1]).sum::<f64>() / count
}

/// A ring that winds once round a pole, from one side of the antimeridian to the other, and back
/// along the frame of the map: down the antimeridian, along the pole, and up.
///
/// `turns` are those of the ring's points, whose last is its first. It is cut open where it crosses
/// the antimeridian nearest to the pole, so that the frame does not cross it. If no point lies
/// there, one is put in.
///
/// The last point is not the first again.
pub(super) fn framed(points: &[f64], stride: usize, turns: &[f64], pole: f64) -> Vec<f64> {
    let points: Vec<&[f64]> = points.chunks_exact(stride).collect();
    let (n, winding) = (points.len() - 1, turns[points.len() - 1] - turns[0]);
    let x = |k: usize| points[k][0] + TURN * turns[k];
    // The crossing nearest to the pole: its latitude, the edge, its turns, the point.
    let mut best: Option<(f64, usize, f64, Vec<f64>)> = None;
    for k in 0..n {
        let (from, to) = (x(k), x(k + 1));
        let turn = ((from.max(to) - HALF_TURN) / TURN).floor();
        let cut = HALF_TURN + TURN * turn;
        if cut < from.min(to) {
            continue;
        }
        let u = if to == from { 0.0 } else { (cut - from) / (to - from) };
        let between = |axis: usize| points[k][axis] + u * (points[k + 1][axis] - points[k][axis]);
        let at: Vec<f64> = match u {
            0.0 => points[k].to_vec(),
            1.0 => points[k + 1].to_vec(),
            _ => (0..stride).map(between).collect(),
        };
        let nearness = at[1] * pole.signum();
        if best.as_ref().is_none_or(|(most, ..)| nearness > *most) {
            best = Some((nearness, k, turn, at));
        }
    }
    let Some((_, edge, turn, mut end)) = best else { return points[..n].concat() };
    // The ring begins at −180 and goes east, or at 180 and goes west.
    let shift = if winding > 0.0 { turn + 1.0 } else { turn };
    end[0] = -HALF_TURN * winding;
    let mut ring = end.clone();
    let mut push = |point: &[f64], turn: f64| {
        let mut point = point.to_vec();
        if turn != 0.0 {
            point[0] += TURN * turn;
        }
        if ring[ring.len() - stride..] != point[..] {
            ring.extend(point);
        }
    };
    for k in edge + 1..edge + 1 + n {
        let again = if k > n { winding } else { 0.0 };
        let k = if k > n { k - n } else { k };
        push(points[k], turns[k] + again - shift);
    }
    for (side, latitude) in [(1.0, end[1]), (1.0, pole), (-1.0, pole)] {
        (end[0], end[1]) = (HALF_TURN * winding * side, latitude);
        push(&end, 0.0);
    }
    ring
}

/// Adds the turns to the longitudes.
pub(super) fn apply(points: &mut [f64], stride: usize, turns: &[f64]) {
    for (point, turn) in points.chunks_exact_mut(stride).zip(turns) {
        if *turn != 0.0 {
            point[0] += TURN * turn;
        }
    }
}

/// Moves a ring by whole turns so that its middle lies within ±180.
pub(super) fn centre(points: &mut [f64], stride: usize) {
    let x = || points.chunks_exact(stride).map(|point| point[0]);
    let (low, high) = (x().fold(f64::INFINITY, f64::min), x().fold(f64::NEG_INFINITY, f64::max));
    let middle = 0.5 * (low + high);
    if middle.abs() > HALF_TURN {
        apply(points, stride, &vec![-(middle / TURN).round(); points.len() / stride]);
    }
}

/// The shift, in whole turns, that brings a hole nearest to the middle of its shell.
pub(super) fn turns_to_shell(shell: &[f64], hole_x: f64, stride: usize) -> f64 {
    let x = || shell.chunks_exact(stride).map(|point| point[0]);
    let (low, high) = (x().fold(f64::INFINITY, f64::min), x().fold(f64::NEG_INFINITY, f64::max));
    if (low..=high).contains(&hole_x) { 0.0 } else { ((0.5 * (low + high) - hole_x) / TURN).round() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unwrapped(mut points: Vec<f64>) -> Vec<f64> {
        let turns = turns(&points, 2).expect("a jump");
        apply(&mut points, 2, &turns);
        points.chunks_exact(2).map(|point| point[0]).collect()
    }

    #[test]
    fn longitudes_go_on_past_180_in_both_directions_and_come_back() {
        let there_and_back = vec![179.0, 0.0, -179.0, 1.0, -178.0, 2.0, 179.5, 3.0];
        assert_eq!(unwrapped(there_and_back), [179.0, 181.0, 182.0, 179.5]);
        assert_eq!(unwrapped(vec![-179.5, 0.0, 179.5, 1.0, -179.5, 0.0]), [-179.5, -180.5, -179.5]);
    }

    #[test]
    fn a_ring_round_the_pole_ends_a_turn_later() {
        let ring = vec![0.0, 80.0, 90.0, 80.0, 180.0, 80.0, -90.0, 80.0, 0.0, 80.0];
        assert_eq!(unwrapped(ring), [0.0, 90.0, 180.0, 270.0, 360.0]);
        let westward = vec![-180.0, -80.0, 90.0, -80.0, 0.0, -80.0, -90.0, -80.0, -180.0, -80.0];
        assert_eq!(unwrapped(westward), [180.0, 90.0, 0.0, -90.0, -180.0], "not −180 … −540");
    }

    #[test]
    fn half_a_turn_is_no_jump_and_unwrapping_twice_changes_nothing() {
        assert_eq!(turns(&[-90.0, 0.0, 90.0, 0.0], 2), None);
        let once = unwrapped(vec![170.0, 0.0, -170.0, 0.0, -60.0, 0.0]);
        let again: Vec<f64> = once.iter().flat_map(|&x| [x, 0.0]).collect();
        assert_eq!(turns(&again, 2), None);
    }

    #[test]
    fn metres_are_no_degrees() {
        assert!(is_geographic(&[-180.0, 90.0, 200.0, -90.0], 2));
        assert!(!is_geographic(&[2_500_000.0, 45.0], 2));
        assert!(!is_geographic(&[300.0, 120.0], 2));
    }

    #[test]
    fn a_hole_is_brought_to_its_shell() {
        let shell = [179.0, 0.0, 185.0, 0.0, 185.0, 5.0];
        assert_eq!(turns_to_shell(&shell, -177.0, 2), 1.0);
        assert_eq!(turns_to_shell(&shell, 180.0, 2), 0.0);
    }
}
