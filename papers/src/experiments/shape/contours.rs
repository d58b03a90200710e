//! Contour lines that may not cross: a table and a picture.

use std::f64::consts::TAU;
use std::fmt::Write;

use crate::picture::{Panel, Sheet, Stroke};
use faircurve::discrete::{Fair, Limits};
use faircurve::topology::{Options, Topology};
use faircurve::{CurveBatch, CurveStatus, Device, Fit, Result, Sampling};
use glam::DVec2;

use super::super::Record;
use super::field::{Simplified, contours};

/// Edges between two points.
const EDGES: usize = 16;

const LINE: [u8; 3] = [0, 114, 178];
const AGAIN: [u8; 3] = [0, 158, 115];
const CROSSING: [u8; 3] = [213, 94, 0];

const ROWS: [Simplified; 6] = [
    Simplified::Within(0.02),
    Simplified::Within(0.05),
    Simplified::Within(0.1),
    Simplified::Every(8),
    Simplified::Every(16),
    Simplified::Every(24),
];

/// That of the picture.
const DRAWN: Simplified = Simplified::Within(0.05);

pub const HEADS: &str = "simplified,curves,points,crossing,crossing_kept_apart,again,infeasible,cost\n";

/// Adds the rows, and returns them as CSV.
pub fn rows(record: &mut Record) -> Result<String> {
    record.line("");
    record.line(
        "Contour lines of a made-up landscape, simplified, those that meet no other then, in bending and tautness. Crossings are pairs of spans of different\n\
         lines, without --no-crossing and with it; again: the lines fitted again, with their median cost in energy.\n",
    );
    record.line(format_args!(
        "{:<24}{:>7}{:>8}{:>11}{:>6}{:>7}{:>12}{:>10}",
        "points", "lines", "points", "crossings", "with", "again", "infeasible", "cost"
    ));
    let mut csv = String::from(HEADS);
    let mut left = 0;
    for simplified in ROWS {
        let batch = lines_apart(simplified)?;
        let [free, apart] = [false, true].map(|apart| fitted(&batch, apart));
        let (free, apart) = (free?, apart?);
        let [before, after] = [&free, &apart].map(|fit| crossings(&batch, fit));
        let (before, after) = (before?.len(), after?.len());
        let kept = || apart.reports().iter().filter_map(|report| report.limits);
        let again = kept().filter(|kept| kept.neighbours > 0).count();
        let infeasible = apart.reports().iter().filter(|report| report.status == CurveStatus::Infeasible).count();
        let mut costs: Vec<f64> = kept().filter(|kept| kept.neighbours > 0).map(|kept| kept.cost).collect();
        costs.sort_unstable_by(f64::total_cmp);
        let cost = costs.get(costs.len() / 2).copied().unwrap_or(0.0);
        let (lines, points) = (batch.len(), batch.coords().len() / 2);
        left += after;
        record.line(format_args!(
            "{:<24}{lines:>7}{points:>8}{before:>11}{after:>6}{again:>7}{infeasible:>12}{:>10}",
            simplified.to_string(),
            format!("{:.2} %", 100.0 * cost)
        ));
        let _ = writeln!(csv, "\"{simplified}\",{lines},{points},{before},{after},{again},{infeasible},{cost:.6}");
    }
    record.line("");
    record.check("no two contour lines cross that may not", left == 0);
    Ok(csv)
}

/// The simplified lines that do not meet another as polygons. The others may cross.
fn lines_apart(simplified: Simplified) -> Result<CurveBatch> {
    let all = contours(simplified)?;
    let found = fitted(&all, true)?;
    let is_apart = |i: &usize| found.reports()[*i].limits.is_some_and(|limits| limits.touching == 0);
    Ok(all.select(&(0..all.len()).filter(is_apart).collect::<Vec<_>>()))
}

fn fitted(batch: &CurveBatch, no_crossing: bool) -> Result<Fit> {
    Fair { limits: Limits { no_crossing, ..Limits::default() }, ..Fair::default() }.fit(batch, &Device::cpu())
}

/// Where lines cross others that their points do not: one place for each pair of spans.
fn crossings(batch: &CurveBatch, fit: &Fit) -> Result<Vec<DVec2>> {
    let topology = Topology::new(batch, &Options::default())?;
    let faults = topology.sample(fit.clone(), Sampling::PerSpan(EDGES)).faults();
    let others = faults.crossings.iter().filter(|crossing| crossing.curves[0] != crossing.curves[1]);
    Ok(others.map(|crossing| DVec2::from(crossing.at)).collect())
}

/// The lines of [`DRAWN`] without and with the limit, and a part of them.
pub fn sheet() -> Result<String> {
    let batch = lines_apart(DRAWN)?;
    let [free, apart] = [false, true].map(|apart| fitted(&batch, apart));
    let (free, apart) = (free?, apart?);
    let marks = crossings(&batch, &free)?;
    let middle = marks.get(marks.len() / 2).copied().unwrap_or_default();
    let mut panels = Vec::new();
    for (part, radius) in [("", 0.06), (", a part", 0.03)] {
        for (fit, name) in [(&free, "without the limit"), (&apart, "no crossing")] {
            let within = |point: &DVec2| part.is_empty() || (*point - middle).abs().max_element() < 0.8;
            let mut strokes = strokes(&batch, fit, within);
            let circle = |at: DVec2| (0..=24).map(move |k| at + radius * DVec2::from_angle(TAU * f64::from(k) / 24.0));
            strokes.extend(crossings(&batch, fit)?.into_iter().filter(within).map(|at| Stroke {
                points: circle(at).collect(),
                colour: CROSSING,
                width: 1.6,
                name: Some("crossing".into()),
            }));
            let dots = batch.coords().as_chunks::<2>().0.iter().map(|&point| DVec2::from(point));
            let dots = if part.is_empty() { vec![] } else { dots.filter(within).collect() };
            panels.push(Panel { title: format!("{name}{part}"), strokes, dots, ..Panel::default() });
        }
    }
    Ok(Sheet {
        title: Some(format!("Contour lines of {} points, {DRAWN}", batch.coords().len() / 2)),
        caption: "Green: fitted again, so that they do not cross.".into(),
        columns: 2,
        panels,
        ..Sheet::default()
    }
    .draw())
}

/// The lines that lie within a window, each in as many pieces as it takes.
fn strokes(batch: &CurveBatch, fit: &Fit, within: impl Fn(&DVec2) -> bool) -> Vec<Stroke> {
    let vertices = fit.polylines(Sampling::PerSpan(EDGES));
    let of_line = |i: usize| {
        let mut points: Vec<DVec2> = vertices.points(i).as_chunks::<2>().0.iter().map(|&point| point.into()).collect();
        points.extend(batch.is_closed(i).then(|| points[0]));
        let is_again = fit.reports()[i].limits.is_some_and(|limits| limits.neighbours > 0);
        let (colour, name) = if is_again { (AGAIN, "fitted again") } else { (LINE, "line") };
        let parts: Vec<Vec<DVec2>> = points.split(|point| !within(point)).map(<[DVec2]>::to_vec).collect();
        parts.into_iter().filter(|part| part.len() > 1).map(move |points| Stroke {
            points,
            colour,
            width: 1.2,
            name: Some(name.into()),
        })
    };
    (0..vertices.len()).flat_map(of_line).collect()
}
