//! The pictures: surfaces by their lines, with what they hide left out, and curves in them.

use std::f64::consts::TAU;
use std::sync::Arc;

use crate::picture::{Panel, Sheet, Stroke};
use faircurve::discrete::{Fair, Segments, geodesic_bending, length};
use faircurve::surface::{Quadric, Surface, Torus};
use faircurve::{CurveBatch, Device, Result, Sampling};
use glam::{DVec2, DVec3};

use super::{TRACK, closed, curve, descend, turn_to, turned, unit};

/// Lines of the surface, and curves.
const LINES: [u8; 3] = [190; 3];
const COLOURS: [[u8; 3]; 4] = [[0, 114, 178], [213, 94, 0], [0, 158, 115], [204, 121, 167]];

/// The part of a hidden curve's colour that is left.
const PALE: f64 = 0.3;

/// A parallel view of a surface.
pub struct View<'a> {
    surface: &'a dyn Surface,
    /// To the right, up, and towards the eye.
    axes: [DVec3; 3],
    /// The width of the surface.
    size: f64,
}

impl<'a> View<'a> {
    /// From a direction, with z upwards.
    pub fn from(surface: &'a dyn Surface, eye: DVec3, size: f64) -> Self {
        let towards = eye.normalize();
        let right = DVec3::Z.cross(towards).normalize_or(DVec3::X);
        View { surface, axes: [right, towards.cross(right), towards], size }
    }

    /// In units of the size.
    fn project(&self, x: DVec3) -> DVec2 {
        DVec2::new(x.dot(self.axes[0]), x.dot(self.axes[1])) / self.size
    }

    /// Whether a point of the surface is seen: its side faces the eye, and the way there passes through nothing.
    fn sees(&self, x: DVec3) -> bool {
        let towards = self.axes[2];
        let steps = 200;
        // Where a surface is not known it hides nothing.
        let hides = |x: DVec3| self.surface.value(x) < 0.0 && self.surface.undefined(x).is_none();
        let enters = (1..=steps).any(|k| hides(x + self.size * f64::from(k) / f64::from(steps) * towards));
        self.surface.gradient(x).dot(towards) > 0.0 && !enters
    }

    /// A line of points of the surface as strokes of what is seen, and of what is not where it has a colour for that.
    fn strokes(&self, line: &[DVec3], colour: [u8; 3], width: f64, hidden: Option<[u8; 3]>, out: &mut Vec<Stroke>) {
        let is_seen: Vec<bool> = line.iter().map(|x| self.sees(*x)).collect();
        let mut start = 0;
        for k in 1..=line.len() {
            if k < line.len() && is_seen[k] == is_seen[start] {
                continue;
            }
            let points = line[start..(k + 1).min(line.len())].iter().map(|x| self.project(*x)).collect();
            let shown = if is_seen[start] { Some((colour, width)) } else { hidden.map(|pale| (pale, 0.6 * width)) };
            out.extend(shown.map(|(colour, width)| Stroke { points, colour, width, name: None }));
            start = k;
        }
    }

    fn curve(&self, line: &[DVec3], which: usize, out: &mut Vec<Stroke>) {
        let colour = COLOURS[which % COLOURS.len()];
        let pale = colour.map(|c| (255.0 - PALE * (255.0 - f64::from(c))) as u8);
        self.strokes(line, colour, 1.8, Some(pale), out);
    }

    /// A panel of the surface's lines and some curves.
    pub fn panel(&self, title: &str, lines: &[Vec<DVec3>], curves: &[Vec<DVec3>], dots: &[DVec3]) -> Panel {
        let mut strokes = Vec::new();
        lines.iter().for_each(|line| self.strokes(line, LINES, 0.5, None, &mut strokes));
        curves.iter().enumerate().for_each(|(k, curve)| self.curve(curve, k, &mut strokes));
        let dots = dots.iter().filter(|x| self.sees(**x)).map(|x| self.project(*x)).collect();
        Panel { title: title.into(), strokes, dots, room: 10.0, ..Panel::default() }
    }
}

/// Meridians and parallels of an ellipsoid.
fn grid(axes: DVec3) -> Vec<Vec<DVec3>> {
    let at = |lat: f64, lon: f64| axes * DVec3::new(lat.cos() * lon.cos(), lat.cos() * lon.sin(), lat.sin());
    let turn = |k: usize, of: usize| TAU * k as f64 / of as f64;
    let meridians = (0..12).map(|m| (0..=180).map(|k| at(turn(k, 360) - 0.25 * TAU, turn(m, 12))).collect());
    let parallels = (1..6).map(|p| (0..=360).map(|k| at(turn(p, 12) - 0.25 * TAU, turn(k, 360))).collect());
    meridians.chain(parallels).collect()
}

fn torus_grid() -> Vec<Vec<DVec3>> {
    let at = |u: f64, v: f64| {
        let out = 2.0 + u.cos();
        DVec3::new(out * v.cos(), out * v.sin(), u.sin())
    };
    let turn = |k: usize, of: usize| TAU * k as f64 / of as f64;
    let tubes = (0..24).map(|m| (0..=180).map(|k| at(turn(k, 180), turn(m, 24))).collect());
    let rounds = (0..12).map(|p| (0..=240).map(|k| at(turn(p, 12), turn(k, 240))).collect());
    tubes.chain(rounds).collect()
}

