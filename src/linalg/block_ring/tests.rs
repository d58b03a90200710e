//! The twin against dense matrices, and against the banded elimination in f32.

use nalgebra::{Cholesky, DMatrix, DVector};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::*;
use crate::discrete::{Energy, Evaluate, MOST_EDGES, SpacingRegularisation, Want, bending, length, variation};
use crate::linalg::Real;
use crate::linalg::banded::Banded;
use crate::{CurveBatch, Device};

const LANES: [usize; 6] = [1, 2, 4, 8, 16, 64];

/// Every small number of vertices, where chunks are of the least length, uneven, and wrapped; then
/// longer ones.
fn counts() -> impl Iterator<Item = usize> {
    (3..=26).chain([31, 33, 64, 65, 100, 129, 200])
}

/// A system in f64 with its right-hand side.
pub(super) struct Case<const D: usize> {
    pub closed: bool,
    pub reach: usize,
    pub blocks: Vec<[Block<f64, D>; MOST_REACH + 1]>,
    pub movable: Vec<bool>,
    pub rhs: Vec<[f64; D]>,
}

impl<const D: usize> Case<D> {
    /// Σ w v vᵀ over random stencils v of reach + 1 vertices, weights over so many decades, and a
    /// small diagonal.
    pub fn random(n: usize, closed: bool, reach: usize, pins: bool, decades: f64, seed: u64) -> Self {
        let mut rng = StdRng::seed_from_u64(seed);
        let mut blocks = vec![[[[0.0; D]; D]; MOST_REACH + 1]; n];
        let stencils = if closed { n } else { n.saturating_sub(reach) };
        for v in (0..stencils).flat_map(|v| [v; D]) {
            let weight = 10_f64.powf(rng.random_range(-decades..=0.0));
            let stencil: Vec<[f64; D]> =
                (0..=reach).map(|_| std::array::from_fn(|_| rng.random_range(-1.0..1.0))).collect();
            for (i, j) in (0..=reach).flat_map(|i| (i..=reach).map(move |j| (i, j))) {
                for (a, b) in (0..D).flat_map(|a| (0..D).map(move |b| (a, b))) {
                    blocks[(v + i) % n][j - i][a][b] += weight * stencil[i][a] * stencil[j][b];
                }
            }
        }
        for block in &mut blocks {
            (0..D).for_each(|a| block[0][a][a] += 10_f64.powf(-decades));
            // Not to be read.
            block[reach + 1..].fill([[f64::NAN; D]; D]);
        }
        if !closed {
            for (v, block) in blocks.iter_mut().enumerate() {
                block[reach.min(n - 1 - v) + 1..].fill([[f64::NAN; D]; D]);
            }
        }
        let movable = (0..n).map(|v| !pins || (v != 0 && v % 5 != 3)).collect();
        let rhs = (0..n).map(|_| std::array::from_fn(|_| rng.random_range(-1.0..1.0))).collect();
        Case { closed, reach, blocks, movable, rhs }
    }

    /// The Hessian of an energy at a wavy ring or arc, shifted so that its smallest eigenvalue is
    /// that fraction of the largest.
    pub fn hessian(energy: &Energy, n: usize, closed: bool, reach: usize, fraction: f64, seed: u64) -> Self {
        let mut rng = StdRng::seed_from_u64(seed);
        let turn = if closed { std::f64::consts::TAU / n as f64 } else { 4.0 / n as f64 };
        let mut points = Vec::new();
        for v in 0..n {
            let angle = v as f64 * turn;
            let r = 1.0 + 0.2 * (3.0 * angle).sin() + 0.1 * turn * rng.random_range(-1.0..1.0);
            let at = [r * angle.cos(), r * angle.sin(), 0.3 * (2.0 * angle).cos()];
            points.extend_from_slice(&at[..D]);
        }
        Self::at(energy, points, closed, reach, fraction, rng)
    }

