//! TCK, MRtrix's tracks: a text of fields, then triplets of floats, with NaN between streamlines
//! and infinity at the end.

use std::io::{self, Write};
use std::sync::Arc;

use super::{Bytes, MILLIMETRE, as_streamlines, cut_off, streamline};
use crate::batch::{CurveBatch, Origin};
use crate::error::{Result, quoted};
use crate::io::entry::Entry;
use crate::io::source::Source;
use crate::io::{ReadOptions, is_finite};

pub(in crate::io) const ENTRY: Entry = Entry {
    reads: "MRtrix's tracks; millimetres, x to the right, y to the front, z up",
    writes: "the same fields with new streamlines",
    lacks: "there is no streamline after the header",
    dimensions: 3..=3,
    ..Entry::new("tck", "TCK", read, |out, batch, _, _| write(out, batch))
};

/// What a file begins with.
const MAGIC: &str = "mrtrix tracks";

/// What is kept of a file.
struct Header {
    /// Lines of the header, except the ones that writing makes.
    fields: Vec<Vec<u8>>,
    datatype: Datatype,
}

#[derive(Clone, Copy)]
struct Datatype {
    is_double: bool,
    is_big_endian: bool,
}

impl Datatype {
    fn of(word: &str) -> Option<Self> {
        let lower = word.to_ascii_lowercase();
        let (size, order) = lower.strip_prefix("float").and_then(|rest| rest.split_at_checked(2))?;
        let is_double = match size {
            "32" => false,
            "64" => true,
            _ => return None,
        };
        let is_big_endian = match order {
            "be" => true,
            "le" | "" => false,
            _ => return None,
        };
        Some(Datatype { is_double, is_big_endian })
    }

    fn word(self) -> String {
        let [size, order] =
            [if self.is_double { 64 } else { 32 }.to_string(), if self.is_big_endian { "BE" } else { "LE" }.into()];
        format!("Float{size}{order}")
    }
}

fn read(source: &mut Source, options: &ReadOptions) -> Result<CurveBatch> {
    let bytes = source.bytes()?;
    let mut lines = bytes.split(|&byte| byte == b'\n');
    if lines.next().is_none_or(|line| line.trim_ascii_end() != MAGIC.as_bytes()) {
        return Err(source.error(None, format!("it does not begin with \"{MAGIC}\": this is no TCK file")));
    }
    let (mut fields, mut start, mut datatype) = (Vec::new(), None, None);
    loop {
        let bytes = lines.next().ok_or_else(|| source.error(None, "its header has no END: it was cut off"))?;
        if bytes.trim_ascii_end() == b"END" {
            break;
        }
        let line = String::from_utf8_lossy(bytes);
        let (key, value) = line.split_once(':').map_or((&*line, ""), |(key, value)| (key.trim(), value.trim()));
        match key {
            "file" => start = value.strip_prefix('.').and_then(|offset| offset.trim().parse::<usize>().ok()),
            "datatype" => {
                let wrong = || {
                    format!("its datatype is {}: Float32LE, Float32BE, Float64LE or Float64BE are read", quoted(value))
                };
                datatype = Some(Datatype::of(value).ok_or_else(|| source.error(None, wrong()))?);
            }
            "count" => {}
            _ => fields.push(bytes.to_vec()),
        }
    }
    let start = start.filter(|start| *start <= bytes.len());
    let start = start
        .ok_or_else(|| source.error(None, "its header has no line such as \"file: . 67\", where the points begin"))?;
    let datatype = datatype.unwrap_or(Datatype { is_double: false, is_big_endian: false });
    let mut numbers = Bytes { bytes: &bytes, at: start, is_big_endian: datatype.is_big_endian };
    let (mut coords, mut offsets): (Vec<f64>, Vec<usize>) = (Vec::new(), vec![0]);
    loop {
        let mut number = || if datatype.is_double { numbers.f64() } else { numbers.f32() };
        let (Ok(x), Ok(y), Ok(z)) = (number(), number(), number()) else {
            return Err(cut_off(source, offsets.len() - 1));
        };
        if x.is_nan() && y.is_nan() && z.is_nan() {
            source.push(&mut offsets, coords.len() / 3)?;
        } else if x.is_infinite() && y.is_infinite() && z.is_infinite() {
            break;
        } else {
            source.grow(&mut coords, 3)?;
            coords.extend([x, y, z]);
        }
    }
    // Some programs write no separator behind the last streamline.
    if offsets.last() != Some(&(coords.len() / 3)) {
        offsets.push(coords.len() / 3);
    }
    let origin =
        Origin { document: Some(Arc::new(Header { fields, datatype })), metres: Some(MILLIMETRE), ..source.origin() };
    as_streamlines(CurveBatch::from_file(3, coords, offsets, Arc::new(origin))?, options)
}

fn write(out: &mut dyn Write, batch: &CurveBatch) -> io::Result<()> {
    let header: Option<&Header> = batch.origin().document.as_ref().and_then(|document| document.downcast_ref());
    let datatype = header.map_or(Datatype { is_double: false, is_big_endian: false }, |header| header.datatype);
    let mut text = format!("{MAGIC}\n").into_bytes();
    for field in header.iter().flat_map(|header| &header.fields) {
        text.extend_from_slice(field);
        text.push(b'\n');
    }
    text.extend(format!("datatype: {}\ncount: {}\n", datatype.word(), batch.len()).bytes());
    // The header holds its own length, whose digits count.
    let end = |offset: usize| format!("file: . {offset}\nEND\n");
    let mut offset = text.len();
    while text.len() + end(offset).len() > offset {
        offset = text.len() + end(offset).len();
    }
    text.extend(end(offset).bytes());
    text.resize(offset, b'\n');
    out.write_all(&text)?;
    let mut buffer = Vec::new();
    let mut push = |x: f64| match (datatype.is_double, datatype.is_big_endian) {
        (false, false) => buffer.extend((x as f32).to_le_bytes()),
        (false, true) => buffer.extend((x as f32).to_be_bytes()),
        (true, false) => buffer.extend(x.to_le_bytes()),
        (true, true) => buffer.extend(x.to_be_bytes()),
    };
    for i in 0..batch.len() {
        // What is not all numbers has no points: they would end the streamline, or the file.
        streamline(batch, i)
            .filter(|_| is_finite(batch, i))
            .for_each(|k| batch.points(i)[3 * k..3 * k + 3].iter().for_each(|x| push(*x)));
        (0..3).for_each(|_| push(f64::NAN));
    }
    (0..3).for_each(|_| push(f64::INFINITY));
    out.write_all(&buffer)
}
