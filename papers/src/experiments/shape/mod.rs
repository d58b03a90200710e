//! Fair curves that keep inequalities, after R. J. Renka, *Shape-preserving interpolation by fair discrete G³ space
//! curves*, CAGD 22, 2005: how many rough curves keep their limits, at what cost, and pictures.

mod contours;
mod field;
mod pictures;

use std::fmt::Write;

use faircurve::discrete::{Fair, Limits, Region, Segments, bending, length, variation};
use faircurve::{Constraints, CurveBatch, CurveReport, CurveStatus, Device, Result, Sampling};
use glam::DVec3;
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

use super::{Experiment, Outcome, Record};

const FILES: [&str; 5] = ["shape.txt", "shape.csv", "shape.svg", "shape-contours.csv", "shape-contours.svg"];

pub const EXPERIMENT: Experiment = Experiment { name: "shape", files: &FILES, run };

/// Curves of a row of the table.
const CURVES: usize = 200;

/// Points of a curve, at unit steps.
const POINTS: usize = 5;

/// Edges between two points.
const EDGES: usize = 16;

/// Standard deviations of their heights.
const ROUGH: [f64; 3] = [0.2, 0.6, 1.2];

const SEED: u64 = 20_261_125;

/// One limit of the table.
struct Kind {
    name: &'static str,
    dimension: usize,
    limits: Limits,
    /// The largest curvature, as a part of that of the curve without limits.
    part: Option<f64>,
}

fn kinds() -> Vec<Kind> {
    let planar = |name, limits| Kind { name, dimension: 2, limits, part: None };
    let bound = |name, dimension, part| Kind { name, dimension, limits: Limits::default(), part: Some(part) };
    let shape = Limits { shape: true, ..Limits::default() };
    let tunnel = [1.0, -1.0].map(|y| Region::HalfSpace { normal: [0.0, y, 0.0], offset: 4.0 });
    vec![
        bound("largest curvature, 0.9", 2, 0.9),
        bound("largest curvature, 0.8", 2, 0.8),
        bound("largest curvature, 0.65", 2, 0.65),
        bound("largest curvature in space, 0.9", 3, 0.9),
        planar("sides of the points", shape.clone()),
        Kind { part: Some(0.8), ..planar("sides, and 0.8 of the curvature", shape.clone()) },
        Kind { dimension: 3, ..planar("sides of the twist in space", shape) },
        planar("corridor, 0.1", Limits { corridor: Some(0.1), ..Limits::default() }),
        planar("monotone in y", Limits { monotone: vec![[0.0, 1.0, 0.0]], ..Limits::default() }),
        planar("between two lines", Limits { regions: tunnel.to_vec(), ..Limits::default() }),
        planar("length, 1.05 polygons", Limits { stretch: Some(1.05), ..Limits::default() }),
    ]
}

/// Whether the sign of torsion is kept.
fn is_twist(kind: &Kind) -> bool {
    kind.dimension == 3 && kind.limits.shape
}

fn run() -> Result<Outcome> {
    let mut record = Record::new(HEAD, ["yes", "NO"]);
    let mut csv = String::from("limit,sigma,curves,met,infeasible,neither,iterations,most,free_iterations,cost\n");
    record.line(format_args!(
        "{:<34}{:>5}{:>6}{:>12}{:>9}{:>12}{:>16}{:>10}",
        "limit", "σ", "met", "infeasible", "neither", "iterations", "without limits", "cost"
    ));
    let (mut neither, mut twisted, mut broken) = (0, 0, 0);
    for kind in kinds() {
        for sigma in ROUGH {
            let row = Row::of(&kind, sigma)?;
            *(if is_twist(&kind) { &mut twisted } else { &mut neither }) += row.neither;
            broken += row.broken;
            record.line(&row);
            row.write(&mut csv);
        }
    }
    record.line("");
    record.check("every curve that converged keeps its limits", broken == 0);
    let twists = kinds().iter().filter(|kind| is_twist(kind)).count();
    let [all, of_twists] = [kinds().len() - twists, twists].map(|rows| rows * ROUGH.len() * CURVES);
    record.check(
        &format!("{neither} of {all} curves neither keep their limits nor are infeasible, at most 1 of 500"),
        500 * neither <= all,
    );
    record.check(
        &format!("{twisted} of {of_twists} with sides of the twist, which no gradient keeps where curvature vanishes, at most 1 of 10"),
        10 * twisted <= of_twists,
    );
    let of_contours = contours::rows(&mut record)?;
    record.end("it should be");
    let files = vec![record.table, csv, pictures::sheet()?, of_contours, contours::sheet()?];
    Ok(Outcome { agrees: record.agrees, files })
}

const HEAD: &str = "Fair curves that keep limits: bending and 0.1 of the length, and variation,\nbending and length where they twist\n\n\
                    200 open curves a row, of 5 points at unit steps with heights of standard deviation σ. Iterations are medians of\n\
                    the curves that a limit holds, all of them and those without limits; the cost is their median in energy.\n\n";

