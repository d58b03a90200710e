//! Limits that follow the recipe in CONTRIBUTING.md.

use super::*;
use crate::discrete::energy::{bending, length};
use crate::discrete::{Fair, Segments};
use crate::{CurveStatus, Device, Fit, Sampling};

#[test]
fn every_kind_of_limits_stands_where_its_penaltys_do() {
    fn check<const D: usize>() {
        let limits = Limits { monotone: vec![[1.0, 0.0, 0.0]; MOST_DIRECTIONS], ..Limits::default() };
        for (k, kind) in LimitKind::<D>::ALL.iter().enumerate() {
            for in_surface in [false, true] {
                assert_eq!((kind.functional)(&limits, in_surface).penalty(), Some(k), "{D}-D");
            }
        }
    }
    check::<2>();
    check::<3>();
}

/// The largest T_y of the edges of a curve.
fn steepest(fit: &Fit, i: usize) -> f64 {
    let vertices = fit.polylines(Sampling::PerSpan(16));
    let edge = |ends: &[[f64; 2]]| {
        let [x, y] = [0, 1].map(|c| ends[1][c] - ends[0][c]);
        y / x.hypot(y)
    };
    vertices.points(i).as_chunks::<2>().0.windows(2).map(edge).fold(-1.0, f64::max)
}

/// Curves that are too steep without the limit.
fn steep() -> CurveBatch {
    let points = |k: usize| [[0.0, 0.0], [1.0, 0.02 * k as f64], [2.0, 1.25], [3.0, 1.2], [4.0 + k as f64, 1.1]];
    let curves: Vec<_> = (0..5).map(points).collect();
    CurveBatch::from_slices(&curves.iter().map(|curve| &curve[..]).collect::<Vec<_>>()).unwrap()
}

fn fair(toy: bool) -> Fair {
    let limits = Limits { toy, ..Limits::default() };
    Fair { energy: bending(2.0) + 0.1 * length(), limits, segments: Segments::PerSpan(16), ..Fair::default() }
}

fn keeps_it(fit: &Fit) {
    for (i, report) in fit.reports().iter().enumerate() {
        assert_eq!(report.status, CurveStatus::Converged, "curve {i}: {:?}", report.message);
        assert!(steepest(fit, i) <= 0.8, "curve {i}: {}", steepest(fit, i));
        assert_eq!(report.limits.unwrap().violation, 0.0, "curve {i}");
    }
}

#[test]
fn a_limit_by_the_recipe_is_kept() {
    let batch = steep();
    let [free, kept] = [false, true].map(|toy| fair(toy).fit(&batch, &Device::cpu()).unwrap());
    assert!((0..batch.len()).any(|i| steepest(&free, i) > 0.82), "no curve is too steep without it");
    keeps_it(&kept);
}

#[cfg(feature = "gpu")]
#[test]
fn a_limit_by_the_recipe_is_kept_by_a_kernel_too() {
    use crate::Precision;
    use crate::gpu::testing::{gpu, precisions};
    let Some(gpu) = gpu() else { return };
    if !precisions(&gpu).contains(&Precision::F64) {
        return;
    }
    let device = Device::from_gpu(gpu).with_precision(Precision::F64);
    let fit = fair(true).fit(&steep(), &device).unwrap();
    assert!(fit.device().is_gpu && fit.device().finished_on_cpu == 0, "{}", fit.device());
    keeps_it(&fit);
}
