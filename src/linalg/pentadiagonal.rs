//! Symmetric pentadiagonal systems, open and cyclic: LDLᵀ without pivoting, factored in place once,
//! solved for many right-hand sides.
//!
//! A matrix is three slices: the diagonal, and the bands one and two places beside it, entry `i` of
//! which couples the unknowns `i` and `i + 1`, or `i` and `i + 2`. Nothing is allocated and every
//! loop runs over the rows in order, so that one GPU thread can do the same for its curve with the
//! same steps. No pivoting is needed, and the growth of errors is bounded, where the matrix is
//! positive definite.
//!
//! Right-hand sides are interleaved: `width` numbers a row.

use super::real::Real;

/// Factors an open system of `n = diagonal.len()` unknowns: L D Lᵀ with unit lower
/// bidiagonal-by-two L.
///
/// `first` and `second` hold at least n − 1 and n − 2 entries; further ones are not touched.
/// Afterwards `diagonal` holds the inverse pivots and `first`, `second` the two subdiagonals of L.
///
/// # Errors
/// The row whose pivot is not positive: the matrix is not positive definite, or not so in this
/// precision.
pub fn factor_pentadiagonal<T: Real>(diagonal: &mut [T], first: &mut [T], second: &mut [T]) -> Result<(), usize> {
    let n = diagonal.len();
    // Of the rows before: subdiagonals of L, and the same times their pivots.
    let (mut l1, mut l2, mut l2_before) = (T::ZERO, T::ZERO, T::ZERO);
    let (mut u1, mut u2, mut u2_before) = (T::ZERO, T::ZERO, T::ZERO);
    for i in 0..n {
        let pivot = diagonal[i] - l2_before * u2_before - l1 * u1;
        // False for NaN too.
        let positive = pivot > T::ZERO;
        if !positive {
            return Err(i);
        }
        let inverse = T::ONE / pivot;
        diagonal[i] = inverse;
        let u1_here = if i + 1 < n { first[i] - l1 * u2 } else { T::ZERO };
        let u2_here = if i + 2 < n { second[i] } else { T::ZERO };
        (l2_before, u2_before) = (l2, u2);
        (l1, u1) = (u1_here * inverse, u1_here);
        (l2, u2) = (u2_here * inverse, u2_here);
        if i + 1 < n {
            first[i] = l1;
        }
        if i + 2 < n {
            second[i] = l2;
        }
    }
    Ok(())
}

/// Solves with the factors of [`factor_pentadiagonal`], in place: `rhs` holds `width` numbers a row.
pub fn solve_pentadiagonal<T: Real>(diagonal: &[T], first: &[T], second: &[T], rhs: &mut [T], width: usize) {
    // The widths that curves have, with a known trip count for the inner loop.
    match width {
        1 => solve_rows::<T, 1, false>(diagonal, first, second, rhs),
        2 => solve_rows::<T, 2, false>(diagonal, first, second, rhs),
        3 => solve_rows::<T, 3, false>(diagonal, first, second, rhs),
        _ => (0..width).for_each(|column| {
            let mut one: Vec<T> = rhs.iter().skip(column).step_by(width).copied().collect();
            solve_rows::<T, 1, false>(diagonal, first, second, &mut one);
            rhs.iter_mut().skip(column).step_by(width).zip(one).for_each(|(to, x)| *to = x);
        }),
    }
}

/// 0 for numbers that decay below what matters: the border of a long cyclic system does, and
/// subnormal numbers are slow.
fn settled<T: Real>(x: T) -> T {
    if x.abs() < T::SMALLEST_NORMAL { T::ZERO } else { x }
}

/// `SETTLE`: subnormal numbers become 0.
fn solve_rows<T: Real, const W: usize, const SETTLE: bool>(diagonal: &[T], first: &[T], second: &[T], rhs: &mut [T]) {
    let n = diagonal.len();
    let (rows, _) = rhs.as_chunks_mut::<W>();
    let (mut one_before, mut two_before) = ([T::ZERO; W], [T::ZERO; W]);
    for i in 0..n {
        let l1 = if i >= 1 { first[i - 1] } else { T::ZERO };
        let l2 = if i >= 2 { second[i - 2] } else { T::ZERO };
        let mut here = rows[i];
        for c in 0..W {
            here[c] = (here[c] - l2 * two_before[c]) - l1 * one_before[c];
            here[c] = if SETTLE { settled(here[c]) } else { here[c] };
        }
        rows[i] = here;
        (two_before, one_before) = (one_before, here);
    }
    (one_before, two_before) = ([T::ZERO; W], [T::ZERO; W]);
    for i in (0..n).rev() {
        let l1 = if i + 1 < n { first[i] } else { T::ZERO };
        let l2 = if i + 2 < n { second[i] } else { T::ZERO };
        let mut here = rows[i];
        for c in 0..W {
            here[c] = (here[c] * diagonal[i] - l2 * two_before[c]) - l1 * one_before[c];
            here[c] = if SETTLE { settled(here[c]) } else { here[c] };
        }
        rows[i] = here;
        (two_before, one_before) = (one_before, here);
    }
}

