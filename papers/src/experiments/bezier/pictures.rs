//! The picture: what is known, what is found, and how degree elevation keeps the curve.

use crate::picture::{Axis, Panel, Plot, Series, Sheet, Stroke};
use faircurve::bezier::{Eigenstructure, Energy, Given, Polygons, complete, elevate, evaluate};
use faircurve::{Device, Result};
use glam::DVec2;

/// Okabe and Ito's blue, vermilion, green and grey.
const CURVE: [u8; 3] = [0, 114, 178];
const OTHER: [u8; 3] = [213, 94, 0];
const THIRD: [u8; 3] = [0, 158, 115];
const POLYGON: [u8; 3] = [150, 150, 150];

/// Points of a curve drawn.
const SAMPLES: u32 = 120;

/// Pixels.
const WIDTH: f64 = 1200.0;

/// A decic that winds, for panels with some of its points left out.
const DECIC: [[f64; 2]; 11] = [
    [0.0, 0.0],
    [0.5, 2.5],
    [2.0, 3.0],
    [3.0, -1.5],
    [4.5, -2.0],
    [5.0, 3.0],
    [6.5, 3.5],
    [7.5, -1.0],
    [9.0, -1.5],
    [9.5, 1.0],
    [10.0, 0.0],
];

pub fn sheet() -> Result<String> {
    let cubic = [[0.0, 0.0], [1.0, 2.5], [f64::NAN; 2], [4.0, 0.0]];
    let quintic = [[0.0, 0.0], [0.8, 1.8], [f64::NAN; 2], [f64::NAN; 2], [3.6, 1.6], [4.0, 0.0]];
    let panels = vec![
        completed("d = 3, both ends known: the elevated line", &cubic, &[0, 3])?,
        completed("d = 3, P₀, P₁, P₃ known: P₂ = (P₁ + P₃)/2", &cubic, &[0, 1, 3])?,
        completed("d = 5, two known at each end: a cubic", &quintic, &[0, 1, 4, 5])?,
        patterns()?,
        orders()?,
        elevated()?,
    ];
    Ok(Sheet {
        title: Some("Bézier curves of least bending energy".into()),
        caption: "Dots are the known control points; thin lines are control polygons.".into(),
        width: WIDTH,
        columns: 3,
        panels,
        plots: vec![cubic_modes()?, spectrum()?],
    }
    .draw())
}

/// Control points and curve, the points not listed having least energy.
fn solved(points: &[[f64; 2]], known: &[usize], energy: Energy) -> Result<(Vec<DVec2>, Vec<DVec2>)> {
    let known: Vec<bool> = (0..points.len()).map(|i| known.contains(&i)).collect();
    let offsets = [0, points.len()];
    let polygons = Polygons { dimension: 2, coords: points.as_flattened(), offsets: &offsets };
    let given = Given { known: Some(&known), ..Given::default() };
    let coords = complete(&polygons, &given, &energy, &Device::cpu())?.coords;
    let curve = curve(&Polygons { coords: &coords, ..polygons })?;
    Ok((vectors(&coords), curve))
}

fn curve(polygons: &Polygons) -> Result<Vec<DVec2>> {
    let parameters: Vec<f64> = (0..=SAMPLES).map(|k| f64::from(k) / f64::from(SAMPLES)).collect();
    Ok(vectors(&evaluate(polygons, &parameters, &Device::cpu())?.coords))
}

fn vectors(coords: &[f64]) -> Vec<DVec2> {
    coords.chunks_exact(2).map(|p| DVec2::new(p[0], p[1])).collect()
}

fn thin(points: Vec<DVec2>) -> Stroke {
    Stroke { points, colour: POLYGON, width: 0.8, name: Some("control polygon".into()) }
}

fn bold(points: Vec<DVec2>, colour: [u8; 3], name: &str) -> Stroke {
    Stroke { points, colour, width: 2.0, name: Some(name.into()) }
}

