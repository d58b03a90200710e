//! What `faircurve bezier` takes a file's points for, and what it completes them by.

use std::str::FromStr;

use clap::{Args, ValueEnum};
use faircurve::bezier::{Chain, Complete, Completed, EndTangents, Energy, Joints, MOST_DEGREE, PieceLengths, Simplify};
use faircurve::io::{self, Closed, Flatness, Format, ReadOptions};
use faircurve::{Constraints, CurveBatch, Device, Error, Result};

use super::method::{Degrees, weights};
use super::words::one_of;
use super::{InputArgs, count, thousands};

/// The degree of the pieces in SVG.
const CUBIC: usize = 3;

/// The energies by name, ∫|X′|², ∫|X″|² and ∫|X‴|².
const ENERGIES: [&str; 3] = ["tension", "bending", "variation"];

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum KnownWord {
    /// Those that the file says: its column or array `known`, and all of them without
    File,
    /// Those where pieces meet, and the ends
    Joints,
    /// The first and the last
    Ends,
}

/// Weights of ∫|X′|², ∫|X″|² and ∫|X‴|².
#[derive(Clone, Copy, Debug, PartialEq)]
struct Weights([f64; 3]);

impl FromStr for Weights {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut found = [0.0; 3];
        for (name, weight) in weights(text, &ENERGIES)? {
            let order = ENERGIES.iter().position(|energy| *energy == name).expect("names are checked with the weights");
            found[order] = weight;
        }
        if found == [0.0; 3] {
            return Err(
                "every weight is 0, and nothing would be minimised: give one that is positive, such as bending=1"
                    .into(),
            );
        }
        Ok(Weights(found))
    }
}

#[derive(Args, Debug)]
pub struct PlanArgs {
    /// Reads every curve as a chain of Béziers of degree D
    ///
    /// A chain has D control points per piece and one more, or none more if it is closed. Without
    /// this option every curve is one Bézier curve, closed only where the file or --closed yes says
    /// so. Paths of SVG are chains of cubics.
    #[arg(long, value_name = "D", allow_negative_numbers = true, help_heading = "Béziers")]
    degree: Option<i64>,
    /// How the pieces of a chain meet [default: free]
    #[arg(long, value_parser = one_of(Joints::WORDS), help_heading = "Béziers")]
    joints: Option<Joints>,
    /// How long the pieces of a chain are in the parameter [default: chords]
    ///
    /// Joints and energies refer to it.
    #[arg(long, value_parser = one_of(PieceLengths::WORDS), help_heading = "Béziers")]
    lengths: Option<PieceLengths>,
    /// Which control points are kept; the others are completed
    #[arg(long, value_enum, default_value_t = KnownWord::File, help_heading = "Béziers")]
    known: KnownWord,
    /// What tangents at the ends of a single curve say [default: derivatives]
    ///
    /// They are the columns tx ty tz.
    #[arg(long, value_parser = one_of(EndTangents::WORDS), help_heading = "Béziers")]
    tangents: Option<EndTangents>,
    /// What is minimised
    ///
    /// A weighted sum of ∫|X″|² (bending), ∫|X′|² (tension) and ∫|X‴|² (variation) over the
    /// parameter, which is 0 to 1 of a single curve.
    #[arg(long, value_name = "NAME=WEIGHT,...", default_value = "bending=1", help_heading = "Béziers")]
    energy: Weights,
    /// Keeps corners: joints where the handles given turn by more than this angle, in degrees
    ///
    /// The parts of a chain between corners are completed as chains of their own. [default with
    /// --simplify: 1]
    #[arg(long, value_name = "DEGREES", help_heading = "Béziers")]
    corners: Option<Degrees>,
    /// Lays as few cubics as possible within --tolerance of those given
    ///
    /// Joints are free to go, directions are kept, and corners too. All control points count as
    /// known.
    #[arg(long, conflicts_with_all = ["joints", "lengths", "known", "tangents", "energy"], help_heading = "Béziers")]
    simplify: bool,
    /// Ends Béziers where x or y is extreme, as fonts ask
    #[arg(long, requires = "simplify", help_heading = "Béziers")]
    extremes: bool,
}

