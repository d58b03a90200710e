//! Gaussian Adaptation, the black-box search that Alon & Bergmann use where there are many dots.

use std::f64::consts::{E, PI};

use faircurve::{Error, Result};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rand::SeedableRng;
use rand::rngs::ChaCha12Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{Evolution, Outcome, Record, Request, SegmentCosts, check, evaluate};

/// Options of Gaussian Adaptation, which samples all slopes together.
///
/// The samples come from a Gaussian that is widened, turned and moved. A fraction P of them stays
/// below a threshold that falls.
///
/// There are n free slopes, a mean m, a scale r and a matrix Q of determinant 1. A candidate is x =
/// m + r Q η with η standard normal. If its cost f(x) is below the threshold c_T it is accepted:
///
/// - r ← f_e r, f_e = 1 + β (1 − P);
/// - m ← (1 − 1/N_m) m + x/N_m;
/// - QQᵀ ← (1 − 1/N_C) QQᵀ + (x − m)(x − m)ᵀ/(N_C r²), then scaled to determinant 1 again;
/// - c_T ← (1 − 1/N_T) c_T + f(x)/N_T.
///
/// Otherwise r ← f_c r, f_c = 1 − β P, and nothing else changes. If a fraction P is accepted r
/// stays the same. P = 1/e maximises −P ln P, the rate of entropy gained at a success. The other
/// constants are N_m = N_T = e n, N_C = (n + 1)²/ln(n + 1) and β = 1/N_C. The covariance is always
/// r²QQᵀ. r alone carries its size, so samples enter QQᵀ in units of r.
///
/// c_T starts at [`threshold`](Self::threshold). While c_T is infinite it becomes the first finite
/// cost found. A slope is a real number to the Gaussian, although costs repeat after a turn.
/// Therefore r is kept below π, where samples cover the circle evenly.
///
/// Source: C. L. Müller and I. F. Sbalzarini, *Gaussian Adaptation revisited: an entropic view on
/// covariance matrix adaptation*, EvoStar 2010, LNCS 6024, after G. Kjellström and L. Taxén. Two
/// things differ here:
///
/// - QQᵀ is kept as its Cholesky factor, updated by rank one in O(n²). The samples have the same
///   distribution with any root of QQᵀ.
/// - Candidates are drawn and evaluated [`batch`](Self::batch) at a time, all from one Gaussian.
///   They are then absorbed one after the other. A batch of 1 is the method of the paper. For large
///   batches N_m and N_T are at least P times the batch, and N_C at least the batch. Otherwise r
///   would shrink through a whole batch that was drawn before, and never recover.
///
/// The search can leave local minima in which the greedy search and Newton's method stay. It
/// approaches any minimum slowly, so finish with one of those.
///
/// ```
/// use faircurve_papers::searches::{GaussianAdaptation, Request, SegmentCosts};
///
/// /// Segments that want to leave at 0.5 and to arrive as they leave.
/// struct Wanted;
/// impl SegmentCosts for Wanted {
///     fn dots(&self) -> usize { 4 }
///     fn is_closed(&self) -> bool { false }
///     fn costs(&mut self, requests: &[Request], costs: &mut [f64]) -> faircurve::Result<()> {
///         for (cost, Request { slopes: [a, b], .. }) in costs.iter_mut().zip(requests) {
///             *cost = (a - 0.5).powi(2) + (b - a).powi(2);
///         }
///         Ok(())
///     }
/// }
/// let outcome = GaussianAdaptation::default().search(&mut Wanted, &[0.0; 4], &[false; 4])?;
/// assert!(outcome.settled && outcome.slopes.iter().all(|slope| (slope - 0.5).abs() < 1e-3));
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct GaussianAdaptation {
    /// The seed of the generator (ChaCha with 12 rounds, the same on every machine).
    ///
    /// The same seed, options and costs give the same result, bit for bit.
    pub seed: u64,
    /// The candidates drawn and evaluated together, in one request of `batch` × segments.
    ///
    /// `None` means as many as there are free slopes. The mean then moves by at most about a
    /// seventh of the way (n P/N_m = 1/e²) before the next batch is drawn. The search takes no more
    /// candidates than with one at a time. Larger batches fill a device better. Beyond e² n, seven
    /// times as many, the search takes more candidates in proportion.
    pub batch: Option<usize>,
    /// The standard deviation r of the slopes at the start, in radians.
    ///
    /// The default is 0.3.
    ///
    /// It is wide enough even where the neighbours' directions, from which the paper starts, are
    /// far off.
    pub radius: f64,
    /// The search has settled when r is below this, in radians.
    ///
    /// 1e-5 by default.
    ///
    /// Costs then differ from their minimum by about 1e-10 of themselves. With r below 1e-7 they
    /// differ by their rounding alone.
    pub smallest_radius: f64,
    /// The threshold c_T at the start.
    ///
    /// `None` means the cost of the slopes at the start.
    ///
    /// Higher values, including ∞, search more widely before they descend.
    pub threshold: Option<f64>,
    /// The most candidates.
    ///
    /// 1,000,000 by default.
    ///
    /// About 230 n^1.5 settle where the cost is convex: 1,300 for 3 slopes, 7,000 for 10, 220,000
    /// for 95.
    pub max_candidates: usize,
}

