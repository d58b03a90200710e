//! A. Alon and S. Bergmann, *Connecting points by smooth connection functions defines shapes in the
//! smoothest possible way*: figures 2 to 5 drawn anew, and the searches of the paper beside
//! Newton's method.

mod pictures;
mod searches;

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

use faircurve::{Error, Result};
use glam::DVec2;
use rayon::prelude::*;
use serde::Deserialize;

use self::searches::Case;
use super::{Experiment, Outcome};

const FILES: [&str; 5] = ["scf.txt", "scf.csv", "scf-fans.svg", "scf-dots.svg", "scf-octopus.svg"];

pub const EXPERIMENT: Experiment = Experiment { name: "scf", files: &FILES, run };

/// A search that ends lower than Newton's method by more than this part of the cost has found
/// another minimum.
const LOWER: f64 = 1e-6;

/// A search whose cost still falls by more than this part of itself a radian of some slope has
/// found no minimum.
const STEEP: f64 = 1e-3;

/// The lists of points: those of figure 3, then both of the octopus.
const FIGURE_3: &str = include_str!("../../../../examples/data/dots.csv");
const OCTOPUS: &str = include_str!("../../../../examples/data/octopus.csv");

/// Exponents of figure 3, and of figures 4 and 5.
const FEW_DOTS: &[f64] = &[2.0, 4.0, 20.0];
const MANY_DOTS: &[f64] = &[2.0, 20.0];

/// Dots to be joined.
struct Shape {
    name: String,
    points: Vec<DVec2>,
    closed: bool,
}

#[derive(Deserialize)]
struct Row {
    curve: String,
    x: f64,
    y: f64,
    closed: u8,
}

impl Shape {
    fn read(file: &str) -> Result<Vec<Self>> {
        let mut shapes: Vec<Shape> = Vec::new();
        for row in csv::Reader::from_reader(file.as_bytes()).into_deserialize() {
            let Row { curve, x, y, closed } =
                row.map_err(|error| Error::argument(format!("the dots of scf: {error}")))?;
            match shapes.last_mut() {
                Some(shape) if shape.name == curve => shape.points.push(DVec2::new(x, y)),
                _ => shapes.push(Shape { closed: closed == 1, name: curve, points: vec![DVec2::new(x, y)] }),
            }
        }
        Ok(shapes)
    }

    fn segments(&self) -> usize {
        if self.closed { self.points.len() } else { self.points.len() - 1 }
    }

    /// The dots that a segment joins, by number, its chord, and the angles of these slopes from it.
    fn segment(&self, k: usize, slopes: &[f64]) -> ([usize; 2], DVec2, [f64; 2]) {
        let dots = [k, (k + 1) % self.points.len()];
        let [first, last] = dots.map(|dot| self.points[dot]);
        let chord = last - first;
        let from_chord = |dot: usize| {
            let angle = slopes[dot] - chord.to_angle();
            (angle - TAU * (angle / TAU).round()).clamp(-PI, PI)
        };
        (dots, chord, dots.map(from_chord))
    }
}

fn run() -> Result<Outcome> {
    let (few, many) = (Shape::read(FIGURE_3)?, Shape::read(OCTOPUS)?);
    let cases = |shapes: &[Shape], exponents: &[f64]| -> Result<Vec<Vec<Case>>> {
        shapes.par_iter().with_max_len(1).map(|shape| Case::of(shape, exponents)).collect()
    };
    let (figure_3, octopus) = (cases(&few, FEW_DOTS)?, cases(&many, MANY_DOTS)?);
    let (mut table, mut csv, mut agrees) = (head(), CSV_HEAD.to_string(), true);
    for case in figure_3.iter().chain(&octopus).flatten() {
        agrees &= case.write(&mut table, &mut csv);
    }
    table.push_str(match agrees {
        true => "\nWhere a minimum was found, no search ended lower than Newton's method from 32 starts by more than 1e-6 of the cost.\n",
        false => {
            "\nA search ended lower than Newton's method from 32 starts by more than 1e-6 of the cost: see above.\n"
        }
    });
    let files =
        vec![table, csv, pictures::fans(), pictures::figure_3(&few, &figure_3), pictures::octopus(&many, &octopus)];
    Ok(Outcome { files, agrees })
}

const CSV_HEAD: &str = "dots,exponent,method,iteration,segment_solves,cost\n";

fn head() -> String {
    let mut table = String::from(
        "Alon & Bergmann: the curve of least S = Σ∫|κ|^ν ds through dots, by the searches of the paper and by Newton's\n\
         method\n\n\
         The greedy search moves one slope at a time by Δα = 0.01, and Gaussian Adaptation is seeded; both start from the\n\
         directions between neighbours. Newton's method starts from circles through neighbouring dots. A solve evaluates\n\
         one segment. Seconds are those of one thread.\n\n",
    );
    let _ = writeln!(
        table,
        "{:<12}{:>3}  {:<26}{:>10}{:>12}{:>10}{:>16}{:>16}   end",
        "dots", "ν", "method", "iterations", "solves", "seconds", "cost", "above the least"
    );
    table
}
