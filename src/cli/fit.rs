//! `faircurve fit`: a file of points in, a file of curves out.

use std::f64::consts::SQRT_2;
use std::str::FromStr;
use std::sync::Arc;

use clap::Args;
use faircurve::bezier::LEAST_TOLERANCE;
use faircurve::ground::check_samples;
use faircurve::io::{self, Flatness, Format, ReadOptions, Selection, WriteOptions};
use faircurve::picture::Picture;
use faircurve::topology::Topology;
use faircurve::tracks;
use faircurve::{CurveBatch, Deviation, Device, Error, Fit, Result, Sampling};

use super::clean::CleanArgs;
use super::curves::{BEZIER_TOLERANCE, CurveArgs, Made, ROUNDING, Shape, size};
use super::drive::DriveArgs;
use super::lengths::{Length, in_units_of};
use super::map::{self, MapArgs};
use super::method::{Method, MethodArgs};
use super::output::title;
use super::run::{Run, RunArgs};
use super::sampling::{count_of, points, sampling};
use super::track::TrackArgs;
use super::{count, positive};

/// The part of --tolerance that the rounding of coordinates may take. The unit of rounding is also at
/// most a part of the size of each ring that is as large as some tolerances: without it the areas of 83
/// of 553 polygons of the United States change by more than 0.1 % within 10 km.
const ROUNDED: f64 = 0.02;
const ROUNDED_RING: f64 = 1e-3;
const LARGE: f64 = 4.0;

/// The most decimals of a number.
const MOST_DIGITS: f64 = 15.0;

/// The part of --within that --tolerance auto is, of samples and of Béziers.
const AUTO: f64 = 0.25;
const AUTO_OF_BEZIERS: f64 = 0.1;

/// How far what is written may be from its curve.
#[derive(Clone, Copy, Debug)]
enum Tolerance {
    Auto,
    Distance(Deviation),
}

impl FromStr for Tolerance {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        if text == "auto" { Ok(Tolerance::Auto) } else { text.parse().map(Tolerance::Distance) }
    }
}

#[derive(Args, Clone, Debug)]
pub struct FitArgs {
    #[command(flatten)]
    curves: CurveArgs,
    /// Takes what has a value, such as name=Utah,Nevada; the rest stays as it is
    ///
    /// Of GeoJSON and TopoJSON the key is a property of features, or layer, an object of TopoJSON. Of
    /// SVG it is an attribute, such as id or class, of an element or of a group around it.
    #[arg(long = "where", value_name = "KEY=VALUE,...", help_heading = "Input")]
    selected: Option<Selection>,
    /// What is written of each curve
    #[arg(long = "as", value_enum, default_value_t = Shape::Polyline, value_name = "SHAPE", help_heading = "Output")]
    shape: Shape,
    #[command(flatten)]
    method: MethodArgs,
    /// Writes as few samples as keep within T of the curve, or with --as bezier as few cubics
    ///
    /// T is a distance as --within takes it. With --within the curve is fitted within D − T, so that
    /// what is written is within D. T may then be auto: a quarter of D, or less, down to a 40th, for
    /// curves that have no more than half as many samples for it as data points; with --as bezier a tenth of D.
    /// Coordinates are rounded to digits that T can do without. [default with --as bezier: 1e-6 of the
    /// data's size, and a cubic or more per span]
    #[arg(long, value_name = "auto|T", conflicts_with_all = ["samples", "spacing", "points", "every", "at"], allow_negative_numbers = true, help_heading = "Output")]
    tolerance: Option<Tolerance>,
    /// Ends Béziers where x or y is extreme, as fonts ask; with --as bezier and --tolerance
    #[arg(long, requires = "tolerance", help_heading = "Output")]
    extremes: bool,
    /// Samples at equal arc length, at most D apart
    ///
    /// In units of the input, or a length such as 5mm. It takes the place of --samples.
    #[arg(long, value_name = "D", conflicts_with = "samples", allow_negative_numbers = true, help_heading = "Output")]
    spacing: Option<Length>,
    /// Draws curvature combs into the picture [default: 1]
    ///
    /// SCALE lengthens their quills.
    #[arg(long, value_name = "SCALE", requires = "picture", num_args = 0..=1, default_missing_value = "1", help_heading = "Picture")]
    comb: Option<f64>,
    #[command(flatten)]
    map: MapArgs,
    #[command(flatten)]
    clean: CleanArgs,
    #[command(flatten)]
    tracks: TrackArgs,
    #[command(flatten)]
    drive: DriveArgs,
    #[command(flatten)]
    run: RunArgs,
}

