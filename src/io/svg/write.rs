//! Writing: the drawing that was read with other path data, or one `<path>` a curve and a `viewBox`
//! that fits. y is turned over, since SVG's y points down.

use std::borrow::Cow;
use std::io::{self, Write};
use std::ops::Range;

use kurbo::{Affine, Point};

use super::chain::straight;
use super::document::{Drawing, Edit, Element};
use super::path::largest_scale;
use crate::batch::CurveBatch;
use crate::bounds::Bounds;
use crate::io::text::Text;
use crate::io::{WriteOptions, is_finite};

/// A transform preserves this many digits of a coordinate, of about sixteen.
const KEPT_DIGITS: f64 = 13.0;

/// The most decimals to which transformed coordinates are rounded.
const MOST_DECIMALS: f64 = 300.0;

/// The margin around the drawing, as a part of its larger side.
const MARGIN: f64 = 0.02;

/// Writes the batch, into the drawing that it came from if there is one.
///
/// With `decimals` coordinates are rounded. With `beziers` the points of each curve are a chain of
/// cubic control points. With `rounding` they are written in relative steps, rounded to a power of
/// ten of no more than this.
pub(in crate::io) fn write(out: &mut dyn Write, batch: &CurveBatch, options: &WriteOptions) -> io::Result<()> {
    let WriteOptions { beziers, rounding, decimals, .. } = *options;
    let mut text = Text::new(out).with_decimals(decimals);
    let rounding = rounding.filter(|_| beziers && decimals.is_none());
    match drawing(batch) {
        Some(drawing) => fill(&mut text, batch, drawing, beziers, rounding)?,
        None => draw(&mut text, batch, beziers, rounding, |_, _| Ok(()))?,
    }
    text.finish()
}

/// The drawing that the batch came from, if it has the same curves still.
fn drawing(batch: &CurveBatch) -> Option<&Drawing> {
    let drawing: &Drawing = batch.origin().document.as_ref()?.downcast_ref()?;
    (drawing.curves == batch.len()).then_some(drawing)
}

/// Whether the drawing that was read is written again.
pub(super) fn fills(batch: &CurveBatch) -> bool {
    drawing(batch).is_some()
}

