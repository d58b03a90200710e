//! `faircurve exponent`: the ν of ∫|κ|^ν ds that draws each curve, and each piece of it, best.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use faircurve::picture::drawing::{Bar, Panel, Sheet, Stroke};
use faircurve::scf::exponent::{DotsOf, ExponentSearch, ShapeExponent};
use faircurve::{CurveBatch, Device, Error, Result};
use glam::DVec2;
use rayon::prelude::*;

use super::output::{self, title};
use super::progress::Progress;
use super::{InputArgs, Talk, count};

/// Dots of a curve that has points enough, and the points a dot that a shape needs to be told by.
const DOTS: usize = 10;
const POINTS_A_DOT: usize = 3;

/// The fewest dots of open and of closed curves.
const LEAST: [usize; 2] = [2, 3];

/// Exponents are sought from here on. Nearer to 1 curves are polygons, and solutions lose digits.
const LEAST_EXPONENT: f64 = 1.1;

/// The colour of what no exponent draws: a grey.
const WITHOUT: [u8; 3] = [169; 3];

#[derive(Args, Debug)]
pub struct ExponentArgs {
    #[command(flatten)]
    input: InputArgs,
    /// CSV file to write: a row a curve, and a row a piece
    ///
    /// Its columns are curve; piece, 0 for the whole curve; first and last, the numbers of the points between which it
    /// lies, from 0; exponent; rms and largest, the distances of the points from the curve of that exponent, in units
    /// of the input. A curve that no exponent can draw has none. - writes to standard output.
    #[arg(short, long, default_value = "-", help_heading = "Output")]
    output: PathBuf,
    /// Points that the curves compared go through, at equal arc lengths [default: 10, or a third of the points]
    #[arg(long, value_name = "N", help_heading = "Exponents")]
    dots: Option<usize>,
    /// Chords between dots that make a piece
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..), help_heading = "Exponents")]
    chords: u16,
    /// Largest exponent tried
    #[arg(long, value_name = "ν", default_value_t = 60.0, allow_negative_numbers = true, help_heading = "Exponents")]
    most: f64,
    /// Draws the curves into an SVG file, each piece in the colour of its exponent
    #[arg(long, value_name = "FILE.svg", help_heading = "Picture")]
    picture: Option<PathBuf>,
    /// Replaces outputs that exist
    #[arg(long, help_heading = "Run")]
    force: bool,
    #[command(flatten)]
    talk: Talk,
}

/// What was found of a curve: itself, and its pieces.
struct Found {
    whole: ShapeExponent,
    pieces: Vec<ShapeExponent>,
}

pub fn run(args: &ExponentArgs) -> Result<bool> {
    if !(args.most > LEAST_EXPONENT && args.most.is_finite()) {
        let most = args.most;
        return Err(Error::argument(format!(
            "--most is {most}; exponents from {LEAST_EXPONENT} on are tried, such as --most 60"
        )));
    }
    output::check_picture(args.picture.as_deref())?;
    let files = [("--output", Some(&args.output)), ("--picture", args.picture.as_ref())];
    let files: Vec<_> = files.into_iter().filter_map(|(option, path)| Some((option, path?.as_path()))).collect();
    output::check(&files, args.force)?;
    let mut progress = Progress::new(args.talk.quiet);
    progress.step("reading");
    let batch = args.input.read()?;
    if batch.dimension() != 2 {
        return Err(Error::argument(
            "exponents are those of planar curves, and the points have three coordinates: leave z out",
        ));
    }
    progress.count("looking for exponents of", batch.len(), "curve");
    let of = |i: usize| {
        let found = args.search(&batch, i);
        progress.advance(1);
        found
    };
    let found: Vec<Result<Found>> = (0..batch.len()).into_par_iter().with_max_len(1).map(of).collect();
    output::write(&args.output, args.force, |out| table(out, &batch, &found))?;
    if let Some(path) = &args.picture {
        let drawing = args.draw(&batch, &found);
        output::write(path, args.force, |out| drawing.write(out, &()))?;
    }
    progress.finish();
    let failed = found.iter().filter(|found| found.is_err()).count();
    for error in found.iter().filter_map(|found| found.as_ref().err()) {
        args.talk.say(error);
    }
    args.talk.say(format_args!("{} measured, {failed} could not be", count(batch.len(), "curve")));
    Ok(failed == 0)
}

