//! The kernels against their twins in single precision; host structs; divisions of chunks.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::exact::{ExactFamily, ExactParams};
use super::sparse::{SparseFamily, SparseParams};
use super::*;
use crate::gpu::reflect::assert_layout;
use crate::gpu::testing::{gpu, precisions};
use crate::laplacian::{Reproduces, SparseRule, Subdivide};
use crate::linalg::Real;
use crate::status::CurveStatus;

fn seeded(seed: u64) -> StdRng {
    println!("seed {seed}");
    StdRng::seed_from_u64(seed)
}

/// Grids in frames that they need not be put into: extents from −1 to 1.
fn framed(dimension: usize, shapes: &[[usize; 2]], random: &mut StdRng) -> Grids {
    let mut values: Vec<f64> = Vec::new();
    for [rows, columns] in shapes {
        let start = values.len();
        values.extend((0..rows * columns * dimension).map(|_| f64::from(random.random_range(-1.0_f32..1.0))));
        for c in 0..dimension {
            (values[start + c], values[start + dimension + c]) = (-1.0, 1.0);
        }
    }
    Grids::new(dimension, shapes.to_vec(), values).unwrap()
}

fn usable(grids: &Grids) -> Vec<GridReport> {
    vec![GridReport { status: CurveStatus::Converged, message: None }; grids.len()]
}

fn on_gpu(method: &Subdivide, grids: &Grids, gpu: &Gpu, precision: Precision) -> Vec<f64> {
    let reports = usable(grids);
    let subdivision = Subdivision::new(&method.rule, method.rounds, grids, gpu, precision, &reports);
    let count = (0..grids.len()).map(|i| subdivision.values(grids.shape(i))).sum();
    let mut values = vec![f64::NAN; count];
    subdivision.run(&method.rule, &mut values).unwrap();
    values
}

/// What the CPU makes of grids in the precision of S.
fn twin<S: Real + faircurve_dct::Transformed>(method: &Subdivide, grids: &Grids) -> Vec<f64> {
    let refiner = Refiner::<S>::new(&method.rule, grids.shapes(), method.rounds);
    let mut all = Vec::new();
    for i in 0..grids.len() {
        let own: Vec<S> = grids.grid(i).iter().map(|&x| Real::from_f64(x)).collect();
        let [rows, columns] = refined(grids.shape(i), method.rounds).unwrap();
        let mut fine = vec![<S as Real>::NAN; rows * columns * grids.dimension()];
        refiner.refine(grids.dimension(), grids.shape(i), &own, &mut fine);
        all.extend(fine.into_iter().map(Real::to_f64));
    }
    all
}

/// The largest difference, in ε of the precision. Extents are 2, so that this is a difference in
/// units of their halves.
fn roundings(found: &[f64], wanted: &[f64], precision: Precision) -> f64 {
    assert_eq!(found.len(), wanted.len());
    let epsilon = if precision == Precision::F64 { f64::EPSILON } else { f32::EPSILON.into() };
    found.iter().zip(wanted).fold(0.0, |most: f64, (x, y)| {
        assert!(x.is_finite() && y.is_finite());
        most.max((x - y).abs() / epsilon)
    })
}

#[test]
fn the_sparse_kernel_is_its_twin_but_for_contractions() {
    let Some(gpu) = gpu() else { return };
    let mut random = seeded(1400);
    let shapes = [[2, 2], [3, 8], [5, 5], [8, 3], [12, 12], [13, 30], [5, 5], [40, 12]];
    for support in [3, 5, 7, 9, 11] {
        for (dimension, reproduces) in [(1, Reproduces::Constants), (3, Reproduces::Linear)] {
            let rule = Rule::Sparse(SparseRule::of_support(support, reproduces).unwrap());
            let grids = framed(dimension, &shapes, &mut random);
            let method = Subdivide { rule, rounds: 1 };
            for precision in precisions(&gpu) {
                let found = on_gpu(&method, &grids, &gpu, precision);
                let wanted = match precision {
                    Precision::F64 => twin::<f64>(&method, &grids),
                    _ => twin::<f32>(&method, &grids),
                };
                let apart = roundings(&found, &wanted, precision);
                println!("support {support}, {reproduces:?}, {precision:?}: {apart:.2} ε");
                // Every product that is not rounded by itself may move a sum of up to 2 by half an
                // ε of it: of up to 36, few do.
                assert!(apart <= 4.0, "support {support}, {precision:?}: {apart} ε");
            }
        }
    }
}

#[test]
fn the_exact_kernels_are_as_good_as_their_twin() {
    let Some(gpu) = gpu() else { return };
    let mut random = seeded(1401);
    let shapes = [[2, 2], [3, 8], [5, 5], [8, 3], [12, 12], [13, 30], [5, 5], [40, 12], [2, 65], [100, 2]];
    for dimension in [1, 2] {
        let grids = framed(dimension, &shapes, &mut random);
        for rounds in [1, 2] {
            let method = Subdivide { rule: Rule::Exact, rounds };
            let wanted = twin::<f64>(&method, &grids);
            let single = roundings(&twin::<f32>(&method, &grids), &wanted, Precision::F32);
            for precision in precisions(&gpu) {
                let apart = roundings(&on_gpu(&method, &grids, &gpu, precision), &wanted, precision);
                println!(
                    "{dimension} values a point, {rounds} rounds, {precision:?}: {apart:.2} ε; twin {single:.2} ε"
                );
                // Long sums against fast transforms, both of cosines rounded once.
                assert!(apart <= 3.0 * single.max(4.0), "{precision:?}: {apart} ε, twin {single} ε");
            }
        }
    }
}

