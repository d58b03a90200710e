//! Tridiagonal batches: right against dense algebra and the textbook, and the same bits whoever the
//! neighbours are.

use faircurve::linalg::{Cyclic, Matrix, Real, Solutions, TridiagonalBatch, solve_tridiagonal_batch, thomas};
use faircurve::{CurveStatus, Device};
use nalgebra::{DMatrix, DVector};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// Lengths around every block and lane boundary, and some long ones.
fn lengths() -> Vec<usize> {
    (1..=130).chain(255..=257).chain([1000, 4097]).collect()
}

#[derive(Clone, Copy, PartialEq)]
enum Form {
    Bands,
    Network,
}

/// Owned systems; `a` is the lower band or empty, `b` the diagonal or the excess, `c` the upper
/// band or the weights.
#[derive(Clone)]
struct Systems<T> {
    form: Form,
    a: Vec<T>,
    b: Vec<T>,
    c: Vec<T>,
    offsets: Vec<usize>,
    cyclic: Vec<bool>,
    rhs: Vec<T>,
    columns: usize,
}

impl<T: Real> Systems<T> {
    fn random(form: Form, lengths: &[usize], columns: usize, seed: u64) -> Self {
        let mut rng = StdRng::seed_from_u64(seed);
        let mut s =
            Systems { form, a: vec![], b: vec![], c: vec![], offsets: vec![0], cyclic: vec![], rhs: vec![], columns };
        for &n in lengths {
            s.cyclic.push(rng.random());
            for _ in 0..n {
                match form {
                    Form::Bands => {
                        let (l, u): (f64, f64) = (rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
                        let sign = if rng.random() { 1.0 } else { -1.0 };
                        s.a.push(T::from_f64(l));
                        s.b.push(T::from_f64(sign * (l.abs() + u.abs() + rng.random_range(0.05..1.0))));
                        s.c.push(T::from_f64(u));
                    }
                    Form::Network => {
                        s.b.push(T::from_f64(10_f64.powf(rng.random_range(-5.0..5.0))));
                        s.c.push(T::from_f64(10_f64.powf(rng.random_range(-5.0..5.0))));
                    }
                }
            }
            s.rhs.extend((0..n * columns).map(|_| T::from_f64(rng.random_range(-1.0..1.0))));
            s.offsets.push(s.offsets[s.offsets.len() - 1] + n);
        }
        s
    }

    fn batch(&self) -> TridiagonalBatch<'_, T> {
        let matrix = match self.form {
            Form::Bands => Matrix::Bands { lower: &self.a, diagonal: &self.b, upper: &self.c },
            Form::Network => Matrix::Network { excess: &self.b, weights: &self.c },
        };
        TridiagonalBatch { matrix, offsets: &self.offsets, cyclic: Cyclic::Each(&self.cyclic) }
    }

    fn solve(&self) -> Solutions<T> {
        solve_tridiagonal_batch(&self.batch(), &self.rhs, self.columns, &Device::cpu()).unwrap()
    }

    fn rows(&self, i: usize) -> std::ops::Range<usize> {
        self.offsets[i]..self.offsets[i + 1]
    }

    /// The three bands of system i in f64, with zeros where an open system has nothing.
    fn bands(&self, i: usize) -> [Vec<f64>; 3] {
        let (rows, cyclic) = (self.rows(i), self.cyclic[i]);
        let n = rows.len();
        let numbers = |source: &[T]| source[rows.clone()].iter().map(|x| x.to_f64()).collect::<Vec<_>>();
        let (mut lower, diagonal, mut upper) = match self.form {
            Form::Bands => (numbers(&self.a), numbers(&self.b), numbers(&self.c)),
            Form::Network => {
                let (excess, mut w) = (numbers(&self.b), numbers(&self.c));
                if !cyclic {
                    w[0] = 0.0;
                }
                let next = |k: usize| if k + 1 == n { w[0] } else { w[k + 1] };
                (
                    w.iter().map(|w| -w).collect(),
                    (0..n).map(|k| excess[k] + w[k] + next(k)).collect(),
                    (0..n).map(|k| -next(k)).collect(),
                )
            }
        };
        if !cyclic {
            (lower[0], upper[n - 1]) = (0.0, 0.0);
        }
        [lower, diagonal, upper]
    }