impl Default for GaussianAdaptation {
    fn default() -> Self {
        GaussianAdaptation {
            seed: 0,
            batch: None,
            radius: 0.3,
            smallest_radius: 1e-5,
            threshold: None,
            max_candidates: 1_000_000,
        }
    }
}

/// The most slopes that may be free.
///
/// Q is an n × n matrix, then of 128 MiB. N_C, in which it adapts, grows as n².
const MOST_FREE: usize = 4096;

impl GaussianAdaptation {
    /// Searches from the slopes `start` (radians, one a dot), which are the first mean.
    ///
    /// Where `fixed`, a slope stays as it is, bit for bit. The outcome holds the best candidate
    /// ever drawn, or the start.
    ///
    /// # Errors
    ///
    /// - [`Error::Argument`] where the numbers of slopes and flags differ from that of dots, a
    ///   slope is not finite, the batch is empty, a radius is not positive, the threshold is NaN,
    ///   or more than 4096 slopes are free.
    /// - Those of [`SegmentCosts::costs`].
    pub fn search(&self, costs: &mut dyn SegmentCosts, start: &[f64], fixed: &[bool]) -> Result<Outcome> {
        check(costs.dots(), start, fixed)?;
        let free: Vec<usize> = (0..start.len()).filter(|&dot| !fixed[dot]).collect();
        self.check(free.len())?;
        let segments = costs.segments();
        let mut best = (super::total_cost(costs, start)?, start.to_vec());
        let mut evolution = Evolution::new();
        let at = |iterations, cost| Record { iterations, segment_solves: segments * (1 + iterations), cost };
        evolution.record(at(0, best.0), &best.1);
        let mean = DVector::from_iterator(free.len(), free.iter().map(|&dot| start[dot]));
        let batch = self.batch.unwrap_or(free.len());
        let mut gaussian = Gaussian::new(mean, self.radius, self.threshold.unwrap_or(best.0), batch);
        let mut random = ChaCha12Rng::seed_from_u64(self.seed);
        let (mut drawn, mut requests, mut found) = (0, Vec::new(), Vec::new());
        // There is nothing to search without a segment to cost, or without a slope to move.
        let mut settled = segments == 0 || free.is_empty();
        while !settled && drawn < self.max_candidates {
            let count = batch.min(self.max_candidates - drawn);
            let steps: Vec<DVector<f64>> = (0..count).map(|_| gaussian.draw(&mut random)).collect();
            let candidates: Vec<DVector<f64>> =
                steps.iter().map(|step| &gaussian.mean + step * gaussian.radius).collect();
            let mut slopes = start.to_vec();
            requests.clear();
            for candidate in &candidates {
                free.iter().zip(candidate).for_each(|(&dot, &slope)| slopes[dot] = slope);
                requests.extend((0..segments).map(|segment| Request {
                    segment,
                    slopes: [slopes[segment], slopes[(segment + 1) % slopes.len()]],
                }));
            }
            found.resize(requests.len(), 0.0);
            evaluate(costs, &requests, &mut found)?;
            for ((candidate, step), costs) in candidates.iter().zip(&steps).zip(found.chunks_exact(segments)) {
                let cost: f64 = costs.iter().sum();
                if cost < best.0 {
                    best.0 = cost;
                    free.iter().zip(candidate).for_each(|(&dot, &slope)| best.1[dot] = slope);
                }
                gaussian.absorb(candidate, step, cost);
            }
            drawn += count;
            evolution.record(at(drawn, best.0), &best.1);
            settled = gaussian.radius < self.smallest_radius;
        }
        let last = at(drawn, best.0);
        Ok(evolution.finish(best.1, last, settled, last.segment_solves))
    }