    /// That at a curve of these points.
    fn at(energy: &Energy, points: Vec<f64>, closed: bool, reach: usize, fraction: f64, mut rng: StdRng) -> Self {
        let n = points.len() / D;
        let batch = CurveBatch::from_ragged(D, points, vec![0, n]).unwrap().closed_each(vec![closed]).unwrap();
        let regularisation = Some(SpacingRegularisation { weights: &[1.0], is_data: &vec![false; n] });
        let options = Evaluate { want: Want::Blocks, regularisation, ..Evaluate::default() };
        let found = energy.evaluate(&batch, options, &Device::cpu()).unwrap().remove(0).hessian;
        let block = |v: usize, k: usize| -> Block<f64, D> {
            let first = (v * (MOST_EDGES + 1) + k) * D * D;
            std::array::from_fn(|a| std::array::from_fn(|b| found[first + a * D + b]))
        };
        let blocks = (0..n).map(|v| std::array::from_fn(|k| block(v, k))).collect();
        let rhs = (0..n).map(|_| std::array::from_fn(|_| rng.random_range(-1.0..1.0))).collect();
        let mut case = Case { closed, reach, blocks, movable: vec![true; n], rhs };
        let eigenvalues = case.dense().symmetric_eigenvalues();
        let (least, most) = (eigenvalues.min(), eigenvalues.max());
        case.shift(fraction * (most - least) - least);
        case
    }

    pub fn shift(&mut self, x: f64) {
        self.blocks.iter_mut().for_each(|block| (0..D).for_each(|a| block[0][a][a] += x));
    }

    pub fn dense(&self) -> DMatrix<f64> {
        let n = self.blocks.len();
        let mut dense = DMatrix::zeros(n * D, n * D);
        for (v, k) in (0..n).flat_map(|v| (0..=self.reach).map(move |k| (v, k))) {
            let other = v + k;
            if !self.closed && other >= n {
                continue;
            }
            let other = other % n;
            for (a, b) in (0..D).flat_map(|a| (0..D).map(move |b| (a, b))) {
                dense[(v * D + a, other * D + b)] += self.blocks[v][k][a][b];
                if k > 0 {
                    dense[(other * D + b, v * D + a)] += self.blocks[v][k][a][b];
                }
            }
        }
        for (i, j) in (0..n * D).flat_map(|i| (0..n * D).map(move |j| (i, j))) {
            if !self.movable[i / D] || !self.movable[j / D] {
                dense[(i, j)] = if i == j { 1.0 } else { 0.0 };
            }
        }
        dense
    }

    pub fn right_hand_side(&self) -> DVector<f64> {
        let held = |i: usize| if self.movable[i / D] { self.rhs[i / D][i % D] } else { 0.0 };
        DVector::from_fn(self.rhs.len() * D, |i, _| held(i))
    }

    pub fn solve<S: Scalar>(&self, lanes: usize) -> (DVector<f64>, f64) {
        let round = |x: f64| S::of(x);
        let blocks: Vec<[Block<S, D>; MOST_REACH + 1]> =
            self.blocks.iter().map(|blocks| blocks.map(|block| block.map(|row| row.map(round)))).collect();
        let rhs: Vec<[S; D]> = self.rhs.iter().map(|x| x.map(round)).collect();
        let system = BlockSystem { closed: self.closed, reach: self.reach, blocks: &blocks, movable: &self.movable };
        let solution = solve_blocks(&system, &rhs, lanes);
        assert_eq!(solution.x.len(), rhs.len());
        let x = |i: usize| solution.x[i / D][i % D].lane(0).to_f64();
        (DVector::from_fn(rhs.len() * D, |i, _| x(i)), solution.smallest.lane(0).to_f64())
    }

