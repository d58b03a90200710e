//! λ chosen by the data, beside SciPy's `make_smoothing_spline(x, y, w)` without `lam` (1.17).

use std::sync::Arc;

use faircurve::spline::{Parametrisation, Smoothing, SmoothingTarget, SurfaceSpline};
use faircurve::surface::Globe;
use faircurve::{CurveBatch, CurveStatus, Device, Fit, Sampling};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// Made up: sin x with noise of 0.3.
const X: [f64; 40] = [
    0.028, 0.202, 0.644, 1.069, 1.151, 1.344, 1.351, 1.793, 1.879, 1.893, 2.013, 2.194, 2.305, 2.508, 2.58, 2.588,
    3.499, 4.081, 4.169, 4.536, 4.681, 5.415, 6.001, 6.492, 6.616, 6.704, 6.705, 7.636, 7.788, 7.93, 8.581, 8.716,
    8.802, 8.963, 9.228, 9.275, 9.367, 9.456, 9.466, 9.468,
];
const Y: [f64; 40] = [
    0.1507, 0.0285, 0.8863, 0.8381, 1.0913, 1.1582, 0.8586, 0.3963, 0.8486, 1.114, 0.7898, 0.9437, 1.0362, 0.4288,
    0.9019, 1.0123, -0.0261, -0.4576, -0.5269, -0.3081, -0.9437, -0.7625, -0.0975, -0.0652, -0.1392, 0.1439, 0.5212,
    1.1183, 0.5369, 0.4321, 0.6523, 0.5945, 0.5685, 0.6469, 0.5642, 0.2185, 0.2416, -0.3598, -0.3941, 0.0277,
];
const WEIGHTS: [f64; 40] = [
    0.616, 1.531, 0.965, 1.538, 0.623, 1.807, 1.543, 1.673, 1.41, 1.187, 0.79, 1.914, 0.718, 1.282, 0.682, 0.663,
    1.545, 1.833, 1.192, 1.692, 1.789, 1.303, 1.663, 0.939, 0.725, 0.784, 0.511, 0.607, 1.627, 1.855, 0.586, 1.581,
    1.666, 1.522, 1.249, 1.228, 1.542, 0.868, 1.629, 0.788,
];

/// λ and every eighth value.
const SCIPY: (f64, [f64; 5]) =
    (0.15721523, [0.1514737848753089, 0.9151947765566011, 0.0328846300853097, 0.13428800231742488, 0.5443413058589935]);

fn fit(batch: &CurveBatch, target: SmoothingTarget) -> Fit {
    let smoothing = Smoothing { target, pin_ends: false, parametrisation: Parametrisation::Given };
    smoothing.fit(batch, &Device::cpu()).unwrap()
}

fn batch(y: &[f64]) -> CurveBatch {
    let points: Vec<[f64; 2]> = y.iter().map(|&y| [y, 0.0]).collect();
    CurveBatch::from_slices(&[&points[..]]).unwrap().with_parameters(X.to_vec()).unwrap()
}

#[test]
fn chosen_factors_are_those_of_scipy() {
    let (batch, (lambda, values)) = (batch(&Y), SCIPY);
    let found = fit(&batch, SmoothingTarget::CrossValidation);
    let own = found.reports()[0].smoothing.unwrap();
    // Trials are 0.5 % apart.
    assert!((own / lambda - 1.0).abs() < 6e-3, "{own} {lambda}");
    let samples = found.polylines(Sampling::PerSpan(1));
    let values = samples.points(0).chunks_exact(2).step_by(8).zip(values);
    assert!(values.into_iter().all(|(own, value)| (own[0] - value).abs() < 1e-3), "{:?}", samples.points(0));
    // The same curve as with this λ.
    let again = fit(&batch, SmoothingTarget::Lambda(own));
    let [a, b] = [found, again].map(|fit| fit.curve(0).point(4.4).x);
    assert!((a - b).abs() < 1e-12, "{a} {b}");
}

