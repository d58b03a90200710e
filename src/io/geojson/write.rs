//! Writing: the document that was read, with new coordinates in their places, or a collection of
//! one feature a curve.

use std::io::{self, Write};
use std::ops::Range;

use super::along::{Along, CURVE, DATES, TIMES, of_text};
use super::cut::Cut;
use super::lists::{has_places, is_flat, list, position};
use super::{Document, Object, Part, Shape};
use crate::batch::{Column, CurveBatch, Values};
use crate::io::columns::STATUS;
use crate::io::text::Text;
use crate::io::{Antimeridian, WriteOptions, free_names};
use crate::status::CurveStatus;

/// Writes the batch, into the document that it came from if there is one.
pub(in crate::io) fn write(out: &mut dyn Write, batch: &CurveBatch, options: &WriteOptions) -> io::Result<()> {
    let text = Text::new(out).with_decimals(options.decimals);
    let cut = options.antimeridian == Antimeridian::Cut;
    write_with(text, batch, &options.statuses, cut, true, &mut |text, i, ring| line(text, batch, i, ring))
}

/// Writes the batch. `line` writes the coordinates of a curve, which is a ring or not. On demand
/// features have statuses, geometries are cut at the antimeridian, and lines have the times and
/// columns of their positions.
pub(in crate::io) fn write_with(
    mut text: Text,
    batch: &CurveBatch,
    statuses: &[CurveStatus],
    cut: bool,
    along: bool,
    line: Line,
) -> io::Result<()> {
    let cut = |first: usize, shape: &Shape| if cut { Cut::of(batch, first, shape) } else { None };
    match Document::of(batch) {
        Some(document) => fill(&mut text, document, statuses, &cut, line)?,
        None => collect(&mut text, batch, statuses, &cut, along, line)?,
    }
    text.finish()
}

/// The objects of the topology that the batch came from.
pub(in crate::io) fn objects(batch: &CurveBatch) -> Vec<Object> {
    Document::of(batch).map_or_else(Vec::new, |document| document.objects.clone())
}

/// Writes curve i, which is a ring or not.
type Line<'a> = &'a mut dyn FnMut(&mut Text, usize, bool) -> io::Result<()>;

/// Whether the document that the batch came from is written again.
pub(in crate::io) fn fills(batch: &CurveBatch) -> bool {
    Document::of(batch).is_some()
}

/// Cuts a geometry whose first curve this is, where it is to be cut.
type Cutting<'a> = &'a dyn Fn(usize, &Shape) -> Option<Cut>;

fn fill(text: &mut Text, document: &Document, statuses: &[CurveStatus], cut: Cutting, line: Line) -> io::Result<()> {
    let mut done = 0;
    for slot in &document.slots {
        text.push(&document.text[done..slot.at])?;
        done = slot.at;
        match slot.part {
            Part::Status(ref mark) => match worst(statuses, &mark.curves) {
                Some(status) => {
                    let [before, after] = mark.around;
                    text.push(format!("{before}\"{}\":\"{}\"{after}", mark.name, status.word()))?;
                }
                None => text.push(mark.otherwise)?,
            },
            Part::Kind(k) => {
                let (first, shape) = &document.shapes[k];
                kind(text, cut(*first, shape).map_or(shape.kind(), |cut| cut.kind()))?;
            }
            Part::Coordinates(k) => {
                let (first, shape) = &document.shapes[k];
                match cut(*first, shape) {
                    Some(cut) => cut.write(text)?,
                    None => coordinates(text, *first, shape, line)?,
                }
            }
        }
    }
    text.push(&document.text[done..])
}

/// The worst status of some curves, if they are told and there are any.
fn worst(statuses: &[CurveStatus], curves: &Range<usize>) -> Option<CurveStatus> {
    statuses.get(curves.clone())?.iter().copied().max_by_key(|status| status.severity())
}

fn kind(text: &mut Text, kind: &str) -> io::Result<()> {
    text.push("\"")?;
    text.push(kind)?;
    text.push("\"")
}

/// The coordinates of a geometry whose first curve is `i`.
fn coordinates(text: &mut Text, i: usize, shape: &Shape, line: Line) -> io::Result<()> {
    match shape {
        Shape::Line => line(text, i, false),
        Shape::Lines(count) => list(text, *count, |text, k| line(text, i + k, false)),
        Shape::Polygon(rings) => list(text, *rings, |text, k| line(text, i + k, true)),
        Shape::Polygons(polygons) => {
            let mut first = i;
            list(text, polygons.len(), |text, p| {
                list(text, polygons[p], |text, k| line(text, first + k, true))?;
                first += polygons[p];
                Ok(())
            })
        }
    }
}