    /// By banded elimination, of half-bandwidth B = (reach + 1) D − 1.
    fn solve_banded<S: Scalar, const B: usize>(&self) -> DVector<f64> {
        assert_eq!(B, (self.reach + 1) * D - 1);
        let n = self.blocks.len();
        let mut banded = Banded::<S, B>::new(self.closed, &[n * D]);
        for (v, k) in (0..n).flat_map(|v| (0..=self.reach).map(move |k| (v, k))) {
            if !self.closed && v + k >= n {
                continue;
            }
            for (a, b) in (0..D).flat_map(|a| (0..D).map(move |b| (a, b))) {
                let (row, column) = ((v + k) * D + b, v * D + a);
                let x = S::of(self.blocks[v][k][a][b]);
                match k {
                    0 if a == b => banded.add_diagonal(row, x),
                    0 if a > b => {}
                    _ => banded.add_entry(row, column, x),
                }
            }
        }
        let movable: Vec<S> = (0..n * D).map(|i| if self.movable[i / D] { S::ONE } else { S::ZERO }).collect();
        banded.factor(&movable);
        let mut x: Vec<[S; 1]> = self.right_hand_side().iter().map(|&x| [S::of(x)]).collect();
        banded.solve(&mut x);
        DVector::from_fn(n * D, |i, _| x[i][0].lane(0).to_f64())
    }
}

fn check<const D: usize>(case: &Case<D>, lanes: usize, what: &str) {
    let (dense, rhs) = (case.dense(), case.right_hand_side());
    let (x, smallest) = case.solve::<f64>(lanes);
    assert!(smallest > 0.0, "{what}: smallest pivot {smallest}");
    for (v, _) in case.movable.iter().enumerate().filter(|(_, moves)| !**moves) {
        assert!((0..D).all(|a| x[v * D + a] == 0.0), "{what}: vertex {v} is held, and moves");
    }
    // Cholesky's backward error is some n ε at most, whatever the condition.
    let residual = (&dense * &x - &rhs).amax() / (dense.amax() * x.amax() + rhs.amax());
    assert!(residual < 1e-13, "{what}: residual {residual:e}");
    let wanted = Cholesky::new(dense.clone()).unwrap().solve(&rhs);
    let condition = dense.norm() * dense.try_inverse().unwrap().norm();
    let error = (&x - &wanted).amax() / wanted.amax();
    assert!(error < 1e-14 * condition, "{what}: error {error:e} at condition {condition:e}");
}

fn every_size<const D: usize>(decades: f64) {
    let mut seed = 0;
    for n in counts() {
        for (reach, closed, pins) in (1..=3)
            .flat_map(|reach| [(false, false), (false, true), (true, false), (true, true)].map(|(c, p)| (reach, c, p)))
        {
            seed += 1;
            let case = Case::<D>::random(n, closed, reach, pins, decades, seed);
            // Dense matrices of the longest take their time.
            let lanes = if n > 100 { &LANES[3..4] } else { &LANES[..] };
            for &lanes in lanes {
                let what = format!("D {D}, reach {reach}, {n} vertices, closed {closed}, pins {pins}, {lanes} lanes");
                check(&case, lanes, &what);
            }
        }
    }
}

#[test]
fn solutions_satisfy_their_equations_open_and_closed_at_every_size_with_any_lanes() {
    every_size::<2>(1.0);
    every_size::<3>(1.0);
}

#[test]
fn conditions_of_up_to_ten_million_cost_no_more_than_they_must() {
    every_size::<2>(6.0);
}

#[test]
fn open_curves_of_fewer_vertices_than_are_kept_are_solved() {
    for n in [1, 2] {
        check(&Case::<2>::random(n, false, 3, false, 1.0, 5), 8, &format!("{n} vertices"));
    }
}

#[test]
fn a_matrix_has_a_pivot_that_is_not_positive_if_and_only_if_it_is_not_positive_definite() {
    for n in [3, 4, 5, 9, 24, 40] {
        for (closed, reach) in [(false, 2), (true, 2), (false, 3), (true, 3)] {
            let case = || Case::<2>::random(n, closed, reach, false, 1.0, n as u64);
            let eigenvalues = case().dense().symmetric_eigenvalues();
            for (factor, definite) in [(1.0 - 1e-9, true), (1.0 + 1e-9, false), (10.0, false), (1e6, false)] {
                let mut case = case();
                case.shift(-factor * eigenvalues.min());
                for lanes in LANES {
                    let (x, smallest) = case.solve::<f64>(lanes);
                    let what = format!("{n} vertices, closed {closed}, reach {reach}, {lanes} lanes, shift {factor}");
                    assert_eq!(smallest > 0.0, definite, "{what}: smallest pivot {smallest:e}");
                    assert!(x.iter().all(|x| x.is_finite()), "{what}");
                }
            }
        }
    }
}

