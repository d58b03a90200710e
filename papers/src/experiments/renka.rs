//! Section 4 of R. J. Renka, Geometric Curve Modeling with Sobolev Gradients, 2006: the shortest
//! curve between two points, by every method of the paper, from a spline that crosses itself.

use std::fmt::Write;

use crate::picture;
use crate::renka::{Direction, Ending, InnerProduct, Iterate, Minimisation, Minimised, Minimiser, Step};
use faircurve::discrete::{Energy, length, tension};
use faircurve::spline::{Natural, Parametrisation};
use faircurve::{CurveBatch, Device, Result, Sampling};
use glam::DVec2;

use super::{Experiment, Outcome};

const FILES: [&str; 5] =
    ["renka.txt", "renka.csv", "renka-length-ordinary.svg", "renka-tension-ordinary.svg", "renka-length-sobolev.svg"];

pub const EXPERIMENT: Experiment = Experiment { name: "renka", files: &FILES, run };

const POINTS: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0]];

/// Edges of the curve.
const EDGES: usize = 200;

/// Steps at most: the paper's count on ψ.
const MOST: u32 = 39_000;

/// The length that the paper's descent on ψ ends at.
const SHORT: f64 = 1.001;

/// The solution has length 1: at this one a descent is still far away.
const FAR: f64 = 1.5;

/// How near one Sobolev step must come to the segment.
const LANDS: f64 = 1e-12;

type Curve = Vec<[f64; 2]>;

/// The tables, and whether they are as the paper says.
struct Record {
    table: String,
    csv: String,
    agrees: bool,
}

/// Energy, sign and name; its weight is 1.
struct Case {
    sign: &'static str,
    energy: Energy,
}

/// One method on one curve, and what the paper says about it.
struct Run<'a> {
    case: &'a Case,
    method: Minimiser,
    words: &'a str,
    start: &'a [[f64; 2]],
    paper: &'a str,
}

fn run() -> Result<Outcome> {
    let start = spline()?;
    let phi = Case { sign: "φ", energy: length() };
    // The paper drops the constant m.
    let psi = Case { sign: "ψ", energy: 1.0 / EDGES as f64 * tension() };
    let mut record = Record::new(polygon_length(&start));
    let lengths = lengths(&mut record, &phi, &start)?;
    let tensions = tensions(&mut record, &psi, &start)?;
    record.notes();
    let (sobolev, _) = shown(&Minimisation {
        method: descent(InnerProduct::Sobolev, Step::Constant(0.2)),
        ..Minimisation::new(phi.energy.clone())
    })(&start)?;
    let picture = |title: &str, curves: &[Curve], caption: String| {
        let points = |curve: &Curve| curve.iter().map(|&p| DVec2::from(p)).collect();
        let curves: Vec<Vec<DVec2>> = curves.iter().map(points).collect();
        picture::evolution(title, caption, &POINTS.map(DVec2::from), &curves)
    };
    let (iterations, left) = (lengths.1.iterations, lengths.1.length);
    let files = vec![
        record.table,
        record.csv,
        picture(
            "Length, ordinary gradient with a line search",
            &lengths.0,
            format!(
                "can be reduced no further after {iterations} iterations: length {left:.4}, where the segment has 1"
            ),
        ),
        picture(
            "ψ, ordinary gradient with constant step 0.5",
            &tensions.0,
            format!("length {:.5} after {} iterations", tensions.1.length, tensions.1.iterations),
        ),
        picture(
            "Length, Sobolev gradient with constant step 0.2",
            &sobolev,
            "with step 1 the first step leads to the last curve".into(),
        ),
    ];
    Ok(Outcome { files, agrees: record.agrees })
}

/// The paper's curve: vertices at equal arc lengths of the natural cubic spline over chord lengths.
fn spline() -> Result<Curve> {
    let by_chords = Natural { parametrisation: Parametrisation::ChordLength, ..Natural::default() };
    let fit = by_chords.fit(&CurveBatch::from_slices(&[&POINTS[..]])?, &Device::cpu())?;
    // Largest spacing not above this one that divides the length evenly: EDGES pieces.
    let spacing = fit.curve(0).length() / (EDGES as f64 - 0.5);
    Ok(fit.polylines(Sampling::Spacing(spacing)).points(0).as_chunks::<2>().0.to_vec())
}