fn collect(
    text: &mut Text,
    batch: &CurveBatch,
    statuses: &[CurveStatus],
    cut: Cutting,
    along: bool,
    line: Line,
) -> io::Result<()> {
    let times = if batch.has_dates() { DATES } else { TIMES };
    let taken = [CURVE, times, STATUS];
    let names = free_names(batch, if statuses.is_empty() { &taken[..2] } else { &taken });
    text.push("{\"type\":\"FeatureCollection\",\"features\":[")?;
    for i in 0..batch.len() {
        text.push(if i == 0 { "\n" } else { ",\n" })?;
        text.push("{\"type\":\"Feature\",\"properties\":{\"curve\":")?;
        text.push(serde_json::to_string(&batch.name(i))?)?;
        if let Some(status) = statuses.get(i) {
            text.push(format!(",\"{STATUS}\":\"{}\"", status.word()))?;
        }
        let cut = cut(i, &Shape::Line);
        let along = along.then(|| Along::of(batch, i, cut.as_ref())).flatten();
        if let Some(along) = &along {
            along.write_times(text)?;
        }
        for (column, name) in batch.columns().iter().zip(&names) {
            match (of_curve(batch, column, i), &along) {
                (Some(value), _) => text.push(format!(",{}:{value}", serde_json::to_string(name)?))?,
                (None, Some(along)) => along.write_column(text, name, column)?,
                (None, None) => {}
            }
        }
        text.push("},\"geometry\":{\"type\":")?;
        kind(text, cut.as_ref().map_or("LineString", Cut::kind))?;
        text.push(",\"coordinates\":")?;
        match cut {
            Some(cut) => cut.write(text)?,
            None => line(text, i, false)?,
        }
        text.push("}}")?;
    }
    text.push("\n]}\n")
}

/// What all points of curve `i` have in a column, as JSON, if it is the same.
fn of_curve(batch: &CurveBatch, column: &Column, i: usize) -> Option<serde_json::Value> {
    let points = batch.offsets()[i]..batch.offsets()[i + 1];
    match &column.values {
        Values::Texts(texts) => same(&texts[points]).map(|text| of_text(text)),
        values => same(&values.numbers()?[points]).map(|&number| number.into()),
    }
}

/// Whether a new document has a place for a column: a property if each curve has one value, and for
/// lines of GeoJSON a list `along` their positions.
pub(in crate::io) fn holds(batch: &CurveBatch, column: &Column, along: bool) -> bool {
    let is_constant = |i: usize| batch.count(i) == 0 || of_curve(batch, column, i).is_some();
    is_own(batch) && (along || (0..batch.len()).all(is_constant))
}

/// Whether the batch is written into a new document, which has times of positions, too.
pub(in crate::io) fn is_own(batch: &CurveBatch) -> bool {
    Document::of(batch).is_none()
}

/// The value that all of some values are.
fn same<T: PartialEq>(values: &[T]) -> Option<&T> {
    values.first().filter(|first| values.iter().all(|value| value == *first))
}

/// The positions of curve `i`.
///
/// The first position is repeated if the curve is closed, or is a ring that does not end where it
/// began. A ring has four positions at least: those of fewer repeat the first. JSON has no NaN. A
/// curve with such a longitude or latitude gets no positions, which RFC 7946 reads as no geometry.
/// A position with such an altitude has none, and so have all of a curve that came without.
fn line(text: &mut Text, batch: &CurveBatch, i: usize, ring: bool) -> io::Result<()> {
    let (d, points) = (batch.dimension(), batch.points(i));
    if points.is_empty() || !has_places(batch, i) {
        return text.push("[]");
    }
    let axes = if is_flat(batch, i) { 2 } else { d };
    let ends_where_it_began = points.len() > d && points[..d] == points[points.len() - d..];
    let again = batch.is_closed(i) || (ring && !ends_where_it_began);
    let count = points.len() / d;
    let least = if ring { 4 } else { 0 };
    list(text, (count + usize::from(again)).max(least), |text, k| {
        position(text, &points[if k < count { k * d } else { 0 }..][..axes])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io;

    /// Every span as `n` segments, as a fit returns its polylines: new points, the same origin.
    fn sampled(batch: &CurveBatch, n: usize) -> CurveBatch {
        let (mut coords, mut offsets) = (Vec::new(), vec![0]);
        for i in 0..batch.len() {
            let (points, count) = (batch.points(i), batch.count(i));
            for span in 0..batch.spans(i) {
                let (a, b) = (&points[2 * span..][..2], &points[(span + 1) % count * 2..][..2]);
                let between = (0..n).map(|k| k as f64 / n as f64);
                coords.extend(between.flat_map(|u| [a[0] + (b[0] - a[0]) * u, a[1] + (b[1] - a[1]) * u]));
            }
            if !batch.is_closed(i) {
                coords.extend_from_slice(&points[points.len() - 2..]);
            }
            offsets.push(coords.len() / 2);
        }
        let sampled = CurveBatch::from_file(2, coords, offsets, batch.origin().clone()).unwrap();
        sampled.closed_each((0..batch.len()).map(|i| batch.is_closed(i)).collect()).unwrap()
    }

    #[test]
    fn sampled_curves_go_back_into_the_document_that_they_came_from() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fair.geojson");
        let batch = io::read("examples/data/countries-50m.geojson.gz").unwrap();
        let fair = sampled(&batch, 16);
        assert!(fair.total_points() > 1_250_000, "{}", fair.total_points());
        io::write(&path, &fair).unwrap();
        let again = io::read(&path).unwrap();
        assert_eq!((again.offsets(), again.coords()), (fair.offsets(), fair.coords()));
        assert!((0..again.len()).all(|i| again.name(i) == i.to_string() && again.is_closed(i) == fair.is_closed(i)));
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text.matches("\"properties\":{\"arc\":").count(), 1959);
    }
}
