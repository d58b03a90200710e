//! A map whose neighbours stay neighbours: borders are found, fitted once, and put back.
//!
//! ```sh
//! cargo run --release --example map
//! ```

use faircurve::topology::{Options, Topology};
use faircurve::{Device, Sampling, io, spline};

fn main() -> faircurve::Result<()> {
    let world = io::read("examples/data/world-110m.topojson")?;
    let topology = Topology::new(&world, &Options::of(&world))?;
    println!("{} rings have {} borders and coasts", world.len(), topology.strokes().len());
    let strokes = spline::Natural::default().fit(topology.strokes(), &Device::cpu())?;
    let rings = std::sync::Arc::new(topology).join(strokes);
    io::write("world.geojson", &rings.polylines(Sampling::PerSpan(8)))
}
