//! Tables of limits of single curves and points.

use std::path::Path;

use super::source::Source;
use super::times::records;
use crate::batch::{Column, CurveBatch, Values};
use crate::error::{Error, Result, quoted};

/// The columns of limits.
const LIMITS: [&str; 9] = [
    "min_radius",
    "kmax",
    "corridor",
    "corridor_left",
    "corridor_right",
    "heading",
    "curvature",
    "max_speed",
    "pinned",
];

/// The batch with the limits of a table, whose rows are for a `curve` and perhaps one `point` of it.
///
/// - `curve` is a name; blank, or without the column, a row is for all curves. Parts of a curve `a`, called
///   `a.1`, `a.2` …, have the limits of `a`.
/// - `point` counts from 0, or from −1 back; blank, a row is for all points of a curve.
/// - `min_radius` or `kmax`, `corridor`, `corridor_left` and `corridor_right` become the columns of these names
///   of [`Constraints`](crate::Constraints). `heading`, in degrees from north (y) to the right, is the tangent at
///   a point, and `curvature` in the same row the curvature there, positive to the left. `pinned` 1 pins
///   points. `max_speed` becomes the column of [`drive`](crate::tracks::drive). Blank cells leave what is there.
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
    let (speeds, mut columns): (Vec<_>, Vec<_>) =
        batch.columns().iter().cloned().partition(|column| column.name == "max_speed");
    let mut speeds = speeds.first().and_then(|column| column.values.numbers()).map(Vec::from);
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
            let number = match dialect.number(cell(limit).as_bytes()) {
                Ok(None) => continue,
                Ok(Some(number)) if number.is_finite() => number,
                _ => {
                    let what = format!("column {limit} holds {}, which is no number: mend it", quoted(cell(limit)));
                    return Err(wrong(what));
                }
            };
            let blank = |width: usize| vec![f64::NAN; width * n];
            let (column, width, place, value) = match limit {
                "min_radius" => (&mut own.largest_curvatures, 1, 0, 1.0 / number),
                "kmax" => (&mut own.largest_curvatures, 1, 0, number),
                "corridor" => (&mut own.corridors, 1, 0, number),
                "corridor_left" => (&mut own.widths, 2, 0, number),
                "corridor_right" => (&mut own.widths, 2, 1, number),
                "max_speed" => (&mut speeds, 1, 0, number),
                "pinned" => {
                    let flags = own.pinned.get_or_insert_with(|| vec![false; n]);
                    points.iter().for_each(|&point| flags[point] = number != 0.0);
                    continue;
                }
                _ if cell("point").is_empty() => {
                    return Err(wrong(format!("a {limit} needs a point: give both")));
                }
                _ => {
                    let Some(heading) = dialect.number(cell("heading").as_bytes()).ok().flatten() else {
                        return Err(wrong("a curvature needs a heading: give both".into()));
                    };
                    let (sin, cos) = heading.to_radians().sin_cos();
                    let (vectors, vector) = match limit {
                        "heading" => (&mut own.tangents, [sin, cos, 0.0]),
                        _ => (&mut own.curvatures, [-cos * number, sin * number, 0.0]),
                    };
                    let vectors = vectors.get_or_insert_with(|| blank(d));
                    for point in &points {
                        vectors[point * d..(point + 1) * d].copy_from_slice(&vector[..d]);
                    }
                    continue;
                }
            };
            let column = column.get_or_insert_with(|| blank(width));
            points.iter().for_each(|point| column[width * point + place] = value);
        }
    }
    let speeds = speeds.map(|speeds| Column { name: "max_speed".into(), values: Values::Numbers(speeds) });
    columns.extend(speeds);
    batch.clone().with_constraints(own)?.with_columns(columns)
}