    fn dense(&self, i: usize) -> DMatrix<f64> {
        let [lower, diagonal, upper] = self.bands(i);
        let n = diagonal.len();
        let mut matrix = DMatrix::zeros(n, n);
        for k in 0..n {
            matrix[(k, (k + n - 1) % n)] += lower[k];
            matrix[(k, k)] += diagonal[k];
            matrix[(k, (k + 1) % n)] += upper[k];
        }
        matrix
    }

    fn column(&self, numbers: &[T], i: usize, c: usize) -> Vec<f64> {
        self.rows(i).map(|row| numbers[row * self.columns + c].to_f64()).collect()
    }

    /// The systems in another order.
    fn permuted(&self, order: &[usize]) -> Self {
        let pick = |source: &[T], width: usize| -> Vec<T> {
            if source.is_empty() {
                return vec![];
            }
            order
                .iter()
                .flat_map(|&i| source[self.offsets[i] * width..self.offsets[i + 1] * width].iter().copied())
                .collect()
        };
        let mut offsets = vec![0];
        order.iter().for_each(|&i| offsets.push(offsets[offsets.len() - 1] + self.rows(i).len()));
        Systems {
            a: pick(&self.a, 1),
            b: pick(&self.b, 1),
            c: pick(&self.c, 1),
            rhs: pick(&self.rhs, self.columns),
            cyclic: order.iter().map(|&i| self.cyclic[i]).collect(),
            offsets,
            ..self.clone()
        }
    }

    fn solution<'a>(&self, solutions: &'a Solutions<T>, i: usize) -> &'a [T] {
        &solutions.x[self.offsets[i] * self.columns..self.offsets[i + 1] * self.columns]
    }
}

fn bits<T: Real>(numbers: &[T]) -> Vec<u64> {
    numbers.iter().map(|x| x.to_f64().to_bits()).collect()
}

/// |A·x − b| ≤ k·ε·(|A|·|x| + |b|) row by row: x solves a system within k roundings of the one asked for.
fn assert_residuals<T: Real>(systems: &Systems<T>, solutions: &Solutions<T>, k: f64) {
    for i in 0..systems.cyclic.len() {
        assert_eq!(solutions.status[i], CurveStatus::Converged);
        let [lower, diagonal, upper] = systems.bands(i);
        let n = diagonal.len();
        for c in 0..systems.columns {
            let (x, b) = (systems.column(&solutions.x, i, c), systems.column(&systems.rhs, i, c));
            let largest = x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for row in 0..n {
                let terms =
                    [lower[row] * x[(row + n - 1) % n], diagonal[row] * x[row], upper[row] * x[(row + 1) % n], -b[row]];
                let (residual, size) = (terms.iter().sum::<f64>(), terms.iter().map(|x| x.abs()).sum::<f64>());
                // The kept row of a cyclic system collects roundings of all others, of the size of
                // the whole solution.
                let largest = diagonal[row].abs() * largest;
                assert!(
                    residual.abs() <= k * T::EPSILON.to_f64() * (size + largest),
                    "n = {n}, cyclic {}, row {row}: residual {residual:e} of {size:e}",
                    systems.cyclic[i]
                );
            }
        }
    }
}

#[test]
fn bands_solve_their_equations_at_every_length() {
    for columns in 1..=5 {
        let systems = Systems::<f64>::random(Form::Bands, &lengths(), columns, 1 + columns as u64);
        assert_residuals(&systems, &systems.solve(), 32.0);
        let systems = Systems::<f32>::random(Form::Bands, &lengths(), columns, 11 + columns as u64);
        assert_residuals(&systems, &systems.solve(), 32.0);
    }
}

