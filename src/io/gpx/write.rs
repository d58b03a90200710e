//! Writing: the file that was read, with new points in their places, or a track a curve.

use std::io::{self, Write};

use super::{Document, ELEVATION, Edit, Value, document};
use crate::batch::{Column, CurveBatch};
use crate::io::text::Text;
use crate::io::{WriteOptions, antimeridian, is_finite};

pub(super) fn write(out: &mut dyn Write, batch: &CurveBatch, options: &WriteOptions) -> io::Result<()> {
    let mut text = Text::new(out).with_decimals(options.decimals);
    match document(batch) {
        Some(document) => fill(&mut text, batch, document)?,
        None => collect(&mut text, batch)?,
    }
    text.finish()
}

/// Writes the file that was read. Points of which some have no place stay as they were.
fn fill(text: &mut Text, batch: &CurveBatch, document: &Document) -> io::Result<()> {
    let mut done = 0;
    for (range, edit) in &document.edits {
        let before = &document.text[done..range.start];
        match edit {
            Edit::Points(curve, _) if !is_finite(batch, *curve) => continue,
            Edit::Points(curve, name) => {
                text.push(before)?;
                let blanks = &before[before.trim_ascii_end().len()..];
                points(text, batch, *curve, name, blanks, &document.values)?;
            }
            Edit::Nothing => text.push(before)?,
        }
        done = range.end;
    }
    text.push(&document.text[done..])
}

/// Writes a new file.
fn collect(text: &mut Text, batch: &CurveBatch) -> io::Result<()> {
    text.push("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n")?;
    text.push("<gpx version=\"1.1\" creator=\"faircurve\" xmlns=\"http://www.topografix.com/GPX/1/1\">\n")?;
    for i in 0..batch.len() {
        text.push(format!("<trk>\n<name>{}</name>\n<trkseg>\n", escaped(&batch.name(i))))?;
        if is_finite(batch, i) {
            points(text, batch, i, "trkpt", "\n", &[])?;
            text.push("\n")?;
        }
        text.push("</trkseg>\n</trk>\n")?;
    }
    text.push("</gpx>\n")
}

/// Writes the points of curve `i` as elements of this name, with blanks between them.
fn points(text: &mut Text, batch: &CurveBatch, i: usize, name: &str, blanks: &str, values: &[Value]) -> io::Result<()> {
    let prefix = &name[..name.find(':').map_or(0, |colon| colon + 1)];
    let numbers = |name: &str| batch.columns().iter().find_map(|column| numbers(column, name));
    let elevations = numbers(ELEVATION);
    let values: Vec<(&Value, &[f64])> =
        values.iter().filter_map(|value| Some((value, numbers(&value.column)?))).collect();
    let times = batch.parameters(i).zip(batch.origin().clock(i));
    let (first, count) = (batch.offsets()[i], batch.count(i));
    for step in 0..count + usize::from(batch.is_closed(i) && count > 0) {
        let k = step % count;
        let point = &batch.points(i)[2 * k..2 * k + 2];
        text.push(format!("{}<{name} lat=\"", if step > 0 { blanks } else { "" }))?;
        text.point(&point[1..], "")?;
        text.push("\" lon=\"")?;
        text.point(&[antimeridian::wrapped(point[0])], "")?;
        text.push("\">")?;
        if let Some(elevation) = elevations.map(|numbers| numbers[first + k]).filter(|x| x.is_finite()) {
            text.push(format!("<{prefix}ele>"))?;
            text.number(elevation)?;
            text.push(format!("</{prefix}ele>"))?;
        }
        if let Some((t, clock)) = times {
            // The first point again has the time at which the curve is back.
            let t = if step < count { t[k] } else { t[count - 1] + batch.closing_length(i, t) };
            let time = clock.for_all(std::iter::once(t)).write(t);
            text.push(format!("<{prefix}time>{time}</{prefix}time>"))?;
        }
        let own = values.iter().map(|(value, numbers)| (*value, numbers[first + k]));
        nested(text, own.filter(|(_, number)| number.is_finite()))?;
        text.push(format!("</{name}>"))?;
    }
    Ok(())
}

/// Numbers in the elements around them. Neighbours share these as far as their paths are the same.
fn nested<'a>(text: &mut Text, values: impl Iterator<Item = (&'a Value, f64)>) -> io::Result<()> {
    let mut open: Vec<&str> = Vec::new();
    for (value, number) in values {
        let Some((leaf, around)) = value.path.split_last() else { continue };
        let shared = open.iter().zip(around).take_while(|(a, b)| a == b).count();
        close(text, &mut open, shared)?;
        for name in &around[shared..] {
            text.push(format!("<{name}>"))?;
            open.push(name);
        }
        text.push(format!("<{leaf}>"))?;
        text.number(if value.is_whole { number.round() } else { number })?;
        text.push(format!("</{leaf}>"))?;
    }
    close(text, &mut open, 0)
}

fn close(text: &mut Text, open: &mut Vec<&str>, shared: usize) -> io::Result<()> {
    for name in open.drain(shared..).rev() {
        text.push(format!("</{name}>"))?;
    }
    Ok(())
}

/// The numbers of a column of this name.
fn numbers<'a>(column: &'a Column, name: &str) -> Option<&'a [f64]> {
    column.values.numbers().filter(|_| column.name == name)
}

fn escaped(name: &str) -> String {
    let name = name.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    name.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}
