//! The methods and their options, checked before any work is done.

mod chosen;
mod energy;
mod fair;
mod limits;
mod obstacles;
mod surface;
mod units;

use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

use clap::{Args, ValueEnum};
use faircurve::discrete::{Pins, Solver};
use faircurve::scf::Smooth;
use faircurve::spline::{Band, Corners, Natural, Parametrisation, Smoothing, SmoothingTarget};
use faircurve::tracks::{self, ELEVATION};
use faircurve::{Column, CurveBatch, Deviation, Error, Fit, Result};

pub use self::chosen::Method;
pub use self::energy::weights;
use self::energy::{EnergyWeights, energy_help};
use self::limits::LimitArgs;
use self::surface::SurfaceArgs;
use super::count;
use super::given::Given;
use super::lengths::Length;
use super::words::one_of;

/// How much heights are smoothed.
#[derive(Clone, Copy, Debug)]
pub enum HeightTarget {
    Within(Length),
    Gcv,
}

impl FromStr for HeightTarget {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        if text == "gcv" { Ok(HeightTarget::Gcv) } else { text.parse().map(HeightTarget::Within) }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum MethodName {
    /// Cubic splines through every point, with no curvature at the ends
    Natural,
    /// Smoothing splines near the points: --smoothing or --deviation says how near
    Smoothing,
    /// Discrete fair curves of least --energy through every point, or near them: --deviation says
    /// how near
    Fair,
    /// Smooth connection functions through every point: exact planar curves of least ∫|κ|^ν ds
    Scf,
    /// Geodesics of a --surface from point to point; a closed curve descends to a closed geodesic
    /// near it
    Geodesic,
}

/// An angle, such as 60deg, 60° or 60.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Degrees(pub f64);

impl FromStr for Degrees {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = text.strip_suffix("deg").or_else(|| text.strip_suffix('°')).unwrap_or(text).trim();
        let degrees: f64 = number.parse().map_err(|_| format!("'{text}' is no angle: give degrees, such as 60deg"))?;
        if !(0.0..=180.0).contains(&degrees) {
            return Err(format!(
                "{text} is not between 0 and 180 degrees; corners are turns by more than such an angle"
            ));
        }
        Ok(Degrees(degrees))
    }
}

/// λ, or how it is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SmoothingFactor {
    Lambda(f64),
    Gcv,
}

impl FromStr for SmoothingFactor {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.parse()) {
            ("gcv", _) => Ok(SmoothingFactor::Gcv),
            (_, Ok(lambda)) => Ok(SmoothingFactor::Lambda(lambda)),
            _ => Err(format!("'{text}' is no λ: give a number, or gcv")),
        }
    }
}

impl Display for SmoothingFactor {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            SmoothingFactor::Lambda(lambda) => lambda.fmt(f),
            SmoothingFactor::Gcv => f.write_str("gcv"),
        }
    }
}

/// The corners to keep: auto, or an angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum KeptCorners {
    Auto,
    Straight,
    Above(Degrees),
}

impl FromStr for KeptCorners {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(KeptCorners::Auto),
            "straight" => Ok(KeptCorners::Straight),
            angle => angle.parse().map(KeptCorners::Above),
        }
    }
}