fn descent(product: InnerProduct, step: Step) -> Minimiser {
    Minimiser::Gradient { product, step, direction: Direction::Steepest }
}

/// Runs it and keeps a few of its curves, the first and the last among them.
fn shown(minimisation: &Minimisation) -> impl Fn(&[[f64; 2]]) -> Result<(Vec<Curve>, Minimised<2>)> + '_ {
    |start| {
        let (mut curves, mut next) = (Vec::new(), 0);
        let found = minimisation.run(start, |iterate: Iterate<'_, 2>| {
            if iterate.iteration >= next {
                curves.push(iterate.vertices.to_vec());
                next = iterate.iteration + (iterate.iteration / 2).max(1);
            }
        })?;
        curves.push(found.vertices.clone());
        Ok((curves, found))
    }
}

/// All rows on φ; the curves and the end of the ordinary descent with a line search.
fn lengths(record: &mut Record, phi: &Case, start: &[[f64; 2]]) -> Result<(Vec<Curve>, Minimised<2>)> {
    let far = "fails far from the solution";
    let row = |method, words, paper| Run { case: phi, method, words, start, paper };
    let ordinary = |step| descent(InnerProduct::Ordinary, step);
    for (step, words, paper) in [
        (Step::Constant(0.01), "ordinary gradient, step 0.01", far),
        (Step::Constant(0.001), "ordinary gradient, step 0.001", ""),
        (Step::Search, "ordinary gradient, line search", far),
    ] {
        let found = row(ordinary(step), words, paper).record(record)?;
        record.agrees &= found.ending == Ending::Stalled && found.length > FAR;
    }
    let once = "1 iteration";
    let mut away = 0.0;
    for (step, direction, words, paper) in [
        (Step::Constant(1.0), Direction::Steepest, "Sobolev gradient, step 1", once),
        (Step::Search, Direction::Steepest, "Sobolev gradient, line search", once),
        (Step::Search, Direction::Conjugate, "Sobolev gradient, conjugate", ""),
    ] {
        let method = Minimiser::Gradient { product: InnerProduct::Sobolev, step, direction };
        let found = row(method, words, paper).record(record)?;
        away = f64::max(away, distance_to_segment(start, &found.vertices));
        record.agrees &= found.ending == Ending::Converged && found.iterations == 1;
    }
    record.agrees &= away <= LANDS;
    row(Minimiser::Newton, "Newton", "fails to converge").record(record)?;
    let offs: [(f64, &str); 3] = [
        (1e-3, "Newton, 0.001 off the segment"),
        (1e-6, "Newton, 0.000001 off the segment"),
        (0.0, "Newton, on the segment"),
    ];
    for (off, words) in offs {
        let start: Curve =
            (0..=EDGES).map(|k| k as f64 / EDGES as f64).map(|x| [x, 4.0 * off * x * (1.0 - x)]).collect();
        let paper = if off > 0.0 { "fails to converge" } else { "singular" };
        let found = Run { case: phi, method: Minimiser::Newton, words, start: &start, paper }.record(record)?;
        record.agrees &= found.ending == Ending::Singular;
    }
    let _ = writeln!(record.table, "    one Sobolev step is {away:.1e} at most from the segment of theorem 2.2\n");
    shown(&Minimisation {
        method: ordinary(Step::Search),
        max_iterations: MOST,
        ..Minimisation::new(phi.energy.clone())
    })(start)
}

/// All rows on ψ; the curves and the end of the ordinary descent with constant step 0.5.
fn tensions(record: &mut Record, psi: &Case, start: &[[f64; 2]]) -> Result<(Vec<Curve>, Minimised<2>)> {
    let row = |method, words, paper| Run { case: psi, method, words, start, paper };
    let ordinary = |step| descent(InnerProduct::Ordinary, step);
    let best = "length 1.001 after 39000";
    let found = row(ordinary(Step::Constant(0.5)), "ordinary gradient, step 0.5", best).record(record)?;
    record.agrees &= found.length < SHORT;
    row(ordinary(Step::Constant(0.51)), "ordinary gradient, step 0.51", "does not converge").record(record)?;
    row(ordinary(Step::Search), "ordinary gradient, line search", "does not converge").record(record)?;
    for (step, direction, words) in [
        (Step::Constant(1.0), Direction::Steepest, "Sobolev gradient, step 1"),
        (Step::Search, Direction::Steepest, "Sobolev gradient, line search"),
        (Step::Search, Direction::Conjugate, "Sobolev gradient, conjugate"),
    ] {
        let method = Minimiser::Gradient { product: InnerProduct::Sobolev, step, direction };
        row(method, words, "").record(record)?;
    }
    let newton = row(Minimiser::Newton, "Newton; Sobolev gradient of D", "1 iteration").record(record)?;
    record.agrees &= newton.ending == Ending::Converged && newton.iterations == 1;
    shown(&Minimisation {
        method: ordinary(Step::Constant(0.5)),
        max_iterations: MOST,
        ..Minimisation::new(psi.energy.clone())
    })(start)
}

