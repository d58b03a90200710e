//! How far surfaces of sparse rules are from the exact ones.

use std::fmt::Write;

use faircurve::laplacian::{Grids, Reproduces, Rule, SparseRule, Subdivide};
use faircurve::{Device, Result};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use super::SUPPORTS;

/// Grids measured.
pub const GRIDS: usize = 10;

/// Points along their sides: as many as the widest support needs for border rules of its own, and
/// one more.
pub const SIDE: usize = 13;

/// Rounds measured.
pub const ROUNDS: u32 = 5;

const SEED: u64 = 1997;

/// One rule after some rounds, on all grids.
pub struct Row {
    reproduces: Reproduces,
    support: usize,
    rounds: u32,
    /// √ of the mean of squares over all points of all grids.
    pub root_mean_square: f64,
    /// The same of each grid.
    of_each: Vec<f64>,
    /// Anywhere.
    largest: f64,
    /// At least a quarter of the distance of control points away from all of them.
    pub largest_away: f64,
}

pub struct Distances(Vec<Row>);

/// A wider window that is no nearer.
pub struct Exception {
    reproduces: Reproduces,
    rounds: u32,
    supports: [usize; 2],
    grids: usize,
}

impl std::fmt::Display for Exception {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Exception { reproduces, rounds, supports: [wide, wider], grids } = self;
        let plural = if *rounds == 1 { "" } else { "s" };
        write!(
            f,
            "{reproduces}, {rounds} round{plural}: support {wider} is no nearer than {wide} on {grids} of {GRIDS} grids"
        )
    }
}

/// Heights of grid `number`, in ±1.
pub fn random_heights(number: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(SEED + number);
    (0..SIDE * SIDE).map(|_| random.random_range(-1.0..1.0)).collect()
}

impl Distances {
    pub fn measure() -> Result<Self> {
        let heights = (0..GRIDS as u64).flat_map(random_heights).collect();
        let grids = Grids::uniform(1, [SIDE; 2], heights)?;
        let fit = |rule: Rule, rounds: u32| -> Result<Grids> {
            Ok(Subdivide { rule, rounds }.fit(&grids, &Device::cpu())?.grids().clone())
        };
        let mut rows = Vec::new();
        for rounds in 1..=ROUNDS {
            let exact = fit(Rule::Exact, rounds)?;
            for reproduces in [Reproduces::Constants, Reproduces::Linear] {
                for support in SUPPORTS {
                    let sparse = fit(Rule::Sparse(SparseRule::of_support(support, reproduces)?), rounds)?;
                    rows.push(Row::of(&exact, &sparse, reproduces, support, rounds));
                }
            }
        }
        Ok(Distances(rows))
    }

    /// The row of a rule and a number of rounds that were measured.
    pub fn of(&self, reproduces: Reproduces, support: usize, rounds: u32) -> &Row {
        let is = |row: &&Row| (row.reproduces, row.support, row.rounds) == (reproduces, support, rounds);
        self.0.iter().find(is).expect("all were measured")
    }

    /// Where the wider window of a rule is not nearer, on any of the grids.
    pub fn exceptions(&self) -> Vec<Exception> {
        let mut exceptions = Vec::new();
        for reproduces in [Reproduces::Constants, Reproduces::Linear] {
            for rounds in 1..=ROUNDS {
                for pair in SUPPORTS.windows(2) {
                    let [wide, wider] = [pair[0], pair[1]].map(|support| self.of(reproduces, support, rounds));
                    let pairs = wide.of_each.iter().zip(&wider.of_each);
                    let grids = pairs.filter(|(wide, wider)| wider >= wide).count();
                    if grids > 0 {
                        exceptions.push(Exception { reproduces, rounds, supports: [pair[0], pair[1]], grids });
                    }
                }
            }
        }
        exceptions
    }

    pub fn csv(&self) -> String {
        let mut csv = String::from(
            "reproduces,support,rounds,root_mean_square,least_of_grids,most_of_grids,largest,largest_away\n",
        );
        for row in &self.0 {
            let least = row.of_each.iter().copied().fold(f64::INFINITY, f64::min);
            let most = row.of_each.iter().copied().fold(0.0, f64::max);
            let Row { reproduces, support, rounds, root_mean_square, largest, largest_away, .. } = row;
            let _ = writeln!(
                csv,
                "{reproduces},{support},{rounds},{root_mean_square},{least},{most},{largest},{largest_away}"
            );
        }
        csv
    }
}

impl Row {
    fn of(exact: &Grids, sparse: &Grids, reproduces: Reproduces, support: usize, rounds: u32) -> Self {
        let (step, columns) = (1usize << rounds, exact.shape(0)[1]);
        // From the nearest data point along an axis, in fine steps.
        let off = |k: usize| (k % step).min(step - k % step);
        let (mut largest, mut largest_away) = (0.0f64, 0.0f64);
        let of_each = (0..exact.len()).map(|i| {
            let pairs = exact.grid(i).iter().zip(sparse.grid(i));
            let mut sum = 0.0;
            for (k, (a, b)) in pairs.enumerate() {
                let difference = (a - b).abs();
                sum += difference * difference;
                largest = largest.max(difference);
                let (row, column) = (off(k / columns), off(k % columns));
                if 16 * (row * row + column * column) >= step * step {
                    largest_away = largest_away.max(difference);
                }
            }
            (sum / exact.grid(i).len() as f64).sqrt()
        });
        let of_each: Vec<f64> = of_each.collect();
        let root_mean_square = (of_each.iter().map(|x| x * x).sum::<f64>() / of_each.len() as f64).sqrt();
        Row { reproduces, support, rounds, root_mean_square, of_each, largest, largest_away }
    }
}
