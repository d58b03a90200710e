//! What the library promises of its types.

use std::fmt::Debug;

use faircurve::{
    Constraint, Constraints, CurveBatch, CurveReport, CurveSet, Device, Fit, Precision, Sampling, spline::Natural,
};

fn is_shared<T: Send + Sync + Debug>() {}

#[test]
fn what_users_hold_can_be_shown_and_shared_between_threads() {
    is_shared::<CurveBatch>();
    is_shared::<faircurve::Constraints>();
    is_shared::<Device>();
    is_shared::<faircurve::DeviceReport>();
    is_shared::<faircurve::Error>();
    is_shared::<Fit>();
    is_shared::<CurveReport>();
    is_shared::<faircurve::Grids>();
    is_shared::<faircurve::bezier::Chain>();
    is_shared::<faircurve::bezier::Complete>();
    is_shared::<faircurve::discrete::Energy>();
    is_shared::<faircurve::discrete::Fair>();
    is_shared::<faircurve::laplacian::Subdivide>();
    is_shared::<faircurve::scf::Smooth>();
    is_shared::<Natural>();
    is_shared::<faircurve::spline::Smoothing>();
}

#[test]
fn a_method_of_a_users_own_refuses_constraints_it_does_not_know() {
    let batch = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 1.0]][..]]).unwrap();
    let curvatures = Constraints { curvatures: Some(vec![0.0; 4]), ..Constraints::default() };
    let constrained = batch.clone().with_constraints(curvatures).unwrap();
    batch.allows(&[], "arcs").unwrap();
    constrained.allows(&[Constraint::Tangents, Constraint::Curvatures], "arcs").unwrap();
    let refused = constrained.allows(&[Constraint::Tangents], "arcs").unwrap_err().to_string();
    assert!(refused.starts_with("arcs know no curvature vectors"), "{refused}");
}

/// A method of a user's own: the curves of another, shifted by nothing.
struct Own(Fit);

impl CurveSet for Own {
    fn curve(&self, i: usize) -> Box<dyn faircurve::Curve + '_> {
        self.0.curve(i)
    }

    fn polylines(&self, sampling: Sampling) -> CurveBatch {
        self.0.polylines(sampling)
    }
}

#[test]
fn a_method_of_a_users_own_makes_a_fit() {
    let batch = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]][..]]).unwrap();
    let inner = Natural::default().fit(&batch, &Device::cpu()).unwrap();
    let mut report = CurveReport::solved(3.0);
    report.iterations = 7;
    let fit = Fit::new(Own(inner.clone()), vec![report], Device::cpu().report_of(Precision::F64));
    assert_eq!((fit.len(), fit.usable(), fit.reports()[0].iterations), (1, 1, 7));
    assert_eq!(fit.curve(0).length(), inner.curve(0).length());
    assert!(!fit.device().is_gpu && fit.device().precision == Precision::F64);
    assert!(format!("{fit:?}").contains("Converged"));
}
