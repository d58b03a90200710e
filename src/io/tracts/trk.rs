//! TRK, TrackVis' tracks: a header of 1,000 bytes, then the points of every streamline as floats,
//! with scalars a point and properties a streamline.
//!
//! The layout is TrackVis' own (trackvis.org/docs, version 2). Scalars of several values are named
//! as nibabel does: the name, a zero byte, and how many.

use std::io::{self, Write};
use std::sync::Arc;

use super::space::{HEADER_BYTES, to_millimetres};
use super::{Bytes, CutOff, MILLIMETRE, as_streamlines, cut_off, streamline};
use crate::batch::{Column, CurveBatch, Origin, Values};
use crate::error::{Error, Result};
use crate::io::entry::Entry;
use crate::io::source::Source;
use crate::io::{ReadOptions, encoding};
use glam::{DAffine3, DVec3};

pub(in crate::io) const ENTRY: Entry = Entry {
    reads: "TrackVis' tracks with all that points and streamlines have; millimetres, x to the right, y to the front, z up",
    writes: "the same header with new streamlines; at most 10 columns, of numbers",
    lacks: "there is no streamline after the header",
    dimensions: 3..=3,
    columns: true,
    check,
    ..Entry::new("trk", "TRK", read, |out, batch, _, _| write(out, batch))
};

/// Places in the header.
const SCALARS: (usize, usize) = (36, 38);
const PROPERTIES: (usize, usize) = (238, 240);
const COUNT: usize = 988;
const VERSION: usize = 992;
const SIZE: usize = 996;

/// A header names at most this many scalars, and as many properties, with this many bytes each.
const NAMES: usize = 10;
const NAME_BYTES: usize = 20;

/// What is kept of a file.
struct Header {
    bytes: [u8; HEADER_BYTES],
    is_big_endian: bool,
    /// From the file's coordinates to millimetres.
    to_millimetres: DAffine3,
    /// The columns that are scalars of points, and those that are properties of streamlines.
    columns: [Vec<String>; 2],
    streamlines: usize,
    /// The properties of streamlines. Columns have no entry for a streamline without points.
    properties: Vec<f64>,
}

/// Values of one name.
struct Named {
    name: String,
    count: usize,
}

impl Named {
    /// The names of its columns.
    fn columns(&self) -> impl Iterator<Item = String> {
        (1..=self.count).map(|k| if self.count == 1 { self.name.clone() } else { format!("{}_{k}", self.name) })
    }
}

