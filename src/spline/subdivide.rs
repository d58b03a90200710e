//! One round of bounded-domain cubic subdivision, on slices: the arithmetic of the CPU and of the
//! kernel, in one order of operations.

use crate::linalg::Real;

/// Number of points after one round: 2n − 1 for an open curve, 2n for a closed one.
pub(crate) fn refined_count(count: usize, closed: bool) -> usize {
    if closed { 2 * count } else { (2 * count).saturating_sub(1) }
}

/// Point `i` of the finer curve, coordinate `axis`; `count` points of `dimension` numbers stand in
/// `coarse`.
///
/// A new point (odd `i`) is the mean ½ ½ of its neighbours; an old one (even `i`) becomes ⅛ ¾ ⅛ of
/// itself and its neighbours, except that the ends of an open curve stay where they are.
pub(crate) fn refined<T: Real>(coarse: &[T], count: usize, dimension: usize, closed: bool, i: usize, axis: usize) -> T {
    let at = |k: usize| coarse[k * dimension + axis];
    let here = i / 2;
    let next = if here + 1 == count { 0 } else { here + 1 };
    if i % 2 == 1 {
        return T::from_f64(0.5) * (at(here) + at(next));
    }
    if !closed && (here == 0 || here + 1 == count) {
        return at(here);
    }
    let previous = if here == 0 { count - 1 } else { here - 1 };
    T::from_f64(0.75) * at(here) + T::from_f64(0.125) * (at(previous) + at(next))
}

/// One round for one curve: writes [`refined_count`] points to `fine`.
pub(crate) fn subdivide_once<T: Real>(coarse: &[T], fine: &mut [T], dimension: usize, closed: bool) {
    let count = coarse.len() / dimension;
    for (i, point) in fine.chunks_exact_mut(dimension).enumerate() {
        for (axis, x) in point.iter_mut().enumerate() {
            *x = refined(coarse, count, dimension, closed, i, axis);
        }
    }
}

/// Any number of rounds for one curve, into `fine`, which has the final length. `spare` is scratch
/// of any length.
pub(crate) fn subdivide_rounds<T: Real>(
    coarse: &[T],
    fine: &mut [T],
    spare: &mut Vec<T>,
    dimension: usize,
    closed: bool,
    rounds: u32,
) {
    // The rounds alternate between the two buffers so that the last one writes to `fine`.
    spare.clear();
    spare.resize(fine.len(), T::ZERO);
    let (mut from, mut to) = if rounds.is_multiple_of(2) { (fine, &mut spare[..]) } else { (&mut spare[..], fine) };
    from[..coarse.len()].copy_from_slice(coarse);
    let mut count = coarse.len() / dimension;
    for _ in 0..rounds {
        let finer = refined_count(count, closed);
        subdivide_once(&from[..count * dimension], &mut to[..finer * dimension], dimension, closed);
        std::mem::swap(&mut from, &mut to);
        count = finer;
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::spline::energy::tests::energy_matrix;

    /// The subdivision matrix S, row by row from unit vectors.
    fn subdivision_matrix(count: usize, closed: bool) -> DMatrix<f64> {
        let fine = refined_count(count, closed);
        let mut s = DMatrix::zeros(fine, count);
        for k in 0..count {
            let mut unit = vec![0.0; count];
            unit[k] = 1.0;
            let mut column = vec![0.0; fine];
            subdivide_once(&unit, &mut column, 1, closed);
            s.set_column(k, &column.into());
        }
        s
    }

    #[test]
    fn the_matrix_is_the_one_of_the_book() {
        let s = subdivision_matrix(4, false);
        #[rustfmt::skip]
        let book = DMatrix::from_row_slice(7, 4, &[
            8.0, 0.0, 0.0, 0.0,
            4.0, 4.0, 0.0, 0.0,
            1.0, 6.0, 1.0, 0.0,
            0.0, 4.0, 4.0, 0.0,
            0.0, 1.0, 6.0, 1.0,
            0.0, 0.0, 4.0, 4.0,
            0.0, 0.0, 0.0, 8.0,
        ]) / 8.0;
        assert_eq!(s, book);
    }

    #[test]
    fn differences_and_subdivision_commute_with_upsampling() {
        // 8 E S = U E, equation 6.17 with E_k = 8^k E: every entry is a multiple of 1/8, so exactly.
        for closed in [false, true] {
            for count in 1..=12 {
                let fine = refined_count(count, closed);
                let coarse_energy = energy_matrix(count, closed);
                let mut upsampled = DMatrix::zeros(fine, count);
                (0..count).for_each(|k| upsampled.set_row(2 * k, &coarse_energy.row(k)));
                let left = energy_matrix(fine, closed) * subdivision_matrix(count, closed) * 8.0;
                assert_eq!(left, upsampled, "{count} points, closed {closed}");
            }
        }
    }

    #[test]
    fn rounds_in_one_call_equal_rounds_one_by_one() {
        let coarse: Vec<f64> = (0..14).map(|k| (k as f64 * 1.7).sin()).collect();
        for closed in [false, true] {
            let mut one_by_one = coarse.clone();
            for rounds in 0..5 {
                let mut at_once = vec![0.0; one_by_one.len()];
                subdivide_rounds(&coarse, &mut at_once, &mut vec![9.0], 2, closed, rounds);
                assert_eq!(at_once, one_by_one, "{rounds} rounds, closed {closed}");
                let mut finer = vec![0.0; refined_count(one_by_one.len() / 2, closed) * 2];
                subdivide_once(&one_by_one, &mut finer, 2, closed);
                one_by_one = finer;
            }
        }
    }

    #[test]
    fn single_precision_takes_the_same_steps() {
        let coarse: Vec<f64> = (0..33).map(|k| (k as f64 * 0.7).cos()).collect();
        let narrow: Vec<f32> = coarse.iter().map(|&x| x as f32).collect();
        let (mut fine, mut narrow_fine) = (vec![0.0; 126], vec![0.0_f32; 126]);
        subdivide_rounds(&coarse, &mut fine[..123], &mut Vec::new(), 3, false, 2);
        subdivide_rounds(&narrow, &mut narrow_fine[..123], &mut Vec::new(), 3, false, 2);
        // Two rounds of means of numbers below 1: each rounds twice at most.
        let worst = fine.iter().zip(&narrow_fine).map(|(a, &b)| (a - b as f64).abs()).fold(0.0, f64::max);
        assert!(worst < 5.0 * f64::from(f32::EPSILON), "{worst}");
        assert!(worst > 0.0);
    }
}