#[test]
fn networks_solve_their_equations_at_every_length() {
    for columns in 1..=4 {
        let systems = Systems::<f64>::random(Form::Network, &lengths(), columns, 21 + columns as u64);
        assert_residuals(&systems, &systems.solve(), 32.0);
    }
}

#[test]
fn short_systems_agree_with_dense_elimination_and_with_the_textbook() {
    let lengths: Vec<usize> = (1..=40).chain(1..=40).collect();
    let systems = Systems::<f64>::random(Form::Bands, &lengths, 2, 31);
    let solutions = systems.solve();
    for i in 0..lengths.len() {
        let lu = systems.dense(i).lu();
        let [lower, diagonal, upper] = systems.bands(i);
        for c in 0..2 {
            let (x, b) = (systems.column(&solutions.x, i, c), systems.column(&systems.rhs, i, c));
            let dense = lu.solve(&DVector::from_vec(b.clone())).unwrap();
            let textbook = if systems.cyclic[i] { thomas::thomas_cyclic } else { thomas::thomas };
            let textbook = textbook(&lower, &diagonal, &upper, &b);
            let scale = dense.amax();
            for k in 0..x.len() {
                // Dominance bounds the inverse by 1/0.05.
                assert!((x[k] - dense[k]).abs() <= 1e-13 * scale, "{i} {k}: {} for {}", x[k], dense[k]);
                assert!((textbook[k] - dense[k]).abs() <= 1e-13 * scale, "{i} {k}: {} for {}", textbook[k], dense[k]);
            }
        }
    }
}

#[test]
fn networks_in_f32_keep_every_component_over_ten_decades() {
    let lengths: Vec<usize> = (1..=60).chain(1..=60).chain([128, 128, 200, 200]).collect();
    for seed in 41..45 {
        let mut systems = Systems::<f32>::random(Form::Network, &lengths, 2, seed);
        // The worst conditioned kind: excess in few rows only.
        let mut rng = StdRng::seed_from_u64(seed);
        for (i, &n) in lengths.iter().enumerate() {
            let (rows, pinned) = (systems.rows(i), rng.random_range(0..n));
            rows.clone().enumerate().for_each(|(k, row)| systems.b[row] *= if k == pinned { 1.0 } else { 0.0 });
        }
        let solutions = systems.solve();
        for (i, &n) in lengths.iter().enumerate() {
            // The inverse column by column in f64, by star-mesh elimination: dense elimination
            // would lose it.
            let mut unit = Systems::<f64> {
                form: Form::Network,
                a: vec![],
                b: systems.b[systems.rows(i)].iter().map(|x| x.to_f64()).collect(),
                c: systems.c[systems.rows(i)].iter().map(|x| x.to_f64()).collect(),
                offsets: vec![0, n],
                cyclic: vec![systems.cyclic[i]],
                rhs: vec![0.0; n * n],
                columns: n,
            };
            (0..n).for_each(|k| unit.rhs[k * n + k] = 1.0);
            let inverse = unit.solve().x;
            for c in 0..2 {
                let (x, d) = (systems.column(&solutions.x, i, c), systems.column(&systems.rhs, i, c));
                for row in 0..n {
                    let exact: f64 = (0..n).map(|k| inverse[row * n + k] * d[k]).sum();
                    let size: f64 = (0..n).map(|k| inverse[row * n + k] * d[k].abs()).sum();
                    assert!((x[row] - exact).abs() <= 1e-6 * size, "n = {n}, row {row}: {} for {exact}", x[row]);
                }
            }
        }
    }
}

#[test]
fn a_network_never_makes_a_negative_out_of_non_negative_right_hand_sides() {
    let mut systems = Systems::<f32>::random(Form::Network, &lengths(), 1, 51);
    systems.rhs.iter_mut().for_each(|d| *d = d.abs());
    let solutions = systems.solve();
    assert!(solutions.x.iter().all(|&x| x >= 0.0));
    assert!(solutions.x.iter().any(|&x| x > 0.0));
}