#[test]
fn a_pivot_that_is_not_a_number_is_reported_wherever_it_arises() {
    for (closed, lanes) in [(false, 1), (true, 1), (false, 8), (true, 8)] {
        for v in 0..40 {
            for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let mut case = Case::<2>::random(40, closed, 2, false, 1.0, 3);
                case.blocks[v][0][1][1] = x;
                let (_, smallest) = case.solve::<f64>(lanes);
                assert!(smallest <= 0.0, "{x} at vertex {v}: smallest pivot {smallest}");
            }
        }
    }
}

#[test]
fn a_singular_hessian_has_a_pivot_of_rounding_alone() {
    // Nothing holds a closed curve in its place: translations and turns cost nothing.
    let energy = bending(2.0) + length();
    for n in [5, 12, 65] {
        // A regular polygon, whose null vectors are waves.
        let around = (0..n).map(|v| std::f64::consts::TAU * v as f64 / n as f64);
        let points = around.flat_map(|angle| [angle.cos(), angle.sin()]).collect();
        let mut case = Case::<2>::at(&energy, points, true, 2, 1e-3, StdRng::seed_from_u64(1));
        let eigenvalues = case.dense().symmetric_eigenvalues();
        let (least, most) = (eigenvalues.min(), eigenvalues.max());
        case.shift(-least);
        for lanes in LANES {
            let (_, smallest) = case.solve::<f64>(lanes);
            // A backward error of N ε a for N unknowns, over the share of the unknown that comes
            // last in the square of the null vector, 1/N on average.
            let threshold = 4.0 * ((2 * n) as f64).powi(2) * f64::EPSILON * most;
            assert!(smallest <= threshold, "{n} vertices, {lanes} lanes: {smallest:e} above {threshold:e}");
        }
    }
}

/// The logarithm of the error in f32 of the ring over that of banded elimination, at Hessians: sum
/// and number of cases.
fn compare<const D: usize, const B: usize>(energy: &Energy, reach: usize, lanes: usize) -> (f64, f64) {
    let (mut sum, mut count) = (0.0, 0.0);
    for (n, closed) in [8, 17, 33, 65, 90].into_iter().flat_map(|n| [(n, false), (n, true)]) {
        for (seed, fraction) in [1e-4, 1e-5, 1e-6].into_iter().enumerate() {
            let case = Case::<D>::hessian(energy, n, closed, reach, fraction, seed as u64);
            let wanted = Cholesky::new(case.dense()).unwrap().solve(&case.right_hand_side());
            let error = |x: DVector<f64>| (x - &wanted).amax() / wanted.amax();
            let (x, smallest) = case.solve::<f32>(lanes);
            assert!(smallest > 0.0, "{n} vertices: smallest pivot {smallest}");
            sum += (error(x) / error(case.solve_banded::<f32, B>())).ln();
            count += 1.0;
        }
    }
    println!("D {D}, reach {reach}, {lanes} lanes: {:.2} times the error of banded elimination", (sum / count).exp());
    (sum, count)
}

#[test]
fn in_f32_hessians_are_solved_as_well_as_by_banded_elimination() {
    let (bending, variation) = (bending(2.0) + length(), variation());
    for lanes in [1, 8] {
        let parts = [
            compare::<2, 5>(&bending, 2, lanes),
            compare::<3, 8>(&bending, 2, lanes),
            compare::<2, 7>(&variation, 3, lanes),
            compare::<3, 11>(&variation, 3, lanes),
        ];
        // By the mean logarithm over many cases: single errors scatter by a factor of ten both ways.
        let (sum, count) = parts.iter().fold((0.0, 0.0), |all, part| (all.0 + part.0, all.1 + part.1));
        let ratio = f64::exp(sum / count);
        assert!(ratio < 1.5, "{lanes} lanes: {ratio} times the error of banded elimination");
    }
}