/// What is fitted.
#[derive(Args, Clone, Debug)]
pub struct MethodArgs {
    #[command(flatten)]
    given: Given,
    /// How curves are fitted [default: natural]
    ///
    /// With --within, --smoothing, --deviation or --tube the default is smoothing, and with a limit, such as
    /// --max-curvature, or a --surface it is fair.
    #[arg(long, value_enum)]
    method: Option<MethodName>,
    /// Segments per span between data points [default: 16]
    ///
    /// K points give N(K−1)+1 points, a closed curve N·K.
    #[arg(long, value_name = "N", allow_negative_numbers = true, help_heading = "Output")]
    pub samples: Option<i64>,
    /// Which points of open curves stay where they are [default: ends]
    #[arg(long, value_parser = one_of(&Pins::WORDS[1..]), help_heading = "Near the points")]
    pin: Option<Pins>,
    /// Smoothing parameter λ ≥ 0, or gcv, which chooses it by the data of each curve
    ///
    /// A larger one is smoother. 0 goes through every point. It is in the cube of the unit of t: of
    /// an hour where t holds dates. gcv is generalised cross-validation, for open curves with noise of
    /// one size.
    #[arg(
        long,
        value_name = "λ|gcv",
        conflicts_with = "deviation",
        allow_negative_numbers = true,
        help_heading = "Near the points"
    )]
    smoothing: Option<SmoothingFactor>,
    /// Moves no point by more than D
    ///
    /// Each curve is then as smooth, or as fair, as it can be. D is in units of the input, or a
    /// part of each curve's size (the diagonal of the box around its points), such as 2%, or in
    /// drawings and streamlines a length such as 0.5mm or 2px. Longitudes and latitudes are in degrees,
    /// and with --surface wgs84 D is in metres, or 50m, 2km, 1nmi.
    #[arg(long, value_name = "D", allow_negative_numbers = true, help_heading = "Near the points")]
    deviation: Option<Deviation>,
    /// Smoothing splines of least bending within D of every point
    ///
    /// A single outlier does not stiffen the rest, as it does with --deviation. D is as for
    /// --deviation.
    #[arg(long, value_name = "D", conflicts_with_all = ["smoothing", "deviation"], allow_negative_numbers = true, help_heading = "Near the points")]
    tube: Option<Deviation>,
    /// Keeps smoothed heights of tracks within H of those given, or smooths them as their noise asks: gcv
    ///
    /// Heights are the column z of longitudes and latitudes, or the elevations of a GPX file, a column ele.
    #[arg(long, value_name = "H|gcv", allow_negative_numbers = true, help_heading = "Near the points")]
    within_height: Option<HeightTarget>,
    /// Smooth curves within D of the whole polygon, and the polygon within D of them
    ///
    /// For maps and drawings, where the lines between points count. Long straight lines stay
    /// straight, corners are rounded, and closed curves and the regions of a map keep their area.
    /// D is as for --deviation. On a map of longitudes and latitudes it may be a length on the
    /// ground, such as 50m, 2km or 1nmi, at every latitude.
    #[arg(long, value_name = "D", conflicts_with_all = ["smoothing", "deviation", "tube"], allow_negative_numbers = true, help_heading = "Near the points")]
    within: Option<Deviation>,
    /// Parameters of the points of natural and smoothing splines [default: auto]
    #[arg(long, value_parser = one_of(Parametrisation::WORDS), help_heading = "Splines")]
    parametrisation: Option<Parametrisation>,
    /// Keeps corners: points where the input turns by more than this
    ///
    /// In degrees, such as 60deg, or 60. With --within it may be auto or straight. auto finds corners at
    /// the scale of D, also in noise of half of it; curves that are round at that scale have none.
    /// straight takes those between straight lines of 8 D or more, as surveyed borders have them.
    #[arg(long, value_name = "auto|straight|ANGLE", allow_hyphen_values = true, help_heading = "Near the points")]
    corners: Option<KeptCorners>,
    #[arg(long, value_name = "NAME=WEIGHT,...", help = energy_help(), help_heading = "Fair curves")]
    energy: Option<EnergyWeights>,
    /// Exponent ν of ∫|κ|^ν ds [default: 2]
    ///
    /// From 1 on for fair curves, above 1 for smooth connection functions.
    #[arg(
        long,
        value_name = "ν",
        allow_negative_numbers = true,
        help_heading = "Fair curves and smooth connection functions"
    )]
    exponent: Option<f64>,
    /// How curves descend to the minimum [default: newton]
    ///
    /// Smooth connection functions know newton only.
    #[arg(long, value_parser = one_of(Solver::WORDS), help_heading = "Fair curves and smooth connection functions")]
    solver: Option<Solver>,
    /// Number of searches per curve, of which the best is kept [default: 1]
    ///
    /// Fair curves start from the spline, from circles through neighbouring points, from the
    /// polygon rounded, and then from random directions. Smooth connection functions start from the
    /// circles, and then from random directions near those.
    #[arg(long, value_name = "N", help_heading = "Fair curves and smooth connection functions")]
    starts: Option<u32>,
    /// Tension τ ≥ 0. With tension every list of points has a curve [default: 0, none]
    ///
    /// Minimises ∫(|κ|^ν + λ) ds, where λ = (2(1 − 1/ν)τ/w)^ν and w is the width of the data. τ has
    /// no unit. 1 keeps curves from loops, and a larger value makes them tighter.
    #[arg(long, value_name = "τ", allow_negative_numbers = true, help_heading = "Smooth connection functions")]
    tension: Option<f64>,
    /// Iterations at most [default: 500, scf 200]
    #[arg(long, value_name = "N", help_heading = "Fair curves and smooth connection functions")]
    max_iterations: Option<u32>,
    /// When a curve has converged; smaller is stricter [default: 1e-8, scf 1e-10]
    ///
    /// For fair curves it is the size of the gradient, where the curve has size 1. For smooth
    /// connection functions it is the relative decrement.
    #[arg(
        long,
        value_name = "SIZE",
        allow_negative_numbers = true,
        help_heading = "Fair curves and smooth connection functions"
    )]
    convergence: Option<f64>,
    #[command(flatten)]
    limits: LimitArgs,
    #[command(flatten)]
    surface: SurfaceArgs,
}

