//! Small batches of anything.

use arbitrary::{Result, Unstructured};
use faircurve::{Constraints, CurveBatch};

use super::numbers::number;

const MOST_CURVES: usize = 4;
const MOST_POINTS: usize = 12;

/// A batch of a few short curves with the columns that chance gives it; `None` where the arrays are
/// refused as malformed.
pub fn batch(bytes: &mut Unstructured) -> Result<Option<CurveBatch>> {
    let dimension = bytes.int_in_range(2..=3)?;
    let mut offsets = vec![0];
    for _ in 0..bytes.int_in_range(1..=MOST_CURVES)? {
        offsets.push(offsets[offsets.len() - 1] + bytes.int_in_range(0..=MOST_POINTS)?);
    }
    let (curves, points) = (offsets.len() - 1, offsets[offsets.len() - 1]);
    let mut coords = column(bytes, points * dimension)?;
    // Repeated points and curves that end where they begin are common in files.
    for point in 1..points {
        if bytes.ratio(1, 8)? {
            let from = bytes.int_in_range(0..=point - 1)?;
            coords.copy_within(from * dimension..(from + 1) * dimension, point * dimension);
        }
    }
    let made = (|| {
        let mut batch = CurveBatch::from_ragged(dimension, coords, offsets)?;
        if bytes.ratio(1, 4).unwrap_or(false) {
            batch = batch.with_parameters(parameters(bytes, points).unwrap_or_default())?;
        }
        if bytes.ratio(1, 6).unwrap_or(false) {
            batch = batch.with_weights(column(bytes, points).unwrap_or_default())?;
        }
        if bytes.ratio(1, 6).unwrap_or(false) {
            batch = batch.with_constraints(constraints(bytes, points, dimension).unwrap_or_default())?;
        }
        let closed = (0..curves).map(|_| bytes.ratio(1, 3).unwrap_or(false)).collect();
        batch.closed_each(closed)
    })();
    Ok(made.ok())
}

fn column(bytes: &mut Unstructured, count: usize) -> Result<Vec<f64>> {
    (0..count).map(|_| number(bytes)).collect()
}

/// Mostly increasing.
fn parameters(bytes: &mut Unstructured, count: usize) -> Result<Vec<f64>> {
    let mut t = 0.0;
    (0..count)
        .map(|_| {
            t += if bytes.ratio(7, 8)? { f64::from(bytes.arbitrary::<u8>()?) / 16.0 } else { number(bytes)? };
            Ok(t)
        })
        .collect()
}

fn constraints(bytes: &mut Unstructured, points: usize, dimension: usize) -> Result<Constraints> {
    let mut vectors = |one_in: u8| -> Result<Option<Vec<f64>>> {
        if !bytes.ratio(1, one_in)? {
            return Ok(None);
        }
        let mut all = vec![f64::NAN; points * dimension];
        for vector in all.chunks_exact_mut(dimension) {
            if bytes.ratio(1, 4)? {
                for x in vector {
                    *x = number(bytes)?;
                }
            }
        }
        Ok(Some(all))
    };
    let (tangents, curvatures) = (vectors(2)?, vectors(3)?);
    let exponents = if bytes.ratio(1, 4)? { Some(column(bytes, points)?) } else { None };
    let known =
        if bytes.ratio(1, 4)? { Some((0..points).map(|_| bytes.arbitrary()).collect::<Result<_>>()?) } else { None };
    let pinned =
        if bytes.ratio(1, 4)? { Some((0..points).map(|_| bytes.arbitrary()).collect::<Result<_>>()?) } else { None };
    let largest_curvatures = if bytes.ratio(1, 4)? { Some(column(bytes, points)?) } else { None };
    let corridors = if bytes.ratio(1, 8)? { Some(column(bytes, points)?) } else { None };
    let widths = if bytes.ratio(1, 8)? { Some(column(bytes, 2 * points)?) } else { None };
    Ok(Constraints { tangents, curvatures, exponents, known, pinned, largest_curvatures, corridors, widths })
}