impl ExponentArgs {
    fn search(&self, batch: &CurveBatch, i: usize) -> Result<Found> {
        if let Some(problem) = batch.problem(i) {
            return Err(Error::argument(problem.message.clone()));
        }
        let (shape, closed) = (batch.points(i).as_chunks::<2>().0, batch.is_closed(i));
        let least = LEAST[usize::from(closed)];
        let dots = self.dots.unwrap_or((shape.len() / POINTS_A_DOT).clamp(least, DOTS));
        if shape.len() <= dots {
            let what = format!(
                "it has {}, and all that lies between {dots} dots is what an exponent is told by: give it more points, or ask for \
                 fewer --dots",
                count(shape.len(), "point")
            );
            return Err(Error::argument(batch.sentence(i, 0, &what)));
        }
        let search = ExponentSearch { dots: DotsOf::Count(dots), range: [LEAST_EXPONENT, self.most] };
        let whole = search.whole(shape, closed, &Device::cpu());
        let pieces = || search.by_piece(shape, closed, usize::from(self.chords), &Device::cpu());
        let both = whole.and_then(|whole| Ok(Found { whole, pieces: pieces()? }));
        both.map_err(|error| Error::argument(batch.sentence(i, 0, &error.to_string())))
    }

    /// Every piece in the colour of its exponent, on a logarithmic scale.
    fn draw(&self, batch: &CurveBatch, found: &[Result<Found>]) -> Sheet {
        let part = |exponent: f64| (exponent / LEAST_EXPONENT).ln() / (self.most / LEAST_EXPONENT).ln();
        let (mut curves, mut dots, mut rest) = (Vec::new(), Vec::new(), Vec::new());
        for (i, found) in found.iter().enumerate() {
            let shape: Vec<DVec2> = batch.points(i).as_chunks::<2>().0.iter().map(|&point| point.into()).collect();
            let Ok(Found { whole, pieces }) = found else {
                let closing = shape.first().filter(|_| batch.is_closed(i));
                rest.push(shape.iter().chain(closing).copied().collect());
                continue;
            };
            dots.extend(whole.dots.iter().map(|&dot| shape[dot]));
            for piece in pieces {
                let [first, last] = ends(piece);
                let last = if last > first { last } else { last + shape.len() };
                let points: Vec<DVec2> = (first..=last).map(|k| shape[k % shape.len()]).collect();
                match piece.best.rms.is_finite() {
                    true => curves.push((part(piece.best.exponent), points)),
                    false => rest.push(points),
                }
            }
        }
        let bar = Bar::new("exponent ν, on a logarithmic scale", [LEAST_EXPONENT, self.most]);
        let mut panel = Panel::by_value("", &curves, &dots, bar);
        let without = |points| Stroke { points, colour: WITHOUT, width: 1.2, name: Some("without an exponent".into()) };
        panel.strokes.extend(rest.into_iter().map(without));
        let name = title(&self.input.input).unwrap_or_default();
        Sheet {
            title: Some(format!("{name}: the exponents of its pieces")),
            caption: format!(
                "A piece is {} between dots; its ν is that whose curve through its dots comes nearest to it.",
                count(usize::from(self.chords), "chord")
            ),
            columns: 1,
            panels: vec![panel],
            ..Sheet::default()
        }
    }
}

/// The numbers of a piece's first and last points.
fn ends(piece: &ShapeExponent) -> [usize; 2] {
    [piece.dots[0], piece.dots[piece.dots.len() - 1]]
}

/// A row for every curve and every piece of one.
fn table(out: &mut dyn Write, batch: &CurveBatch, found: &[Result<Found>]) -> std::io::Result<()> {
    let mut rows = csv::Writer::from_writer(out);
    rows.write_record(["curve", "piece", "first", "last", "exponent", "rms", "largest"])?;
    for (i, found) in found.iter().enumerate() {
        let Ok(Found { whole, pieces }) = found else {
            rows.write_record([&*batch.name(i), "0", "", "", "", "", ""])?;
            continue;
        };
        let last = batch.count(i) - usize::from(!batch.is_closed(i));
        let of_whole = std::iter::once((whole, [0, last]));
        for (piece, (found, [first, last])) in
            of_whole.chain(pieces.iter().map(|piece| (piece, ends(piece)))).enumerate()
        {
            let best = found.best;
            let numbers = [best.exponent, best.rms, best.largest];
            let numbers = numbers.map(|number| if best.rms.is_finite() { number.to_string() } else { String::new() });
            let places = [piece, first, last].map(|place| place.to_string());
            rows.write_record(
                std::iter::once(&*batch.name(i)).chain(places.iter().chain(&numbers).map(|cell| &cell[..])),
            )?;
        }
    }
    rows.flush()
}
