//! The five data sets of R. J. Renka, Algorithm 828: DNSPLIN1, ACM Transactions on Mathematical
//! Software 29(4), 2003: every printed iteration beside ours, and where the descents end when they
//! go on.

use std::collections::BTreeMap;
use std::fmt::Write;

use crate::picture;
use crate::toms828::{Graph, GraphTrace, Mesh};
use faircurve::{Error, Result};
use glam::DVec2;
use serde::Deserialize;

use super::{Experiment, Outcome};

const FILES: [&str; 7] =
    ["toms828.txt", "toms828.csv", "toms828-1.svg", "toms828-2.svg", "toms828-3.svg", "toms828-4.svg", "toms828-5.svg"];

pub const EXPERIMENT: Experiment = Experiment { name: "toms828", files: &FILES, run };

/// Relative differences up to which an iteration counts as reproduced: φ is printed with 16 digits,
/// and depends on every step before it; steps are printed with four.
const PHI_AGREES: f64 = 1e-6;
const STEP_AGREES: f64 = 1e-3;

/// At most so many curves make a picture.
const MOST_CURVES: usize = 24;

#[derive(Deserialize)]
struct File {
    sets: BTreeMap<String, Set>,
}

#[derive(Deserialize)]
struct Set {
    t: Vec<f64>,
    d: Vec<f64>,
    mesh_width: f64,
    published_phi: Vec<f64>,
    published_step: Vec<f64>,
}

impl Set {
    /// The descent, and the ordinates after each iteration.
    fn trace(&self, published: bool) -> Result<(GraphTrace, Vec<Vec<f64>>)> {
        let graph = Graph { mesh: Mesh::Width(self.mesh_width), published, ..Graph::default() };
        let mut curves = Vec::new();
        let trace = graph.trace(&self.t, &self.d, |y| curves.push(y.to_vec()))?;
        Ok((trace, curves))
    }
}

fn run() -> Result<Outcome> {
    let file: File = serde_json::from_str(include_str!("../../../tests/data/toms828.json"))
        .map_err(|error| Error::argument(format!("the data of toms828: {error}")))?;
    let mut table =
        String::from("TOMS 828 (DNSPLIN1): nonlinear splines as graphs; published and ours, iteration by iteration\n");
    let mut csv = String::from("set,iteration,phi,published_phi,phi_difference,step,published_step,step_difference\n");
    let (mut pictures, mut worst, mut compared, mut listed) = (Vec::new(), [0.0f64; 2], 0, 0);
    for (name, set) in &file.sets {
        let (published, _) = set.trace(true)?;
        let _ = writeln!(table, "\nset {name}: {} points, mesh of {} points", set.t.len(), published.ordinates.len());
        let _ = writeln!(
            table,
            "{:>4}{:>22}{:>22}{:>10}{:>12}{:>11}{:>10}",
            "", "φ", "published", "relative", "step", "published", "relative"
        );
        let _ = writeln!(table, "{:>4}{:>22.12}", 0, published.initial_phi);
        let theirs = set.published_phi.iter().zip(&set.published_step);
        listed += set.published_phi.len();
        for (k, (ours, (phi, step))) in published.iterations.iter().zip(theirs).enumerate() {
            let off = [(ours.phi / phi - 1.0).abs(), (ours.step / step - 1.0).abs()];
            worst = [worst[0].max(off[0]), worst[1].max(off[1])];
            compared += 1;
            let _ = writeln!(
                table,
                "{:>4}{:>22.12}{phi:>22.12}{:>10.1e}{:>12.5}{step:>11}{:>10.1e}",
                k + 1,
                ours.phi,
                off[0],
                ours.step,
                off[1]
            );
            let (ours_phi, ours_step) = (ours.phi, ours.step);
            let _ = writeln!(csv, "{name},{},{ours_phi},{phi},{:.2e},{ours_step},{step},{:.2e}", k + 1, off[0], off[1]);
        }
        let (trace, curves) = set.trace(false)?;
        let ending =
            format!("{} after {} iterations, φ = {:.10}", trace.status.word(), trace.iterations.len(), trace.phi);
        let _ = writeln!(table, "     continued: {ending}");
        if let Some(message) = &trace.message {
            let _ = writeln!(table, "     {message}");
        }
        pictures.push(picture(name, set, &trace, &curves, ending));
    }
    let _ = writeln!(
        table,
        "\n{compared} of {listed} published iterations compared: φ within {:.1e}, steps within {:.1e} (printed with 4 digits)",
        worst[0], worst[1]
    );
    let agrees = compared == listed && worst[0] < PHI_AGREES && worst[1] < STEP_AGREES;
    let files = [table, csv].into_iter().chain(pictures).collect();
    Ok(Outcome { files, agrees })
}

fn picture(name: &str, set: &Set, trace: &GraphTrace, curves: &[Vec<f64>], caption: String) -> String {
    let data: Vec<DVec2> = set.t.iter().zip(&set.d).map(|(&t, &d)| DVec2::new(t, d)).collect();
    // The first and the last among them.
    let most = curves.len().min(MOST_CURVES);
    let shown = (0..most).map(|k| &curves[k * (curves.len() - 1) / (most - 1).max(1)]);
    let points = |y: &Vec<f64>| -> Vec<DVec2> {
        y.iter().enumerate().map(|(k, &y)| DVec2::new(trace.start + k as f64 * trace.width, y)).collect()
    };
    let shown: Vec<Vec<DVec2>> = shown.map(points).collect();
    picture::evolution(&format!("TOMS 828, data set {name}"), caption, &data, &shown)
}
