//! Allocations per curve of a second fit, once threads and kept memory are there.

use std::alloc::{GlobalAlloc, Layout, System};
use std::hint::black_box;
use std::sync::atomic::{AtomicUsize, Ordering};

use faircurve::discrete::Fair;
use faircurve::spline::{Natural, Smoothing, SmoothingTarget};
use faircurve::{CurveBatch, Device, Sampling};

/// The system's allocator, which counts.
struct Counting;

static COUNT: AtomicUsize = AtomicUsize::new(0);

#[allow(unsafe_code, reason = "an allocator is unsafe, and this one only counts")]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promise is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise is passed on.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Planar curves through 10 points on circles of different sizes.
fn circles(curves: usize) -> CurveBatch {
    let point = |k: usize| {
        let (radius, angle) = (1.0 + 0.01 * (k / 10 % 100) as f64, 0.6 * (k % 10) as f64);
        [radius * angle.cos(), radius * angle.sin()]
    };
    let coords = (0..10 * curves).flat_map(point).collect();
    CurveBatch::from_ragged(2, coords, (0..=curves).map(|i| 10 * i).collect()).expect("finite points")
}

/// The allocations of 2,000 more curves, per curve.
fn per_curve(fit: impl Fn(&CurveBatch)) -> f64 {
    let [few, many] = [2_000, 4_000].map(|curves| {
        let batch = circles(curves);
        fit(&batch);
        let before = COUNT.load(Ordering::Relaxed);
        fit(&batch);
        (COUNT.load(Ordering::Relaxed) - before) as f64
    });
    (many - few) / 2_000.0
}

/// One test, since the count is of the whole process.
#[test]
fn splines_allocate_nothing_per_curve_and_fair_curves_little() {
    let device = Device::cpu();
    let natural = per_curve(|batch| {
        let fit = Natural::default().fit(batch, &device).expect("a fit");
        black_box(fit.polylines(Sampling::Count(80)));
    });
    let smoothing = per_curve(|batch| {
        let smoothing = Smoothing { target: SmoothingTarget::Lambda(0.1), ..Smoothing::default() };
        black_box(smoothing.fit(batch, &device).expect("a fit"));
    });
    let fair = per_curve(|batch| drop(black_box(Fair::default().fit(batch, &device).expect("a fit"))));
    println!("natural {natural:.3}, smoothing {smoothing:.3}, fair {fair:.2} allocations per curve");
    assert!(natural < 0.1, "{natural}");
    assert!(smoothing < 0.2, "{smoothing}");
    assert!(fair < 45.0, "{fair}");
}