pub fn run(args: &FitArgs) -> Result<bool> {
    let asked = args.asked_tolerance()?;
    let (mut method, mut note_of_tolerance) = args.method(asked)?;
    args.sampling()?;
    args.check()?;

    let mut run = Run::start(&args.run, "curve", ["fitting", "fitted"]);
    let input = &args.curves.input;
    let by_default = input.options();
    let flatness = match asked {
        Some(Deviation::Units(tolerance)) => Some(Flatness::Within(tolerance)),
        _ => by_default.flatness,
    };
    let carried = args.tracks.carried()?;
    let carried = if args.drive.vehicle().is_some() { carried.with_optional(&tracks::ALONG_DRIVES) } else { carried };
    let selected = args.selected.clone();
    let paths_only = args.map.only_paths();
    let options = ReadOptions { carried, flatness, paths_only, selected, ..by_default };
    let batch = io::read_with(&input.input, &options)?;
    let (batch, dropped, mut said) = args.clean.clean(batch)?;
    let (batch, easings) = args.tracks.easings(args.tracks.split(batch)?)?;
    let (own, notes_of_units) = args.in_units_of(&batch)?;
    let args = &own;
    let batch = args.method.with_limits(args.method.smooth_elevations(batch)?)?;
    if !notes_of_units.is_empty() {
        (method, note_of_tolerance) = args.method(args.asked_tolerance()?)?;
    }
    let sampling = args.sampling()?;
    let tolerance = args.asked_tolerance()?.map(|asked| tolerance_for(&batch, asked)).transpose()?.flatten();
    let sampling = tolerance.map_or(sampling, |tolerance| args.sampling_within((1.0 - ROUNDED) * tolerance));
    let tracks = args.tracks.samples(&batch, sampling, easings)?;
    let (method, of_lambda) = method.for_times_of(&batch);
    said.extend(args.method.distances(&batch, args.spacing.map(Length::number))?);
    said.extend(notes_of_units);
    said.extend(note_of_tolerance.into_iter().chain(of_lambda));
    said.extend(tracks.as_ref().and_then(|tracks| tracks.note(&batch)));
    let points_out = |i: usize| match &tracks {
        _ if args.shape == Shape::Bezier => None,
        Some(tracks) => tracks.count(&batch, i),
        None => count_of(&batch, i, sampling),
    };
    if args.curves.format() == Some(Format::Npy) && args.spacing.is_some() && batch.len() > 1 {
        return Err(Error::argument(
            "NPY holds curves of one length, and with --spacing each has its own: give --points N, or write NPZ",
        ));
    }
    args.curves.check_format(&batch, method.dimension(&batch), args.shape == Shape::Bezier, points_out)?;
    match &tracks {
        Some(tracks) => tracks.check(&batch, method.surface())?,
        None if args.shape == Shape::Polyline => check_samples(sampling, &batch, method.surface(), 0)?,
        None => {}
    }
    let chains = Chains::new(&batch, tolerance, args.extremes);
    let decimals = args.decimals(&batch, tolerance);
    let volume = format!("{}, {}", count(batch.len(), "curve"), count(batch.total_points(), "point"));
    let vehicle = args.drive.vehicle();
    let of_each_curve = args.tracks.given_for(&batch).or(vehicle.map(|_| "--speed".to_string()));
    let topology = args.map.topology(&batch, of_each_curve.as_deref(), args.method.keeps_area())?;
    let fitted = topology.as_ref().map_or(&batch, |topology| topology.strokes());
    let work = method.work(points(fitted, sampling));
    let device = run.device(&work, volume, Some(fitted.len()))?;
    let (fit, curves, notes) = match (&topology, args.shape, vehicle, &tracks) {
        (None, Shape::Polyline, Some(vehicle), _) => {
            let fit = method.fit(&batch, &device)?;
            let (drive, notes) = (tracks::drive(&batch, &fit, sampling, &vehicle)?, method.notes(&fit));
            (fit, drive, notes)
        }
        (None, Shape::Polyline, None, Some(tracks)) => {
            let fit = method.fit(&batch, &device)?;
            let samples = tracks.of(&batch, &fit)?;
            let notes = method.notes(&fit).into_iter().chain(tracks.note_of_untimed(&batch)).collect();
            (fit, samples, notes)
        }
        (None, Shape::Polyline, None, None) => {
            let (fit, polylines) = method.fit_sampled(&batch, sampling, &device)?;
            let notes = method.notes(&fit);
            (fit, polylines, notes)
        }
        (None, Shape::Bezier, ..) => {
            let fit = method.fit(&batch, &device)?;
            let (beziers, notes) = (chains.of(&fit), method.notes(&fit));
            (fit, beziers, notes)
        }
        (Some(topology), ..) => args.fit_map(&mut run, topology, &method, (sampling, decimals), &chains, &device)?,
    };
    let curves = if topology.is_some() && !batch.columns().is_empty() {
        let columns = batch.columns_of_curves(&curves);
        curves.with_columns(columns)?
    } else {
        curves
    };
    let (obstacles, corridor) = method.areas();
    let picture = Picture {
        comb: args.comb,
        title: title(&args.curves.input.input),
        method: args.method.title(),
        obstacles,
        corridor,
        ..Picture::default()
    };
    // Points that were rounded have few digits, and what stays has its own.
    let decimals = decimals.filter(|_| topology.is_none() || !args.map.keeps_a_part(&batch));
    let options = WriteOptions { decimals, ..args.write_options(tolerance) };
    let lambda_unit = method.lambda_unit(&batch);
    let cuts = if args.shape == Shape::Polyline { args.method.note_of_cuts(&curves, &fit)? } else { None };
    let notes = said.into_iter().chain(notes).chain(cuts).collect();
    if let Some(dropped) = dropped {
        args.clean.write(&dropped, args.run.force)?;
    }
    let method = args.method.word();
    let made = Made { batch: &batch, fit: &fit, curves, options, method, picture, notes, lambda_unit };
    made.finish(run, &args.curves)
}

