//! A spline through points, sampled, measured and drawn.
//!
//! ```sh
//! cargo run --release --example spline
//! ```

use faircurve::picture::Picture;
use faircurve::{CurveBatch, Device, Sampling, spline};

fn main() -> faircurve::Result<()> {
    let zigzag = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [3.0, 1.0]];
    let corner = [[0.0, 0.0], [3.0, 0.0], [3.0, 2.0]];
    let batch = CurveBatch::from_slices(&[&zigzag[..], &corner[..]])?;
    let fit = spline::Natural::default().fit(&batch, &Device::cpu())?;
    for (curve, report) in &fit {
        println!("{}: length {:.3}, energy {:.3}", report.status.word(), curve.length(), report.energy);
    }
    let samples = fit.polylines(Sampling::PerSpan(4));
    println!("the first curve in {} points: {:.2?}", samples.count(0), samples.points(0));
    std::fs::write("spline.svg", Picture::default().draw(&batch, &fit)).expect("a folder to write in");
    Ok(())
}