/// What points are, and how they are completed.
pub struct Plan {
    method: Method,
    known: KnownWord,
    closed: Closed,
    /// Whether the input is a drawing.
    svg: bool,
}

enum Method {
    Single(Complete),
    Chain(Chain),
    Simplify(Simplify),
}

impl PlanArgs {
    /// What is to be done, checked before anything is read.
    ///
    /// # Errors
    /// Options that do not fit together, or are out of range.
    pub fn plan(&self, input: &InputArgs, tolerance: Option<f64>) -> Result<Plan> {
        let svg = input.format() == Some(Format::Svg);
        if self.simplify {
            let method = Method::Simplify(self.simplified(tolerance)?);
            return Ok(Plan { method, known: KnownWord::File, closed: input.closed, svg });
        }
        let energy = Energy { weights: self.energy.0 };
        let (method, closed) = match self.degree(svg)? {
            Some(degree) => {
                if self.tangents.is_some() {
                    return Err(Error::argument(
                        "--tangents belongs to single Bézier curves; those of chains are directions with --joints g1, and derivatives else: \
                         leave it out",
                    ));
                }
                let joints = self.joints.unwrap_or(Joints::Free);
                let lengths = self.lengths.unwrap_or_default();
                (Method::Chain(Chain { degree, joints, energy, lengths, corners: self.angle() }), input.closed)
            }
            None => {
                self.refuse_what_needs_a_chain()?;
                let tangents = self.tangents.unwrap_or_default();
                // A curve that ends where it starts has both points in its polygon, unless the file
                // marks it as closed.
                let closed = match input.closed {
                    Closed::Auto if input.format() != Some(Format::Npz) => Closed::No,
                    given => given,
                };
                (Method::Single(Complete { energy, tangents }), closed)
            }
        };
        Ok(Plan { method, known: self.known, closed, svg })
    }

    /// Turns by more than this angle are corners (radians).
    fn angle(&self) -> Option<f64> {
        self.corners.map(|Degrees(angle)| angle.to_radians())
    }

    fn simplified(&self, tolerance: Option<f64>) -> Result<Simplify> {
        let Some(tolerance) = tolerance else {
            return Err(Error::argument(
                "--simplify needs to know how far the new curves may be from those given, in units of the input: give --tolerance, \
                 such as --tolerance 0.5",
            ));
        };
        if self.degree.is_some_and(|degree| degree != CUBIC as i64) {
            return Err(Error::argument("--simplify takes chains of cubics: give --degree 3, or leave it out"));
        }
        let by_default = Simplify::default();
        Ok(Simplify { tolerance, corners: self.angle().unwrap_or(by_default.corners), extremes: self.extremes })
    }

    /// Whether fewer cubics are wanted.
    pub fn simplifies(&self) -> bool {
        self.simplify
    }

    /// The degree of a chain's pieces; none for single curves.
    fn degree(&self, svg: bool) -> Result<Option<usize>> {
        match self.degree {
            None => Ok(svg.then_some(CUBIC)),
            Some(degree) if svg && degree != CUBIC as i64 => Err(Error::argument(format!(
                "--degree is {degree}, but paths of SVG are read as chains of cubics: leave it out; --elevate raises the degree"
            ))),
            Some(degree) if (1..=MOST_DEGREE as i64).contains(&degree) => Ok(Some(degree as usize)),
            Some(degree) => Err(Error::argument(format!(
                "--degree is {degree}; degrees from 1 to {MOST_DEGREE} are possible, such as --degree 3"
            ))),
        }
    }