    fn check(&self, free: usize) -> Result<()> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        let text = if self.batch == Some(0) {
            "Gaussian Adaptation was given a batch of 0 candidates: give at least 1".to_string()
        } else if !(positive(self.radius) && positive(self.smallest_radius)) {
            let radii = [self.radius, self.smallest_radius];
            format!("Gaussian Adaptation's radii are {} and {}: give positive angles in radians", radii[0], radii[1])
        } else if self.threshold.is_some_and(f64::is_nan) {
            "Gaussian Adaptation's threshold is NaN: give a cost, ∞, or none".to_string()
        } else if free > MOST_FREE {
            format!(
                "Gaussian Adaptation over {free} slopes exceeds its {MOST_FREE}: use Newton's method or the greedy search"
            )
        } else {
            return Ok(());
        };
        Err(Error::argument(text))
    }
}

/// The target probability of success.
const P: f64 = 1.0 / E;

/// The state that adapts.
struct Gaussian {
    mean: DVector<f64>,
    radius: f64,
    /// The factor of QQᵀ, which is the Q of the samples.
    factor: Cholesky<f64, Dyn>,
    threshold: f64,
    /// N_m = N_T, and N_C.
    memory: f64,
    matrix_memory: f64,
}

impl Gaussian {
    fn new(mean: DVector<f64>, radius: f64, threshold: f64, batch: usize) -> Self {
        let (n, batch) = (mean.len(), batch as f64);
        let more = n as f64 + 1.0;
        Gaussian {
            mean,
            radius: radius.min(PI),
            factor: Cholesky::pack_dirty(DMatrix::identity(n, n)),
            threshold,
            memory: (P * batch).max(E * n as f64),
            matrix_memory: batch.max(more * more / more.ln()),
        }
    }

    /// Draws Q η.
    fn draw(&self, random: &mut ChaCha12Rng) -> DVector<f64> {
        let normals: DVector<f64> = DVector::from_fn(self.mean.len(), |_, _| StandardNormal.sample(random));
        // The factor's upper triangle holds no meaningful numbers.
        let q = self.factor.l_dirty();
        DVector::from_fn(normals.len(), |row, _| (0..=row).map(|column| q[(row, column)] * normals[column]).sum())
    }

    /// Learns from a candidate and its cost.
    ///
    /// `step` is the Q η of the Gaussian from which it was drawn.
    fn absorb(&mut self, candidate: &DVector<f64>, step: &DVector<f64>, cost: f64) {
        let beta = 1.0 / self.matrix_memory;
        // An infinite threshold accepts every finite cost, and never an infinite one.
        if cost >= self.threshold {
            self.radius *= 1.0 - beta * P;
            return;
        }
        self.radius = (self.radius * (1.0 + beta * (1.0 - P))).min(PI);
        let weight = 1.0 / self.memory;
        self.mean = &self.mean * (1.0 - weight) + candidate * weight;
        self.threshold = match self.threshold.is_finite() {
            true => (1.0 - weight) * self.threshold + weight * cost,
            false => cost,
        };
        // (1 − β) QQᵀ + β s sᵀ without the factor 1 − β, which the scaling of the determinant
        // removes anyway.
        self.factor.rank_one_update(step, beta / (1.0 - beta));
        let n = self.mean.len();
        let logarithm: f64 = (0..n).map(|k| self.factor.l_dirty()[(k, k)].ln()).sum();
        let factor = std::mem::replace(&mut self.factor, Cholesky::pack_dirty(DMatrix::zeros(0, 0)));
        self.factor = Cholesky::pack_dirty(factor.unpack_dirty() * (-logarithm / n as f64).exp());
    }
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::{Counted, Forbidden, Quadratic, Wells};
    use super::super::{Greedy, total_cost};
    use super::*;