#[test]
fn a_systems_bits_depend_on_no_neighbour_and_on_no_order() {
    fn check<T: Real>(form: Form, seed: u64) {
        let mut rng = StdRng::seed_from_u64(seed);
        let lengths: Vec<usize> = (0..3000).map(|_| rng.random_range(1..60)).chain([20_000]).collect();
        let systems = Systems::<T>::random(form, &lengths, 2, seed);
        let solutions = systems.solve();
        let mut order: Vec<usize> = (0..lengths.len()).collect();
        for k in (1..order.len()).rev() {
            order.swap(k, rng.random_range(0..=k));
        }
        let permuted = systems.permuted(&order);
        let of_permuted = permuted.solve();
        for (to, &from) in order.iter().enumerate() {
            assert_eq!(bits(systems.solution(&solutions, from)), bits(permuted.solution(&of_permuted, to)));
        }
        // Alone: no lanes at all.
        for i in (0..lengths.len()).step_by(97).chain([3000]) {
            let alone = systems.permuted(&[i]);
            assert_eq!(bits(systems.solution(&solutions, i)), bits(&alone.solve().x), "length {}", lengths[i]);
        }
        // NaN and infinity spoil their own system only.
        let mut spoilt = systems.clone();
        let victims: Vec<usize> = (0..lengths.len()).step_by(7).collect();
        for (k, &i) in victims.iter().enumerate() {
            let row = systems.offsets[i] + lengths[i] / 2;
            let value = T::from_f64([f64::NAN, f64::INFINITY][k / 3 % 2]);
            match k % 3 {
                0 => spoilt.b[row] = value,
                1 => spoilt.rhs[row * 2 + 1] = value,
                // An entry that is not ignored: a cyclic system uses all.
                _ if systems.cyclic[i] && lengths[i] > 1 => spoilt.c[row] = value,
                _ => spoilt.b[row] = value,
            }
        }
        let of_spoilt = spoilt.solve();
        for i in 0..lengths.len() {
            if victims.contains(&i) {
                assert_eq!(of_spoilt.status[i], CurveStatus::Invalid, "system {i}");
                assert!(spoilt.solution(&of_spoilt, i).iter().all(|x| x.to_f64().is_nan()));
            } else {
                assert_eq!(of_spoilt.status[i], CurveStatus::Converged);
                assert_eq!(bits(systems.solution(&solutions, i)), bits(spoilt.solution(&of_spoilt, i)));
            }
        }
    }
    check::<f64>(Form::Bands, 61);
    check::<f32>(Form::Bands, 62);
    check::<f64>(Form::Network, 63);
    check::<f32>(Form::Network, 64);
}

#[test]
fn what_an_open_system_ignores_may_be_anything() {
    let mut systems = Systems::<f64>::random(Form::Bands, &lengths(), 1, 71);
    let mut network = Systems::<f64>::random(Form::Network, &lengths(), 1, 72);
    systems.cyclic.fill(false);
    network.cyclic.fill(false);
    let (plain, of_network) = (systems.solve(), network.solve());
    for i in 0..systems.cyclic.len() {
        systems.a[systems.offsets[i]] = f64::NAN;
        systems.c[systems.offsets[i + 1] - 1] = f64::INFINITY;
        network.c[network.offsets[i]] = f64::NAN;
    }
    assert_eq!(bits(&plain.x), bits(&systems.solve().x));
    assert_eq!(bits(&of_network.x), bits(&network.solve().x));
}

