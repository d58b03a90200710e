//! Archives of NumPy's arrays, as far as the peers exchange them: `<f8`, `<i8` and `|b1`, row after
//! row.

use std::error::Error;
use std::fs::File;
use std::io::{Read, Write};

use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Shape and values of an array; integers and booleans as numbers.
pub fn array(path: &str, name: &str) -> Result<(Vec<usize>, Vec<f64>)> {
    let mut bytes = Vec::new();
    ZipArchive::new(File::open(path)?)?.by_name(&format!("{name}.npy"))?.read_to_end(&mut bytes)?;
    let end = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let (header, elements) = (std::str::from_utf8(&bytes[10..end])?, &bytes[end..]);
    let inside = |open: &str, close: char| header.split(open).nth(1)?.split(close).next();
    let shape = inside("'shape': (", ')').ok_or("no shape")?;
    let shape: Vec<usize> = shape.split(',').filter_map(|length| length.trim().parse().ok()).collect();
    let (eights, _) = elements.as_chunks::<8>();
    let values = match inside("'descr': '", '\'') {
        Some("<f8") => eights.iter().map(|eight| f64::from_le_bytes(*eight)).collect(),
        Some("<i8") => eights.iter().map(|eight| i64::from_le_bytes(*eight) as f64).collect(),
        Some("|b1") => elements.iter().map(|&flag| f64::from(flag)).collect(),
        other => return Err(format!("{path}: array {name} has the type {other:?}").into()),
    };
    Ok((shape, values))
}

/// Writes arrays of numbers: names, shapes, values.
#[allow(dead_code, reason = "one peer only reads")]
pub fn write(path: &str, arrays: &[(&str, Vec<usize>, Vec<f64>)]) -> Result<()> {
    let mut zip = ZipWriter::new(File::create(path)?);
    for (name, shape, values) in arrays {
        zip.start_file(format!("{name}.npy"), SimpleFileOptions::default())?;
        let lengths: String = shape.iter().map(|length| format!("{length}, ")).collect();
        let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({lengths}), }}\n");
        zip.write_all(b"\x93NUMPY\x01\x00")?;
        zip.write_all(&(header.len() as u16).to_le_bytes())?;
        zip.write_all(header.as_bytes())?;
        zip.write_all(&values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>())?;
    }
    zip.finish()?;
    Ok(())
}