    fn refuse_what_needs_a_chain(&self) -> Result<()> {
        let chain = "give --degree D, such as --degree 3, where every curve of the file is a chain";
        if let Some(joints) = self.joints {
            return Err(Error::argument(format!("--joints {joints} says how the pieces of a chain meet: {chain}")));
        }
        if self.corners.is_some() {
            return Err(Error::argument(format!("--corners keeps joints of a chain as corners: {chain}")));
        }
        if self.lengths.is_some() {
            return Err(Error::argument(format!("--lengths says how long the pieces of a chain are: {chain}")));
        }
        if self.known == KnownWord::Joints {
            return Err(Error::argument(format!(
                "--known joints keeps the points where the pieces of a chain meet: {chain}, or --known ends"
            )));
        }
        Ok(())
    }

    /// What a caption calls it.
    pub fn title(&self) -> String {
        if self.simplify {
            return "Fewer cubics".into();
        }
        let energies = ENERGIES.iter().zip(self.energy.0).filter(|(_, weight)| *weight > 0.0);
        let sum: Vec<String> = energies
            .map(|(name, weight)| if weight == 1.0 { name.to_string() } else { format!("{weight} {name}") })
            .collect();
        format!("Bézier curves of least {}", sum.join(" + "))
    }
}

impl Plan {
    /// Reads the control points, with cubics so near to the arcs of a drawing, and marks those that
    /// are kept.
    ///
    /// # Errors
    /// Those of reading; weights; closed chains of which only the ends would be kept.
    pub fn read(&self, input: &InputArgs, arcs: Flatness) -> Result<CurveBatch> {
        let options = ReadOptions { closed: self.closed, controls: self.svg, flatness: Some(arcs), ..input.options() };
        let batch = io::read_with(&input.input, &options)?;
        if (0..batch.len()).any(|i| batch.weights(i).is_some()) {
            return Err(Error::argument(
                "the file gives its points weights, but Bézier curves are polynomial here and have none: drop the column with \
                 --columns weight=, or the array",
            ));
        }
        let flags = match (self.known, &self.method) {
            (KnownWord::File, _) => return Ok(batch),
            (KnownWord::Joints, Method::Chain(chain)) => joints(&batch, chain.degree),
            _ => ends(&batch)?,
        };
        let constraints = Constraints { known: Some(flags), ..batch.constraints().clone() };
        batch.with_constraints(constraints)
    }

    /// Completes the control points.
    ///
    /// # Errors
    /// Those of the device.
    pub fn complete(&self, batch: &CurveBatch, device: &Device) -> Result<Completed> {
        match &self.method {
            Method::Single(complete) => complete.fit(batch, device),
            Method::Chain(chain) => chain.fit(batch, device),
            Method::Simplify(simplify) => simplify.fit(batch, device),
        }
    }

    /// Whether the input is cubics as well.
    pub fn reads_cubics(&self) -> bool {
        self.svg || matches!(self.method, Method::Simplify(_))
    }

    /// What is worth a line about what was completed.
    pub fn notes(&self, before: &CurveBatch, after: &CurveBatch) -> Vec<String> {
        let cubics = |batch: &CurveBatch| (0..batch.len()).map(|i| batch.spans(i) / 3).sum::<usize>();
        match self.method {
            Method::Simplify(_) => {
                vec![format!("{} became {}", count(cubics(before), "cubic"), thousands(cubics(after)))]
            }
            _ => Vec::new(),
        }
    }
}

/// Every point that a piece starts or ends with.
fn joints(batch: &CurveBatch, degree: usize) -> Vec<bool> {
    (0..batch.len()).flat_map(|i| (0..batch.count(i)).map(move |k| k % degree == 0)).collect()
}

/// The first and the last point of every curve.
fn ends(batch: &CurveBatch) -> Result<Vec<bool>> {
    if let Some(i) = (0..batch.len()).find(|&i| batch.is_closed(i)) {
        return Err(Error::argument(format!(
            "--known ends: curve {} is closed and has none: give --known joints",
            batch.label(i)
        )));
    }
    Ok((0..batch.len()).flat_map(|i| (0..batch.count(i)).map(move |k| k == 0 || k + 1 == batch.count(i))).collect())
}
