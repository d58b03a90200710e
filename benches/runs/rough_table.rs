//! Fits curves through rough points under each energy and each limit, on the CPU, and in single precision on the first
//! GPU, if there is one. Prints Markdown tables of statuses, loops, iterations and times.
//!
//! usage: `rough_table [CURVES]`: random curves per cell, 1000 by default

#[path = "../../tests/common/rough.rs"]
mod rough;

use std::time::Instant;

use faircurve::discrete::{Energy, Fair, Limits, Segments, bending, length, tautness, variation};
use faircurve::{Constraints, CurveBatch, CurveStatus, Device, Fit, Precision, Result};
use rough::Family;

const SEED: u64 = 4;

/// Curves of energies over three edges take longer: a fifth of them serves.
const FEWER: usize = 5;

/// The fit, and its microseconds per curve in the faster of two runs.
fn fitted(fair: &Fair, batch: &CurveBatch, device: &Device) -> Result<(Fit, f64)> {
    let timed = || -> Result<(Fit, f64)> {
        let start = Instant::now();
        let fit = fair.fit(batch, device)?;
        Ok((fit, start.elapsed().as_secs_f64() * 1e6 / batch.len() as f64))
    };
    let (first, second) = (timed()?, timed()?);
    Ok(if second.1 < first.1 { second } else { first })
}

fn fair(energy: Energy) -> Fair {
    Fair { energy, segments: Segments::PerSpan(16), max_iterations: 500, ..Fair::default() }
}

/// The median and the 95th percentile of the iterations of converged curves.
fn iterations(fit: &Fit) -> String {
    let converged = fit.reports().iter().filter(|report| report.status == CurveStatus::Converged);
    let mut all: Vec<u32> = converged.map(|report| report.iterations).collect();
    all.sort_unstable();
    let at = |share: usize| all.get(share * all.len() / 100).copied().unwrap_or(0);
    format!("{}/{}", at(50), at(95))
}

fn count(fit: &Fit, status: CurveStatus) -> usize {
    fit.reports().iter().filter(|report| report.status == status).count()
}

/// The name of a row, and the function that computes its cells.
type Row<'a> = (&'a str, &'a dyn Fn(Family) -> Result<String>);

/// Prints a table with a column per family.
fn table(title: &str, families: &[Family], rows: &[Row<'_>]) -> Result<()> {
    println!("\n{title}\n");
    println!("| | {} |", families.iter().map(ToString::to_string).collect::<Vec<_>>().join(" | "));
    println!("|---{}|", "|---".repeat(families.len()));
    for (name, cell) in rows {
        let cells: Vec<String> = families.iter().map(|family| cell(*family)).collect::<Result<_>>()?;
        println!("| {name} | {} |", cells.join(" | "));
    }
    Ok(())
}

/// A cell: the number of usable curves, of curves with loops, the iterations and the time.
fn by_energy(energy: &Energy, family: Family, curves: usize, device: &Device) -> Result<String> {
    let curves = if energy.order() > 2 { curves.div_ceil(FEWER) } else { curves };
    let (fit, time) = fitted(&fair(energy.clone()), &family.batch(curves, SEED), device)?;
    let loops = fit.reports().iter().filter(|report| report.loops.is_some()).count();
    Ok(format!("{} of {curves}, {loops} with loops; {}; {time:.0} µs", fit.usable(), iterations(&fit)))
}

/// A cell under bending + 0.1 length: kept/infeasible/neither, iterations and time.
///
/// `part` bounds the curvature of each curve, as a fraction of its largest curvature without limits.
fn by_limit(part: Option<f64>, shape: bool, family: Family, curves: usize) -> Result<String> {
    let (energy, batch) = (bending(2.0) + 0.1 * length(), family.batch(curves, SEED));
    let free = fair(energy.clone()).fit(&batch, &Device::cpu())?;
    let bound = |i: usize| part.map_or(f64::NAN, |part| part * free.curve(i).max_curvature());
    let bounds = (0..batch.len()).flat_map(|i| vec![bound(i); batch.count(i)]).collect();
    let constraints = Constraints { largest_curvatures: part.map(|_| bounds), ..Constraints::default() };
    let limits = Limits { shape, ..Limits::default() };
    let (fit, time) = fitted(&Fair { limits, ..fair(energy) }, &batch.with_constraints(constraints)?, &Device::cpu())?;
    let [kept, infeasible] = [CurveStatus::Converged, CurveStatus::Infeasible].map(|status| count(&fit, status));
    Ok(format!("{kept}/{infeasible}/{}; {}; {time:.0} µs", curves - kept - infeasible, iterations(&fit)))
}

fn main() -> Result<()> {
    let curves: usize = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(1000);
    println!("{curves} curves a cell ({} of variation), seed {SEED}, 16 edges a span", curves.div_ceil(FEWER));
    let families =
        |dimension: usize| [0.2, 0.6, 1.2].map(|sigma| Family { dimension, closed: false, points: 5, sigma });
    let energies = [
        ("bending + tautness", bending(2.0) + tautness()),
        ("bending + 0.1 length", bending(2.0) + 0.1 * length()),
        ("bending + length", bending(2.0) + length()),
        ("variation + 0.1 length", variation() + 0.1 * length()),
    ];
    let gpu = Device::gpu(0).ok().map(|device| device.with_precision(Precision::F32));
    // Energies of order 3 are not descended in f32.
    let devices = [("f64, CPU", Some(Device::cpu()), 3), ("f32, GPU", gpu, 2)];
    for (name, device, order) in devices {
        let Some(device) = device else { continue };
        let cells = energies.each_ref().map(|(_, energy)| {
            let device = &device;
            move |family: Family| by_energy(energy, family, curves, device)
        });
        let rows = energies.iter().zip(&cells).filter(|((_, energy), _)| energy.order() <= order);
        let rows: Vec<Row<'_>> =
            rows.map(|((word, _), cell)| (*word, cell as &dyn Fn(Family) -> Result<String>)).collect();
        table(&format!("By energy, {name}"), &families(2), &rows)?;
    }
    let limit = |part: Option<f64>, shape: bool| move |family: Family| by_limit(part, shape, family, curves);
    let planar: [Row<'_>; 6] = [
        ("none", &limit(None, false)),
        ("κ ≤ 0.9", &limit(Some(0.9), false)),
        ("κ ≤ 0.8", &limit(Some(0.8), false)),
        ("sides", &limit(None, true)),
        ("sides and κ ≤ 0.8", &limit(Some(0.8), true)),
        ("κ ≤ 0.65", &limit(Some(0.65), false)),
    ];
    table("By limit, in the plane", &families(2), &planar)?;
    let spatial = [planar[0], planar[1], planar[2], planar[5]];
    table("By limit, in space", &families(3), &spatial)
}
