//! Contour lines of a made-up landscape, simplified as those of maps are.

use std::collections::HashMap;

use faircurve::{CurveBatch, Result};
use glam::DVec2;

/// The field is 12 by 8, with so many cells a unit.
const SIDES: [usize; 2] = [12, 8];
const CELLS: usize = 12;

/// Hills and hollows: height, the middle, the half-widths along and across, and the angle of the long one.
const HILLS: [[f64; 6]; 9] = [
    [1.0, 3.0, 5.2, 2.4, 1.0, 0.5],
    [0.8, 8.8, 5.4, 2.2, 1.1, -0.6],
    [0.7, 6.2, 2.2, 2.8, 0.8, 0.1],
    [0.5, 1.6, 1.8, 1.0, 0.8, 1.0],
    [0.45, 10.6, 1.6, 1.2, 0.7, 0.9],
    [-0.35, 5.4, 4.3, 0.9, 0.6, 0.3],
    [0.25, 4.4, 6.6, 0.7, 0.35, -0.4],
    [0.25, 7.6, 3.6, 0.9, 0.3, 0.8],
    [-0.2, 9.6, 3.8, 0.6, 0.4, -0.2],
];

/// Heights of the contour lines.
const STEP: f64 = 0.025;
const LEVELS: usize = 48;

/// Lines of fewer vertices before they are simplified are left out.
const LEAST: usize = 24;

/// How points of a contour line are chosen.
#[derive(Clone, Copy)]
pub enum Simplified {
    /// By Douglas and Peucker: no vertex is further from the polygon.
    Within(f64),
    /// One of so many.
    Every(usize),
}

impl std::fmt::Display for Simplified {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Simplified::Within(distance) => write!(f, "Douglas–Peucker, {distance}"),
            Simplified::Every(step) => write!(f, "every {step}th vertex"),
        }
    }
}

fn height(at: DVec2) -> f64 {
    let hill = |[height, x, y, along, across, angle]: [f64; 6]| {
        let away = DVec2::from_angle(-angle).rotate(at - DVec2::new(x, y)) / DVec2::new(along, across);
        height * (-0.5 * away.length_squared()).exp()
    };
    let ripple = 0.02 * ((2.1 * at.x + 0.7 * at.y).sin() + (1.3 * at.x - 2.9 * at.y).cos());
    HILLS.into_iter().map(hill).sum::<f64>() + ripple
}

/// The contour lines, simplified. A closed one does not repeat its first point.
pub fn contours(simplified: Simplified) -> Result<CurveBatch> {
    let lines: Vec<(Vec<DVec2>, bool)> = (1..=LEVELS).flat_map(|k| lines(STEP * k as f64)).collect();
    let mut kept = Vec::new();
    for (line, closed) in lines.into_iter().filter(|(line, _)| line.len() >= LEAST) {
        let mut points = match simplified {
            Simplified::Every(step) => line.iter().copied().step_by(step).collect(),
            Simplified::Within(distance) if closed => {
                // From the vertex that is furthest from the first one, as two lines.
                let far =
                    (0..line.len()).max_by(|&a, &b| line[a].distance(line[0]).total_cmp(&line[b].distance(line[0])));
                let far = far.unwrap_or(0);
                let (mut there, mut back) = (vec![line[0]], vec![line[far]]);
                peucker(&line[..=far], distance, &mut there);
                peucker(&[&line[far..], &line[..1]].concat(), distance, &mut back);
                there.extend(&back[1..back.len() - 1]);
                there
            }
            Simplified::Within(distance) => {
                let mut points = vec![line[0]];
                peucker(&line, distance, &mut points);
                points
            }
        };
        if let (false, Some(last)) = (closed, line.last())
            && points.last() != Some(last)
        {
            points.push(*last);
        }
        if points.len() >= 4 {
            kept.push((points, closed));
        }
    }
    let coords = kept.iter().flat_map(|(points, _)| points).flat_map(|point| point.to_array()).collect();
    let offsets = kept.iter().fold(vec![0], |mut offsets, (points, _)| {
        offsets.push(offsets[offsets.len() - 1] + points.len());
        offsets
    });
    let closed = kept.iter().map(|(_, closed)| *closed).collect();
    CurveBatch::from_ragged(2, coords, offsets)?.closed_each(closed)
}

/// Adds the vertices after the first that are needed.
fn peucker(line: &[DVec2], distance: f64, points: &mut Vec<DVec2>) {
    let (first, last) = (line[0], line[line.len() - 1]);
    let away = |k: usize| {
        let (way, from) = (last - first, line[k] - first);
        way.perp_dot(from).abs() / way.length()
    };
    let furthest = (1..line.len() - 1).max_by(|&a, &b| away(a).total_cmp(&away(b)));
    match furthest.filter(|&k| away(k) > distance) {
        Some(k) => {
            peucker(&line[..=k], distance, points);
            peucker(&line[k..], distance, points);
        }
        None => points.push(last),
    }
}

/// The lines of one level by marching squares, and whether each is closed.
fn lines(level: f64) -> Vec<(Vec<DVec2>, bool)> {
    let at = |x: usize, y: usize| DVec2::new(x as f64, y as f64) / CELLS as f64;
    let [columns, rows] = SIDES.map(|side| side * CELLS);
    let value = |x: usize, y: usize| height(at(x, y)) - level;
    // An edge of the grid is named by its lower end and by whether it goes up. Each meets one line at most.
    type Edge = (usize, usize, bool);
    let place = |(x, y, up): Edge| {
        let (a, b) = (value(x, y), if up { value(x, y + 1) } else { value(x + 1, y) });
        let end = if up { at(x, y + 1) } else { at(x + 1, y) };
        at(x, y).lerp(end, a / (a - b))
    };
    let mut next: HashMap<Edge, Vec<Edge>> = HashMap::new();
    let mut join = |a: Edge, b: Edge| {
        next.entry(a).or_default().push(b);
        next.entry(b).or_default().push(a);
    };
    for y in 0..rows {
        for x in 0..columns {
            let edges = [(x, y, false), (x + 1, y, true), (x, y + 1, false), (x, y, true)];
            let above = [value(x, y), value(x + 1, y), value(x + 1, y + 1), value(x, y + 1)].map(|value| value > 0.0);
            let crossed: Vec<Edge> = (0..4).filter(|&k| above[k] != above[(k + 1) % 4]).map(|k| edges[k]).collect();
            match crossed[..] {
                [a, b] => join(a, b),
                [a, b, c, d] => {
                    join(a, b);
                    join(c, d);
                }
                _ => {}
            }
        }
    }
    let mut starts: Vec<Edge> = next.keys().copied().collect();
    // Ends at the edge of the field first.
    starts.sort_unstable_by_key(|edge| (next[edge].len(), *edge));
    let mut lines = Vec::new();
    for start in starts {
        let Some(ways) = next.remove(&start) else { continue };
        let (mut line, mut here) = (vec![place(start)], ways[0]);
        while let Some(ways) = next.remove(&here) {
            line.push(place(here));
            let Some(onward) = ways.into_iter().find(|edge| next.contains_key(edge)) else { break };
            here = onward;
        }
        lines.push((line, ways.len() == 2));
    }
    lines
}
