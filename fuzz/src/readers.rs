//! Readers on arbitrary bytes, and writers on whatever they read.

use faircurve::CurveBatch;
use faircurve::io::grids::{self, GridFormat, GridWrite};
use faircurve::io::{self, Carried, Closed, Flatness, Format, ReadOptions, WriteOptions};
use faircurve::surface::{HeightField, Surface};
use glam::DVec3;

/// CSV with the options that the first byte chooses.
pub fn csv(data: &[u8]) {
    read(Format::Csv, data);
}

/// GeoJSON.
pub fn geojson(data: &[u8]) {
    read(Format::GeoJson, data);
}

/// SVG, as vertices or as control points.
pub fn svg(data: &[u8]) {
    read(Format::Svg, data);
}

/// NumPy's archives.
pub fn npz(data: &[u8]) {
    read(Format::Npz, data);
}

/// Tracts, tracks of receivers, and arrays.
pub fn tracts(data: &[u8]) {
    let Some((&first, rest)) = data.split_first() else { return };
    read([Format::Trk, Format::Tck, Format::Gpx, Format::Npy][usize::from(first) % 4], rest);
}

/// Grids in CSV or NPZ, out in every format and as terrain; meshes in OBJ.
pub fn grids(data: &[u8]) {
    let Some((&first, rest)) = data.split_first() else { return };
    if first & 2 != 0 {
        return match io::read_mesh_from(rest) {
            Err(error) => check_sentence(&error.to_string()),
            Ok(mesh) => look_around(&mesh),
        };
    }
    let format = if first & 1 == 0 { GridFormat::Csv } else { GridFormat::Npz };
    match grids::read_from(rest, format) {
        Err(error) => check_sentence(&error.to_string()),
        Ok(grids) => {
            if grids.len() == 1 && grids.dimension() == 1 {
                match HeightField::new(grids.shape(0), grids.grid(0).to_vec()) {
                    Err(error) => check_sentence(&error.to_string()),
                    Ok(field) => look_around(&field),
                }
            }
            for format in [GridFormat::Csv, GridFormat::Npz, GridFormat::Obj, GridFormat::Svg] {
                let options = GridWrite { format: Some(format), ..GridWrite::default() };
                if let Err(error) = grids::write_to(Vec::new(), &grids, &options) {
                    check_sentence(&error.to_string());
                }
            }
        }
    }
}

/// What is closest to a few points is in the surface or is not there.
fn look_around(surface: &dyn Surface) {
    for x in [DVec3::ZERO, DVec3::new(0.5, 0.5, 1.0), DVec3::new(1.5, -0.2, 1e3), DVec3::splat(1e9)] {
        let Some(closest) = surface.closest(x) else { continue };
        assert!(closest.is_finite(), "{closest} is closest to {x} in {}", surface.name());
        surface.undefined(closest).iter().for_each(|why| check_sentence(why));
    }
}

/// Whatever a reader makes of bytes, written in a format and read again: the same curves, bit for
/// bit.
pub fn round_trip(data: &[u8]) {
    let [from, to, rest @ ..] = data else { return };
    let formats = [Format::Csv, Format::GeoJson, Format::Svg, Format::Npz];
    let (from, to) = (formats[*from as usize % 4], formats[*to as usize % 4]);
    let options = ReadOptions { format: Some(from), ..ReadOptions::default() };
    let Ok(batch) = io::read_from(rest, &options) else { return };
    let mut written = Vec::new();
    if io::write_to(&mut written, &batch, &WriteOptions { format: Some(to), ..WriteOptions::default() }).is_err() {
        return;
    }
    // In rows of text the parameter tells nothing of a curve without points, and a document keeps
    // only what it had places for.
    let back = io::read_from(&written[..], &ReadOptions { format: Some(to), ..ReadOptions::default() });
    if matches!(to, Format::Csv | Format::Npz) {
        let filled: Vec<usize> = (0..batch.len()).filter(|&i| batch.count(i) > 0).collect();
        if filled.is_empty() || (to == Format::Npz && filled.len() < batch.len()) {
            return;
        }
        let back = back.unwrap_or_else(|error| panic!("what was written from {from} to {to} is refused: {error}"));
        assert_same(&batch.select(&filled), &back);
    }
}

fn assert_same(wanted: &CurveBatch, found: &CurveBatch) {
    assert_eq!(wanted.len(), found.len(), "curves");
    for i in 0..wanted.len() {
        let bits = |batch: &CurveBatch| {
            let points: Vec<Vec<u64>> = batch
                .points(i)
                .chunks_exact(batch.dimension())
                .map(|p| p.iter().map(|x| x.to_bits()).collect())
                .collect();
            // Where a closed curve repeats its first point at the end, readers take the repetition
            // for its closing; it may repeat nothing else.
            let kept = match batch.is_closed(i) {
                true => 1 + points.iter().rposition(|point| *point != points[0]).unwrap_or(0),
                false => points.len(),
            };
            points[..kept].to_vec()
        };
        // A NaN has many bits, and text one word for it.
        let is_number = wanted.points(i).iter().all(|x| !x.is_nan());
        assert!(
            !is_number || bits(wanted) == bits(found),
            "points of curve {i}: {:?} {:?}",
            wanted.points(i),
            found.points(i)
        );
        assert_eq!(wanted.is_closed(i), found.is_closed(i), "whether curve {i} is closed");
    }
}

fn read(format: Format, data: &[u8]) {
    let Some((&first, rest)) = data.split_first() else { return };
    let columns = match first & 3 {
        3 => "x=1,y=2,curve=3,t=4".parse(),
        1 => "x=lon,y=lat,curve=id,t=hours".parse(),
        2 => "weight=,t=".parse(),
        _ => "".parse(),
    };
    let options = ReadOptions {
        format: Some(format),
        columns: columns.expect("columns that make sense"),
        closed: [Closed::Auto, Closed::Yes, Closed::No, Closed::Auto][(first >> 2 & 3) as usize],
        controls: first & 16 != 0,
        sorted: first & 32 != 0,
        carried: if first & 64 != 0 { "all".parse().expect("a word") } else { Carried::default() },
        flatness: (first & 128 != 0).then_some(Flatness::OfSize(0.01)),
        paths_only: false,
        selected: None,
    };
    match io::read_from(rest, &options) {
        Err(error) => check_sentence(&error.to_string()),
        Ok(batch) => {
            assert!(batch.total_points() * batch.dimension() == batch.coords().len());
            for &format in Format::ALL {
                let options = WriteOptions { format: Some(format), ..WriteOptions::default() };
                if let Err(error) = io::write_to(Vec::new(), &batch, &options) {
                    check_sentence(&error.to_string());
                }
            }
        }
    }
}

/// A sentence quotes at most 80 characters of each thing that it was given.
fn check_sentence(sentence: &str) {
    assert!(sentence.chars().count() < 2000, "a sentence of {} characters", sentence.chars().count());
}
