//! Frames: JSON for animation, a list of curves with a frame for each sample.

use std::io::{self, Write};

use super::columns::STATUS;
use super::entry::Entry;
use super::source::Source;
use super::text::Text;
use super::{ReadOptions, WriteOptions, free_names};
use crate::batch::{CurveBatch, Values};
use crate::error::Result;

pub(super) const ENTRY: Entry = Entry {
    reads: "not read",
    writes: "JSON: a list of curves, each with `frames` of `t`, `x`, `y`[, `z`] and all columns",
    columns: true,
    statuses: true,
    parameters: true,
    ..Entry::new("frames", "Frames", read, |out, batch, options, _| write(out, batch, options))
};

fn read(source: &mut Source, _: &ReadOptions) -> Result<CurveBatch> {
    Err(source.error(None, "frames are written and not read: give the keys that they were made from, as CSV"))
}

/// Writes `[{"curve":…,"frames":[{"t":…,"x":…,"y":…},…]},…]`, a line per frame.
///
/// `t` is a text where times are dates, and the number of the sample where there are no times. A
/// number that is not finite is null. The last frame of a closed curve repeats its first point.
fn write(out: &mut dyn Write, batch: &CurveBatch, options: &WriteOptions) -> io::Result<()> {
    let d = batch.dimension();
    let mut text = Text::new(out).with_decimals(options.decimals);
    let names = free_names(batch, &["t", "x", "y", "z"][..d + 1]);
    let keys: Vec<String> = names.iter().map(serde_json::to_string).collect::<Result<_, _>>()?;
    for i in 0..batch.len() {
        text.push(if i == 0 { "[\n" } else { ",\n" })?;
        text.push(format!("{{\"curve\":{}", serde_json::to_string(&batch.name(i))?))?;
        if let Some(status) = options.statuses.get(i) {
            text.push(format!(",\"{STATUS}\":\"{}\"", status.word()))?;
        }
        text.push(",\"frames\":[")?;
        let (first, count) = (batch.offsets()[i], batch.count(i));
        let clock = batch.parameters(i).and_then(|t| Some(batch.origin().clock(i)?.for_all(t.iter().copied())));
        for (k, time) in batch.times_with_end(i).into_iter().enumerate() {
            let own = k % count;
            text.push(if k == 0 { "\n{\"t\":" } else { ",\n{\"t\":" })?;
            match clock {
                Some(clock) => text.push(format!("\"{}\"", clock.write(time)))?,
                None => text.number_or_null(time)?,
            }
            for (name, &x) in ["x", "y", "z"].iter().zip(&batch.points(i)[own * d..][..d]) {
                text.push(format!(",\"{name}\":"))?;
                if x.is_finite() { text.point(&[x], "")? } else { text.push("null")? }
            }
            for (column, key) in batch.columns().iter().zip(&keys) {
                text.push(format!(",{key}:"))?;
                match &column.values {
                    Values::Texts(texts) => text.push(serde_json::to_string(&texts[first + own])?)?,
                    values => text.number_or_null(values.numbers().map_or(f64::NAN, |numbers| numbers[first + own]))?,
                }
            }
            text.push("}")?;
        }
        text.push("\n]}")?;
    }
    text.push(if batch.is_empty() { "[]\n" } else { "\n]\n" })?;
    text.finish()
}