fn read(source: &mut Source, options: &ReadOptions) -> Result<CurveBatch> {
    let bytes = source.bytes()?;
    let wrong = |what: &str| source.error(None, format!("{what}: this is no TRK file of TrackVis"));
    let Some(head) = bytes.first_chunk::<HEADER_BYTES>().filter(|head| head.starts_with(b"TRACK")) else {
        return Err(wrong("it does not begin with TRACK and 1,000 bytes of header"));
    };
    let size: [u8; 4] = std::array::from_fn(|k| head[SIZE + k]);
    let is_big_endian = match (i32::from_le_bytes(size), i32::from_be_bytes(size)) {
        (1000, _) => false,
        (_, 1000) => true,
        _ => return Err(wrong("its header does not say that it has 1,000 bytes")),
    };
    let at = |at: usize| Bytes { bytes: &bytes, at, is_big_endian };
    let in_header = |_: CutOff| wrong("its header is cut off");
    let scalars = names(head, SCALARS, at(SCALARS.0).i16().map_err(in_header)?, "scalar");
    let properties = names(head, PROPERTIES, at(PROPERTIES.0).i16().map_err(in_header)?, "property");
    let [Some(scalars), Some(properties)] = [scalars, properties] else {
        return Err(wrong("its header gives points or streamlines fewer than 0 values"));
    };
    let version = at(VERSION).i32().map_err(in_header)?;
    let to_millimetres = to_millimetres(at(0), version).map_err(in_header)?;
    let to_millimetres =
        to_millimetres.ok_or_else(|| wrong("its header has a matrix without an inverse, or voxels without a size"))?;

    let [scalars, properties] =
        [scalars, properties].map(|named| named.iter().flat_map(Named::columns).collect::<Vec<String>>());
    let (mut coords, mut offsets) = (Vec::new(), vec![0]);
    let mut columns: Vec<Vec<f64>> = vec![vec![]; scalars.len() + properties.len()];
    let mut of_streamlines = Vec::new();
    let mut numbers = at(HEADER_BYTES);
    while !numbers.is_at_end() {
        let streamline = offsets.len() - 1;
        let cut_off = |_: CutOff| cut_off(source, streamline);
        let count = numbers.i32().map_err(cut_off)?;
        let count =
            usize::try_from(count).map_err(|_| wrong(&format!("streamline {streamline} has {count} points")))?;
        // Of what the file claims only what it has takes memory.
        let claimed = count.saturating_mul(3 + scalars.len()).saturating_add(properties.len()).saturating_mul(4);
        if claimed > bytes.len() - numbers.at {
            return Err(cut_off(CutOff));
        }
        source.grow(&mut coords, 3 * count)?;
        for column in &mut columns {
            source.grow(column, count)?;
        }
        for _ in 0..count {
            let mut number = || numbers.f32().map_err(cut_off);
            let point = DVec3::new(number()?, number()?, number()?);
            coords.extend(to_millimetres.transform_point3(point).to_array());
            for column in &mut columns[..scalars.len()] {
                column.push(number()?);
            }
        }
        for column in &mut columns[scalars.len()..] {
            let value = numbers.f32().map_err(cut_off)?;
            column.extend(std::iter::repeat_n(value, count));
            source.push(&mut of_streamlines, value)?;
        }
        source.push(&mut offsets, coords.len() / 3)?;
    }
    let header = Header {
        bytes: *head,
        is_big_endian,
        to_millimetres,
        columns: [scalars.clone(), properties.clone()],
        streamlines: offsets.len() - 1,
        properties: of_streamlines,
    };
    let origin = Origin { document: Some(Arc::new(header)), metres: Some(MILLIMETRE), ..source.origin() };
    let named = scalars.into_iter().chain(properties).zip(columns);
    let columns = named.map(|(name, numbers)| Column { name, values: Values::Numbers(numbers) }).collect();
    as_streamlines(CurveBatch::from_file(3, coords, offsets, Arc::new(origin))?.with_columns(columns)?, options)
}

/// The names of `values` values. Values without a name are called `what`.
fn names(head: &[u8; HEADER_BYTES], (_, start): (usize, usize), values: i16, what: &str) -> Option<Vec<Named>> {
    let (mut left, mut named) = (usize::try_from(values).ok()?, Vec::new());
    for slot in head[start..].chunks_exact(NAME_BYTES).take(NAMES).take_while(|slot| slot[0] != 0) {
        let mut parts = slot.split(|byte| *byte == 0);
        let text = |part: &[u8]| String::from_utf8(part.into()).unwrap_or_else(|_| encoding::of_latin(part));
        let [name, count] = [parts.next(), parts.next()].map(|part| text(part.unwrap_or_default()));
        let count = count.parse().unwrap_or(1).min(left);
        if count > 0 {
            named.push(Named { name, count });
        }
        left -= count;
    }
    named.extend((left > 0).then(|| Named { name: what.into(), count: left }));
    Some(named)
}

/// Refuses texts, and more columns than the header can name.
fn check(batch: &CurveBatch) -> Result<()> {
    let all = 0..batch.total_points();
    if let Some(column) = batch.columns().iter().find(|column| all.clone().any(|k| number(column, k).is_none())) {
        return Err(Error::Argument(format!(
            "TRK holds numbers, and the column {} is text: write CSV, or leave it out",
            column.name
        )));
    }
    let [scalars, properties] = columns(batch);
    match slots(&scalars).len().max(slots(&properties).len()) {
        ..=NAMES => Ok(()),
        more => {
            Err(Error::Argument(format!("TRK names {NAMES} columns at most, and there are {more}: leave some out")))
        }
    }
}

/// The number of a point. Columns that are the same along each curve are texts where they were read
/// from text.
fn number(column: &Column, k: usize) -> Option<f64> {
    match &column.values {
        Values::Texts(texts) if texts[k].is_empty() => Some(f64::NAN),
        Values::Texts(texts) => texts[k].parse().ok(),
        values => values.numbers().map(|numbers| numbers[k]),
    }
}

fn header(batch: &CurveBatch) -> Option<&Header> {
    batch.origin().document.as_ref()?.downcast_ref()
}