impl FitArgs {
    /// The arguments with all lengths in units of these curves, and what is to be said of those that had
    /// others.
    fn in_units_of(&self, batch: &CurveBatch) -> Result<(FitArgs, Vec<String>)> {
        let (mut own, mut notes) = (self.clone(), Vec::new());
        let on_earth = if batch.is_geographic() { own.method.put_on_earth() } else { None };
        let on_globe = own.method.is_on_globe();
        let FitArgs { method, tolerance, spacing, map, .. } = &mut own;
        let of_output = match tolerance {
            Some(Tolerance::Distance(distance)) => Some(("--tolerance", distance)),
            _ => None,
        };
        let spacing = spacing.as_mut().map(|length| ("--spacing", &mut length.0));
        let snap = map.snap().map(|length| ("--snap", length));
        for (option, length) in method.lengths().chain(of_output).chain(spacing).chain(snap) {
            let on_ground = ["--within", "--tolerance"].contains(&option);
            notes.extend(in_units_of(batch, on_globe, on_ground, option, length)?);
        }
        // Metres are metres there.
        let notes = on_earth.map_or(notes, |note| vec![note]);
        Ok((own, notes))
    }

    /// Where curves are sampled, but for --tolerance and times.
    fn sampling(&self) -> Result<Sampling> {
        match self.tracks.sampling()? {
            Some(sampling) => Ok(sampling),
            None => sampling(self.method.samples, self.spacing.map(Length::number)),
        }
    }

