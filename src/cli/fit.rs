//! `faircurve fit`: a file of points in, a file of curves out.

use std::sync::Arc;

use clap::Args;
use faircurve::bezier::LEAST_TOLERANCE;
use faircurve::ground::check_samples;
use faircurve::io::{self, Flatness, Format, ReadOptions, WriteOptions};
use faircurve::picture::Picture;
use faircurve::topology::Topology;
use faircurve::{CurveBatch, Device, Error, Fit, Result, Sampling};

use super::curves::{BEZIER_TOLERANCE, CurveArgs, Made, ROUNDING, Shape, size};
use super::map::{self, MapArgs};
use super::method::{Method, MethodArgs};
use super::output::title;
use super::run::{Run, RunArgs};
use super::sampling::{count_of, points, sampling};
use super::track::TrackArgs;
use super::{count, positive};

#[derive(Args, Debug)]
pub struct FitArgs {
    #[command(flatten)]
    curves: CurveArgs,
    /// What is written of each curve
    #[arg(long = "as", value_enum, default_value_t = Shape::Polyline, value_name = "SHAPE", help_heading = "Output")]
    shape: Shape,
    #[command(flatten)]
    method: MethodArgs,
    /// Samples at equal arc length, at most D apart
    ///
    /// In units of the input. It takes the place of --samples.
    #[arg(long, value_name = "D", conflicts_with = "samples", allow_negative_numbers = true, help_heading = "Output")]
    spacing: Option<f64>,
    /// Draws curvature combs into the picture [default: 1]
    ///
    /// SCALE lengthens their quills.
    #[arg(long, value_name = "SCALE", requires = "picture", num_args = 0..=1, default_missing_value = "1", help_heading = "Picture")]
    comb: Option<f64>,
    #[command(flatten)]
    map: MapArgs,
    #[command(flatten)]
    tracks: TrackArgs,
    #[command(flatten)]
    run: RunArgs,
}

pub fn run(args: &FitArgs) -> Result<bool> {
    let sampling = match args.tracks.sampling()? {
        Some(sampling) => sampling,
        None => sampling(args.method.samples, args.spacing)?,
    };
    let method = args.method()?;
    args.check()?;

    let mut run = Run::start(&args.run, "curve", ["fitting", "fitted"]);
    let input = &args.curves.input;
    let by_default = input.options();
    let flatness = args.asked_tolerance().map(Flatness::Within).or(by_default.flatness);
    let options = ReadOptions { carried: args.tracks.carried(), flatness, ..by_default };
    let batch = io::read_with(&input.input, &options)?;
    let batch = args.tracks.split(batch)?;
    let tracks = args.tracks.samples(&batch, sampling)?;
    let mut units = args.method.distances(&batch, args.spacing)?;
    let (method, of_lambda) = method.for_times_of(&batch);
    units.extend(of_lambda.into_iter().chain(tracks.as_ref().and_then(|tracks| tracks.note(&batch))));
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
    let tolerances = args.bezier_tolerances(&batch)?;
    let volume = format!("{}, {}", count(batch.len(), "curve"), count(batch.total_points(), "point"));
    let topology = args.map.topology(&batch, args.tracks.given().as_deref(), args.method.keeps_area())?;
    let fitted = topology.as_ref().map_or(&batch, |topology| topology.strokes());
    let work = method.work(points(fitted, sampling));
    let device = run.device(&work, volume, Some(fitted.len()))?;
    let (fit, curves, notes) = match (&topology, args.shape, &tracks) {
        (None, Shape::Polyline, Some(tracks)) => {
            let fit = method.fit(&batch, &device)?;
            let samples = tracks.of(&batch, &fit)?;
            let notes = method.notes(&fit).into_iter().chain(tracks.note_of_untimed(&batch)).collect();
            (fit, samples, notes)
        }
        (None, Shape::Polyline, None) => {
            let (fit, polylines) = method.fit_sampled(&batch, sampling, &device)?;
            let notes = method.notes(&fit);
            (fit, polylines, notes)
        }
        (None, Shape::Bezier, _) => {
            let fit = method.fit(&batch, &device)?;
            let (beziers, notes) = (fit.beziers_each(|i| tolerances[i]), method.notes(&fit));
            (fit, beziers, notes)
        }
        (Some(topology), ..) => args.fit_map(&mut run, topology, &method, sampling, &tolerances, &device)?,
    };
    let picture = Picture {
        comb: args.comb,
        title: title(&args.curves.input.input),
        method: args.method.title(),
        ..Picture::default()
    };
    let options = args.write_options();
    let lambda_unit = method.lambda_unit(&batch);
    let notes = units.into_iter().chain(notes).collect();
    let method = args.method.word();
    let made = Made { batch: &batch, fit: &fit, curves, options, method, picture, notes, lambda_unit };
    made.finish(run, &args.curves)
}

