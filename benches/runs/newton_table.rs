//! How many iterations Newton's method in the Sobolev metric takes, and where it ends: energies,
//! gentle and rough points, planar and spatial, open and closed, few and many points, coarse and
//! fine; prints Markdown tables of median / 99 % / most iterations of what converged, how many
//! did not, and for energies over three edges how many did within 60 iterations.
//!
//! usage: `newton_table [CURVES]`: so many random curves a cell, 1000 if not said

#[path = "../../tests/common/rough.rs"]
mod rough;

use faircurve::discrete::{Energy, Fair, Segments, bending, length, variation};
use faircurve::{CurveStatus, Device, Result};
use rough::Family;

const SEED: u64 = 4;

/// Iterations at most.
const MOST: u32 = 100;

/// Iterations in which rough curves of energies over three edges are wanted.
const SOON: u32 = 60;

/// Energies over three edges take longer: a fifth of the curves serves.
const FEWER: usize = 5;

fn energies() -> Vec<(&'static str, Energy)> {
    vec![
        ("bending", bending(2.0)),
        ("bending + 0.1 length", bending(2.0) + 0.1 * length()),
        ("bending + length", bending(2.0) + length()),
        ("ν = 1.5, + length", bending(1.5) + length()),
        ("ν = 3, + length", bending(3.0) + length()),
        ("ν = 4, + length", bending(4.0) + length()),
        ("variation", variation()),
        ("variation + 0.1 length", variation() + 0.1 * length()),
        ("variation + length", variation() + length()),
    ]
}

fn cell(energy: &Energy, family: Family, segments: usize, curves: usize) -> Result<String> {
    let curves = if energy.order() > 2 { curves.div_ceil(FEWER) } else { curves };
    let fair =
        Fair { energy: energy.clone(), segments: Segments::PerSpan(segments), max_iterations: MOST, ..Fair::default() };
    let fit = fair.fit(&family.batch(curves, SEED), &Device::cpu())?;
    let of = |status: CurveStatus| fit.reports().iter().filter(move |report| report.status == status);
    let mut iterations: Vec<u32> = of(CurveStatus::Converged).map(|report| report.iterations).collect();
    iterations.sort_unstable();
    let mut text = match iterations.len() {
        0 => "–".to_string(),
        n => format!("{}/{}/{}", iterations[n / 2], iterations[(99 * n / 100).min(n - 1)], iterations[n - 1]),
    };
    let share = |count: usize| 100.0 * count as f64 / curves as f64;
    for (status, word) in [(CurveStatus::Unbounded, "unbounded"), (CurveStatus::NotConverged, "not converged")] {
        match of(status).count() {
            0 => {}
            count => text += &format!(", {:.1} % {word}", share(count)),
        }
    }
    if energy.order() > 2 {
        text += &format!(", {:.1} % within {SOON}", share(iterations.iter().filter(|&&own| own <= SOON).count()));
    }
    Ok(text)
}

fn table(title: &str, columns: &[(String, Family, usize)], energies: &[(&str, Energy)], curves: usize) -> Result<()> {
    println!("\n{title}\n");
    println!("| energy | {} |", columns.iter().map(|column| column.0.clone()).collect::<Vec<_>>().join(" | "));
    println!("|---{}|", "|---".repeat(columns.len()));
    for (name, energy) in energies {
        let cells: Result<Vec<String>> =
            columns.iter().map(|(_, family, segments)| cell(energy, *family, *segments, curves)).collect();
        println!("| {name} | {} |", cells?.join(" | "));
    }
    Ok(())
}

fn main() -> Result<()> {
    let curves: usize = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(1000);
    println!(
        "{curves} curves a cell ({} of variation), seed {SEED}, at most {MOST} iterations",
        curves.div_ceil(FEWER)
    );
    let open = |dimension: usize, sigma: f64| Family { dimension, closed: false, points: 5, sigma };
    let closed = |dimension: usize, sigma: f64| Family { dimension, closed: true, points: 8, sigma };
    let kinds = [open(2, 0.2), open(2, 0.6), open(2, 1.2), open(3, 0.2), open(3, 0.6), open(3, 1.2)];
    let rings = [closed(2, 0.1), closed(2, 0.3), closed(3, 0.1)];
    let named = |family: &Family| (family.to_string(), *family, 16);
    let all = energies();
    table("Open, 16 edges a span", &kinds.iter().map(named).collect::<Vec<_>>(), &all, curves)?;
    table("Closed, 16 edges a span", &rings.iter().map(named).collect::<Vec<_>>(), &all, curves)?;
    let some: Vec<_> = all.iter().filter(|(name, _)| name.ends_with("length")).cloned().collect();
    let number = |points: usize| (format!("{points} points"), Family { points, ..open(2, 0.2) }, 16);
    table("Gentle (2-D, σ 0.2), by points", &[3, 5, 12, 50].map(number), &some, curves.div_ceil(FEWER))?;
    let fineness = |segments: usize| (format!("{segments} edges a span"), open(2, 0.2), segments);
    table("Gentle (2-D, σ 0.2), by edges a span", &[8, 16, 64, 256].map(fineness), &some, curves.div_ceil(FEWER))
}
