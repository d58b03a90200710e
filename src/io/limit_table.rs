//! Tables of limits of single curves and points.

use std::path::Path;

use super::source::Source;
use super::times::records;
use crate::batch::CurveBatch;
use crate::error::{Error, Result, quoted};

/// The columns of limits.
const LIMITS: [&str; 7] = ["min_radius", "kmax", "corridor", "corridor_left", "corridor_right", "heading", "pinned"];

/// The batch with the limits of a table, whose rows are for a `curve` and perhaps one `point` of it.
///
/// - `curve` is a name; blank, or without the column, a row is for all curves. Parts of a curve `a`, called
///   `a.1`, `a.2` …, have the limits of `a`.
/// - `point` counts from 0, or from −1 back; blank, a row is for all points of a curve.
/// - `min_radius` or `kmax`, `corridor`, `corridor_left` and `corridor_right` become the columns of these names
///   of [`Constraints`](crate::Constraints). `heading`, in degrees from north (y) to the right, is the tangent at
///   a point, and `pinned` 1 pins points. Blank cells leave what is there.
///
/// # Errors
/// A file that cannot be read, has other columns, or names a curve or a point that is not there. A number that
/// cannot be read.
pub fn read_limits(path: impl AsRef<Path>, batch: &CurveBatch) -> Result<CurveBatch> {
    let mut source = Source::open(path.as_ref())?;
    let (dialect, records) = records(&mut source)?;
    let Some(((heading, header), rows)) = records.split_first() else { return Ok(batch.clone()) };
    let unknown = header.iter().find(|name| !LIMITS.contains(name) && !["curve", "point"].contains(name));
    if let Some(unknown) = unknown {
        let what = format!("there is no limit {}: known are curve, point, {}", quoted(unknown), LIMITS.join(", "));
        return Err(source.error(*heading, what));
    }
    let (n, d) = (batch.total_points(), batch.dimension());
    let mut own = batch.constraints().clone();
    for (line, record) in rows {
        let wrong = |what: String| -> Error { source.error(*line, what) };
        let cell = |name: &str| header.iter().position(|own| own == name).and_then(|k| record.get(k)).unwrap_or("");
        let name = cell("curve");
        let is_own = |i: &usize| {
            let own = batch.name(*i);
            let part = own.strip_prefix(name).and_then(|part| part.strip_prefix('.'));
            name.is_empty() || own == name || part.is_some_and(|part| part.bytes().all(|c| c.is_ascii_digit()))
        };
        let curves: Vec<usize> = (0..batch.len()).filter(is_own).collect();
        if curves.is_empty() && !batch.is_empty() {
            return Err(wrong(format!("there is no curve {}: mend the name, or remove the row", quoted(name))));
        }
        let mut points = Vec::new();
        for i in curves {
            let (first, count) = (batch.offsets()[i], batch.count(i));
            let at = |point: i64| usize::try_from(if point < 0 { point + count as i64 } else { point }).ok();
            match cell("point") {
                "" => points.extend(first..first + count),
                text => match text.parse().ok().and_then(at).filter(|point| *point < count) {
                    Some(point) => points.push(first + point),
                    None => {
                        let what =
                            format!("curve {} has {count} points, and no point {}", batch.label(i), quoted(text));
                        return Err(wrong(what));
                    }
                },
            }
        }
        for limit in LIMITS {
            let number = dialect.number(cell(limit).as_bytes()).ok().flatten();
            let Some(number) = number.filter(|x| x.is_finite()) else {
                if cell(limit).is_empty() {
                    continue;
                }
                return Err(wrong(format!(
                    "column {limit} holds {}, which is no number: mend it",
                    quoted(cell(limit))
                )));
            };
            let blank = |width: usize| vec![f64::NAN; width * n];
            let (column, width, place, value) = match limit {
                "min_radius" => (&mut own.largest_curvatures, 1, 0, 1.0 / number),
                "kmax" => (&mut own.largest_curvatures, 1, 0, number),
                "corridor" => (&mut own.corridors, 1, 0, number),
                "corridor_left" => (&mut own.widths, 2, 0, number),
                "corridor_right" => (&mut own.widths, 2, 1, number),
                "pinned" => {
                    let flags = own.pinned.get_or_insert_with(|| vec![false; n]);
                    points.iter().for_each(|&point| flags[point] = number != 0.0);
                    continue;
                }
                _ if cell("point").is_empty() => {
                    return Err(wrong("a heading needs a point: give both".into()));
                }
                _ => {
                    let (sin, cos) = number.to_radians().sin_cos();
                    let tangents = own.tangents.get_or_insert_with(|| blank(d));
                    for point in &points {
                        tangents[point * d..(point + 1) * d].copy_from_slice(&[sin, cos, 0.0][..d]);
                    }
                    continue;
                }
            };
            let column = column.get_or_insert_with(|| blank(width));
            points.iter().for_each(|point| column[width * point + place] = value);
        }
    }
    batch.clone().with_constraints(own)
}