fn dots(points: &[[f64; 2]], known: &[usize]) -> Vec<DVec2> {
    known.iter().map(|&k| DVec2::from(points[k])).collect()
}

fn completed(title: &str, points: &[[f64; 2]], known: &[usize]) -> Result<Panel> {
    let (polygon, curve) = solved(points, known, Energy::bending())?;
    let strokes = vec![thin(polygon), bold(curve, CURVE, "least bending")];
    Ok(Panel { title: title.into(), strokes, dots: dots(points, known), ..Panel::default() })
}

/// The decic with all, half, and few of its points.
fn patterns() -> Result<Panel> {
    let mut strokes = Vec::new();
    let few = [0, 3, 7, 10];
    for (known, colour, name) in [
        (&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10][..], POLYGON, "all points known"),
        (&[0, 1, 2, 5, 8, 9, 10], OTHER, "seven of eleven known"),
        (&few, CURVE, "least bending"),
    ] {
        strokes.push(bold(solved(&DECIC, known, Energy::bending())?.1, colour, name));
    }
    Ok(Panel {
        title: "d = 10: all points, seven, four (dots) known".into(),
        strokes,
        dots: dots(&DECIC, &few),
        ..Panel::default()
    })
}

fn orders() -> Result<Panel> {
    let known = [0, 2, 5, 8, 10];
    let mut strokes = Vec::new();
    for (order, colour, name) in [(1, OTHER, "least ∫|X′|²"), (2, CURVE, "least bending"), (3, THIRD, "least ∫|X‴|²")]
    {
        strokes.push(bold(solved(&DECIC, &known, Energy::of_order(order))?.1, colour, name));
    }
    Ok(Panel {
        title: "d = 10, five known: least of three energies".into(),
        strokes,
        dots: dots(&DECIC, &known),
        ..Panel::default()
    })
}

/// Control polygons of higher degrees come nearer to the curve that they all have.
fn elevated() -> Result<Panel> {
    let points = [[0.0, 0.0], [0.5, 3.0], [3.5, -2.0], [4.0, 1.0]];
    let offsets = [0, 4];
    let polygons = Polygons { dimension: 2, coords: points.as_flattened(), offsets: &offsets };
    let mut strokes = Vec::new();
    for by in [0, 1, 2, 4, 8, 16, 27] {
        strokes.push(thin(vectors(&elevate(&polygons, by, &Device::cpu())?.coords)));
    }
    strokes.push(bold(curve(&polygons)?, CURVE, "least bending"));
    Ok(Panel {
        title: "One cubic, degrees 3, 4, 5, 7, 11, 19, 30".into(),
        strokes,
        dots: dots(&points, &[0, 1, 2, 3]),
        ..Panel::default()
    })
}

fn cubic_modes() -> Result<Plot> {
    let cubic = Eigenstructure::new(3, &Energy::bending())?;
    let series = cubic.values.iter().zip(&cubic.vectors).enumerate().map(|(k, (value, vector))| Series {
        name: format!("V{k}, eigenvalue {:.0}", value / 6.0),
        points: vector.iter().enumerate().map(|(i, &x)| DVec2::new(i as f64, x)).collect(),
    });
    Ok(Plot {
        title: "Eigenvectors of M/6, d = 3".into(),
        x: Axis::linear("control point"),
        y: Axis::linear("entry"),
        series: series.collect(),
    })
}

fn spectrum() -> Result<Plot> {
    let series = [3, 5, 10, 20, 30].into_iter().map(|degree| {
        let structure = Eigenstructure::new(degree, &Energy::bending())?;
        let values = structure.values.iter().enumerate();
        let points = values.map(|(k, &value)| DVec2::new(k as f64 + 1.0, value)).collect();
        Ok(Series { name: format!("d = {degree}"), points })
    });
    Ok(Plot {
        title: "Eigenvalues of M but for the zeros".into(),
        x: Axis::linear("number"),
        y: Axis::log("eigenvalue"),
        series: series.collect::<Result<_>>()?,
    })
}