    /// The formulas as printed: C = QQᵀ as a whole, with a new root for every candidate.
    #[test]
    fn candidates_one_by_one_follow_the_printed_formulas() {
        let n = 5;
        let mut costs = Quadratic::random(n, true, 11);
        let search = GaussianAdaptation { seed: 3, batch: Some(1), max_candidates: 400, ..Default::default() };
        let outcome = search.search(&mut costs, &[1.0; 5], &[false; 5]).unwrap();

        let (nf, mut random) = (n as f64, ChaCha12Rng::seed_from_u64(3));
        let (n_m, n_c, p) = (E * nf, (nf + 1.0).powi(2) / (nf + 1.0).ln(), (-1.0f64).exp());
        let mut m = DVector::from_element(n, 1.0);
        let (mut r, mut c) = (0.3, DMatrix::<f64>::identity(n, n));
        let mut c_t = total_cost(&mut costs, m.as_slice()).unwrap();
        let (mut best, mut accepted) = (c_t, 0);
        for _ in 0..400 {
            let q = c.clone().cholesky().expect("positive definite").l();
            let eta: DVector<f64> = DVector::from_fn(n, |_, _| StandardNormal.sample(&mut random));
            let x = &m + r * &q * eta;
            let f = total_cost(&mut costs, x.as_slice()).unwrap();
            best = best.min(f);
            if f < c_t {
                let away = (&x - &m) / r;
                c = (1.0 - 1.0 / n_c) * c + &away * away.transpose() / n_c;
                c /= c.determinant().powf(1.0 / nf);
                m = (1.0 - 1.0 / n_m) * m + x / n_m;
                c_t = (1.0 - 1.0 / n_m) * c_t + f / n_m;
                r *= 1.0 + (1.0 - p) / n_c;
                accepted += 1;
            } else {
                r *= 1.0 - p / n_c;
            }
        }
        assert!(accepted > 100);
        // This is rounding, amplified by 400 updates.
        assert!((outcome.cost - best).abs() < 1e-9 * best, "{} against {best}", outcome.cost);
    }

