//! The kernels against the equations they solve, and against their twin.

use std::sync::OnceLock;

use super::super::tests::Case;
use super::*;
use crate::gpu::reflect::assert_layout;
use crate::ragged;

fn opened() -> Option<Gpu> {
    match Gpu::open(0) {
        Ok(gpu) => Some(gpu.with_poisoned_arrays()),
        Err(error) if std::env::var_os("FAIRCURVE_REQUIRE_GPU").is_some() => panic!("{error}"),
        Err(_) => None,
    }
}

/// One for all tests, so that every kernel is compiled once.
fn gpu() -> Option<&'static Gpu> {
    static GPU: OnceLock<Option<Gpu>> = OnceLock::new();
    GPU.get_or_init(opened).as_ref()
}

/// Precisions of an adapter, each with ε.
fn precisions(gpu: &Gpu) -> Vec<(Precision, f64)> {
    let mut precisions = vec![(Precision::F32, f64::from(f32::EPSILON))];
    precisions.extend(gpu.summary().has_f64.then_some((Precision::F64, f64::EPSILON)));
    precisions
}

/// The arrays of a batch.
struct Arrays {
    dimension: usize,
    reach: usize,
    offsets: Vec<usize>,
    closed: Vec<bool>,
    blocks: Vec<f64>,
    movable: Vec<bool>,
    rhs: Vec<f64>,
}

impl Arrays {
    fn of<const D: usize>(cases: &[Case<D>]) -> Self {
        let offsets = ragged::offsets(cases.iter().map(|case| case.rhs.len()));
        Arrays {
            dimension: D,
            reach: cases[0].reach,
            offsets,
            closed: cases.iter().map(|case| case.closed).collect(),
            blocks: cases.iter().flat_map(|case| case.blocks.iter().flatten().flatten().flatten().copied()).collect(),
            movable: cases.iter().flat_map(|case| case.movable.iter().copied()).collect(),
            rhs: cases.iter().flat_map(|case| case.rhs.iter().flatten().copied()).collect(),
        }
    }

    fn solve(&self, gpu: &Gpu, precision: Precision, lanes: u32) -> Result<BlockSolutions<f64>> {
        let systems = BlockBatch {
            dimension: self.dimension,
            reach: self.reach,
            offsets: &self.offsets,
            closed: &self.closed,
            blocks: &self.blocks,
            movable: &self.movable,
        };
        solve_blocks_on_gpu(gpu, precision, lanes, &systems, &self.rhs)
    }

    /// The bits of a curve's solution and pivot.
    fn bits(&self, i: usize, solutions: &BlockSolutions<f64>) -> (Vec<u64>, u64) {
        let x = &solutions.x[self.offsets[i] * self.dimension..self.offsets[i + 1] * self.dimension];
        (x.iter().map(|x| x.to_bits()).collect(), solutions.pivots[i].to_bits())
    }
}

/// Curves of all small sizes and some larger ones, each open and closed, with and without pins.
fn ragged<const D: usize>(reach: usize, decades: f64) -> Vec<Case<D>> {
    let sizes = (3..=20).chain([31, 64, 65, 100, 150]);
    let forms = [(false, false), (false, true), (true, false), (true, true)];
    let each = sizes.flat_map(|n| forms.map(|(closed, pins)| (n, closed, pins)));
    each.enumerate().map(|(i, (n, closed, pins))| Case::random(n, closed, reach, pins, decades, i as u64)).collect()
}

fn check<const D: usize>(gpu: &Gpu, reach: usize, lanes: u32) {
    let cases = ragged::<D>(reach, 4.0);
    let arrays = Arrays::of(&cases);
    for (precision, epsilon) in precisions(gpu) {
        let solutions = arrays.solve(gpu, precision, lanes).unwrap();
        for (i, case) in cases.iter().enumerate() {
            let (n, closed) = (case.rhs.len(), case.closed);
            let what = format!("D {D}, reach {reach}, {lanes} lanes, {precision:?}, {n} vertices, closed {closed}");
            let x =
                nalgebra::DVector::from_column_slice(&solutions.x[arrays.offsets[i] * D..arrays.offsets[i + 1] * D]);
            let (dense, rhs) = (case.dense(), case.right_hand_side());
            // Cholesky's backward error, whatever the condition: rounding the system to f32 is part
            // of it.
            let residual = (&dense * &x - &rhs).amax() / (dense.amax() * x.amax() + rhs.amax());
            assert!(residual < 64.0 * epsilon, "{what}: residual {residual:e}");
            let (twin, smallest) = match precision {
                Precision::F64 => case.solve::<f64>(lanes as usize),
                _ => case.solve::<f32>(lanes as usize),
            };
            // The same operations in the same order, but for contractions: the condition, up to
            // 1e6, times some ε.
            let apart = (&x - &twin).amax() / twin.amax();
            assert!(apart < 1e7 * epsilon, "{what}: {apart:e} from its twin");
            let apart = (solutions.pivots[i] - smallest).abs() / dense.amax();
            assert!(apart < 64.0 * epsilon, "{what}: smallest pivot {}, its twin's {smallest}", solutions.pivots[i]);
        }
    }
}