pub fn sheet() -> Result<String> {
    let panels = vec![torus()?, ellipsoid()?, elastic()?, tracks()?, flat()?, cone()?];
    Ok(Sheet {
        title: Some("Fair curves in surfaces".into()),
        caption: "Pale: behind the surface. Tracks: blue as given, red turned to 60° north, green over the pole."
            .into(),
        columns: 3,
        panels,
        ..Sheet::default()
    }
    .draw())
}

fn ring(mut vertices: Vec<DVec3>) -> Vec<DVec3> {
    vertices.push(vertices[0]);
    vertices
}

fn torus() -> Result<Panel> {
    let mut curves = Vec::new();
    for own in closed().iter().filter(|own| own.name.contains("round")) {
        curves.push(ring(descend(&own.surface, &*own.start, 256)?.0));
    }
    let surface = Torus::new(2.0, 1.0).expect("R > r");
    Ok(View::from(&surface, DVec3::new(0.5, -1.0, 1.1), 6.0).panel(
        "closed geodesics of a torus",
        &torus_grid(),
        &curves,
        &[],
    ))
}

fn ellipsoid() -> Result<Panel> {
    let axes = DVec3::new(1.3, 1.1, 1.0);
    let surface: Arc<dyn Surface> = Arc::new(Quadric::ellipsoid(axes));
    let mut curves = Vec::new();
    for flat in 0..3 {
        let start = move |s: f64| {
            let mut x = [0.0; 3];
            x[(flat + 1) % 3] = s.cos();
            x[(flat + 2) % 3] = s.sin();
            x[flat] = 0.1 * (3.0 * s).sin();
            DVec3::from_array(x) * axes
        };
        curves.push(ring(descend(&surface, &start, 256)?.0));
    }
    let view = View::from(&*surface, DVec3::new(1.0, -1.3, 0.8), 2.5);
    Ok(view.panel("the three ellipses of an ellipsoid", &grid(axes), &curves, &[]))
}

/// The curve of an energy through points of a surface.
fn through(surface: &Arc<dyn Surface>, points: &[DVec3], weight: f64) -> Result<Vec<DVec3>> {
    let coords: Vec<[f64; 3]> = points.iter().map(|x| x.to_array()).collect();
    let fair = Fair {
        energy: geodesic_bending(2.0) + weight * length(),
        surface: Some(surface.clone()),
        segments: Segments::PerSpan(32),
        ..Fair::default()
    };
    let batch = CurveBatch::from_slices(&[&coords[..]])?;
    let (_, samples) = fair.fit_sampled(&batch, Sampling::PerSpan(32), &Device::cpu())?;
    Ok(samples.points(0).chunks_exact(3).map(DVec3::from_slice).collect())
}

fn elastic() -> Result<Panel> {
    let surface: Arc<dyn Surface> = Arc::new(Quadric::sphere(1.0));
    let points = [[-55.0, -10.0], [-25.0, 35.0], [5.0, -20.0], [35.0, 30.0], [60.0, 0.0]]
        .map(|[lon, lat]| unit().place(lon, lat));
    let curves = [0.0, 3.0, 30.0].map(|weight| through(&surface, &points, weight));
    let curves = curves.into_iter().collect::<Result<Vec<_>>>()?;
    let view = View::from(&*surface, DVec3::new(1.0, 0.0, 0.35), 2.0);
    Ok(view.panel("elastic curves: length 0, 3, 30", &grid(DVec3::ONE), &curves, &points))
}

fn tracks() -> Result<Panel> {
    let surface = Quadric::sphere(1.0);
    let mut curves = vec![curve(&TRACK, true)?];
    for latitude in [60.0, 90.0] {
        curves.push(curve(&turned(&TRACK, turn_to(2.0, latitude)), true)?);
    }
    let view = View::from(&surface, DVec3::new(1.0, 0.05, 0.9), 2.0);
    Ok(view.panel("tracks turned with the globe", &grid(DVec3::ONE), &curves, &[]))
}

fn flat() -> Result<Panel> {
    let surface = Quadric::sphere(1.0);
    let mut curves = vec![curve(&TRACK, false)?];
    for latitude in [60.0, 90.0] {
        curves.push(curve(&turned(&TRACK, turn_to(2.0, latitude)), false)?);
    }
    let view = View::from(&surface, DVec3::new(1.0, 0.05, 0.9), 2.0);
    Ok(view.panel("the same, fitted in flat degrees", &grid(DVec3::ONE), &curves, &[]))
}

fn cone() -> Result<Panel> {
    let slope = f64::to_radians(25.0).tan();
    let surface: Arc<dyn Surface> = Arc::new(Quadric::cone(25.0_f64.to_radians()));
    let at = |height: f64, degrees: f64| {
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        DVec3::new(-height * slope * cos, -height * slope * sin, -height)
    };
    let points = [at(1.0, -130.0), at(1.8, -60.0), at(1.2, 0.0), at(2.0, 60.0), at(1.3, 130.0)];
    let curves = vec![through(&surface, &points, 3.0)?, through(&surface, &points, 30.0)?];
    let lines = (0..18).map(|k| (1..=60).map(|h| at(2.4 * f64::from(h) / 60.0, 20.0 * f64::from(k))).collect());
    let rounds = (1..=6).map(|h| (0..=120).map(|k| at(0.4 * f64::from(h), 3.0 * f64::from(k))).collect());
    let lines: Vec<Vec<DVec3>> = lines.chain(rounds).collect();
    let view = View::from(&*surface, DVec3::new(-1.0, 0.1, 0.35), 2.4);
    Ok(view.panel("elastic curves of a cone: length 3, 30", &lines, &curves, &points))
}
