//! Tracks in time: positions every six hours, with speeds.
//!
//! ```sh
//! cargo run --release --example tracks
//! ```

use faircurve::io::{self, ReadOptions};
use faircurve::spline::{Smoothing, SmoothingTarget};
use faircurve::tracks::{self, At, Quantity};
use faircurve::{Device, Values};

fn main() -> faircurve::Result<()> {
    // The columns lon and lat are longitudes and latitudes, whose lengths are metres.
    let options = ReadOptions { columns: "curve=id,t=hours".parse()?, ..ReadOptions::default() };
    let storms = io::read_with("examples/data/storms.csv.gz", &options)?;
    let fit =
        Smoothing { target: SmoothingTarget::Lambda(1.0), ..Smoothing::default() }.fit(&storms, &Device::cpu())?;
    let samples = tracks::sample(&storms, &fit, &At::Every(6.0), &[Quantity::Speed])?;
    println!("{} storms, {} positions", samples.len(), samples.total_points());
    if let Values::Numbers(speeds) = &samples.columns()[0].values {
        let fastest = speeds.iter().fold(0.0, |a: f64, b| a.max(*b));
        println!("the fastest moves {:.0} km an hour", fastest / 1000.0);
    }
    Ok(())
}
