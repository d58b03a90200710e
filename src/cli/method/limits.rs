//! The limits that curves keep.

use std::fmt::Write;
use std::str::FromStr;

use clap::{Args, ValueEnum};
use faircurve::discrete::{Limits, Region};
use faircurve::{Error, Result};

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
    /// A column kmax bounds single spans. A curve for which none is found that keeps its limits is infeasible. With
    /// --energy length=1 alone planar curves are the shortest ones: Dubins' paths.
    #[arg(long, value_name = "K", allow_negative_numbers = true)]
    max_curvature: Option<f64>,
    /// Keeps the turning radius of fair curves at R or more
    #[arg(long, value_name = "R", conflicts_with = "max_curvature", allow_negative_numbers = true)]
    min_radius: Option<f64>,
    /// Lets curves turn only to the side to which their points turn, and fair ones in space twist
    ///
    /// For --method fair, natural and scf. In space it is the sign of torsion that is kept, by an --energy with variation
    /// or torsion.
    #[arg(long)]
    preserve_shape: bool,
    /// Lets fair curves go along an axis from point to point, and not back: x, or x,y for two
    ///
    /// Between two points the coordinate grows, or falls, as it does from one to the other.
    #[arg(long, value_name = "AXIS", value_delimiter = ',')]
    monotone: Vec<Axis>,
    /// Keeps fair curves within D of the chords between their points, in units of the input
    ///
    /// A column corridor has widths of single spans.
    #[arg(long, value_name = "D", allow_negative_numbers = true)]
    corridor: Option<f64>,
    /// Keeps fair curves out of the disc around X,Y of radius R; in space X,Y,Z,R. Give it once for every disc
    #[arg(long, value_name = "X,Y,R", allow_hyphen_values = true)]
    keep_out: Vec<Numbers>,
    /// Keeps fair curves within the disc around X,Y of radius R; in space X,Y,Z,R. Give it once for every disc
    #[arg(long, value_name = "X,Y,R", allow_hyphen_values = true)]
    keep_in: Vec<Numbers>,
    /// Keeps fair curves in the half-plane A x + B y ≤ C; in space A,B,C,D. Give it once for every half-plane
    #[arg(long, value_name = "A,B,C", allow_hyphen_values = true)]
    half_plane: Vec<Numbers>,
    /// Keeps fair curves from being longer than so many times the polygon of their points
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    max_stretch: Option<f64>,
    /// Keeps planar fair curves from crossing each other where their points do not: contour lines, lanes
    ///
    /// Every pair of curves whose polygons of points do not cross or touch is kept apart, at the cost of energy. Curves that do not cross
    /// stay as they are. One that crosses a neighbour in the end is infeasible.
    #[arg(long)]
    no_crossing: bool,
}

impl LimitArgs {
    /// The options that are given.
    pub fn given(&self) -> impl Iterator<Item = &'static str> {
        let all = [
            ("--max-curvature", self.max_curvature.is_some()),
            ("--min-radius", self.min_radius.is_some()),
            ("--preserve-shape", self.preserve_shape),
            ("--monotone", !self.monotone.is_empty()),
            ("--corridor", self.corridor.is_some()),
            ("--keep-out", !self.keep_out.is_empty()),
            ("--keep-in", !self.keep_in.is_empty()),
            ("--half-plane", !self.half_plane.is_empty()),
            ("--max-stretch", self.max_stretch.is_some()),
            ("--no-crossing", self.no_crossing),
        ];
        all.into_iter().filter(|(_, given)| *given).map(|(option, _)| option)
    }

    /// Whether curves keep the shape of their points.
    pub fn shape(&self) -> bool {
        self.preserve_shape
    }

    /// The half-width of the corridor.
    pub fn corridor(&self) -> Option<f64> {
        self.corridor
    }

    /// The words of a caption, each after a comma.
    pub fn title(&self) -> String {
        let mut title = String::new();
        let mut add = |words: String| write!(title, ", {words}").expect("text has room");
        self.max_curvature.iter().for_each(|curvature| add(format!("curvature ≤ {curvature}")));
        self.min_radius.iter().for_each(|radius| add(format!("radius ≥ {radius}")));
        if self.preserve_shape {
            add("shape kept".into());
        }
        self.monotone.iter().for_each(|axis| add(format!("monotone in {}", format!("{axis:?}").to_lowercase())));
        self.corridor.iter().for_each(|width| add(format!("corridor {width}")));
        self.max_stretch.iter().for_each(|stretch| add(format!("length ≤ {stretch} polygons")));
        if self.no_crossing {
            add("no crossing".into());
        }
        match self.regions().count() {
            0 => {}
            1 => add("1 region".into()),
            count => add(format!("{count} regions")),
        }
        title
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
        let given = [
            ("--max-curvature", self.max_curvature, "1/length"),
            ("--min-radius", self.min_radius, "length"),
            ("--corridor", self.corridor, "length"),
        ];
        for (option, value, unit) in given {
            if let Some(value) = value.filter(|value| !(*value > 0.0 && value.is_finite())) {
                return Err(Error::argument(format!(
                    "{option} is {value}; it must be a positive number, in units of {unit}, such as {option} 0.5"
                )));
            }
        }
        let curvature = self.max_curvature.or(self.min_radius.map(|radius| 1.0 / radius));
        let along = |axis: Axis| std::array::from_fn(|c| f64::from(u8::from(c == axis as usize)));
        Ok(Limits {
            curvature,
            shape: self.preserve_shape,
            monotone: self.monotone.iter().map(|&axis| along(axis)).collect(),
            corridor: self.corridor,
            regions: self.regions().collect(),
            stretch: self.max_stretch,
            no_crossing: self.no_crossing,
        })
    }
}