    #[test]
    fn the_minimum_of_a_convex_cost_is_found_with_any_batch() {
        for (closed, batch) in [(false, None), (true, None), (true, Some(1)), (true, Some(32)), (true, Some(500))] {
            let mut costs = Quadratic::random(8, closed, 12);
            let (minimum, _) = costs.minimum();
            let least = total_cost(&mut costs, &minimum).unwrap();
            let search = GaussianAdaptation { batch, smallest_radius: 1e-7, ..Default::default() };
            let outcome = search.search(&mut costs, &[0.0; 8], &[false; 8]).unwrap();
            assert!(outcome.settled, "{} candidates", outcome.iterations);
            // A Gaussian of 1e-7 has its mean within some 1e-6, and costs rise as the square of
            // that.
            let error = minimum.iter().zip(&outcome.slopes).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(error < 1e-5 && outcome.cost - least < 1e-10, "{error:.1e}, {:.1e}", outcome.cost - least);
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_bits_and_another_seed_others() {
        let run = |seed| {
            let search = GaussianAdaptation { seed, max_candidates: 1000, ..Default::default() };
            search.search(&mut Quadratic::random(10, true, 13), &[0.5; 10], &[false; 10]).unwrap()
        };
        assert_eq!(run(1), run(1));
        assert_ne!(run(1).slopes, run(2).slopes);
    }

    #[test]
    fn a_batch_is_one_request_of_all_segments_of_all_candidates() {
        let mut costs = Counted::new(Quadratic::random(7, false, 14));
        let search = GaussianAdaptation { batch: Some(20), max_candidates: 150, ..Default::default() };
        let outcome = search.search(&mut costs, &[0.0; 7], &[false; 7]).unwrap();
        assert_eq!((outcome.settled, outcome.iterations), (false, 150));
        // The start, seven batches of 20 and one of 10.
        assert_eq!((costs.requests, costs.solves), (9, 6 * 151));
        assert_eq!((outcome.segment_solves, outcome.textbook_solves), (6 * 151, 6 * 151));
        assert!(outcome.history.windows(2).all(|pair| pair[1].cost <= pair[0].cost));
        assert_eq!(outcome.history.last().unwrap().cost, outcome.cost);
        let moments: Vec<usize> = outcome.snapshots.iter().map(|snapshot| snapshot.at.iterations).collect();
        assert_eq!(moments, [0, 20, 40, 80, 140, 150]);
    }

    #[test]
    fn fixed_slopes_stay_and_the_others_reach_their_minimum() {
        let mut costs = Quadratic::random(6, true, 15);
        let fixed = [true, false, false, false, true, false];
        let start = [0.7, 0.0, 0.0, 0.0, -0.2, 0.0];
        let outcome = GaussianAdaptation::default().search(&mut costs, &start, &fixed).unwrap();
        assert_eq!([outcome.slopes[0], outcome.slopes[4]], [0.7, -0.2]);
        let greedy = Greedy { step: 0.01, smallest_step: Some(1e-7), ..Default::default() };
        let other = greedy.search(&mut costs, &start, &fixed).unwrap();
        assert!((outcome.cost - other.cost).abs() < 1e-8 && outcome.cost < total_cost(&mut costs, &start).unwrap());
        let still = GaussianAdaptation::default().search(&mut costs, &start, &[true; 6]).unwrap();
        assert_eq!((still.slopes.as_slice(), still.iterations, still.settled), (&start[..], 0, true));
    }

    #[test]
    fn it_leaves_the_lesser_of_two_wells_where_the_greedy_search_stays() {
        let (mut wells, start) = (Wells { dots: 3 }, [1.0; 3]);
        let greedy = Greedy::default().search(&mut wells, &start, &[false; 3]).unwrap();
        assert!(greedy.slopes.iter().all(|slope| (slope - 1.0).abs() < 0.1));
        let mut run = |seed| {
            let search = GaussianAdaptation { seed, radius: 1.0, threshold: Some(f64::INFINITY), ..Default::default() };
            search.search(&mut wells, &start, &[false; 3]).unwrap()
        };
        // It is not found with every seed, but with 39 of 100.
        let outcomes: Vec<Outcome> = (0..40).map(&mut run).collect();
        let deep = |outcome: &&Outcome| outcome.slopes.iter().all(|slope| (slope + 1.0).abs() < 0.1);
        assert!(outcomes.iter().filter(deep).count() >= 8);
        assert!(outcomes.iter().filter(deep).all(|outcome| outcome.cost < 0.1 * greedy.cost));
    }

    #[test]
    fn an_infinite_start_is_left_and_infinite_candidates_are_never_kept() {
        let mut costs = Forbidden { quadratic: Quadratic::random(4, true, 16), largest_sum: 0.5 };
        let start = [0.4; 4];
        assert_eq!(total_cost(&mut costs, &start).unwrap(), f64::INFINITY);
        let outcome = GaussianAdaptation::default().search(&mut costs, &start, &[false; 4]).unwrap();
        assert!(outcome.cost.is_finite());
        assert!((0..4).all(|k| outcome.slopes[k] + outcome.slopes[(k + 1) % 4] <= 0.5));
        // Nothing is found where nothing is finite, and the limit ends the search.
        let search = GaussianAdaptation { max_candidates: 100, ..Default::default() };
        let lost = search.search(&mut Forbidden { largest_sum: -1e9, ..costs }, &start, &[false; 4]).unwrap();
        assert_eq!((lost.cost, lost.slopes, lost.settled), (f64::INFINITY, start.to_vec(), false));
    }

    #[test]
    fn options_that_make_no_sense_are_refused_with_a_sentence() {
        let refused = |search: GaussianAdaptation, dots: usize| {
            let mut costs = Quadratic::random(dots, true, 0);
            search.search(&mut costs, &vec![0.0; dots], &vec![false; dots]).unwrap_err().to_string()
        };
        let default = GaussianAdaptation::default;
        assert_eq!(
            refused(GaussianAdaptation { batch: Some(0), ..default() }, 3),
            "Gaussian Adaptation was given a batch of 0 candidates: give at least 1"
        );
        assert_eq!(
            refused(GaussianAdaptation { radius: -1.0, ..default() }, 3),
            "Gaussian Adaptation's radii are -1 and 0.00001: give positive angles in radians"
        );
        assert_eq!(
            refused(GaussianAdaptation { threshold: Some(f64::NAN), ..default() }, 3),
            "Gaussian Adaptation's threshold is NaN: give a cost, ∞, or none"
        );
        assert_eq!(
            refused(default(), 4097),
            "Gaussian Adaptation over 4097 slopes exceeds its 4096: use Newton's method or the greedy search"
        );
    }
}
