//! Longitudes that jump at the antimeridian.
//!
//! ±360 is added, so that neighbours stay near and no curve tears.

/// A jump of more than half a turn between neighbours is a crossing of the antimeridian.
const HALF_TURN: f64 = 180.0;
const TURN: f64 = 360.0;

/// Whether the numbers can be longitudes and latitudes in degrees.
///
/// Projected coordinates jump by 180 m without any antimeridian to cross.
pub(super) fn is_geographic(points: &[f64], stride: usize) -> bool {
    points.chunks_exact(stride).all(|point| point[0].abs() <= TURN && point[1].abs() <= 90.0)
}

/// The same of numbers some of which are missing.
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
    let jump =
        |pair: &[f64]| ((pair[0] - pair[1]).abs() > HALF_TURN) as u8 as f64 * ((pair[0] - pair[1]) / TURN).round();
    let x: Vec<f64> = points.chunks_exact(stride).map(|point| point[0]).collect();
    x.windows(2).any(|pair| jump(pair) != 0.0).then(|| {
        let mut turn = 0.0;
        let later = x.windows(2).map(|pair| {
            turn += jump(pair);
            turn
        });
        let mut turns: Vec<f64> = std::iter::once(0.0).chain(later).collect();
        let last = turns[turns.len() - 1];
        let middle = x[0] + 0.5 * TURN * last;
        if last != 0.0 && x[0] == x[x.len() - 1] && middle.abs() > HALF_TURN {
            let shift = (middle / TURN).round();
            turns.iter_mut().for_each(|turn| *turn -= shift);
        }
        turns
    })
}

/// Whether a ring with these turns winds round a pole.
pub(super) fn winds(turns: &[f64]) -> bool {
    turns.first() != turns.last()
}

/// Adds the turns to the longitudes.
pub(super) fn apply(points: &mut [f64], stride: usize, turns: &[f64]) {
    for (point, turn) in points.chunks_exact_mut(stride).zip(turns) {
        if *turn != 0.0 {
            point[0] += TURN * turn;
        }
    }
}

/// Moves a ring by whole turns so that its middle lies within ±180, where its neighbours are.
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
