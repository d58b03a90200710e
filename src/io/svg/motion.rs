//! Motion: SVG in which a marker moves along every curve, at the times of its samples.
//!
//! Positions are the samples themselves, by `keyTimes` and `values` of `animateMotion`. The columns
//! `opacity`, `scale` and `rotation` (degrees, positive to the left) animate the marker. The curves are
//! drawn as in SVG. All markers start again together after the last time.

use std::io::{self, Write};

use super::write::{draw, is_drawn};
use crate::batch::{Column, CurveBatch, Values, way_round};
use crate::io::WriteOptions;
use crate::io::entry::Entry;
use crate::io::text::Text;

pub(in crate::io) const ENTRY: Entry = Entry {
    reads: "its curves, as SVG",
    writes: "SVG with a marker that moves along each curve: `keyTimes`, and columns `opacity`, `scale` and `rotation`",
    dimensions: 2..=2,
    parameters: true,
    ..Entry::new("motion", "Motion", super::read::read, |out, batch, options, _| write(out, batch, options))
};

/// The marker's radius, as a part of the drawing's larger side.
const RADIUS: f64 = 0.01;

/// Key times are rounded to this part of the period.
const KEYS: f64 = 1e6;

/// Columns that animate a marker, and the elements that they make up to their values.
const CHANNELS: [(&str, &str); 3] = [
    ("opacity", "<animate attributeName=\"opacity\""),
    ("rotation", "<animateTransform attributeName=\"transform\" type=\"rotate\" additive=\"sum\""),
    ("scale", "<animateTransform attributeName=\"transform\" type=\"scale\" additive=\"sum\""),
];

/// Whether a file has a place for a column.
pub(in crate::io) fn holds(name: &str, values: &Values) -> bool {
    values.numbers().is_some_and(|all| all.iter().all(|x| x.is_finite())) && CHANNELS.iter().any(|own| own.0 == name)
}

fn write(out: &mut dyn Write, batch: &CurveBatch, options: &WriteOptions) -> io::Result<()> {
    let mut text = Text::new(out).with_decimals(options.decimals);
    let times: Vec<Vec<f64>> = (0..batch.len()).map(|i| batch.times_with_end(i)).collect();
    let drawn: Vec<usize> = (0..batch.len()).filter(|&i| is_drawn(batch, i) && batch.count(i) > 0).collect();
    let all = || drawn.iter().flat_map(|&i| &times[i]);
    let period = all().fold([f64::INFINITY, f64::NEG_INFINITY], |[from, to], &t| [from.min(t), to.max(t)]);
    draw(&mut text, batch, false, None, |text, [_, _, width, height]| {
        // A drop whose point shows the rotation.
        text.push("<defs><path id=\"faircurve-marker\" style=\"fill:#c00;stroke:none\" transform=\"scale(")?;
        text.number(RADIUS * width.max(height))?;
        text.push(")\" d=\"M1.8,0Q0.9,-1 0,-1A1,1 0 0 0 0,1Q0.9,1 1.8,0Z\"/></defs>\n")?;
        drawn.iter().try_for_each(|&i| marker(text, batch, i, &times[i], period))
    })?;
    text.finish()
}

/// The marker of a curve. It waits at the ends while others move.
fn marker(text: &mut Text, batch: &CurveBatch, i: usize, times: &[f64], [from, to]: [f64; 2]) -> io::Result<()> {
    let (points, first, count) = (batch.points(i), batch.offsets()[i], batch.count(i));
    let duration = to - from;
    text.push("<use href=\"#faircurve-marker\"")?;
    if duration.is_nan() || duration <= 0.0 {
        text.push(" transform=\"translate(")?;
        text.point(&[points[0], 0.0 - points[1]], ",")?;
        return text.push(")\"/>\n");
    }
    text.push(">")?;
    let last = times.len() - 1;
    let part = |k: usize| ((times[k] - from) / duration * KEYS).round() / KEYS;
    let before = (times[0] > from).then_some((0.0, 0));
    let after = (times[last] < to).then_some((1.0, last));
    let inner = (0..=last).map(|k| (part(k), k));
    let keys: Vec<(f64, usize)> = before.into_iter().chain(inner).chain(after).collect();
    element(text, "<animateMotion", duration, &keys, |text, k| {
        let point = &points[2 * (k % count)..];
        text.point(&[point[0], 0.0 - point[1]], ",")
    })?;
    for (name, start) in CHANNELS {
        let own = |column: &&Column| column.name == name && holds(name, &column.values);
        let Some(column) = batch.columns().iter().find(own) else { continue };
        let values = channel(&column.values, (0..=last).map(|k| first + k % count), name == "rotation");
        element(text, start, duration, &keys, |text, k| text.number(values[k]))?;
    }
    text.push("</use>\n")
}

/// The values of a column at some points. Angles go on past a whole turn, and rotations have SVG's sign.
fn channel(values: &Values, points: impl Iterator<Item = usize>, is_rotation: bool) -> Vec<f64> {
    let Some(all) = values.numbers() else { return vec![] };
    let mut channel: Vec<f64> = points.map(|k| all[k]).collect();
    if values.are_angles() {
        for k in 1..channel.len() {
            channel[k] = channel[k - 1] + way_round(channel[k - 1] % 360.0, channel[k]).unwrap_or(0.0);
        }
    }
    if is_rotation {
        channel.iter_mut().for_each(|angle| *angle = 0.0 - *angle);
    }
    channel
}

fn element(
    text: &mut Text,
    start: &str,
    duration: f64,
    keys: &[(f64, usize)],
    mut value: impl FnMut(&mut Text, usize) -> io::Result<()>,
) -> io::Result<()> {
    text.push(format!("{start} dur=\"{duration}s\" repeatCount=\"indefinite\" calcMode=\"linear\" keyTimes=\""))?;
    for (n, &(time, _)) in keys.iter().enumerate() {
        text.push(if n == 0 { "" } else { ";" })?;
        text.number(time)?;
    }
    text.push("\" values=\"")?;
    for (n, &(_, k)) in keys.iter().enumerate() {
        text.push(if n == 0 { "" } else { ";" })?;
        value(text, k)?;
    }
    text.push("\"/>")
}