impl Run<'_> {
    /// Minimises, and writes a row; on ψ one more where a slow descent falls below [`SHORT`].
    fn record(&self, record: &mut Record) -> Result<Minimised<2>> {
        let minimisation =
            Minimisation { method: self.method, max_iterations: MOST, ..Minimisation::new(self.case.energy.clone()) };
        let mut below: Option<(u32, f64, f64)> = None;
        let found = minimisation.run(self.start, |iterate| {
            if iterate.length < SHORT && below.is_none() {
                below = Some((iterate.iteration, iterate.length, iterate.energy));
            }
        })?;
        if let (Ending::Exhausted, Some((iterations, length, energy))) = (found.ending, below) {
            record.row(self, iterations, length, energy, "goes on: length < 1.001");
        }
        let ending = match found.ending {
            Ending::Converged => "converged",
            Ending::Stalled => "can reduce it no further",
            Ending::Exhausted => "iterations used up",
            Ending::Singular => "Hessian is singular",
            Ending::Broken => "out of the numbers",
        };
        record.row(self, found.iterations, found.length, found.energy, ending);
        Ok(found)
    }
}

impl Record {
    fn new(polygon: f64) -> Self {
        let mut table = format!(
            "Renka 2006, section 4: the shortest curve from (0, 0) to (1, 0), m = {EDGES}; φ = Σ Δs, ψ = ½ Σ Δs²\n\
             from the natural cubic spline through (0, 0), (1, 1), (0, 1), (1, 0), a polygon of length {polygon:.6}\n\n"
        );
        let _ = writeln!(
            table,
            "    {:<34}{:>10}{:>14}{:>14}   {:<26}the paper",
            "method", "iterations", "length", "energy", "end"
        );
        Record { table, csv: "energy,method,iterations,length,value,end\n".into(), agrees: true }
    }

    fn row(&mut self, run: &Run<'_>, iterations: u32, length: f64, energy: f64, ending: &str) {
        let (sign, words, paper) = (run.case.sign, run.words, run.paper);
        let row = format!("{sign:<4}{words:<34}{iterations:>10}{length:>14.8}{energy:>14.10}   {ending:<26}{paper}");
        let _ = writeln!(self.table, "{}", row.trim_end());
        let name = if sign == "φ" { "length" } else { "tension" };
        let _ = writeln!(self.csv, "{name},\"{words}\",{iterations},{length},{energy},{ending}");
    }

    fn notes(&mut self) {
        self.table.push_str(
            "\nThe paper does not say when its descent on ψ stops, and has it converge with constant steps only; the line search\n\
             here goes by slopes, and converges too. The Sobolev gradients here are those of L_f, which suits φ: on ψ a step of\n\
             length 1 goes only s_m/m of the way. The inner product that suits ψ is that of Dh = h′, and its step of length 1 is\n\
             Newton's. The Hessian of φ is singular at every curve, not only at the segment: of its 2(m − 1) rows at most m are\n\
             independent.\n",
        );
    }
}

/// Largest distance of the curve's vertices from f_0 + (s_i/s_m)(f_m − f_0), s the arc length of
/// the start.
fn distance_to_segment(start: &[[f64; 2]], curve: &[[f64; 2]]) -> f64 {
    let (first, last) = (DVec2::from(start[0]), DVec2::from(start[EDGES]));
    let total = polygon_length(start);
    let distance = |k: usize| {
        let part = polygon_length(&start[..=k]) / total;
        DVec2::from(curve[k]).distance(first + part * (last - first))
    };
    (0..=EDGES).map(distance).fold(0.0, f64::max)
}

fn polygon_length(vertices: &[[f64; 2]]) -> f64 {
    vertices.windows(2).map(|pair| DVec2::from(pair[1]).distance(DVec2::from(pair[0]))).sum()
}
