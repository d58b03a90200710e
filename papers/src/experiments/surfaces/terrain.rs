//! Paths over a mountain: the fair curve, the shortest path, and the straight way as seen from above.

use std::sync::Arc;

use crate::picture::Sheet;
use faircurve::discrete::{Fair, Pins, Segments, geodesic_bending, length};
use faircurve::io::grids::{self, GridFormat};
use faircurve::surface::{HeightField, Surface};
use faircurve::{CurveBatch, CurveReport, CurveStatus, Device, Result, Sampling};
use glam::DVec3;

use super::Record;
use super::pictures::View;

/// Heights in metres, rows from north to south; NOTICE beside it says whose.
const MOUNTAIN: &str = include_str!("../../../../examples/data/mountain.csv");

/// Metres from column to column and from row to row.
const SPACING: [f64; 2] = [74.5, -92.5];

/// The way, by columns and rows: out of a valley, over the mountain, down a spur, and through the next valley onto a ridge.
const NODES: [[usize; 2]; 6] = [[4, 39], [16, 17], [38, 28], [51, 47], [64, 30], [73, 22]];

/// The picture shows heights so many times as large.
const RAISED: f64 = 2.0;

/// Weight of length against bending, in 1/m². The curve forgets a bend over its root, some 700 m.
const WEIGHT: f64 = 2e-6;

/// Edges between two points.
const SEGMENTS: usize = 48;

/// Three ways through the same points.
pub struct Ways {
    terrain: Arc<HeightField>,
    points: Vec<DVec3>,
    fair: (Vec<DVec3>, CurveReport),
    shortest: (Vec<DVec3>, CurveReport),
    straight: Vec<DVec3>,
}

impl Ways {
    pub fn new() -> Result<Self> {
        let grids = grids::read_from(MOUNTAIN.as_bytes(), GridFormat::Csv)?;
        let field = HeightField::new(grids.shape(0), grids.grid(0).to_vec())?.with_spacing(SPACING)?;
        let terrain = Arc::new(field);
        let at = |x: f64, y: f64| DVec3::new(x, y, terrain.height(x, y));
        let node = |[column, row]: [usize; 2]| at(column as f64 * SPACING[0], row as f64 * SPACING[1]);
        let points: Vec<DVec3> = NODES.into_iter().map(node).collect();
        let coords: Vec<[f64; 3]> = points.iter().map(|x| x.to_array()).collect();
        let batch = CurveBatch::from_slices(&[&coords[..]])?;
        let surface: Arc<dyn Surface> = terrain.clone();
        let fair = Fair {
            energy: geodesic_bending(2.0) + WEIGHT * length(),
            surface: Some(surface),
            segments: Segments::PerSpan(SEGMENTS),
            ..Fair::default()
        };
        // A geodesic from point to point.
        let shortest = Fair { energy: geodesic_bending(2.0), pins: Pins::Ends, corners: Some(0.0), ..fair.clone() };
        let fitted = |fair: &Fair| -> Result<(Vec<DVec3>, CurveReport)> {
            let (fit, samples) = fair.fit_sampled(&batch, Sampling::PerSpan(SEGMENTS), &Device::cpu())?;
            let vertices = samples.points(0).chunks_exact(3).map(DVec3::from_slice).collect();
            Ok((vertices, fit.reports()[0].clone()))
        };
        let (fair, shortest) = (fitted(&fair)?, fitted(&shortest)?);
        let between = |pair: &[DVec3], k: usize| {
            let place = pair[0].lerp(pair[1], k as f64 / SEGMENTS as f64);
            at(place.x, place.y)
        };
        let mut straight = vec![points[0]];
        for pair in points.windows(2) {
            straight.extend((1..=SEGMENTS).map(|k| between(pair, k)));
        }
        Ok(Ways { points, fair, shortest, straight, terrain })
    }