    /// Fits the borders of a map one by one: the curves, what is written of them, and what is worth
    /// a line.
    fn fit_map(
        &self,
        run: &mut Run,
        topology: &Arc<Topology>,
        method: &Method,
        (sampling, decimals): (Sampling, Option<u8>),
        chains: &Chains,
        device: &Device,
    ) -> Result<(Fit, CurveBatch, Vec<String>)> {
        let (batch, beziers) = (topology.curves(), self.shape == Shape::Bezier);
        sampling.check(batch)?;
        let strokes = method.fit(topology.strokes(), device)?;
        let (topology, strokes, divided) = match topology.divide(&strokes) {
            None => (topology.clone(), strokes, None),
            Some(divided) => {
                let note = map::note_of(&divided);
                let arcs = method.fit(divided.arcs(), device)?;
                let (topology, strokes) = divided.with(strokes, arcs);
                (topology, strokes, Some(note))
            }
        };
        let mut notes = method.notes(&strokes);
        run.step("looking at crossings");
        let mut strokes = topology.sample(strokes, sampling);
        let decimals = decimals.filter(|_| !beziers && self.curves.rounds(batch));
        if let Some(decimals) = decimals {
            strokes = strokes.rounded(decimals);
        }
        let (strokes, of_map) = self.map.mend(&topology, strokes, decimals);
        notes.extend(of_map.into_iter().chain(divided));
        let fit = strokes.join();
        let curves = if beziers { chains.shared().of(&fit) } else { fit.polylines(sampling) };
        Ok((fit, curves, notes))
    }

    /// Checks what can be checked before anything is read.
    fn check(&self) -> Result<()> {
        self.map.check()?;
        if let Some(vehicle) = self.drive.vehicle() {
            vehicle.check()?;
            if self.shape == Shape::Bezier {
                return Err(Error::argument("--speed makes samples with times: leave --as bezier out"));
            }
        }
        self.tracks.check(self.shape == Shape::Bezier, self.curves.format())?;
        if self.shape == Shape::Bezier && (self.method.samples.is_some() || self.spacing.is_some()) {
            let why = "--as bezier writes the curves themselves: leave --samples and --spacing out";
            return Err(Error::argument(why));
        }
        if self.extremes && self.shape != Shape::Bezier {
            return Err(Error::argument("--extremes are ends of Béziers: add --as bezier"));
        }
        if let Some(scale) = self.comb {
            positive("--comb", scale, "the scale of its quills must be a positive number, such as --comb 2")?;
        }
        io::check_output(&self.curves.output, &self.write_options(None))?;
        self.run.check(Some(&self.curves.output), self.curves.picture.as_deref(), self.clean.file())
    }

    fn write_options(&self, tolerance: Option<f64>) -> WriteOptions {
        let rounding = tolerance.map(|tolerance| ROUNDING * tolerance);
        self.curves.write_options(self.run.force, self.shape == Shape::Bezier, rounding)
    }

    /// The decimals that are written, if not all.
    fn decimals(&self, batch: &CurveBatch, tolerance: Option<f64>) -> Option<u8> {
        match tolerance {
            Some(tolerance) if self.curves.digits.is_none() && self.shape == Shape::Polyline => {
                let rings = (0..batch.len()).filter(|&i| batch.is_closed(i) && batch.problem(i).is_none());
                let sizes = rings.map(|i| Deviation::OfSize(1.0).of(batch, i));
                let sizes = sizes.filter(|size| *size >= LARGE * tolerance).map(|size| ROUNDED_RING * size);
                let unit = sizes.fold(SQRT_2 * ROUNDED * tolerance, f64::min);
                Some((-unit.log10()).ceil().clamp(0.0, MOST_DIGITS) as u8)
            }
            _ => self.curves.decimals(batch),
        }
    }

    /// --tolerance as a distance.
    ///
    /// # Errors
    /// auto without --within.
    fn asked_tolerance(&self) -> Result<Option<Deviation>> {
        match (self.tolerance, self.method.within()) {
            (None, _) => Ok(None),
            (Some(Tolerance::Distance(tolerance)), _) => Ok(Some(tolerance)),
            (Some(Tolerance::Auto), Some(within)) => {
                Ok(Some(within.times(if self.shape == Shape::Bezier { AUTO_OF_BEZIERS } else { AUTO })))
            }
            (Some(Tolerance::Auto), None) => Err(Error::argument(
                "--tolerance auto is a part of --within: give a distance, such as --tolerance 0.001",
            )),
        }
    }

    fn sampling_within(&self, tolerance: f64) -> Sampling {
        match self.tolerance {
            Some(Tolerance::Auto) => Sampling::AsMany(tolerance),
            _ => Sampling::Tolerance(tolerance),
        }
    }

