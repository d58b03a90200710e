//! The searches and segment costs with which the papers' crate compares its own. They are for that
//! crate alone, and not covered by any promise of stability.

use super::Smooth;
use super::arc::Arc;
use super::dots::{Dots, Exponents};
use super::evaluation::Evaluation;
use super::slopes::{SlopesStanding, Until};
use super::stages::{search, search_on_cpu};
use super::start::wrap;
use super::universal::Universal;
use super::workspace::{Workspace, evaluate_all};
use crate::batch::CurveBatch;
use crate::error::{Error, Result};

/// The state at the end of a curve's search.
#[derive(Clone, Debug)]
pub struct Traced {
    /// The iterations of all starts.
    pub iterations: u32,
    /// The evaluations of the whole curve, of all starts.
    pub evaluations: u32,
    /// Σ∫|κ|^ν ds, in units of the input.
    pub cost: f64,
    /// The direction at every dot. `None` if a segment has no minimiser from any start.
    pub slopes: Option<Vec<f64>>,
    /// Whether the decrement is at most the tolerance.
    pub converged: bool,
}

impl Smooth {
    /// Searches for the tangent angles of the first curve of a batch on the CPU, without placing
    /// its segments.
    ///
    /// # Errors
    /// The errors of [`fit`](Self::fit), and the problem of a curve that cannot be fitted.
    pub fn traced(&self, batch: &CurveBatch) -> Result<Traced> {
        self.check(batch)?;
        let exponents = Exponents::of(self.exponent, batch)?;
        let dots = Dots::of(batch, 0, &exponents).map_err(|problem| Error::argument(problem.message))?;
        let mut workspace = Workspace::new(exponents.universal.len());
        let until = Until { tolerance: self.tolerance, iterations: self.max_iterations };
        let found = search(&self.where_to_start(), &[&dots], &exponents, &mut |dots, exponents, directions| {
            Ok(search_on_cpu(dots, exponents, directions, &until, &mut workspace))
        })?;
        let found = &found[0];
        Ok(Traced {
            iterations: found.iterations,
            evaluations: found.evaluations,
            cost: found.cost,
            slopes: found.directions.clone().map(|directions| with_ends(directions, &dots, &exponents)),
            converged: found.standing == SlopesStanding::Converged,
        })
    }
}

/// Fills in the directions of free ends, which are NaN.
fn with_ends(mut directions: Vec<f64>, dots: &Dots, exponents: &Exponents) -> Vec<f64> {
    let last = directions.len() - 1;
    // The segment at the last dot is reversed and mirrored.
    for (dot, inner, segment, sign) in [(0, 1, 0, 1.0), (last, last - 1, last - 1, -1.0)] {
        if directions[dot].is_nan() {
            let chord = dots.chords.directions[segment];
            let curve = &exponents.universal[dots.curves[segment] as usize];
            let turn = match directions[inner] {
                free if free.is_nan() => 0.0,
                inner => {
                    let angle = sign * wrap(inner - chord);
                    let arc = Arc::free(curve, dots.chords.lengths[segment], angle);
                    arc.map_or(f64::NAN, |arc| arc.at(curve, 0.0).0.angle)
                }
            };
            directions[dot] = chord + sign * turn;
        }
    }
    directions
}

/// The costs of segments of one exponent and unit chord, on the CPU.
///
/// [`evaluate_segments`](super::evaluate_segments) computes the universal curve of the exponent for
/// every call, which takes longer than a few segments.
#[derive(Clone, Debug)]
pub struct UnitCosts(Universal);

impl UnitCosts {
    /// The costs for an exponent above 1.
    pub fn new(exponent: f64) -> Self {
        UnitCosts(Universal::new(exponent))
    }

    /// ∫|κ|^ν ds of the segments with these end angles; ∞ if there is no minimiser.
    pub fn of(&self, angles: &[[f64; 2]]) -> Vec<f64> {
        let none = Evaluation { cost: 0.0, gradient: [0.0; 2], hessian: [0.0; 3], exists: 0.0 };
        let mut found = vec![none; angles.len()];
        evaluate_all(&self.0, false, angles, &mut found);
        found.iter().map(|found| if found.exists > 0.0 { found.cost } else { f64::INFINITY }).collect()
    }
}