    /// The ways in the table, and what must hold of them.
    pub fn compare(&self, record: &mut Record) {
        let [rows, columns] = self.terrain.shape();
        record.line(format_args!(
            "A path over a mountain: 6 points of a terrain of {rows} × {columns} heights, {SEGMENTS} edges a span."
        ));
        record.line(format_args!(
            "{:<34}{:>12}{:>12}{:>14}{:>14}{:>12}",
            "path", "length in m", "climb in m", "turn in °", "energy in 1/m", "iterations"
        ));
        let rows = [
            (format!("geodesic bending + {WEIGHT:e} length"), &self.fair.0, Some(&self.fair.1)),
            ("shortest from point to point".into(), &self.shortest.0, Some(&self.shortest.1)),
            ("straight as seen from above".into(), &self.straight, None),
        ];
        for (name, way, report) in &rows {
            let found = report.map_or(["-".into(), "-".into()], |report| {
                [format!("{:.3e}", report.energy), report.iterations.to_string()]
            });
            record.line(format_args!(
                "{name:<34}{:>12.1}{:>12.1}{:>14.1}{:>14}{:>12}",
                length_of(way),
                climb_of(way),
                self.turn_of(way).to_degrees(),
                found[0],
                found[1]
            ));
        }
        let reports = [&self.fair.1, &self.shortest.1];
        record.check("both converge", reports.iter().all(|report| report.status == CurveStatus::Converged));
        let off = |way: &Vec<DVec3>| way.iter().map(|x| self.terrain.value(*x).abs()).fold(0.0, f64::max);
        record
            .check("every vertex lies in the terrain to 1e-10 m", off(&self.fair.0).max(off(&self.shortest.0)) < 1e-10);
        let [fair, shortest, straight] = rows.each_ref().map(|(_, way, _)| length_of(way));
        record.check("no way is shorter than the shortest", shortest <= straight && shortest <= fair);
        record.line("");
    }

    /// By how much a way turns within the terrain, in radians.
    fn turn_of(&self, way: &[DVec3]) -> f64 {
        let turn = |triple: &[DVec3]| {
            let normal = self.terrain.gradient(triple[1]).normalize();
            let flat = |v: DVec3| v - v.dot(normal) * normal;
            flat(triple[1] - triple[0]).angle_between(flat(triple[2] - triple[1]))
        };
        way.windows(3).map(turn).sum()
    }

    pub fn sheet(&self) -> Result<String> {
        let [rows, columns] = self.terrain.shape();
        let raise = |x: &DVec3| DVec3::new(x.x, x.y, RAISED * x.z);
        let at = |column: f64, row: f64| {
            let (x, y) = (column * SPACING[0], row * SPACING[1]);
            DVec3::new(x, y, RAISED * self.terrain.height(x, y))
        };
        let heights = (0..rows * columns).map(|k| at((k % columns) as f64, (k / columns) as f64).z).collect();
        let raised = HeightField::new([rows, columns], heights)?.with_spacing(SPACING)?;
        let across = (0..rows).map(|row| (0..2 * columns - 1).map(|k| at(0.5 * k as f64, row as f64)).collect());
        let down = (0..columns).map(|column| (0..2 * rows - 1).map(|k| at(column as f64, 0.5 * k as f64)).collect());
        let lines: Vec<Vec<DVec3>> = across.chain(down).collect();
        let ways = [&self.straight, &self.shortest.0, &self.fair.0];
        let ways = ways.map(|way| way.iter().map(raise).collect::<Vec<DVec3>>());
        let dots: Vec<DVec3> = self.points.iter().map(raise).collect();
        let view = View::from(&raised, DVec3::new(0.3, -1.0, 0.65), columns as f64 * SPACING[0]);
        let panel = view.panel("a path over a mountain, heights doubled", &lines, &ways, &dots);
        let caption =
            "Green: fair. Red: shortest from point to point. Blue: straight as seen from above. Pale: hidden.";
        let title = Some("Curves over terrain".into());
        Ok(Sheet { title, caption: caption.into(), columns: 1, panels: vec![panel], ..Sheet::default() }.draw())
    }
}

fn length_of(way: &[DVec3]) -> f64 {
    way.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
}

fn climb_of(way: &[DVec3]) -> f64 {
    way.windows(2).map(|pair| (pair[1].z - pair[0].z).max(0.0)).sum()
}
