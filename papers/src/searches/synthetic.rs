//! Costs with known minima, for the tests of both searches.

use faircurve::Result;
use nalgebra::{DMatrix, DVector};
use rand::rngs::ChaCha12Rng;
use rand::{RngExt, SeedableRng};

use super::{Request, SegmentCosts};

/// Σ over segments of p (a − u)² + q (b − v)² + r (a + b − w)².
///
/// It is convex, with a tridiagonal Hessian.
pub struct Quadratic {
    dots: usize,
    closed: bool,
    /// p, q, r, u, v, w of each segment.
    segments: Vec<[f64; 6]>,
}

impl Quadratic {
    pub fn random(dots: usize, closed: bool, seed: u64) -> Self {
        let mut random = ChaCha12Rng::seed_from_u64(seed);
        let mut between = |low, high| random.random_range(low..high);
        let segment = |_| {
            let [p, q, r] = [(); 3].map(|_| between(0.5, 2.0));
            let [u, v, w] = [(); 3].map(|_| between(-1.0, 1.0));
            [p, q, r, u, v, w]
        };
        Quadratic { dots, closed, segments: (0..dots).map(segment).collect() }
    }

    /// The slopes of least cost, by elimination, and ‖H⁻¹‖∞ max H_kk.
    pub fn minimum(&self) -> (Vec<f64>, f64) {
        let mut hessian = DMatrix::<f64>::zeros(self.dots, self.dots);
        let mut right = DVector::<f64>::zeros(self.dots);
        for k in 0..SegmentCosts::segments(self) {
            let ([p, q, r, u, v, w], next) = (self.segments[k], (k + 1) % self.dots);
            hessian[(k, k)] += p + r;
            hessian[(next, next)] += q + r;
            hessian[(k, next)] += r;
            hessian[(next, k)] += r;
            right[k] += p * u + r * w;
            right[next] += q * v + r * w;
        }
        let inverse = hessian.clone().try_inverse().expect("positive definite");
        let norm = inverse.row_iter().map(|row| row.abs().sum()).fold(0.0, f64::max);
        ((inverse * right).as_slice().to_vec(), norm * hessian.diagonal().max())
    }

    fn cost(&self, request: &Request) -> f64 {
        let ([p, q, r, u, v, w], [a, b]) = (self.segments[request.segment], request.slopes);
        p * (a - u).powi(2) + q * (b - v).powi(2) + r * (a + b - w).powi(2)
    }
}

/// Implements the trait with one cost a request.
macro_rules! each {
    ($name:ty, $dots:expr, $closed:expr, $cost:expr) => {
        impl SegmentCosts for $name {
            fn dots(&self) -> usize {
                $dots(self)
            }

            fn is_closed(&self) -> bool {
                $closed(self)
            }

            fn costs(&mut self, requests: &[Request], costs: &mut [f64]) -> Result<()> {
                assert_eq!(requests.len(), costs.len());
                costs.iter_mut().zip(requests).for_each(|(cost, request)| *cost = $cost(self, request));
                Ok(())
            }
        }
    };
}

each!(Quadratic, |q: &Quadratic| q.dots, |q: &Quadratic| q.closed, |q: &Quadratic, request| q.cost(request));

/// A quadratic cost that is NaN or infinite where a segment's slopes sum to more than a bound.
pub struct Forbidden {
    pub quadratic: Quadratic,
    pub largest_sum: f64,
}

each!(
    Forbidden,
    |f: &Forbidden| f.quadratic.dots,
    |f: &Forbidden| f.quadratic.closed,
    |f: &Forbidden, request: &Request| match request.slopes[0] + request.slopes[1] > f.largest_sum {
        true if request.segment.is_multiple_of(2) => f64::NAN,
        true => f64::INFINITY,
        false => f.quadratic.cost(request),
    }
);

/// An open curve where each slope has a well at −1, and a shallower one at +1.
///
/// Neighbours want to be equal.
pub struct Wells {
    pub dots: usize,
}

impl Wells {
    fn cost(request: &Request) -> f64 {
        let well = |a: f64| (a * a - 1.0).powi(2) + 0.2 * (a + 1.0);
        let [a, b] = request.slopes;
        0.5 * (well(a) + well(b)) + 0.1 * (a - b).powi(2)
    }
}

each!(Wells, |w: &Wells| w.dots, |_: &Wells| false, |_: &Wells, request| Wells::cost(request));

/// Counts the requested segments.
pub struct Counted<C> {
    pub inner: C,
    pub solves: usize,
    pub requests: usize,
}

impl<C> Counted<C> {
    pub fn new(inner: C) -> Self {
        Counted { inner, solves: 0, requests: 0 }
    }
}

impl<C: SegmentCosts> SegmentCosts for Counted<C> {
    fn dots(&self) -> usize {
        self.inner.dots()
    }

    fn is_closed(&self) -> bool {
        self.inner.is_closed()
    }

    fn costs(&mut self, requests: &[Request], costs: &mut [f64]) -> Result<()> {
        self.solves += requests.len();
        self.requests += 1;
        self.inner.costs(requests, costs)
    }
}