/// The columns of points, and the columns of streamlines: the properties that were read, and texts.
fn columns(batch: &CurveBatch) -> [Vec<&Column>; 2] {
    let is_property = |column: &&Column| match header(batch) {
        Some(header) => header.columns[1].contains(&column.name),
        None => matches!(column.values, Values::Texts(_)),
    };
    let (properties, scalars) = batch.columns().iter().partition(is_property);
    [scalars, properties]
}

/// Columns `a_1`, `a_2` … that follow each other are values of `a`.
fn slots(columns: &[&Column]) -> Vec<Named> {
    let mut slots: Vec<Named> = Vec::new();
    for column in columns {
        let numbered = column.name.rsplit_once('_').and_then(|(name, k)| Some((name, k.parse::<usize>().ok()?)));
        match (numbered, slots.last_mut()) {
            (Some((name, k)), Some(slot))
                if k > 1 && k == slot.count + 1 && (slot.name == name || slot.name == format!("{name}_1")) =>
            {
                *slot = Named { name: name.into(), count: k };
            }
            _ => slots.push(Named { name: column.name.clone(), count: 1 }),
        }
    }
    slots
}

fn write(out: &mut dyn Write, batch: &CurveBatch) -> io::Result<()> {
    let [scalars, properties] = columns(batch);
    let (mut head, is_big_endian, back) = match header(batch) {
        Some(header) => (header.bytes, header.is_big_endian, header.to_millimetres.inverse()),
        // Voxels of a millimetre, whose first has its middle at the origin.
        None => (super::space::plain_header(), false, DAffine3::from_translation(DVec3::splat(0.5))),
    };
    let order = |mut bytes: [u8; 4]| {
        if is_big_endian {
            bytes.reverse();
        }
        bytes
    };
    let header = header(batch);
    for (k, ((count, start), columns)) in [(SCALARS, &scalars), (PROPERTIES, &properties)].into_iter().enumerate() {
        if header.is_some_and(|header| columns.iter().map(|column| &column.name).eq(&header.columns[k])) {
            continue;
        }
        let bytes = (columns.len() as i16).to_le_bytes();
        head[count..count + 2].copy_from_slice(&if is_big_endian { [bytes[1], bytes[0]] } else { bytes });
        head[start..start + NAMES * NAME_BYTES].fill(0);
        for (slot, Named { name, count }) in head[start..].chunks_exact_mut(NAME_BYTES).zip(slots(columns)) {
            let count = if count > 1 { format!("\0{count}") } else { String::new() };
            // One byte is left, so that a name ends.
            let most = (0..=NAME_BYTES - 1 - count.len()).rev().find(|&at| name.is_char_boundary(at.min(name.len())));
            let text = format!("{}{count}", &name[..most.unwrap_or(0).min(name.len())]);
            slot[..text.len()].copy_from_slice(text.as_bytes());
        }
    }
    head[COUNT..COUNT + 4].copy_from_slice(&order((batch.len() as i32).to_le_bytes()));
    out.write_all(&head)?;
    let read = header.filter(|header| header.streamlines == batch.len());
    let mut buffer = Vec::new();
    for i in 0..batch.len() {
        // Curves without points are sampled as NaN.
        let has_points = !batch.points(i).iter().all(|x| x.is_nan());
        let points = || streamline(batch, i).filter(|_| has_points);
        let first = batch.offsets()[i];
        buffer.extend(order((points().count() as i32).to_le_bytes()));
        let mut push = |x: f64| buffer.extend(order((x as f32).to_le_bytes()));
        let number = |column: &Column, k: usize| number(column, first + k).unwrap_or(f64::NAN);
        for k in points() {
            let point = back.transform_point3(DVec3::from_slice(&batch.points(i)[3 * k..]));
            point.to_array().into_iter().for_each(&mut push);
            scalars.iter().for_each(|column| push(number(column, k)));
        }
        for column in &properties {
            let as_read = || {
                let Header { columns: [_, names], properties, .. } = read?;
                let place = names.iter().position(|name| *name == column.name)?;
                Some(properties[i * names.len() + place])
            };
            push(if has_points { number(column, 0) } else { as_read().unwrap_or(f64::NAN) });
        }
        if buffer.len() > 1 << 16 {
            out.write_all(&buffer)?;
            buffer.clear();
        }
    }
    out.write_all(&buffer)
}
