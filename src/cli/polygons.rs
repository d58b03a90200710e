//! What `faircurve bezier` takes a file's points for, and what it completes them by.

use std::str::FromStr;

use clap::{Args, ValueEnum};
use faircurve::bezier::{Complete, Completed, EndTangents, Energy};
use faircurve::io::{Closed, Format};
use faircurve::{Constraints, CurveBatch, Device, Error, Result};

use super::InputArgs;
use super::method::weights;

/// The energies by name, ∫|X′|², ∫|X″|² and ∫|X‴|².
const ENERGIES: [&str; 3] = ["tension", "bending", "variation"];

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum KnownWord {
    /// Those that the file says: its column or array `known`, and all of them without
    File,
    /// The first and the last
    Ends,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum TangentsWord {
    /// They are the curve's first derivatives
    Derivatives,
    /// Only their directions are, and their lengths are free
    Directions,
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
    /// Which control points are kept; the others are completed
    #[arg(long, value_enum, default_value_t = KnownWord::File)]
    known: KnownWord,
    /// What the tangents (columns tx ty tz) at the ends of a Bézier curve say [default: derivatives]
    #[arg(long, value_enum)]
    tangents: Option<TangentsWord>,
    /// What is made least, ∫|X″|² (bending), ∫|X′|² (tension) and ∫|X‴|² (variation) of every piece over its parameter, 0 to 1
    #[arg(long, value_name = "NAME=WEIGHT,...", default_value = "bending=1")]
    energy: Weights,
}

/// What points are, and how they are completed.
pub struct Plan {
    method: Complete,
    known: KnownWord,
    closed: Closed,
}

impl PlanArgs {
    /// What is to be done, checked before anything is read.
    ///
    /// # Errors
    /// Options that do not fit together, or are out of range.
    pub fn plan(&self, input: &InputArgs) -> Result<Plan> {
        if input.format() == Some(Format::Svg) {
            return Err(Error::argument(
                "paths of SVG are chains of Béziers, and single ones are completed: give control points as CSV or NPZ",
            ));
        }
        // A curve that ends where it starts has both points in its polygon, unless the file marks it as closed.
        let closed = match input.closed {
            Closed::Auto if input.format() != Some(Format::Npz) => Closed::No,
            given => given,
        };
        let tangents = match self.tangents {
            Some(TangentsWord::Directions) => EndTangents::Directions,
            _ => EndTangents::Derivatives,
        };
        let method = Complete { energy: Energy { weights: self.energy.0 }, tangents };
        Ok(Plan { method, known: self.known, closed })
    }

    /// What a caption calls it.
    pub fn title(&self) -> String {
        let energies = ENERGIES.iter().zip(self.energy.0).filter(|(_, weight)| *weight > 0.0);
        let sum: Vec<String> = energies
            .map(|(name, weight)| if weight == 1.0 { name.to_string() } else { format!("{weight} {name}") })
            .collect();
        format!("Bézier curves of least {}", sum.join(" + "))
    }
}

impl Plan {
    /// Reads the control points, and marks those that are kept.
    ///
    /// # Errors
    /// Those of reading; weights; closed chains of which only the ends would be kept.
    pub fn read(&self, input: &InputArgs) -> Result<CurveBatch> {
        let batch = input.read_as(self.closed, false)?;
        if (0..batch.len()).any(|i| batch.weights(i).is_some()) {
            return Err(Error::argument(
                "the file gives its points weights, but Bézier curves are polynomial here and have none: drop the column with \
                 --columns weight=, or the array",
            ));
        }
        let flags = match self.known {
            KnownWord::File => return Ok(batch),
            KnownWord::Ends => ends(&batch)?,
        };
        let constraints = Constraints { known: Some(flags), ..batch.constraints().clone() };
        batch.with_constraints(constraints)
    }

    /// Completes the control points.
    ///
    /// # Errors
    /// Those of the device.
    pub fn complete(&self, batch: &CurveBatch, device: &Device) -> Result<Completed> {
        self.method.fit(batch, device)
    }
}

/// The first and the last point of every curve.
fn ends(batch: &CurveBatch) -> Result<Vec<bool>> {
    if let Some(i) = (0..batch.len()).find(|&i| batch.is_closed(i)) {
        return Err(Error::argument(format!(
            "--known ends: curve {} is closed and has none: give --known file",
            batch.name(i)
        )));
    }
    Ok((0..batch.len()).flat_map(|i| (0..batch.count(i)).map(move |k| k == 0 || k + 1 == batch.count(i))).collect())
}