/// What became of the curves of a row.
struct Row {
    name: &'static str,
    sigma: f64,
    met: usize,
    infeasible: usize,
    neither: usize,
    /// Those that converged and break a limit.
    broken: usize,
    /// Median and 95 % of the iterations, those without limits, and the median cost, of the curves held.
    iterations: [u32; 2],
    free: u32,
    cost: f64,
}

impl Row {
    fn of(kind: &Kind, sigma: f64) -> Result<Row> {
        let energy = match is_twist(kind) {
            true => variation() + bending(2.0) + length(),
            false => bending(2.0) + 0.1 * length(),
        };
        let fair = Fair { energy, segments: Segments::PerSpan(EDGES), ..Fair::default() };
        let batch = rough(kind.dimension, sigma)?;
        let free = fair.fit(&batch, &Device::cpu())?;
        let bounds = kind.part.map(|part| {
            let vertices = free.polylines(Sampling::PerSpan(EDGES));
            let bound = |i: usize| match kind.dimension {
                2 => part * largest_curvature(vertices.points(i).as_chunks::<2>().0),
                _ => part * largest_curvature(vertices.points(i).as_chunks::<3>().0),
            };
            (0..batch.len()).flat_map(|i| [bound(i); POINTS]).collect()
        });
        let batch = batch.with_constraints(Constraints { largest_curvatures: bounds, ..Constraints::default() })?;
        let found = Fair { limits: kind.limits.clone(), ..fair }.fit(&batch, &Device::cpu())?;
        let of = |status| found.reports().iter().filter(|report| report.status == status).count();
        let (met, infeasible) = (of(CurveStatus::Converged), of(CurveStatus::Infeasible));
        let limits = |report: &CurveReport| report.limits.filter(|_| report.status == CurveStatus::Converged);
        let held: Vec<(&CurveReport, u32, f64)> = found
            .reports()
            .iter()
            .zip(free.reports())
            .filter_map(|(report, free)| Some((report, free.iterations, limits(report)?.cost)))
            .filter(|(report, free, _)| report.iterations > *free)
            .collect();
        let sorted = |mut numbers: Vec<u32>| {
            numbers.sort_unstable();
            let at = |part: f64| numbers.get((part * numbers.len() as f64) as usize).copied().unwrap_or(0);
            [at(0.5), at(0.95)]
        };
        let mut costs: Vec<f64> = held.iter().map(|(.., cost)| *cost).filter(|cost| cost.is_finite()).collect();
        costs.sort_unstable_by(f64::total_cmp);
        Ok(Row {
            name: kind.name,
            sigma,
            met,
            infeasible,
            neither: CURVES - met - infeasible,
            broken: found.reports().iter().filter_map(limits).filter(|kept| kept.violation > 0.0).count(),
            iterations: sorted(held.iter().map(|(report, ..)| report.iterations).collect()),
            free: sorted(held.iter().map(|(_, free, _)| *free).collect())[0],
            cost: costs.get(costs.len() / 2).copied().unwrap_or(0.0),
        })
    }

    fn write(&self, csv: &mut String) {
        let Row { name, sigma, met, infeasible, neither, iterations: [half, most], free, cost, .. } = self;
        let _ =
            writeln!(csv, "\"{name}\",{sigma},{CURVES},{met},{infeasible},{neither},{half},{most},{free},{cost:.6}");
    }
}

impl std::fmt::Display for Row {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Row { name, sigma, met, infeasible, neither, iterations: [half, most], free, cost, .. } = self;
        let iterations = format!("{half} to {most}");
        let cost = format!("{:.2} %", 100.0 * cost);
        write!(f, "{name:<34}{sigma:>5}{met:>6}{infeasible:>12}{neither:>9}{iterations:>12}{free:>16}{cost:>10}")
    }
}

/// The largest |T′ − T|/Δa of a polygon.
fn largest_curvature<const D: usize>(vertices: &[[f64; D]]) -> f64 {
    let at = |p: &[f64; D]| DVec3::new(p[0], p[1], p.get(2).copied().unwrap_or(0.0));
    let edges: Vec<DVec3> = vertices.windows(2).map(|ends| at(&ends[1]) - at(&ends[0])).collect();
    let curvature = |pair: &[DVec3]| {
        2.0 * (pair[1].normalize() - pair[0].normalize()).length() / (pair[0].length() + pair[1].length())
    };
    edges.windows(2).map(curvature).fold(0.0, f64::max)
}

/// Rough curves of a dimension.
fn rough(dimension: usize, sigma: f64) -> Result<CurveBatch> {
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let normal = Normal::new(0.0, sigma).expect("a standard deviation is positive");
    let mut coords = Vec::with_capacity(CURVES * POINTS * dimension);
    for k in (0..CURVES).flat_map(|_| 0..POINTS) {
        coords.push(k as f64);
        coords.extend((1..dimension).map(|_| normal.sample(&mut random)));
    }
    CurveBatch::from_ragged(dimension, coords, (0..=CURVES).map(|i| i * POINTS).collect())
}
