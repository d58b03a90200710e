//! [`Simplify`]: as few cubics as possible near chains of cubics.

use glam::DVec3;

use super::completed::{Assembly, Completed};
use crate::batch::{CurveBatch, Unfitted};
use crate::curve::fewest::Fewest;
use crate::curve::handles::check_corners;
use crate::curve::vector;
use crate::device::Device;
use crate::error::{Error, Result};
use crate::parallel;
use crate::report::CurveReport;
use crate::status::CurveStatus;

/// A cubic's control points.
type Piece = [DVec3; 4];

/// Approximates chains of cubics by chains of fewer cubics.
///
/// Corners are kept, and so are the directions at all joints that remain. Straight pieces are kept,
/// unless three or more follow each other without a corner: these count as points of a curve.
///
/// ```
/// use faircurve::{CurveBatch, Device, bezier::Simplify};
/// // A quarter of a circle, in four pieces.
/// let at = |k: f64| (k * std::f64::consts::FRAC_PI_8).sin_cos();
/// let handle = 4.0 / 3.0 * (std::f64::consts::FRAC_PI_8 / 4.0).tan();
/// let mut points = vec![[1.0, 0.0]];
/// for k in 0..4 {
///     let ((s, c), (t, d)) = (at(k as f64), at(k as f64 + 1.0));
///     points.extend([[c - handle * s, s + handle * c], [d + handle * t, t - handle * d], [d, t]]);
/// }
/// let chains = CurveBatch::from_slices(&[&points[..]])?;
/// let fewer = Simplify { tolerance: 1e-3, ..Simplify::default() }.fit(&chains, &Device::cpu())?;
/// assert_eq!(fewer.control_points().count(0), 4, "one cubic");
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Simplify {
    /// The largest distance from any point of either chain to the other (units of the curves, > 0).
    /// By default 0.001.
    pub tolerance: f64,
    /// Joints where the direction turns by more than this (radians, 0 to π) are corners. By default
    /// one degree.
    pub corners: f64,
    /// Whether joints lie where x or y is extreme, with level handles, as fonts ask. By default not.
    pub extremes: bool,
}

impl Default for Simplify {
    fn default() -> Self {
        Simplify { tolerance: 1e-3, corners: 1_f64.to_radians(), extremes: false }
    }
}

impl Simplify {
    /// Simplifies chains of cubics: three control points per piece, and one more for open chains.
    ///
    /// The reports have ∫|X″|² of the new chains (pieces on (0, 1)), and the tolerance as
    /// `max_deviation`. A chain that cannot be simplified keeps its bits. All threads of the CPU
    /// work, whatever the device, which counts finished curves. A curve whose control points are
    /// not finite or do not form cubics keeps them and is `invalid`.
    ///
    /// # Errors
    /// A tolerance that is not positive, or an angle of corners outside 0 … π.
    pub fn fit(&self, chains: &CurveBatch, device: &Device) -> Result<Completed> {
        let Simplify { tolerance, corners, extremes } = *self;
        if !(tolerance > 0.0 && tolerance.is_finite()) {
            return Err(Error::argument(format!("the tolerance is {tolerance}; it must be a positive length")));
        }
        check_corners(corners)?;
        chains.allows(&[], "simplified chains")?;
        let simplified: Vec<std::result::Result<Vec<Piece>, Unfitted>> = parallel::map(chains.len(), 1, |i| {
            let pieces = pieces(chains, i)?;
            Ok(Fewest { tolerance, corners, extremes }.chain(pieces, chains.is_closed(i)))
        });
        device.finished(chains.len());
        let mut assembly = Assembly::new(chains);
        for (i, result) in simplified.into_iter().enumerate() {
            match result {
                Ok(pieces) => {
                    let energy = pieces.iter().map(bending).sum();
                    let report = CurveReport { max_deviation: tolerance, ..CurveReport::solved(energy) };
                    assembly.push(&control_points(&pieces, chains.is_closed(i), chains.dimension()), 3, vec![], report);
                }
                Err(problem) => assembly.push_unfitted(problem),
            }
        }
        Ok(assembly.finish(Device::cpu().report(false)?))
    }
}

/// The pieces of a chain, or why it cannot be simplified.
fn pieces(chains: &CurveBatch, i: usize) -> std::result::Result<Vec<Piece>, Unfitted> {
    if let Some(problem) = chains.problem(i) {
        return Err(problem.clone());
    }
    let (count, spans) = (chains.count(i), chains.spans(i));
    let points: Vec<DVec3> = chains.points(i).chunks_exact(chains.dimension()).map(vector).collect();
    let unfitted = |status, what: &str| Unfitted { status, message: chains.sentence(i, count.saturating_sub(1), what) };
    match spans {
        _ if count < 2 => Err(unfitted(CurveStatus::Degenerate, "it is a single point: there is nothing to simplify")),
        spans if !spans.is_multiple_of(3) => {
            let more = if chains.is_closed(i) { "" } else { " and one more" };
            let what = format!("{count} control points are no cubics: give three a piece{more}");
            Err(unfitted(CurveStatus::Invalid, &what))
        }
        spans => Ok((0..spans / 3).map(|k| std::array::from_fn(|j| points[(3 * k + j) % count])).collect()),
    }
}

/// The control points of a chain, without the repeated first one of a closed chain.
fn control_points(pieces: &[Piece], closed: bool, dimension: usize) -> Vec<f64> {
    let mut coords = Vec::with_capacity((3 * pieces.len() + 1) * dimension);
    if !closed {
        coords.extend_from_slice(&pieces[0][0].to_array()[..dimension]);
    }
    for piece in pieces {
        for point in if closed { &piece[..3] } else { &piece[1..] } {
            coords.extend_from_slice(&point.to_array()[..dimension]);
        }
    }
    coords
}

/// ∫|X″|² of a cubic on (0, 1).
fn bending(&[a, b, c, d]: &Piece) -> f64 {
    let (start, end) = (a - 2.0 * b + c, b - 2.0 * c + d);
    12.0 * (start.length_squared() + start.dot(end) + end.length_squared())
}