#[test]
fn a_free_network_gives_the_solution_of_mean_zero_or_none() {
    let solve = |excess: &[f64], weights: &[f64], rhs: &[f64], cyclic: bool| {
        let systems = TridiagonalBatch {
            matrix: Matrix::Network { excess, weights },
            offsets: &[0, excess.len()],
            cyclic: if cyclic { Cyclic::All } else { Cyclic::None },
        };
        let solutions = solve_tridiagonal_batch(&systems, rhs, 1, &Device::cpu()).unwrap();
        (solutions.x, solutions.status[0])
    };
    let free = CurveStatus::NotUnique;
    assert_eq!(solve(&[0.0; 4], &[1.0; 4], &[1.0, 0.0, -1.0, 0.0], true), (vec![0.5, 0.0, -0.5, 0.0], free));
    assert_eq!(solve(&[0.0; 3], &[9.0, 1.0, 2.0], &[3.0, 0.0, -3.0], false), (vec![2.5, -0.5, -2.0], free));
    assert_eq!(solve(&[0.0], &[1.0], &[0.0], true), (vec![0.0], free));
    // Two components: the first is fixed by its excess, the second is free.
    assert_eq!(
        solve(&[1.0, 0.0, 0.0, 0.0], &[0.0, 1.0, 0.0, 1.0], &[0.0, 1.0, 1.0, -1.0], true).0,
        [1.0, 2.0, 0.5, -0.5]
    );
    let (x, status) = solve(&[0.0; 4], &[1.0; 4], &[1.0, 0.0, 0.0, 0.0], true);
    assert!(x.iter().all(|x| x.is_nan()) && status == CurveStatus::Invalid);
    // Bands: a pivot of 0.
    let systems = TridiagonalBatch {
        matrix: Matrix::Bands { lower: &[0.0, 1.0], diagonal: &[0.0, 1.0], upper: &[1.0, 0.0] },
        offsets: &[0, 2],
        cyclic: Cyclic::None,
    };
    let solutions = solve_tridiagonal_batch(&systems, &[1.0, 1.0], 1, &Device::cpu()).unwrap();
    assert_eq!(solutions.status, [CurveStatus::Invalid]);
    assert!(solutions.x.iter().all(|x: &f64| x.is_nan()));
}

#[test]
fn empty_systems_and_a_million_rows_beside_two() {
    let lengths = [0, 2, 1_000_000, 0, 3, 0];
    let systems = Systems::<f64>::random(Form::Bands, &lengths, 1, 81);
    let solutions = systems.solve();
    assert_eq!(solutions.x.len(), 1_000_005);
    let filled = systems.permuted(&[1, 2, 4]);
    assert_residuals(&filled, &filled.solve(), 32.0);
    assert_eq!(bits(&solutions.x), bits(&filled.solve().x));
}

#[test]
fn arrays_that_do_not_fit_are_refused_with_their_lengths() {
    let matrix = Matrix::Network { excess: &[1.0; 3], weights: &[1.0; 3] };
    let solve = |matrix, offsets: &[usize], rhs: &[f64], columns| {
        let systems = TridiagonalBatch { matrix, offsets, cyclic: Cyclic::Each(&[true]) };
        solve_tridiagonal_batch(&systems, rhs, columns, &Device::cpu()).unwrap_err().to_string()
    };
    let says = |message: String, what: &str| assert!(message.contains(what), "{message}");
    says(solve(matrix, &[0, 3], &[1.0; 4], 1), "4 entries of the right-hand sides where the offsets ask for 3");
    says(solve(matrix, &[0, 4], &[1.0; 4], 1), "3 excesses where the offsets ask for 4");
    says(solve(matrix, &[0, 1, 3], &[1.0; 3], 1), "1 cyclic flags where the offsets ask for 2");
    says(solve(matrix, &[0, 3, 2], &[1.0; 3], 1), "offsets decrease at system 1: 3 is followed by 2");
    says(solve(matrix, &[], &[], 1), "offsets must start with 0");
    says(solve(matrix, &[0, 3], &[], 0), "at least one right-hand side");
    let bands = Matrix::Bands { lower: &[1.0; 3], diagonal: &[1.0; 3], upper: &[1.0; 2] };
    says(solve(bands, &[0, 3], &[1.0; 3], 1), "2 entries of the upper band where the offsets ask for 3");
}