/// Factors a cyclic system of n ≥ 2 unknowns, bordered by its last two.
///
/// All three bands have n entries; entry `i` of `first` couples `i` and `(i + 1) mod n`, of
/// `second` `i` and `(i + 2) mod n`. The matrix is their *sum*: where two entries couple the same
/// unknowns (n ≤ 4) they add up, and an entry that couples an unknown with itself (n = 2) counts
/// twice on the diagonal, as the wrapped sum of an infinite periodic band matrix does. `border`
/// holds 2(n − 2) entries of scratch that belong to the factors.
///
/// # Errors
/// The row whose pivot is not positive, as for [`factor_pentadiagonal`].
///
/// # Panics
/// For fewer than two unknowns.
pub fn factor_cyclic_pentadiagonal<T: Real>(
    diagonal: &mut [T],
    first: &mut [T],
    second: &mut [T],
    border: &mut [T],
) -> Result<(), usize> {
    let n = diagonal.len();
    assert!(n >= 2, "a cyclic system of {n} unknowns has no two neighbours");
    let m = n - 2;
    let border = &mut border[..2 * m];
    border.fill(T::ZERO);
    // The corner block of the last two unknowns: (m, m), (m, m + 1), (m + 1, m + 1).
    let mut corner = [diagonal[m], T::ZERO, diagonal[m + 1]];
    // Every band entry that touches one of them.
    for from in m.saturating_sub(2)..n {
        for (step, band) in [(1, &*first), (2, &*second)] {
            let to = (from + step) % n;
            let (low, high) = (from.min(to), from.max(to));
            if high < m {
                continue;
            }
            let x = band[from];
            if low < m {
                border[2 * low + (high - m)] += x;
            } else if low == high {
                corner[2 * (low - m)] += x + x;
            } else {
                corner[1] += x;
            }
        }
    }
    factor_pentadiagonal(&mut diagonal[..m], first, second)?;
    // Z = B⁻¹ F in place of F, and the Schur complement G − FᵀZ from the half-way D^−½ L⁻¹ F, which
    // keeps it symmetric.
    let (mut y1, mut y2) = ([T::ZERO; 2], [T::ZERO; 2]);
    for i in 0..m {
        let l1 = if i >= 1 { first[i - 1] } else { T::ZERO };
        let l2 = if i >= 2 { second[i - 2] } else { T::ZERO };
        let y = [0, 1].map(|c| settled((border[2 * i + c] - l2 * y2[c]) - l1 * y1[c]));
        corner[0] -= y[0] * y[0] * diagonal[i];
        corner[1] -= y[0] * y[1] * diagonal[i];
        corner[2] -= y[1] * y[1] * diagonal[i];
        (y2, y1) = (y1, y);
    }
    solve_rows::<T, 2, true>(&diagonal[..m], first, second, border);
    let inverse = T::ONE / corner[0];
    let factor = corner[1] * inverse;
    let last = corner[2] - factor * corner[1];
    for (row, pivot) in [(m, corner[0]), (m + 1, last)] {
        let positive = pivot > T::ZERO;
        if !positive {
            return Err(row);
        }
    }
    diagonal[m] = inverse;
    first[m] = factor;
    diagonal[m + 1] = T::ONE / last;
    Ok(())
}

