//! The pictures: curves without limits and with them.

use std::f64::consts::TAU;

use crate::picture::{Panel, Sheet, Stroke};
use faircurve::discrete::{Energy, Fair, Limits, Region, Segments, bending, length, tautness};
use faircurve::{CurveBatch, CurveStatus, Device, Result, Sampling};
use glam::DVec2;

/// The curve without limits, that with them, and what it keeps from.
const FREE: [u8; 3] = [169; 3];
const KEPT: [u8; 3] = [0, 114, 178];
const REGION: [u8; 3] = [213, 94, 0];

/// Edges between two points.
const EDGES: usize = 32;

/// A list of points, and what their curve keeps.
struct Scene<'a> {
    title: &'a str,
    points: &'a [[f64; 2]],
    fair: Fair,
}

pub fn sheet() -> Result<String> {
    let limited =
        |energy: Energy, limits: Limits| Fair { energy, limits, segments: Segments::PerSpan(EDGES), ..Fair::default() };
    let bends = || bending(2.0) + 0.1 * length();
    let cup = [[-0.3, 1.2], [0.0, 0.0], [1.5, 0.0], [3.0, 0.15], [3.2, 1.4]];
    let way = [[0.0, 0.0], [1.0, 0.7], [2.0, 0.2], [2.6, 1.3], [3.6, 1.0], [4.4, 0.1], [5.4, 0.6]];
    let zigzag = [[0.0, 0.0], [1.0, 0.8], [2.0, -0.6], [3.0, 0.9], [4.0, 0.0]];
    let steps = [[0.0, 0.0], [1.0, 1.2], [1.3, 1.3], [3.0, 1.35], [3.2, 2.5], [4.0, 2.6]];
    let gates = [[0.0, 0.0], [1.6, 0.5], [4.0, 0.0]];
    let disc = |x: f64, y: f64, radius: f64| Region::Outside { center: [x, y, 0.0], radius };
    let discs = vec![disc(0.8, 0.1, 0.35), disc(2.6, 0.35, 0.4), disc(3.4, -0.2, 0.25)];
    let room = vec![
        Region::Inside { center: [2.0, 0.1, 0.0], radius: 2.1 },
        Region::HalfSpace { normal: [0.0, 1.0, 0.0], offset: 0.95 },
    ];
    let radius = Limits { curvature: Some(1.0 / 0.7), ..Limits::default() };
    let scenes = [
        Scene {
            title: "convex points: turns to one side",
            points: &cup,
            fair: limited(bending(2.0) + 0.01 * length(), Limits { shape: true, ..Limits::default() }),
        },
        Scene {
            title: "a robot's path: radius 0.7, within 0.15 of its points",
            points: &way,
            fair: Fair { deviation: Some(0.15.into()), ..limited(bending(2.0) + tautness(), radius) },
        },
        Scene {
            title: "corridor of half-width 0.1",
            points: &zigzag,
            fair: limited(bends(), Limits { corridor: Some(0.1), ..Limits::default() }),
        },
        Scene {
            title: "stays out of three discs",
            points: &gates,
            fair: limited(bends(), Limits { regions: discs, ..Limits::default() }),
        },
        Scene {
            title: "within a disc and below a line",
            points: &zigzag,
            fair: limited(bends(), Limits { regions: room, ..Limits::default() }),
        },
        Scene {
            title: "steps: y never falls",
            points: &steps,
            fair: limited(bends(), Limits { monotone: vec![[0.0, 1.0, 0.0]], ..Limits::default() }),
        },
        Scene {
            title: "at most 1.05 times its polygon",
            points: &zigzag,
            fair: limited(bending(2.0), Limits { stretch: Some(1.05), ..Limits::default() }),
        },
    ];
    let panels = scenes.iter().map(Scene::panel).collect::<Result<_>>()?;
    Ok(Sheet {
        title: Some("Fair curves that keep limits".into()),
        caption: "Grey: without limits. Blue: with them. Red: what is kept.".into(),
        columns: 3,
        panels,
        ..Sheet::default()
    }
    .draw())
}

impl Scene<'_> {
    fn panel(&self) -> Result<Panel> {
        let batch = CurveBatch::from_slices(&[self.points])?;
        let free = Fair { limits: Limits::default(), ..self.fair.clone() };
        let mut strokes = self.regions();
        for (fair, colour, width, name) in
            [(&free, FREE, 1.4, "without limits"), (&self.fair, KEPT, 2.0, "with limits")]
        {
            let fit = fair.fit(&batch, &Device::cpu())?;
            debug_assert_eq!(fit.reports()[0].status, CurveStatus::Converged, "{}", self.title);
            let vertices = fit.polylines(Sampling::PerSpan(EDGES));
            let points = vertices.points(0).as_chunks::<2>().0.iter().map(|&p| DVec2::from(p)).collect();
            strokes.push(Stroke { points, colour, width, name: Some(name.into()) });
        }
        let dots = self.points.iter().map(|&p| DVec2::from(p)).collect();
        Ok(Panel { title: self.title.into(), strokes, dots, ..Panel::default() })
    }

    /// The edges of regions and of the corridor.
    fn regions(&self) -> Vec<Stroke> {
        let Limits { regions, corridor, .. } = &self.fair.limits;
        let stroke = |points: Vec<DVec2>| Stroke { points, colour: REGION, width: 1.0, name: Some("kept".into()) };
        let circle = |center: DVec2, radius: f64| {
            stroke((0..=64).map(|k| center + radius * DVec2::from_angle(TAU * f64::from(k) / 64.0)).collect())
        };
        let of_region = |region: &Region| match *region {
            Region::Inside { center: [x, y, _], radius } | Region::Outside { center: [x, y, _], radius } => {
                Some(circle(DVec2::new(x, y), radius))
            }
            Region::HalfSpace { normal: [x, y, _], offset } => {
                let normal = DVec2::new(x, y);
                let middle = self.points.iter().map(|&p| DVec2::from(p)).sum::<DVec2>() / self.points.len() as f64;
                let foot = middle + normal * ((offset - normal.dot(middle)) / normal.length_squared());
                Some(stroke([-2.5, 2.5].map(|t| foot + t * normal.perp().normalize()).to_vec()))
            }
            _ => None,
        };
        let chords = self.points.windows(2).zip(corridor.iter().cycle());
        let sides = chords.flat_map(|(ends, &width)| {
            let [from, to] = [ends[0], ends[1]].map(DVec2::from);
            let across = width * (to - from).perp().normalize();
            [across, -across].map(|across| stroke(vec![from + across, to + across]))
        });
        regions.iter().filter_map(of_region).chain(sides).collect()
    }
}
