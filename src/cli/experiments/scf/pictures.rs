//! The figures.

use std::f64::consts::{FRAC_PI_4, PI, TAU};

use faircurve::picture::{Axis, Panel, Plot, Series, Sheet, Stroke};
use faircurve::scf::Segment;
use faircurve::scf::search::Record;
use glam::DVec2;

use super::Shape;
use super::searches::{Case, Run};

/// Exponents of the fans.
const FANS: [f64; 5] = [1.1, 1.5, 2.0, 4.0, 20.0];

/// Directions at the start of every segment of the fans.
const FROM: f64 = FRAC_PI_4;

/// Steps of the end angle a turn.
const STEPS: i32 = 48;

/// End angle of the panel that compares exponents.
const COMPARED: f64 = -FRAC_PI_4;

/// Polylines keep within this part of their dots' size.
const TOLERANCE: f64 = 2e-4;

/// Figure 2: segments of unit chord.
pub fn fans() -> String {
    let segment = |exponent, angle| -> Option<Vec<DVec2>> {
        let polyline = Segment::between(1.0, [FROM, angle], exponent)?.polyline(TOLERANCE);
        Some(polyline.into_iter().map(DVec2::from).collect())
    };
    let fan = |exponent: f64| {
        let angles = (1 - STEPS / 2..STEPS / 2).map(|k| TAU * f64::from(k) / f64::from(STEPS));
        let segments: Vec<(f64, Vec<DVec2>)> =
            angles.filter_map(|angle| Some((angle, segment(exponent, angle)?))).collect();
        Panel::fan(format!("ν = {exponent}: {} segments", segments.len()), &segments)
    };
    let stroke = |(exponent, colour): (f64, [u8; 3])| {
        let (points, name) = (segment(exponent, COMPARED)?, Some(format!("ν = {exponent}")));
        Some(Stroke { points, colour, width: 1.6, name })
    };
    let compared = Panel {
        title: "one pair of angles, every ν".into(),
        strokes: FANS.into_iter().zip(COLOURS).filter_map(stroke).collect(),
        dots: vec![DVec2::ZERO, DVec2::X],
        room: 2.0,
        bar: None,
    };
    Sheet {
        title: Some("Smooth connection functions that start at 45° from their chord".into()),
        caption: format!(
            "End angles in steps of {:.1}°, from the chord; missing are those that have no minimiser. Last panel: from 45° to {}°.",
            (TAU / f64::from(STEPS)).to_degrees(),
            COMPARED.to_degrees().round()
        ),
        columns: 3,
        panels: FANS.into_iter().map(fan).chain([compared]).collect(),
        ..Sheet::default()
    }
    .draw()
}

/// Okabe and Ito's palette, darkest first.
const COLOURS: [[u8; 3]; 5] = [[0, 0, 0], [0, 114, 178], [0, 158, 115], [230, 159, 0], [213, 94, 0]];

/// Figure 3: the greedy search on few dots.
pub fn figure_3(shapes: &[Shape], cases: &[Vec<Case>]) -> String {
    let mut panels = Vec::new();
    let mut plots = Vec::new();
    for (shape, cases) in shapes.iter().zip(cases) {
        for case in cases {
            let moves = case.greedy.outcome.iterations;
            let title = format!("{} dots, ν = {}: {moves} moves", shape.points.len(), case.exponent);
            let title = if case.has_minimum() { title } else { format!("{title}, no minimum (stopped)") };
            panels.push(evolution(title, shape, case.exponent, &case.greedy));
        }
        let series = |case: &Case| Series {
            name: format!("ν = {}", case.exponent),
            points: relative(case, &case.greedy, |record| record.iterations),
        };
        plots.push(Plot {
            title: format!("{} dots", shape.points.len()),
            x: Axis::linear("moves"),
            y: Axis::linear("cost / first cost"),
            series: cases.iter().map(series).collect(),
        });
    }
    Sheet {
        title: Some("Joining few dots: the greedy search, slopes moved by 0.01 one at a time".into()),
        columns: 3,
        panels,
        plots,
        ..Sheet::default()
    }
    .draw()
}

/// Figures 4 and 5: the octopus.
pub fn octopus(shapes: &[Shape], cases: &[Vec<Case>]) -> String {
    let mut panels = Vec::new();
    let mut plots = Vec::new();
    for (shape, cases) in shapes.iter().zip(cases) {
        let dots = shape.points.len();
        for case in cases {
            let candidates = case.adaptation.outcome.iterations;
            let title = format!("{dots} dots, ν = {}: {candidates} candidates", case.exponent);
            panels.push(evolution(title, shape, case.exponent, &case.adaptation));
        }
        let series = |case: &Case| {
            [("Gaussian Ad.", &case.adaptation), ("greedy", &case.greedy), ("Newton", &case.newton)].map(
                |(name, run)| Series {
                    name: format!("{name}, ν = {}", case.exponent),
                    points: relative(case, run, |record| record.segment_solves),
                },
            )
        };
        plots.push(Plot {
            title: format!("{dots} dots"),
            x: Axis::log("segments evaluated"),
            y: Axis::linear("cost / first cost"),
            series: cases.iter().flat_map(series).collect(),
        });
    }
    Sheet {
        title: Some("Joining the dots of an octopus: Gaussian Adaptation".into()),
        caption: "Both searches start from the directions between neighbours, whose cost is the unit; Newton's method from circles \
                  through neighbouring dots."
            .into(),
        panels,
        plots,
        ..Sheet::default()
    }
    .draw()
}

/// The cost over a count, in units of the first slopes' cost.
fn relative(case: &Case, run: &Run, count: impl Fn(&Record) -> usize) -> Vec<DVec2> {
    let unit = case.first_cost();
    run.outcome.history.iter().map(|record| DVec2::new(count(record) as f64, record.cost / unit)).collect()
}

fn evolution(title: String, shape: &Shape, exponent: f64, run: &Run) -> Panel {
    let curves: Vec<Vec<DVec2>> =
        run.outcome.snapshots.iter().map(|snapshot| curve(shape, exponent, &snapshot.slopes)).collect();
    Panel::evolution(title, &shape.points, &curves)
}

/// The curve with these slopes; straight where there is no segment.
fn curve(shape: &Shape, exponent: f64, slopes: &[f64]) -> Vec<DVec2> {
    let points = &shape.points;
    let (low, high) = points.iter().fold((points[0], points[0]), |(low, high), &p| (low.min(p), high.max(p)));
    let tolerance = TOLERANCE * (high - low).max_element();
    let mut vertices = vec![points[0]];
    for k in 0..if shape.closed { points.len() } else { points.len() - 1 } {
        let after = (k + 1) % points.len();
        let chord = points[after] - points[k];
        let angles = [slopes[k], slopes[after]].map(|slope| wrapped(slope - chord.to_angle()));
        if let Some(segment) = Segment::between(chord.length(), angles, exponent) {
            let along = chord / chord.length();
            let inner = segment.polyline(tolerance).into_iter().skip(1);
            vertices.extend(inner.map(|p| points[k] + along.rotate(DVec2::from(p))));
        } else {
            vertices.push(points[after]);
        }
    }
    vertices
}

/// An angle, from −π to π.
fn wrapped(angle: f64) -> f64 {
    (angle - TAU * (angle / TAU).round()).clamp(-PI, PI)
}
