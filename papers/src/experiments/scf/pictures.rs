//! The figures.

use std::f64::consts::{FRAC_PI_4, PI, TAU};

use crate::picture::{Axis, Panel, Plot, Series, Sheet, Stroke, panel_of_evolution, panel_of_fan, thousands};
use crate::searches::Record;
use faircurve::scf::Segment;
use glam::DVec2;

use super::Shape;
use super::searches::{Case, Run};

/// Exponents of the fans.
const FANS: [f64; 5] = [1.1, 1.5, 2.0, 4.0, 20.0];

/// Directions at the start of every segment of the fans.
const FROM: f64 = FRAC_PI_4;

/// Steps of the end angle a turn, and how many end angles lie below half a turn to either side.
const STEPS: i32 = 45;
const SIDE: i32 = (STEPS - 1) / 2;

/// End angle of the panel that compares exponents.
const COMPARED: f64 = 5.0 * PI / 12.0;

/// Pixels.
const WIDTH: f64 = 1300.0;

/// Polylines keep within this part of their dots' size.
const TOLERANCE: f64 = 2e-4;

/// Figure 2: segments of unit chord.
pub fn fans() -> String {
    let segment = |exponent, angle| -> Option<Vec<DVec2>> {
        let polyline = Segment::between(1.0, [FROM, angle], exponent)?.polyline(TOLERANCE);
        Some(polyline.into_iter().map(DVec2::from).collect())
    };
    let fan = |exponent: f64| {
        let angles = (-SIDE..=SIDE).map(|k| TAU * f64::from(k) / f64::from(STEPS));
        let segments: Vec<(f64, Vec<DVec2>)> =
            angles.filter_map(|angle| Some((angle, segment(exponent, angle)?))).collect();
        panel_of_fan(format!("ν = {exponent}: {} of {} end angles", segments.len(), 2 * SIDE + 1), &segments)
    };
    let stroke = |(exponent, colour): (f64, [u8; 3])| {
        let (points, name) = (segment(exponent, COMPARED)?, Some(format!("ν = {exponent}")));
        Some(Stroke { points, colour, width: 1.6, name })
    };
    let compared = Panel {
        title: format!("every ν, end angle {:.0}°", COMPARED.to_degrees()),
        strokes: FANS.into_iter().zip(COLOURS).filter_map(stroke).collect(),
        dots: vec![DVec2::ZERO, DVec2::X],
        room: 2.0,
        bar: None,
    };
    Sheet {
        title: Some("Smooth connection functions that start at 45° from their chord".into()),
        caption: format!(
            "End angles, too, are measured from the chord, in steps of {}°; where there is no minimiser no curve is \
             drawn.",
            360 / STEPS
        ),
        width: WIDTH,
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
        let dots = shape.points.len();
        for case in cases {
            let moves = case.greedy.outcome.iterations;
            let ending = if case.has_minimum() { "" } else { "no minimum found after " };
            let title = format!("{dots} dots, ν = {}: {ending}{moves} moves", case.exponent);
            panels.push(evolution(title, shape, case.exponent, &case.moved));
        }
        let series = |case: &Case| Series {
            name: format!("ν = {}", case.exponent),
            points: relative(case, &case.greedy, |record| record.iterations),
        };
        plots.push(Plot {
            title: format!("{dots} dots"),
            x: Axis::linear("moves"),
            y: Axis::linear("cost / first cost"),
            series: cases.iter().map(series).collect(),
        });
    }
    Sheet {
        title: Some("Joining few dots: the greedy search moves one slope at a time by 0.01".into()),
        caption: "The first slopes are the directions between neighbours. Between the first and the last curve others are \
                  shown at even numbers of moves. Three dots with ν = 2 have no minimum: the curve grows until a segment \
                  exists no more."
            .into(),
        width: WIDTH,
        columns: 3,
        panels,
        plots,
    }
    .draw()
}

/// Figures 4 and 5: the octopus.
pub fn octopus(shapes: &[Shape], cases: &[Vec<Case>]) -> String {
    let mut panels = Vec::new();
    let mut plots = Vec::new();
    for (shape, case) in shapes.iter().zip(cases).flat_map(|(shape, cases)| cases.iter().map(move |case| (shape, case)))
    {
        let title = format!("{} dots, ν = {}", shape.points.len(), case.exponent);
        let candidates = thousands(case.adaptation.outcome.iterations);
        let ending = if case.has_minimum() { "" } else { "no minimum found after " };
        let slopes: Vec<Vec<f64>> =
            case.adaptation.outcome.snapshots.iter().map(|snapshot| snapshot.slopes.clone()).collect();
        panels.push(evolution(format!("{title}: {ending}{candidates} candidates"), shape, case.exponent, &slopes));
        let methods = [("Gaussian Adaptation", &case.adaptation), ("greedy", &case.greedy), ("Newton", &case.newton)];
        let series = methods.map(|(name, run)| Series {
            name: name.into(),
            points: relative(case, run, |record| record.segment_solves),
        });
        let label = "cost / first cost";
        plots.push(Plot {
            title,
            x: Axis::log("segments evaluated"),
            // With large exponents costs fall by orders of magnitude.
            y: if case.exponent > 4.0 { Axis::log(label) } else { Axis::linear(label) },
            series: series.into(),
        });
    }
    Sheet {
        title: Some("Joining the dots of an octopus: Gaussian Adaptation".into()),
        caption: "Curves are the best after 1, 2, 4, 8 … candidates. Both searches start from the directions between \
                  neighbours, whose cost is the unit; Newton's method, for comparison, from circles through neighbouring \
                  dots."
            .into(),
        width: WIDTH,
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

fn evolution(title: String, shape: &Shape, exponent: f64, slopes: &[Vec<f64>]) -> Panel {
    let curves: Vec<Vec<DVec2>> = slopes.iter().map(|slopes| curve(shape, exponent, slopes)).collect();
    Panel { room: 0.5, ..panel_of_evolution(title, &shape.points, &curves) }
}

/// The curve with these slopes; straight where there is no segment.
fn curve(shape: &Shape, exponent: f64, slopes: &[f64]) -> Vec<DVec2> {
    let points = &shape.points;
    let (low, high) = points.iter().fold((points[0], points[0]), |(low, high), &p| (low.min(p), high.max(p)));
    let tolerance = TOLERANCE * (high - low).max_element();
    let mut vertices = vec![points[0]];
    for k in 0..shape.segments() {
        let ([before, after], chord, angles) = shape.segment(k, slopes);
        if let Some(segment) = Segment::between(chord.length(), angles, exponent) {
            let along = chord / chord.length();
            let inner = segment.polyline(tolerance).into_iter().skip(1);
            vertices.extend(inner.map(|p| points[before] + along.rotate(DVec2::from(p))));
        } else {
            vertices.push(points[after]);
        }
    }
    vertices
}
