//! The limits that curves keep.

use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, ValueEnum};
use faircurve::discrete::{Limits, Region};
use faircurve::{CurveBatch, Result, io};

use super::obstacles::Obstacles;
use crate::cli::lengths::Length;
use crate::cli::{count, positive};

/// An axis along which curves go on.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Axis {
    X,
    Y,
    Z,
}

/// Numbers with commas between them, three in the plane and four in space.
#[derive(Clone, Debug)]
struct Numbers(Vec<f64>);

impl FromStr for Numbers {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |part: &str| part.trim().parse::<f64>().map_err(|_| format!("'{part}' is no number"));
        let numbers = text.split(',').map(number).collect::<Result<Vec<f64>, _>>()?;
        match numbers.len() {
            3 | 4 => Ok(Numbers(numbers)),
            count => Err(format!("{count} numbers; give 3 in the plane, or 4 in space, with commas between them")),
        }
    }
}

impl Numbers {
    /// The vector, with NaN for a third coordinate that is not given, and the last number.
    fn split(&self) -> ([f64; 3], f64) {
        let (last, vector) = self.0.split_last().expect("three or four numbers");
        (std::array::from_fn(|c| vector.get(c).copied().unwrap_or(f64::NAN)), *last)
    }
}

#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Limits of fair curves")]
pub struct LimitArgs {
    /// Keeps the curvature of fair curves at K or less, in 1/length
    ///
    /// A column kmax bounds single spans. A curve is infeasible if none is found that keeps its
    /// limits. With --energy length=1 alone, planar curves are the shortest ones: Dubins' paths.
    #[arg(long, value_name = "K", allow_negative_numbers = true)]
    max_curvature: Option<f64>,
    /// Keeps the turning radius of fair curves at R or more
    #[arg(long, value_name = "R", conflicts_with = "max_curvature", allow_negative_numbers = true)]
    min_radius: Option<Length>,
    /// Keeps the rate of change of the curvature of fair curves at R or less, in 1/length²: how fast wheels turn
    #[arg(long, value_name = "R", allow_negative_numbers = true)]
    max_curvature_rate: Option<f64>,
    /// Keeps the slope of fair curves in space, dz by the length in x and y, at G or less
    #[arg(long, value_name = "G", allow_negative_numbers = true)]
    max_climb: Option<f64>,
    /// Lets curves turn only to the side to which their points turn; in space, twist
    ///
    /// For --method fair, natural and scf. In space the sign of torsion is kept, by fair curves
    /// whose --energy has variation or torsion.
    #[arg(long)]
    preserve_shape: bool,
    /// Lets planar fair curves enclose the area that their points do, an open one with the chord
    /// between its ends
    ///
    /// With shared borders every polygon of a map keeps its area, but where crossings are mended.
    #[arg(long)]
    preserve_area: bool,
    /// Lets fair curves go along an axis from point to point, and not back: x, or x,y for two
    ///
    /// Between two points the coordinate grows, or falls, as it does from one to the other.
    #[arg(long, value_name = "AXIS", value_delimiter = ',')]
    monotone: Vec<Axis>,
    /// Keeps fair curves within D of the chords between their points, in units of the input
    ///
    /// A column corridor gives widths of single spans. Columns corridor_left and corridor_right give the
    /// widths to both sides of every point, within which points move as far as --deviation lets them.
    #[arg(long, value_name = "D", allow_negative_numbers = true)]
    corridor: Option<Length>,
    /// Keeps fair curves out of the disc around X,Y of radius R; in space X,Y,Z,R. Give it once for
    /// every disc
    #[arg(long, value_name = "X,Y,R", allow_hyphen_values = true)]
    keep_out: Vec<Numbers>,
    /// Keeps fair curves within the disc around X,Y of radius R; in space X,Y,Z,R. Give it once for
    /// every disc
    #[arg(long, value_name = "X,Y,R", allow_hyphen_values = true)]
    keep_in: Vec<Numbers>,
    /// Keeps fair curves in the half-plane A x + B y ≤ C; in space A,B,C,D. Give it once for every
    /// half-plane
    #[arg(long, value_name = "A,B,C", allow_hyphen_values = true)]
    half_plane: Vec<Numbers>,
    /// Keeps planar fair curves out of obstacles: polygons, and points with a property radius, of GeoJSON
    ///
    /// Curves go the shortest way around. A property curve names the one curve that stays out of a
    /// polygon, a property name what messages call it.
    #[arg(long, value_name = "FILE")]
    obstacles: Option<PathBuf>,
    /// Keeps fair curves D away from obstacles and --keep-out discs
    ///
    /// --tolerance, and what --spacing leaves out of arcs of --min-radius, are added.
    #[arg(long, value_name = "D", allow_negative_numbers = true)]
    clearance: Option<Length>,
    /// Limits of single curves and points: columns curve, point, min_radius, corridor, heading and others
    ///
    /// A row without a curve is for all, and one without a point for all points of a curve; -1 is the last.
    /// Other columns are kmax, corridor_left, corridor_right, pinned, max_speed (--speed), and curvature, which
    /// goes with heading, in degrees from north, and is positive to the left.
    #[arg(long, value_name = "FILE.csv")]
    limits: Option<PathBuf>,
    /// Keeps the length of fair curves at most S times the length of the polygon of their points
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    max_stretch: Option<f64>,
    /// Keeps planar fair curves from crossing each other where their points do not: contour lines,
    /// lanes
    ///
    /// Pairs of curves whose polygons do not cross or touch are kept apart, at the cost of energy.
    /// Curves that do not cross stay as they are. A curve that still crosses a neighbour is
    /// infeasible.
    #[arg(long)]
    no_crossing: bool,
}