impl MethodArgs {
    /// The method asked for by its name, or by an option that only makes sense with it.
    pub fn name(&self) -> MethodName {
        let near = [self.deviation, self.tube, self.within].iter().any(Option::is_some) || self.smoothing.is_some();
        let is_smoothed_in_surface = self.surface.is_given() && (self.smoothing.is_some() || self.tube.is_some());
        let has_limits = !self.given.of::<LimitArgs>().is_empty() || self.surface.is_given();
        self.method.unwrap_or(match (has_limits && !is_smoothed_in_surface, near) {
            (true, _) => MethodName::Fair,
            (_, true) => MethodName::Smoothing,
            _ => MethodName::Natural,
        })
    }

    /// Its word on the command line, and what captions call its curves.
    fn facts(&self) -> (&'static str, &'static str) {
        match self.name() {
            MethodName::Natural => ("natural", "natural cubic splines"),
            MethodName::Smoothing => ("smoothing", "smoothing splines"),
            MethodName::Fair => ("fair", "fair curves"),
            MethodName::Scf => ("scf", "smooth connection functions"),
            MethodName::Geodesic => ("geodesic", "geodesics"),
        }
    }

    /// The word of the command line.
    pub fn word(&self) -> &'static str {
        self.facts().0
    }

    /// What a caption calls it: the name of the curves and what is asked of them.
    pub fn title(&self) -> String {
        if let Some(distance) = self.tube.or(self.within) {
            let corners = if self.corners.is_some() { ", with their corners" } else { "" };
            return format!("splines of least bending within {distance}{corners}");
        }
        let asked = [
            (self.name() == MethodName::Fair).then(|| self.energy().to_string()),
            (self.name() == MethodName::Scf).then(|| format!("ν = {}", self.exponent.unwrap_or(2.0))),
            self.tension.map(|tension| format!("τ = {tension}")),
            self.smoothing.map(|lambda| format!("λ = {lambda}")),
            self.deviation.map(|deviation| format!("deviation ≤ {deviation}")),
        ];
        let corners = self.corners.map(|corners| match corners {
            KeptCorners::Auto | KeptCorners::Straight => "with their corners".into(),
            KeptCorners::Above(Degrees(angle)) => format!("corners over {angle}°"),
        });
        let asked = asked.into_iter().flatten().chain(self.limits.titles()).chain(self.surface.title()).chain(corners);
        [self.facts().1.to_string()].into_iter().chain(asked).collect::<Vec<_>>().join(", ")
    }

    /// The method asked for.
    ///
    /// # Errors
    /// Options that belong to another method, are missing, or are out of range.
    pub fn method(&self, spacing: Option<f64>) -> Result<Method> {
        self.refuse_options_of_others()?;
        let parametrisation = self.parametrisation.unwrap_or_default();
        match self.name() {
            MethodName::Fair => Ok(Method::Fair(Box::new(self.fair(spacing)?))),
            MethodName::Geodesic => Ok(Method::Fair(Box::new(self.geodesic(spacing)?))),
            MethodName::Scf => Ok(Method::Scf(self.scf()?)),
            MethodName::Natural | MethodName::Smoothing if self.surface.is_given() => {
                Ok(Method::InSurface(Box::new(self.in_surface()?)))
            }
            MethodName::Natural => {
                self.refuse_distance("natural splines")?;
                Ok(Method::Natural(Natural { parametrisation, shape: self.limits.shape(), ..Natural::default() }))
            }
            MethodName::Smoothing if self.within.is_some() => {
                if let Some(parametrisation) = self.parametrisation {
                    return Err(Error::argument(format!(
                        "--parametrisation {parametrisation} does not go with --within, which goes by arc length"
                    )));
                }
                let within = self.within.map(|within| positive("--within", within)).transpose()?;
                let band = within.map(Band::within).expect("it is given");
                let corners = match self.corners {
                    None => Corners::Rounded,
                    Some(KeptCorners::Auto) => Corners::Auto,
                    Some(KeptCorners::Straight) => Corners::Straight,
                    Some(KeptCorners::Above(Degrees(angle))) => Corners::Above(angle.to_radians()),
                };
                Ok(Method::Band(Band { pin_ends: self.pin != Some(Pins::None), corners, ..band }))
            }
            MethodName::Smoothing => {
                let target = self.smoothing_target()?;
                let pin_ends = self.pin != Some(Pins::None);
                Ok(Method::Smoothing(Smoothing { target, pin_ends, parametrisation }))
            }
        }
    }

    /// How much is smoothed.
    fn smoothing_target(&self) -> Result<SmoothingTarget> {
        match (self.lambda()?, self.deviation, self.tube) {
            _ if self.smoothing == Some(SmoothingFactor::Gcv) => Ok(SmoothingTarget::CrossValidation),
            (Some(lambda), ..) => Ok(SmoothingTarget::Lambda(lambda)),
            (_, Some(deviation), _) => Ok(SmoothingTarget::Deviation(positive("--deviation", deviation)?)),
            (_, _, Some(tube)) => Ok(SmoothingTarget::Tube(positive("--tube", tube)?)),
            (None, None, None) => Err(Error::argument(
                "--method smoothing needs to know how far: give --smoothing λ (such as --smoothing 0.1) or --deviation D (such as \
                 --deviation 0.01, in units of the input), or --tube D or --within D",
            )),
        }
    }

    /// Puts smoothing splines on the Earth if their distance is one on the ground, or their λ is chosen.
    /// Returns what is to be said.
    pub fn put_on_earth(&mut self) -> Option<String> {
        let distance = self.tube.or(self.deviation).filter(|own| matches!(own, Deviation::Metres(_)));
        let what = match (distance, self.smoothing) {
            (Some(distance), _) => format!("{distance} is"),
            (_, Some(SmoothingFactor::Gcv)) => "tracks are".to_string(),
            _ => return None,
        };
        if self.surface.is_given() || self.name() != MethodName::Smoothing {
            return None;
        }
        self.surface = SurfaceArgs::wgs84();
        Some(format!("{what} on the ground: lengths and speeds are in metres, as with --surface wgs84"))
    }

    /// How heights are smoothed, if they are.
    fn heights(&self) -> Option<SmoothingTarget> {
        Some(match self.within_height? {
            HeightTarget::Gcv => SmoothingTarget::CrossValidation,
            HeightTarget::Within(Length(distance)) => SmoothingTarget::Tube(distance),
        })
    }

    /// The batch with smoothed elevations, if they are a column and smoothing was asked for.
    pub fn smooth_elevations(&self, batch: CurveBatch) -> Result<CurveBatch> {
        let is_elevation = |column: &Column| column.name == ELEVATION && column.values.numbers().is_some();
        let is_column = batch.dimension() == 2 && batch.has_parameters() && batch.columns().iter().any(is_elevation);
        match (self.heights(), self.within_height) {
            (Some(target), _) if is_column => tracks::smooth_column(&batch, ELEVATION, target),
            (_, Some(HeightTarget::Within(height))) if !self.surface.is_globe() || batch.dimension() == 2 => {
                Err(Error::argument(format!(
                    "--within-height {height} is of heights of longitudes and latitudes on the ground: give a column z and \
                     --surface wgs84 or a distance in metres, or elevations with times, a column ele"
                )))
            }
            _ => Ok(batch),
        }
    }

    /// What is to be said of usable curves that, as they are written, meet what they stay out of.
    pub fn note_of_cuts(&self, curves: &CurveBatch, fit: &Fit) -> Result<Option<String>> {
        let mut cut = self.limits.limits()?.cut(curves);
        cut.retain(|&i| fit.reports()[i].status.is_usable());
        Ok(cut.first().map(|&first| {
            let (n, meet) = (count(cut.len(), "curve"), if cut.len() == 1 { "meets" } else { "meet" });
            let first = curves.label(first);
            format!("{n}, such as {first}, {meet} obstacles between samples: write more samples, or add --clearance")
        }))
    }

    /// The batch with the limits of its curves and points.
    pub fn with_limits(&self, batch: CurveBatch) -> Result<CurveBatch> {
        self.limits.with_limits(batch)
    }

    /// λ of smoothing splines, if it is given.
    fn lambda(&self) -> Result<Option<f64>> {
        match self.smoothing {
            Some(SmoothingFactor::Lambda(lambda)) if !(lambda >= 0.0 && lambda.is_finite()) => Err(Error::argument(
                format!("--smoothing is {lambda}; λ must be 0 or a positive number, such as --smoothing 0.1"),
            )),
            Some(SmoothingFactor::Lambda(lambda)) => Ok(Some(lambda)),
            Some(SmoothingFactor::Gcv) | None => Ok(None),
        }
    }

    /// --within, if it is given.
    pub fn within(&self) -> Option<Deviation> {
        self.within
    }

    /// The distances and lengths among the options.
    pub fn lengths(&mut self) -> impl Iterator<Item = (&'static str, &mut Deviation)> {
        let near = [("--deviation", &mut self.deviation), ("--tube", &mut self.tube), ("--within", &mut self.within)];
        let height = self.within_height.iter_mut().filter_map(|height| match height {
            HeightTarget::Within(length) => Some(("--within-height", &mut length.0)),
            HeightTarget::Gcv => None,
        });
        let near = near.into_iter().filter_map(|(option, distance)| Some((option, distance.as_mut()?))).chain(height);
        near.chain(self.limits.lengths().map(|(option, length)| (option, &mut length.0)))
    }

    /// Whether lengths are those on the Earth, in metres.
    pub fn is_on_globe(&self) -> bool {
        self.surface.is_earth()
    }

    /// Whether curves keep the area of their points.
    pub fn keeps_area(&self) -> bool {
        self.limits.area()
    }

    fn scf(&self) -> Result<Smooth> {
        self.refuse_distance("smooth connection functions")?;
        if self.solver.is_some_and(|solver| solver != Solver::Newton) {
            return Err(Error::argument(
                "smooth connection functions are found by --solver newton; the others belong to --method fair",
            ));
        }
        let defaults = Smooth::default();
        Ok(Smooth {
            exponent: self.exponent.unwrap_or(defaults.exponent),
            tension: self.tension.unwrap_or(defaults.tension),
            shape: self.limits.shape(),
            starts: self.starts.unwrap_or(defaults.starts),
            tolerance: self.convergence.unwrap_or(defaults.tolerance),
            max_iterations: self.max_iterations.unwrap_or(defaults.max_iterations),
            ..defaults
        })
    }

    /// Refuses what leads away from the points, for methods that go through all of them.
    fn refuse_distance(&self, curves: &str) -> Result<()> {
        let lambda = self.smoothing.map(|lambda| ("--smoothing", lambda.to_string()));
        let given = lambda.or(self.deviation.map(|deviation| ("--deviation", deviation.to_string())));
        if let Some((option, value)) = given {
            return Err(Error::argument(format!(
                "{option} {value} belongs to --method smoothing; {curves} go through every point"
            )));
        }
        if self.pin == Some(Pins::None) {
            let why = format!("--pin none belongs to --method smoothing; {curves} go through every point");
            return Err(Error::argument(why));
        }
        Ok(())
    }

    fn refuse_options_of_others(&self) -> Result<()> {
        if let Some(size) = self.convergence {
            super::positive("--convergence", size, "it must be a positive number, such as 1e-8")?;
        }
        use MethodName::{Fair, Geodesic, Natural, Scf};
        if self.surface.is_given() && self.name() == Scf {
            return Err(Error::argument(
                "smooth connection functions are planar: in a --surface ask for --method fair",
            ));
        }
        if self.surface.is_given() && self.name() == Natural && self.limits.shape() {
            return Err(Error::argument("--preserve-shape is that of planar curves: leave it out in a --surface"));
        }
        if let Some(within) = self.within.filter(|_| self.surface.is_given()) {
            return Err(Error::argument(format!(
                "--within {within} goes with no --surface: leave the surface out, or ask for --deviation {within}"
            )));
        }
        for (option, distance) in [("--tube", self.tube), ("--within", self.within)] {
            if let Some(distance) = distance.filter(|_| self.name() != MethodName::Smoothing) {
                return Err(Error::argument(format!("{option} {distance} belongs to --method smoothing")));
            }
        }
        if let Some(parametrisation) = self.parametrisation.filter(|_| matches!(self.name(), Fair | Scf | Geodesic)) {
            return Err(Error::argument(format!(
                "--parametrisation {parametrisation} belongs to --method natural and --method smoothing"
            )));
        }
        let owners = |option: &str| -> &[MethodName] {
            match option {
                "--method" | "--samples" | "--pin" | "--smoothing" | "--deviation" | "--tube" | "--within"
                | "--parametrisation" | "--surface" | "--radius" | "--off-surface" => MethodName::value_variants(),
                "--exponent" | "--solver" | "--starts" => &[Fair, Scf],
                "--corners" => &[Fair, MethodName::Smoothing],
                "--within-height" => &[MethodName::Smoothing],
                "--tension" => &[Scf],
                "--max-iterations" | "--convergence" => &[Fair, Scf, Geodesic],
                "--preserve-shape" => &[Fair, Natural, Scf],
                _ => &[Fair],
            }
        };
        if self.corners.is_some() && self.name() == MethodName::Smoothing && self.within.is_none() {
            return Err(Error::argument("--corners goes with --within, or with --method fair"));
        }
        let Some(option) = self.given.of::<Self>().into_iter().find(|option| !owners(option).contains(&self.name()))
        else {
            return Ok(());
        };
        let named = owners(&option).iter().filter(|owner| **owner != Geodesic);
        let named = named.filter_map(|owner| Some(format!("--method {}", owner.to_possible_value()?.get_name())));
        Err(Error::argument(format!("{option} belongs to {}", all_of(&named.collect::<Vec<_>>()))))
    }
}

/// "a, b and c".
fn all_of(words: &[String]) -> String {
    match words {
        [first @ .., last] if !first.is_empty() => format!("{} and {last}", first.join(", ")),
        _ => words.concat(),
    }
}

/// A deviation that makes sense.
fn positive(option: &str, deviation: Deviation) -> Result<Deviation> {
    let number = deviation.number();
    if number > 0.0 && number.is_finite() {
        return Ok(deviation);
    }
    Err(Error::argument(format!(
        "{option} is {deviation}; it must be a positive number, such as {option} 0.01 or {option} 2%"
    )))
}