/// Solves with the factors of [`factor_cyclic_pentadiagonal`], in place: `rhs` holds `width`
/// numbers a row.
pub fn solve_cyclic_pentadiagonal<T: Real>(
    diagonal: &[T],
    first: &[T],
    second: &[T],
    border: &[T],
    rhs: &mut [T],
    width: usize,
) {
    let m = diagonal.len() - 2;
    let (head, tail) = rhs.split_at_mut(m * width);
    for c in 0..width {
        let (mut x0, mut x1) = (tail[c], tail[width + c]);
        for i in 0..m {
            x0 -= border[2 * i] * head[i * width + c];
            x1 -= border[2 * i + 1] * head[i * width + c];
        }
        let x1 = (x1 - first[m] * x0) * diagonal[m + 1];
        tail[c] = x0 * diagonal[m] - first[m] * x1;
        tail[width + c] = x1;
    }
    solve_pentadiagonal(&diagonal[..m], first, second, head, width);
    for i in 0..m {
        for c in 0..width {
            head[i * width + c] -= border[2 * i] * tail[c] + border[2 * i + 1] * tail[width + c];
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// Diagonally dominant bands, and the matrix they stand for.
    fn system(n: usize, cyclic: bool, random: &mut StdRng) -> ([Vec<f64>; 3], DMatrix<f64>) {
        let mut band = |low: f64, high: f64| -> Vec<f64> { (0..n).map(|_| random.random_range(low..high)).collect() };
        let bands = [band(4.1, 6.0), band(-1.0, 1.0), band(-1.0, 1.0)];
        let mut matrix = DMatrix::zeros(n, n);
        for i in 0..n {
            matrix[(i, i)] += bands[0][i];
            for step in [1, 2] {
                if cyclic || i + step < n {
                    let to = (i + step) % n;
                    matrix[(i, to)] += bands[step][i];
                    matrix[(to, i)] += bands[step][i];
                }
            }
        }
        (bands, matrix)
    }

    #[test]
    fn solutions_satisfy_the_system_for_every_size_and_width() {
        let mut random = StdRng::seed_from_u64(7);
        for n in (1..=40).chain([257]) {
            for cyclic in [false, true] {
                for width in [1, 2, 3, 5] {
                    if cyclic && n == 1 {
                        continue;
                    }
                    let ([mut d, mut f, mut s], matrix) = system(n, cyclic, &mut random);
                    let rhs: Vec<f64> = (0..n * width).map(|_| random.random_range(-1.0..1.0)).collect();
                    let mut x = rhs.clone();
                    if cyclic {
                        let mut border = vec![f64::NAN; 2 * (n - 2)];
                        factor_cyclic_pentadiagonal(&mut d, &mut f, &mut s, &mut border).unwrap();
                        solve_cyclic_pentadiagonal(&d, &f, &s, &border, &mut x, width);
                    } else {
                        factor_pentadiagonal(&mut d, &mut f, &mut s).unwrap();
                        solve_pentadiagonal(&d, &f, &s, &mut x, width);
                    }
                    for c in 0..width {
                        let column = |from: &[f64]| DVector::from_iterator(n, from[c..].iter().step_by(width).copied());
                        let residual = (&matrix * column(&x) - column(&rhs)).amax();
                        assert!(residual < 1e-14, "n {n}, cyclic {cyclic}, width {width}: {residual}");
                    }
                }
            }
        }
    }

    #[test]
    fn single_precision_solves_to_its_own_rounding() {
        let mut random = StdRng::seed_from_u64(8);
        let (bands, matrix) = system(60, true, &mut random);
        let [mut d, mut f, mut s] = bands.map(|band| band.iter().map(|&x| x as f32).collect::<Vec<_>>());
        let mut x: Vec<f32> = (0..60).map(|k| (k as f32).sin()).collect();
        let rhs = DVector::from_iterator(60, x.iter().map(|&x| f64::from(x)));
        let mut border = vec![0.0; 116];
        factor_cyclic_pentadiagonal(&mut d, &mut f, &mut s, &mut border).unwrap();
        solve_cyclic_pentadiagonal(&d, &f, &s, &border, &mut x, 1);
        let residual = (matrix * DVector::from_iterator(60, x.iter().map(|&x| f64::from(x))) - rhs).amax();
        assert!(residual < 8.0 * f64::from(f32::EPSILON), "{residual}");
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_names_its_row() {
        let factor = |mut d: Vec<f64>| factor_pentadiagonal(&mut d, &mut [1.0; 4], &mut [0.5; 4]);
        assert_eq!(factor(vec![4.0; 5]), Ok(()));
        assert_eq!(factor(vec![4.0, 4.0, -4.0, 4.0, 4.0]), Err(2));
        assert_eq!(factor(vec![4.0, 4.0, 4.0, f64::NAN, 4.0]), Err(3));
        let cyclic = |mut d: Vec<f64>| factor_cyclic_pentadiagonal(&mut d, &mut [1.0; 5], &mut [0.5; 5], &mut [0.0; 6]);
        assert_eq!(cyclic(vec![4.0; 5]), Ok(()));
        assert_eq!(cyclic(vec![4.0, 4.0, 4.0, -4.0, 4.0]), Err(3));
        assert_eq!(cyclic(vec![4.0, 4.0, 4.0, 4.0, -4.0]), Err(4));
    }
}
