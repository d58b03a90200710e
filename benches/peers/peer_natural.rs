//! faircurve's side of `benches/peers/compare.sh`: times natural splines, fitted and sampled, on
//! the CPU, and prints one JSON line a case in the form that `benches/peers/README.md` lays down.
//!
//! usage: `peer_natural [--runs 7]`, in the repository, after `benches/data.sh hanzi` and
//! `natural.py --write-random`

use std::error::Error;
use std::hint::black_box;

use faircurve::{Device, Sampling, io, spline::Natural};
#[path = "../common/peer.rs"]
mod peer;

use peer::{line, times};

/// Name of the case, its file, and how each curve is sampled; names as in `natural.py`.
const CASES: [(&str, &str, Sampling); 2] = [
    ("random 20000x10x2, 80 samples", "benches/data/random.npz", Sampling::Count(80)),
    ("hanzi strokes, 8 a span", "benches/data/hanzi.npz", Sampling::PerSpan(8)),
];

fn main() -> Result<(), Box<dyn Error>> {
    let (runs, device) = (peer::runs()?, Device::cpu());
    for (case, file, sampling) in CASES {
        let batch = io::read(file)?;
        let times = times(runs, batch.len(), || {
            let fit = Natural::default().fit(&batch, &device)?;
            black_box(fit.polylines(sampling));
            drop(black_box(fit));
            Ok(())
        })?;
        println!("{}", line(case, &times, batch.len(), batch.total_points()));
        // Points alone, in memory that is used again.
        let mut coords = Vec::new();
        let times = self::times(runs, batch.len(), || {
            let fit = Natural::default().fit(&batch, &device)?;
            let offsets = fit.sample_offsets(sampling).ok_or("the number of samples is known")?;
            coords.resize(offsets[batch.len()] * batch.dimension(), 0.0);
            fit.sample_into(sampling, black_box(&mut coords));
            Ok(())
        })?;
        println!("{}", line(&format!("{case}, sample_into"), &times, batch.len(), batch.total_points()));
    }
    Ok(())
}