#[test]
fn planar_curves_coupled_by_bending_are_solved_with_few_and_many_lanes() {
    let Some(gpu) = gpu() else { return };
    for lanes in BLOCK_LANES {
        check::<2>(gpu, 2, lanes);
    }
}

#[test]
fn spatial_curves_coupled_by_variation_are_solved() {
    let Some(gpu) = gpu() else { return };
    check::<3>(gpu, 3, 8);
}

#[test]
fn the_other_couplings_are_solved() {
    let Some(gpu) = gpu() else { return };
    check::<2>(gpu, 1, 8);
    check::<2>(gpu, 3, 8);
    check::<3>(gpu, 2, 8);
}

#[test]
fn curves_that_are_not_positive_definite_say_so_and_change_no_bit_of_their_neighbours() {
    let Some(gpu) = gpu() else { return };
    for lanes in BLOCK_LANES {
        let mut cases = ragged::<2>(2, 1.0);
        let good = Arrays::of(&cases);
        for i in (2..cases.len()).step_by(5) {
            let middle = cases[i].blocks.len() / 2;
            cases[i].movable[middle] = true;
            let least = cases[i].dense().symmetric_eigenvalues().min();
            match i % 3 {
                0 => cases[i].shift(-0.1 - least),
                1 => cases[i].blocks[middle][0][1][1] = f64::NAN,
                _ => cases[i].blocks[middle][0][0][0] = f64::INFINITY,
            }
        }
        let some_bad = Arrays::of(&cases);
        for (precision, _) in precisions(gpu) {
            let (wanted, found) =
                (good.solve(gpu, precision, lanes).unwrap(), some_bad.solve(gpu, precision, lanes).unwrap());
            for i in 0..cases.len() {
                if i >= 2 && (i - 2) % 5 == 0 {
                    assert!(found.pivots[i] <= 0.0, "{lanes} lanes, curve {i}: {}", found.pivots[i]);
                } else {
                    assert!(found.pivots[i] > 0.0, "{lanes} lanes, curve {i}: {}", found.pivots[i]);
                    assert_eq!(good.bits(i, &wanted), some_bad.bits(i, &found), "{lanes} lanes, curve {i}");
                }
            }
        }
    }
}

#[test]
fn chunks_and_curves_without_vertices_change_no_bit() {
    let Some(gpu) = opened() else { return };
    let mut cases = ragged::<2>(2, 1.0);
    cases.insert(3, Case { closed: true, reach: 2, blocks: vec![], movable: vec![], rhs: vec![] });
    let arrays = Arrays::of(&cases);
    let whole = arrays.solve(&gpu, Precision::F32, 8).unwrap();
    assert_eq!(whole.pivots[3], 1e30);
    let limits = plan::Limits { chunk_bytes: 200_000, ..*gpu.limits() };
    let divided = arrays.solve(&gpu.with_limits(limits), Precision::F32, 8).unwrap();
    for i in 0..cases.len() {
        assert_eq!(arrays.bits(i, &whole), arrays.bits(i, &divided), "curve {i}");
    }
}

#[test]
fn what_no_kernel_solves_is_refused_with_the_remedy() {
    let Some(gpu) = gpu() else { return };
    let refused = |case: Case<2>, lanes: u32| {
        let error = Arrays::of(&[case]).solve(gpu, Precision::F32, lanes).unwrap_err();
        error.to_string()
    };
    let lanes = refused(Case::random(9, false, 2, false, 1.0, 1), 7);
    assert!(lanes.ends_with("7 lanes a curve: take one of [8, 64]"), "{lanes}");
    let mut short = Case::random(3, true, 3, false, 1.0, 1);
    short.blocks.truncate(2);
    short.movable.truncate(2);
    short.rhs.truncate(2);
    let short = refused(short, 8);
    assert!(
        short.ends_with("closed curve 0 has 2 vertices, and each is coupled with the next 3: fold the blocks"),
        "{short}"
    );
    let long = refused(Case::random(96_001, false, 2, false, 1.0, 1), 8);
    assert_eq!(
        long,
        "curve 0 with 96001 vertices and 8 lanes needs 96001, but the device allows 96000: take more lanes, or the CPU"
    );
}

#[test]
fn structs_shared_with_the_kernel_have_their_layout() {
    let key = kernel_key(Precision::F32, 2, 2);
    assert_layout!(key, BlockParams { count, lanes });
    assert_layout!(key, BlockCurve { start, vertices, closed, scratch });
}