impl LimitArgs {
    /// The batch with the limits of its curves and points.
    pub fn with_limits(&self, batch: CurveBatch) -> Result<CurveBatch> {
        self.limits.as_ref().map_or(Ok(batch.clone()), |path| io::read_limits(path, &batch))
    }

    /// Whether curves keep the shape of their points.
    pub fn shape(&self) -> bool {
        self.preserve_shape
    }

    /// Whether curves keep the area of their points.
    pub fn area(&self) -> bool {
        self.preserve_area
    }

    /// The half-width of the corridor.
    pub fn corridor(&self) -> Option<f64> {
        self.corridor.map(Length::number)
    }

    /// The lengths among them, with their options.
    pub fn lengths(&mut self) -> impl Iterator<Item = (&'static str, &mut Length)> {
        let options = [
            ("--min-radius", &mut self.min_radius),
            ("--corridor", &mut self.corridor),
            ("--clearance", &mut self.clearance),
        ];
        options.into_iter().filter_map(|(option, length)| Some((option, length.as_mut()?)))
    }

    /// The words of a caption.
    pub fn titles(&self) -> impl Iterator<Item = String> {
        let regions = self.regions().count();
        let before = [
            self.max_curvature.map(|curvature| format!("curvature ≤ {curvature}")),
            self.min_radius.map(|radius| format!("radius ≥ {radius}")),
            self.max_curvature_rate.map(|rate| format!("curvature rate ≤ {rate}")),
            self.max_climb.map(|climb| format!("slope ≤ {climb}")),
            self.preserve_shape.then(|| "shape kept".into()),
        ];
        let after = [
            self.corridor.map(|width| format!("corridor {width}")),
            self.max_stretch.map(|stretch| format!("length ≤ {stretch} polygons")),
            self.preserve_area.then(|| "area kept".into()),
            self.no_crossing.then(|| "no crossing".into()),
            (regions > 0).then(|| count(regions, "region")),
            self.obstacles.as_ref().map(|_| "obstacles".into()),
        ];
        let along =
            self.monotone.iter().map(|axis| Some(format!("monotone in {}", format!("{axis:?}").to_lowercase())));
        before.into_iter().chain(along).chain(after).flatten()
    }

    fn regions(&self) -> impl Iterator<Item = Region> {
        let split = Numbers::split;
        let half_planes =
            self.half_plane.iter().map(split).map(|(normal, offset)| Region::HalfSpace { normal, offset });
        let inside = self.keep_in.iter().map(split).map(|(center, radius)| Region::Inside { center, radius });
        let outside = self.keep_out.iter().map(split).map(|(center, radius)| Region::Outside { center, radius });
        half_planes.chain(inside).chain(outside)
    }

    /// The limits for curves of a dimension.
    pub fn limits(&self) -> Result<Limits> {
        for (option, value, unit) in [
            ("--max-curvature", self.max_curvature, "1/length"),
            ("--min-radius", self.min_radius.map(Length::number), "length"),
            ("--max-curvature-rate", self.max_curvature_rate, "1/length²"),
            ("--max-climb", self.max_climb, "length by length"),
            ("--corridor", self.corridor(), "length"),
            ("--clearance", self.clearance.map(Length::number), "length"),
        ] {
            let why = format!("it must be a positive number, in units of {unit}, such as {option} 0.5");
            value.map_or(Ok(0.0), |value| positive(option, value, &why))?;
        }
        let curvature = self.max_curvature.or(self.min_radius.map(|radius| 1.0 / radius.number()));
        let along = |axis: Axis| std::array::from_fn(|c| f64::from(u8::from(c == axis as usize)));
        let mut limits = Limits {
            curvature,
            curvature_rate: self.max_curvature_rate,
            climb: self.max_climb,
            shape: self.preserve_shape,
            corridor: self.corridor(),
            stretch: self.max_stretch,
            area: self.preserve_area,
            no_crossing: self.no_crossing,
            ..Limits::default()
        };
        limits.monotone.extend(self.monotone.iter().map(|&axis| along(axis)));
        limits.regions.extend(self.regions());
        if let Some(path) = &self.obstacles {
            let Obstacles { polygons, discs } = Obstacles::read(path)?;
            limits.obstacles = polygons;
            limits.regions.extend(discs);
        }
        Ok(self.clearance.map_or(limits.clone(), |clearance| limits.with_clearance(clearance.number())))
    }
}