    /// The method asked for, and what is to be said of it.
    fn method(&self, tolerance: Option<Deviation>) -> Result<(Method, Option<String>)> {
        let spacing = self.spacing.map(Length::number);
        let (mut method, mut note) = (self.method.method(spacing)?, None);
        if let (Method::Fair(fair), Some(spacing)) = (&mut method, spacing) {
            // Between two points of a polygon with edges this long, a chord cuts its corners by so much.
            let cut = fair.limits.curvature.map_or(0.0, |curvature| 0.25 * curvature * spacing * spacing);
            fair.limits = std::mem::take(&mut fair.limits).with_clearance(cut);
        }
        if let Some(tolerance) = tolerance {
            positive("--tolerance", tolerance.number(), "it must be a positive distance, such as --tolerance 0.001")?;
            if let (Method::Fair(fair), Deviation::Units(tolerance)) = (&mut method, tolerance) {
                fair.limits = std::mem::take(&mut fair.limits).with_clearance(tolerance);
            }
            if let Method::Band(band) = &mut method {
                let within = band.distance;
                band.distance = within.less(tolerance).filter(|left| left.number() > 0.0).ok_or_else(|| {
                    Error::argument(format!(
                        "--tolerance {tolerance} is a part of --within {within}: give less, in the same unit"
                    ))
                })?;
                let left = band.distance;
                note = Some(format!(
                    "--within {within}: curves are fitted within {left}, and written within {tolerance} of them"
                ));
            }
        }
        Ok((method, note))
    }
}

/// A tolerance in units of these curves. `None` if no curve can be fitted.
fn tolerance_for(batch: &CurveBatch, tolerance: Deviation) -> Result<Option<f64>> {
    // Curves that cannot be fitted come out as they came in, whatever the tolerance.
    let fitted: Vec<usize> = (0..batch.len()).filter(|&i| batch.problem(i).is_none()).collect();
    let each = fitted.iter().map(|&i| tolerance.of(batch, i)).filter(|tolerance| *tolerance > 0.0);
    let Some(smallest) = each.reduce(f64::min) else { return Ok(None) };
    let largest = fitted.iter().map(|&i| largest_coordinate(batch.points(i))).fold(0.0, f64::max);
    let least = LEAST_TOLERANCE * largest;
    if smallest < least {
        return Err(Error::argument(format!(
            "--tolerance is {tolerance}, but coordinates up to {largest} are rounded to about as much: give {least:.0e} or more"
        )));
    }
    Ok(Some(smallest))
}

/// How curves become Béziers.
#[derive(Clone)]
struct Chains {
    /// The tolerance of each curve.
    tolerances: Vec<f64>,
    /// Whether there are as few as possible.
    fewest: bool,
    /// Whether they end at extremes.
    extremes: bool,
}

impl Chains {
    fn new(batch: &CurveBatch, tolerance: Option<f64>, extremes: bool) -> Self {
        let own = |i: usize| {
            let points = batch.points(i);
            (BEZIER_TOLERANCE * size(points, batch.dimension())).max(LEAST_TOLERANCE * largest_coordinate(points))
        };
        // What the rounding of the output takes is left to it.
        let asked = tolerance.map(|tolerance| (1.0 - ROUNDING) * tolerance);
        let tolerances = (0..batch.len()).map(|i| asked.unwrap_or_else(|| own(i))).collect();
        Chains { tolerances, fewest: tolerance.is_some(), extremes }
    }

    /// One tolerance, so that curves share the Béziers of their borders.
    fn shared(&self) -> Self {
        let least = self.tolerances.iter().copied().fold(f64::INFINITY, f64::min);
        Chains { tolerances: vec![least; self.tolerances.len()], ..*self }
    }

    fn of(&self, fit: &Fit) -> CurveBatch {
        match self.fewest {
            true => fit.fewest_beziers_each(|i| self.tolerances[i], self.extremes),
            false => fit.beziers_each(|i| self.tolerances[i]),
        }
    }
}

fn largest_coordinate(points: &[f64]) -> f64 {
    points.iter().filter(|x| x.is_finite()).fold(0.0, |largest, x| x.abs().max(largest))
}
