//! faircurve's side of the case of grids in `benches/peers/compare.sh`: times Laplacian subdivision
//! on the CPU, prints one JSON line a case in the form that `benches/peers/README.md` lays down,
//! and writes the rule's interior mask and the surfaces for the peer to compare with:
//! laplacian-faircurve.npz.
//!
//! usage: `peer_laplacian [--runs 7]`, in the repository, after `laplacian.py --write-input`

use std::error::Error;
use std::hint::black_box;

use faircurve::Device;
use faircurve::laplacian::{Grids, Reproduces, Rule, SparseRule, Subdivide};

#[path = "../common/npz.rs"]
mod npz;
#[path = "../common/peer.rs"]
mod peer;

use peer::{line, times};

fn grids(name: &str, side: usize) -> Result<Grids, Box<dyn Error>> {
    let (shape, values) = npz::array(&format!("benches/data/laplacian-{name}.npz"), "grids")?;
    let [count, rows, columns] = shape[..] else { return Err("grids are not heights".into()) };
    if side == rows {
        return Ok(Grids::new(1, vec![[rows, columns]; count], values)?);
    }
    let cut = values.chunks_exact(columns).take(side).flat_map(|row| &row[..side]).copied().collect();
    Ok(Grids::uniform(1, [side, side], cut)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let runs = peer::runs()?;
    let device = Device::cpu();
    let rule = SparseRule::of_support(5, Reproduces::Constants)?;
    // In the middle of a large grid: what a single point does to those around it.
    let mask: Vec<f64> = (0..25).map(|k| rule.weight([62 + k / 5, 62 + k % 5], [32, 32], [64, 64])).collect();
    let mut results = vec![("mask", vec![5, 5], mask)];
    let sparse = Rule::Sparse(rule);
    for (name, case, grids, rule, rounds) in [
        ("sparse", "laplacian 5x5, 1025x1025, 1 round", grids("large", 1025)?, sparse.clone(), 1),
        ("batch", "laplacian 5x5, 10000 of 9x9, 3 rounds", grids("small", 9)?, sparse, 3),
        ("exact", "laplacian exact, 257x257, 1 round", grids("large", 257)?, Rule::Exact, 1),
    ] {
        let method = Subdivide { rule, rounds };
        let times = times(runs, grids.len(), || {
            black_box(method.fit(&grids, &device)?);
            Ok(())
        })?;
        let fine = method.fit(&grids, &device)?;
        let fine = fine.grids();
        let [rows, columns] = fine.shape(0);
        results.push((name, vec![fine.len(), rows, columns], fine.values().to_vec()));
        println!("{}", line(case, &times, grids.len(), fine.total_points()));
    }
    npz::write("benches/data/laplacian-faircurve.npz", &results)
}
