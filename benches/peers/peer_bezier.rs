//! faircurve's side of the case of Béziers in `benches/peers/compare.sh`: times the completion of
//! control polygons on the CPU, and prints one JSON line a case in the form that
//! `benches/peers/README.md` lays down. Compares the control points with the peer's.
//!
//! usage: `peer_bezier [--runs 7]`, in the repository, after `bezier.py --write-input`

use std::error::Error;
use std::hint::black_box;

use faircurve::Device;
use faircurve::bezier::{Energy, Given, Polygons, complete};
use serde_json::json;

#[path = "../common/npz.rs"]
mod npz;
#[path = "../common/peer.rs"]
mod peer;

use peer::{line, times};

/// The cases' names and files, as in `bezier.py`.
const CASES: [(&str, &str); 2] = [
    ("bezier cubics to decics, 16 patterns", "benches/data/bezier-few.npz"),
    ("bezier cubics to decics, any pattern", "benches/data/bezier-any.npz"),
];

fn main() -> Result<(), Box<dyn Error>> {
    let runs = peer::runs()?;
    let device = Device::cpu();
    for (case, file) in CASES {
        let array = |name: &str| npz::array(file, name).map(|(_, values)| values);
        let (coords, wanted) = (array("coords")?, array("solved")?);
        let offsets: Vec<usize> = array("offsets")?.into_iter().map(|offset| offset as usize).collect();
        let known: Vec<bool> = array("known")?.into_iter().map(|flag| flag != 0.0).collect();
        let polygons = Polygons { dimension: 2, coords: &coords, offsets: &offsets };
        let given = Given { known: Some(&known), ..Given::default() };
        let completed = || complete(&polygons, &given, &Energy::bending(), &device);
        let times = times(runs, polygons.len(), || {
            black_box(completed()?);
            Ok(())
        })?;
        // NaN where the peer solved no curve of the kind.
        let pairs = completed()?.coords.into_iter().zip(wanted);
        let worst = pairs.map(|(own, peer)| (own - peer).abs()).filter(|x| !x.is_nan()).fold(0.0, f64::max);
        let mut line = line(case, &times, polygons.len(), known.len());
        line["worst_difference"] = json!(worst);
        println!("{line}");
    }
    Ok(())
}
