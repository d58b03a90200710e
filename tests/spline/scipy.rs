//! The same curves as SciPy's `CubicSpline`: 1,000 random ones, natural and periodic, each on its
//! own knots. The values come from `tests/data/scipy_splines.py`.

use faircurve::spline::{Natural, Parametrisation};
use faircurve::{CurveBatch, CurveSet, Device, io};

fn data(name: &str) -> CurveBatch {
    let options = io::ReadOptions { closed: io::Closed::Auto, ..io::ReadOptions::default() };
    io::read_with(format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR")), &options).unwrap()
}

#[test]
fn a_thousand_random_splines_are_scipys_to_1e_12() {
    let (batch, values) = (data("scipy_splines.npz"), data("scipy_values.npz"));
    assert_eq!((batch.len(), values.len()), (1000, 1000));
    assert_eq!((0..batch.len()).filter(|&i| batch.is_closed(i)).count(), 500);
    let natural = Natural { parametrisation: Parametrisation::Given, ..Natural::default() };
    let (splines, reports) = natural.fit_splines(&batch, &Device::cpu()).unwrap();
    let mut worst = (0.0_f64, 0);
    for (i, report) in reports.iter().enumerate() {
        assert!(report.status.is_usable(), "curve {i}: {report:?}");
        let curve = splines.curve(i);
        let size = batch.points(i).iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        for (&t, wanted) in values.parameters(i).unwrap().iter().zip(values.points(i).chunks_exact(2)) {
            let found = curve.point(t);
            let scale = size.max(wanted[0].abs()).max(wanted[1].abs());
            let difference = (found.x - wanted[0]).abs().max((found.y - wanted[1]).abs()) / scale;
            worst = if difference > worst.0 || difference.is_nan() { (difference, i) } else { worst };
        }
    }
    println!("worst relative difference {:.1e}, curve {}", worst.0, worst.1);
    assert!(worst.0 <= 1e-12, "{worst:?}");
}