impl FitArgs {
    /// Fits the borders of a map one by one: the curves, what is written of them, and what is worth
    /// a line.
    fn fit_map(
        &self,
        run: &mut Run,
        topology: &Arc<Topology>,
        method: &Method,
        sampling: Sampling,
        tolerances: &[f64],
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
        let decimals = self.curves.decimals(batch).filter(|_| !beziers && self.curves.rounds(batch));
        if let Some(decimals) = decimals {
            strokes = strokes.rounded(decimals);
        }
        let (strokes, of_map) = self.map.mend(&topology, strokes, decimals);
        notes.extend(of_map.into_iter().chain(divided));
        let fit = strokes.join();
        // One tolerance, so that curves share the Béziers of their borders.
        let tolerance = tolerances.iter().copied().fold(f64::INFINITY, f64::min);
        let curves = if beziers { fit.beziers(tolerance) } else { fit.polylines(sampling) };
        Ok((fit, curves, notes))
    }

    /// Checks what can be checked before anything is read.
    fn check(&self) -> Result<()> {
        self.map.check()?;
        self.tracks.check(self.shape == Shape::Bezier, self.curves.format())?;
        if self.shape == Shape::Bezier && (self.method.samples.is_some() || self.spacing.is_some()) {
            let why = "--as bezier writes the curves themselves: leave --samples and --spacing out";
            return Err(Error::argument(why));
        }
        if let Some(tolerance) = self.asked_tolerance() {
            let why = "with --as bezier it is the largest distance of the Béziers from the curve: a positive number, in units of \
                       the input, such as --tolerance 0.001";
            positive("--tolerance", tolerance, why)?;
        }
        if let Some(scale) = self.comb {
            positive("--comb", scale, "the scale of its quills must be a positive number, such as --comb 2")?;
        }
        io::check_output(&self.curves.output, &self.write_options())?;
        self.run.check(Some(&self.curves.output), self.curves.picture.as_deref())
    }

    fn write_options(&self) -> WriteOptions {
        let rounding = self.asked_tolerance().map(|tolerance| ROUNDING * tolerance);
        self.curves.write_options(self.run.force, self.shape == Shape::Bezier, rounding)
    }

    /// The tolerance of Béziers, if --tolerance gives it.
    fn asked_tolerance(&self) -> Option<f64> {
        self.method.tolerance.filter(|_| self.shape == Shape::Bezier)
    }

    /// The method asked for; with --as bezier --tolerance is none of its options.
    fn method(&self) -> Result<Method> {
        match self.shape {
            Shape::Polyline => self.method.method(self.spacing),
            Shape::Bezier => self.method.without_tolerance().method(self.spacing),
        }
    }

    /// How far Béziers may be from each curve.
    fn bezier_tolerances(&self, batch: &CurveBatch) -> Result<Vec<f64>> {
        let largest = |points: &[f64]| points.iter().filter(|x| x.is_finite()).fold(0.0f64, |a, x| a.max(x.abs()));
        let Some(tolerance) = self.asked_tolerance() else {
            let own = |i: usize| {
                let points = batch.points(i);
                (BEZIER_TOLERANCE * size(points, batch.dimension())).max(LEAST_TOLERANCE * largest(points))
            };
            return Ok((0..batch.len()).map(own).collect());
        };
        // Curves that cannot be fitted come out as they came in, whatever the tolerance.
        let fitted = (0..batch.len()).filter(|&i| batch.problem(i).is_none());
        let largest = fitted.map(|i| largest(batch.points(i))).fold(0.0, f64::max);
        let least = LEAST_TOLERANCE * largest;
        if tolerance < least {
            return Err(Error::argument(format!(
                "--tolerance is {tolerance}, but coordinates up to {largest} are rounded to about as much: give {least:.0e} or more"
            )));
        }
        // What the rounding of the output takes is left to it.
        Ok(vec![(1.0 - ROUNDING) * tolerance; batch.len()])
    }
}
