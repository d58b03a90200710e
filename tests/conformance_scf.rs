//! Smooth-connection segments on the GPU: reference values, and the CPU's costs, derivatives and refusals.

mod common;

use common::{device, epsilon, precisions, seeded};
use faircurve::scf::{Cost, Query, evaluate_segments};
use faircurve::{Device, Precision};
use rand::RngExt;
use serde_json::Value;

fn query(exponent: f64, a: f64, b: f64) -> Query {
    Query { chord: 1.0, angles: [a, b], exponent }
}

/// Every device, with the precision of its arithmetic.
fn devices() -> Option<Vec<(Device, Precision)>> {
    let device = device()?;
    let precisions = precisions(device.as_gpu().expect("a GPU"));
    Some(precisions.into_iter().map(|precision| (device.clone().with_precision(precision), precision)).collect())
}

#[test]
fn explore() {
    let Some(devices) = devices() else { return };
    let mut rng = seeded(500);
    for exponent in [1.05, 1.3, 1.5, 2.0, 2.7, 3.0, 4.0, 8.0, 20.0] {
        for scale in [1.0, 0.1, 1e-2, 1e-3, 1e-6, 1e-9] {
            let queries: Vec<Query> = (0..300)
                .map(|_| query(exponent, scale * rng.random_range(-2.0..2.0), scale * rng.random_range(-2.0..2.0)))
                .collect();
            let wanted = evaluate_segments(&queries, &Device::cpu()).unwrap();
            for (device, precision) in &devices {
                let found = evaluate_segments(&queries, device).unwrap();
                let mut worst = [0.0_f64; 4];
                let mut at = [0usize; 4];
                for (i, (f, w)) in found.iter().zip(&wanted).enumerate() {
                    let (Some(f), Some(w)) = (f, w) else {
                        if f.is_some() != w.is_some() {
                            worst[3] += 1.0;
                            at[3] = i;
                        }
                        continue;
                    };
                    let m = w.gradient[0].abs().max(w.gradient[1].abs());
                    let h = w.hessian.iter().fold(0.0_f64, |h, x| h.max(x.abs()));
                    let e = epsilon(*precision);
                    let own = [
                        (f.cost - w.cost).abs() / w.cost / e,
                        (0..2).map(|k| (f.gradient[k] - w.gradient[k]).abs()).fold(0.0, f64::max) / m / e,
                        (0..3).map(|k| (f.hessian[k] - w.hessian[k]).abs()).fold(0.0, f64::max) / h / e,
                    ];
                    for k in 0..3 {
                        if !(own[k] <= worst[k]) {
                            worst[k] = own[k];
                            at[k] = i;
                        }
                    }
                }
                eprintln!(
                    "{exponent} {scale:e} {} worst in eps {worst:.1?} {:?}",
                    precision.word(),
                    at.map(|i| queries[i].angles.map(|a| a / scale))
                );
            }
        }
    }
}