/// A drawing with one path per curve, and `more`, which gets the view box.
pub(super) fn draw(
    text: &mut Text,
    batch: &CurveBatch,
    beziers: bool,
    rounding: Option<f64>,
    more: impl FnOnce(&mut Text, [f64; 4]) -> io::Result<()>,
) -> io::Result<()> {
    let view_box = view_box(batch);
    text.push("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"")?;
    text.point(&view_box, " ")?;
    text.push("\">\n<style>path{fill:none;stroke:#000;stroke-width:1px;vector-effect:non-scaling-stroke}</style>\n")?;
    let unit = rounding.and_then(|rounding| unit(batch, 0..batch.len(), rounding));
    for i in 0..batch.len() {
        text.push("<path id=\"")?;
        text.push(escaped(&batch.name(i)).as_bytes())?;
        text.push("\" d=\"")?;
        subpath(text, batch, i, beziers, unit, down)?;
        text.push("\"/>\n")?;
    }
    more(text, view_box)?;
    text.push("</svg>\n")
}

/// The drawing that was read, with other paths.
fn fill(
    text: &mut Text,
    batch: &CurveBatch,
    drawing: &Drawing,
    beziers: bool,
    rounding: Option<f64>,
) -> io::Result<()> {
    let mut done = 0;
    for (range, element, edit) in &drawing.edits {
        let element = &drawing.elements[*element];
        // What was not fitted stays as it is.
        if element.curves.clone().all(|i| batch.problem(i).is_some()) {
            continue;
        }
        text.push(&drawing.text[done..range.start])?;
        done = range.end;
        match *edit {
            Edit::Text(other) => text.push(other)?,
            Edit::Data => data(text, batch, element, beziers, rounding)?,
            Edit::Attribute => {
                text.push(" d=\"")?;
                data(text, batch, element, beziers, rounding)?;
                text.push("\"")?;
            }
        }
    }
    text.push(&drawing.text[done..])
}

/// The path data of an element, in its own coordinates.
fn data(
    text: &mut Text,
    batch: &CurveBatch,
    element: &Element,
    beziers: bool,
    rounding: Option<f64>,
) -> io::Result<()> {
    let Element { affine, inverse, curves } = element;
    if *affine == Affine::IDENTITY {
        let unit = rounding.and_then(|rounding| unit(batch, curves.clone(), rounding));
        return curves.clone().try_for_each(|i| subpath(text, batch, i, beziers, unit, down));
    }
    let place = |point: &[f64]| {
        let [x, y] = down(point);
        let point = *inverse * Point::new(x, y);
        [point.x, point.y]
    };
    let largest = curves.clone().flat_map(|i| batch.points(i).chunks_exact(2).map(place)).flatten();
    let largest = largest.filter(|x| x.is_finite()).fold(0.0f64, |largest, x| largest.max(x.abs()));
    let decimals = (KEPT_DIGITS - largest.log10().ceil()).clamp(0.0, MOST_DECIMALS);
    let tidy = 10f64.powi(decimals as i32);
    let place = |point: &[f64]| place(point).map(|x| (x * tidy).round() / tidy + 0.0);
    // What a step of the rounding is before the transform.
    let unit = rounding.and_then(|rounding| unit(batch, curves.clone(), rounding / largest_scale(*affine)));
    curves.clone().try_for_each(|i| subpath(text, batch, i, beziers, unit, place))
}

/// The point in SVG coordinates. Not −y, which makes −0 of 0.
fn down(point: &[f64]) -> [f64; 2] {
    [point[0], 0.0 - point[1]]
}

/// Path data of a curve, at the places that `place` gives its points.
fn subpath(
    text: &mut Text,
    batch: &CurveBatch,
    i: usize,
    beziers: bool,
    unit: Option<f64>,
    place: impl Fn(&[f64]) -> [f64; 2],
) -> io::Result<()> {
    let points = batch.points(i);
    if points.is_empty() || !is_finite(batch, i) {
        return Ok(());
    }
    if beziers {
        let unit = unit.filter(|_| batch.problem(i).is_none());
        return chain(text, points, batch.is_closed(i), unit, place);
    }
    for (k, point) in points.chunks_exact(2).enumerate() {
        text.push(match k {
            0 => "M",
            1 => "L",
            _ => " ",
        })?;
        text.point(&place(point), ",")?;
    }
    if batch.is_closed(i) { text.push("Z") } else { Ok(()) }
}

/// A chain of cubics. Pieces that reading makes of lines are lines.
///
/// With `unit` points are rounded, and written as steps from one rounded point to another, so that
/// rounding does not add up.
fn chain(
    text: &mut Text,
    points: &[f64],
    closed: bool,
    unit: Option<f64>,
    place: impl Fn(&[f64]) -> [f64; 2],
) -> io::Result<()> {
    let rounded = |point: &[f64]| place(point).map(|x| unit.map_or(x, |unit| (x * unit).round()));
    let first = &points[..2];
    text.push("M")?;
    text.point(&rounded(first).map(|x| unit.map_or(x, |unit| x / unit + 0.0)), ",")?;
    let closing = (closed && points.len() > 2).then_some(first);
    let rest: Vec<&[f64]> = points[2..].chunks_exact(2).chain(closing).collect();
    let (mut from, mut before) = (first, "");
    for (k, piece) in rest.chunks(3).enumerate() {
        let is_line = matches!(piece, &[b, c, d] if is_line([from, b, c, d]));
        let command = match (is_line, unit) {
            (true, None) => "L",
            (true, Some(_)) => "l",
            (false, None) => "C",
            (false, Some(_)) => "c",
        };
        let shown = match is_line {
            // Z draws the last line of a closed chain.
            true if closed && 3 * (k + 1) == rest.len() => &[],
            true => &piece[2..],
            false => piece,
        };
        for (j, point) in shown.iter().enumerate() {
            let command = if j == 0 && command != before { command } else { " " };
            match unit {
                Some(unit) => step(text, command, rounded(from), rounded(point), unit)?,
                None => {
                    text.push(command)?;
                    text.point(&place(point), ",")?;
                }
            }
        }
        (from, before) = (piece[piece.len() - 1], command);
    }
    let repeats =
        rest.last().is_some_and(|last| if unit.is_some() { rounded(last) == rounded(first) } else { *last == first });
    if closed || repeats { text.push("Z") } else { Ok(()) }
}

/// A step from one rounded point to another, after a command or a blank.
fn step(text: &mut Text, command: &str, from: [f64; 2], to: [f64; 2], unit: f64) -> io::Result<()> {
    // A minus separates, too. A negative zero would be longer.
    for (axis, separator) in [(0, command), (1, " ")] {
        let step = (to[axis] - from[axis]) / unit;
        text.push(if step < 0.0 && separator == " " { "" } else { separator })?;
        text.number(step + 0.0)?;
    }
    Ok(())
}

/// Whether a piece is, bit for bit, what reading makes of a line.
fn is_line(piece: [&[f64]; 4]) -> bool {
    let [a, b, c, d] = piece.map(|point| Point::new(point[0], point[1]));
    a != d && straight(a, d) == [b, c, d]
}

/// The number of rounding steps in a unit, a power of ten.
///
/// `None` if coordinates do not have that many digits. Curves that were not fitted do not count,
/// and are written as they were read.
fn unit(batch: &CurveBatch, mut curves: Range<usize>, rounding: f64) -> Option<f64> {
    let places = (-rounding.log10()).ceil().max(0.0);
    let fitted = curves.by_ref().filter(|&i| batch.problem(i).is_none());
    let coords = fitted.flat_map(|i| batch.points(i)).filter(|x| x.is_finite());
    let largest = coords.fold(0.0f64, |largest, x| largest.max(x.abs()));
    // Up to this size multiples of the step are integers of f64.
    let unit = 10f64.powi(places as i32);
    (places <= 22.0 && largest * unit < 2f64.powi(52)).then_some(unit)
}

/// Whether a curve was fitted and has a place in a drawing.
pub(super) fn is_drawn(batch: &CurveBatch, i: usize) -> bool {
    batch.problem(i).is_none() && is_finite(batch, i)
}

/// Left, top, width and height of what can be drawn: the fitted curves, or all curves if none was
/// fitted.
fn view_box(batch: &CurveBatch) -> [f64; 4] {
    let any = (0..batch.len()).any(|i| is_drawn(batch, i));
    let drawn = (0..batch.len()).filter(|&i| if any { is_drawn(batch, i) } else { is_finite(batch, i) });
    let bounds = Bounds::of(drawn.flat_map(|i| batch.points(i).chunks_exact(2)).map(down));
    if bounds == Bounds::EMPTY {
        return [0.0, 0.0, 1.0, 1.0];
    }
    let (low, size, larger) = (bounds.low, bounds.sides(), bounds.size());
    let margin = if larger > 0.0 { MARGIN * larger } else { 0.5 };
    [low[0] - margin, low[1] - margin, size[0] + 2.0 * margin, size[1] + 2.0 * margin]
}

/// Escapes text for an attribute.
///
/// White space becomes references, since XML readers would make blanks of it. Characters that XML
/// cannot hold become U+FFFD.
fn escaped(name: &str) -> Cow<'_, str> {
    if name.chars().all(|c| c.is_ascii_alphanumeric() || "/_-. ".contains(c)) {
        return Cow::Borrowed(name);
    }
    let mut text = String::with_capacity(name.len() + 8);
    for c in name.chars() {
        match c {
            '&' => text.push_str("&amp;"),
            '<' => text.push_str("&lt;"),
            '"' => text.push_str("&quot;"),
            '\t' => text.push_str("&#9;"),
            '\n' => text.push_str("&#10;"),
            '\r' => text.push_str("&#13;"),
            '\0'..'\u{20}' | '\u{fffe}' | '\u{ffff}' => text.push('\u{fffd}'),
            _ => text.push(c),
        }
    }
    Cow::Owned(text)
}