#[test]
fn chosen_factors_have_the_least_score_with_weights_too() {
    let unit = |k: usize| batch(&std::array::from_fn::<f64, 40, _>(|j| f64::from(u8::from(j == k))));
    for weights in [[1.0; 40], WEIGHTS] {
        let weighted = |batch: CurveBatch| batch.with_weights(weights.to_vec()).unwrap();
        // n Σ w (y − p)²/tr(I − A)², with the columns of A from fits of unit vectors.
        let score = |lambda: f64| {
            let value = |batch: CurveBatch, k: usize| {
                let found = fit(&weighted(batch), SmoothingTarget::Lambda(lambda)).polylines(Sampling::PerSpan(1));
                found.points(0)[2 * k]
            };
            let freedom: f64 = (0..40).map(|k| 1.0 - value(unit(k), k)).sum();
            let found = fit(&weighted(batch(&Y)), SmoothingTarget::Lambda(lambda)).polylines(Sampling::PerSpan(1));
            let squares = (0..40).map(|k| weights[k] * (Y[k] - found.points(0)[2 * k]).powi(2)).sum::<f64>();
            40.0 * squares / freedom.powi(2)
        };
        let found = fit(&weighted(batch(&Y)), SmoothingTarget::CrossValidation);
        let own = found.reports()[0].smoothing.unwrap();
        let least = score(own);
        for factor in [0.01, 0.5, 0.97, 1.03, 2.0, 100.0] {
            assert!(score(factor * own) > least, "{factor} {own}");
        }
    }
}

#[test]
fn a_chosen_factor_is_told_from_the_noise_of_any_size() {
    let mut rng = StdRng::seed_from_u64(3);
    println!("seed 3");
    let mut lambdas = Vec::new();
    for size in [1e-6, 1e-3, 0.1, 1.0] {
        let noise: Vec<f64> = X.iter().map(|x| x.sin() + size * rng.random_range(-1.7..1.7)).collect();
        let found = fit(&batch(&noise), SmoothingTarget::CrossValidation);
        let error = X.map(|x| (found.curve(0).point(x).x - x.sin()).powi(2)).iter().sum::<f64>() / 40.0;
        assert!(error.sqrt() < 0.9 * size.max(2e-3), "{size}: {}", error.sqrt());
        lambdas.push(found.reports()[0].smoothing.unwrap());
    }
    assert!(lambdas.is_sorted(), "{lambdas:?}");
}

#[test]
fn tracks_on_the_earth_choose_their_factor_closed_curves_do_not() {
    let points: Vec<[f64; 2]> = (0..200_i32)
        .map(|k| {
            let side = |k: i32| 2e-4 * (f64::from(k * k % 13) / 6.0 - 1.0);
            [179.0 + 0.01 * f64::from(k) + 2.0 * side(k), 60.0 + side(3 * k + 1)]
        })
        .collect();
    let t: Vec<f64> = (0..200).map(f64::from).collect();
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap().with_parameters(t).unwrap();
    let smoothing = Some(SmoothingTarget::CrossValidation);
    let spline = SurfaceSpline { smoothing, ..SurfaceSpline::new(Arc::new(Globe::WGS84)) };
    let fit = spline.fit(&batch, &Device::cpu()).unwrap();
    assert_eq!(fit.reports()[0].status, CurveStatus::Converged, "{:?}", fit.reports()[0]);
    let speeds: Vec<f64> = (5..195).map(|span| fit.curve(0).speed(span, 0.3)).collect();
    let mean = speeds.iter().sum::<f64>() / speeds.len() as f64;
    assert!(speeds.iter().all(|speed| (speed / mean - 1.0).abs() < 0.05), "{speeds:?}");
    let ring = CurveBatch::from_slices(&[&points[..]]).unwrap().closed(true);
    let found = Smoothing { target: SmoothingTarget::CrossValidation, ..Smoothing::default() };
    let found = found.fit(&ring, &Device::cpu()).unwrap();
    let report = &found.reports()[0];
    assert!(
        report.status == CurveStatus::Invalid && report.message.as_ref().unwrap().contains("give a λ"),
        "{report:?}"
    );
}