#[test]
fn grids_are_grouped_by_shape_and_found_again() {
    let shapes = [[3, 2], [2, 2], [3, 2], [4, 1], [2, 2], [3, 2]];
    let grids = Grids::new(2, shapes.to_vec(), vec![0.0; 2 * 30]).unwrap();
    let layout = Layout::new(&grids, &(1..6), &[true, true, true, false, true, true]);
    assert_eq!(layout.members, [1, 4, 2, 5]);
    assert_eq!(
        layout.families.iter().map(|family| (family.shape, family.count)).collect::<Vec<_>>(),
        [([2, 2], 2), ([3, 2], 2)]
    );
    assert_eq!(layout.offsets(0), (vec![0, 16], 16 + 24));
    // After a round grids of 9 and of 15 points.
    assert_eq!(layout.offsets(1), (vec![0, 36], 36 + 60));
    assert_eq!(layout.places(1), [Some((0, 0)), Some((2, 36)), None, Some((1, 18)), Some((3, 66))]);
    // 130 threads are three workgroups of 64.
    assert_eq!(layout.workgroups(0, |[rows, _]| if rows == 2 { 65 } else { 1 }), (vec![0, 3], 4));
}

#[test]
fn frames_hold_all_values_between_minus_2_and_2() {
    let of = |values: &[f64], dimension: usize| {
        let mut middle = vec![f64::NAN; dimension];
        let size = frame_of(values, &mut middle);
        for (k, x) in values.iter().enumerate() {
            assert!(((x - middle[k % dimension]) / size).abs() < 2.0, "{x} in {middle:?}, {size}");
        }
        (middle, size)
    };
    assert_eq!(of(&[1.0, 4.0, 3.0, 10.0], 2), (vec![2.0, 7.0], 2.0));
    assert_eq!(of(&[5.0; 4], 1), (vec![5.0], 1.0));
    assert_eq!(of(&[-1.7e308, 1.7e308], 1), (vec![0.0], 2_f64.powi(1023)));
    assert_eq!(of(&[1e-310, 0.0], 1), (vec![5e-311], f64::MIN_POSITIVE));
}

#[test]
fn chunks_are_divided_where_products_become_too_many() {
    let of = |parts: &[f64]| divided(10..10 + parts.len(), |i| parts[i - 10] * MOST_PRODUCTS);
    assert_eq!(of(&[0.0, 0.0, 1.0, 0.5]), [10..13, 13..14]);
    assert_eq!(of(&[0.5, 0.5, 0.25, 0.5, 1.0, 0.0]), [10..12, 12..14, 14..16]);
    assert_eq!(of(&[2.0, 2.0]), [10..11, 11..12]);
}

#[test]
fn what_takes_threads_too_long_is_not_for_the_device() {
    let Some(gpu) = gpu() else { return };
    let takes = |rule: Rule, rounds: u32, dimension: usize, shape: [usize; 2]| {
        let grids = Grids::new(dimension, Vec::new(), Vec::new()).unwrap();
        Subdivision::new(&rule, rounds, &grids, &gpu, Precision::F32, &[]).takes(shape)
    };
    let sparse = || Rule::Sparse(SparseRule::of_support(11, Reproduces::Constants).unwrap());
    for rule in [Rule::Exact, sparse()] {
        assert!(takes(rule.clone(), 3, 4, [2, 2]));
        // Means of two, and copies.
        assert!(!takes(rule.clone(), 3, 4, [1, 2]) && !takes(rule.clone(), 3, 4, [2, 1]) && !takes(rule, 0, 4, [2, 2]));
    }
    // Sums of 30,000 terms and as many systems' rows go up to 65,535 turns, with those of blocks.
    assert!(takes(Rule::Exact, 1, 1, [2, 15_000]) && !takes(Rule::Exact, 1, 1, [2, 30_000]));
    assert!(takes(Rule::Exact, 1, 1, [25_000, 2]) && !takes(Rule::Exact, 1, 1, [30_000, 2]));
    // 2.5 n m² products, and an eighth of them in the round before.
    assert!(takes(Rule::Exact, 1, 1, [900, 900]) && !takes(Rule::Exact, 1, 1, [1000, 1000]));
    assert!(takes(sparse(), 1, 1, [2, 30_000]) && takes(sparse(), 1, 1, [1000, 1000]));
    assert!(takes(sparse(), 1, 1000, [2, 2]) && !takes(sparse(), 1, 2000, [2, 2]));
}

#[test]
fn host_structs_are_the_kernels() {
    for precision in [Precision::F32, Precision::F64] {
        for key in laplacian_kernels(precision) {
            if key.path == "laplacian/sparse.wgsl" {
                assert_layout!(key, SparseParams { families, dimension, radius });
                assert_layout!(
                    key,
                    SparseFamily { grids, rows, columns, coarse, fine, stencils, lines, row_border, column_border }
                );
            } else {
                assert_layout!(key, ExactParams { families, dimension });
                assert_layout!(
                    key,
                    ExactFamily { grids, rows, columns, coarse, fine, spectrum, v, table, intervals, step }
                );
            }
        }
    }
}
