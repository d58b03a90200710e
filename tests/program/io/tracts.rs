//! Streamlines as nibabel and MRtrix write them.

use std::path::{Path, PathBuf};

use faircurve::io::{self, Closed, Format, ReadOptions, WriteOptions};
use faircurve::{Column, CurveBatch, Values};

use super::bits;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn bytes(batch: &CurveBatch, format: Format) -> Vec<u8> {
    let mut bytes = Vec::new();
    io::write_to(&mut bytes, batch, &WriteOptions { format: Some(format), ..WriteOptions::default() }).unwrap();
    bytes
}

fn parsed(bytes: &[u8], format: Format) -> Result<CurveBatch, String> {
    let options = ReadOptions { format: Some(format), ..ReadOptions::default() };
    io::read_from(bytes, &options).map_err(|error| error.to_string())
}

/// What nibabel found, with all columns.
fn reference() -> CurveBatch {
    io::read_with(data("tracts.csv"), &ReadOptions { carried: "all".parse().unwrap(), ..ReadOptions::default() })
        .unwrap()
}

/// The numbers of a column. What is the same along each curve is text where it was read from text.
fn numbers(column: &Column) -> Vec<f64> {
    match &column.values {
        Values::Numbers(numbers) => numbers.clone(),
        Values::Texts(texts) => texts.iter().map(|text| text.parse().unwrap()).collect(),
        _ => panic!("{column:?}"),
    }
}

fn assert_same_columns(found: &CurveBatch, wanted: &CurveBatch) {
    assert_eq!(found.columns().len(), wanted.columns().len());
    for (a, b) in found.columns().iter().zip(wanted.columns()) {
        assert_eq!((&a.name, numbers(a)), (&b.name, numbers(b)));
    }
}

#[test]
fn streamlines_are_where_nibabel_finds_them_whatever_the_order_of_voxels() {
    let wanted = reference();
    for name in ["tracts_las.trk", "tracts_als.trk", "tracts.tck"] {
        let found = io::read(data(name)).unwrap();
        assert_eq!((found.offsets(), found.dimension()), (wanted.offsets(), 3), "{name}");
        // nibabel rounds to single precision.
        let far = found.coords().iter().zip(wanted.coords()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(far < 1e-5, "{name}: {far}");
        if name.ends_with("trk") {
            assert_same_columns(&found, &wanted);
        }
    }
}

#[test]
fn files_come_back_with_their_header_and_all_that_belongs_to_points() {
    for name in ["tracts_las.trk", "tracts_als.trk"] {
        let (given, batch) = (std::fs::read(data(name)).unwrap(), io::read(data(name)).unwrap());
        let written = bytes(&batch, Format::Trk);
        assert_eq!((given.len(), &given[..1000]), (written.len(), &written[..1000]), "{name}");
        // Points are moved to millimetres and back: a few last bits.
        let differ = given.iter().zip(&written).filter(|(a, b)| a != b).count();
        assert!(differ <= given.len() / 50, "{name}: {differ} bytes of {}", given.len());
        let back = parsed(&written, Format::Trk).unwrap();
        let far = back.coords().iter().zip(batch.coords()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(far < 2e-5, "{name}: {far}");
        assert_same_columns(&back, &batch);
    }
    let (given, batch) = (std::fs::read(data("tracts.tck")).unwrap(), io::read(data("tracts.tck")).unwrap());
    let points = 12 * (batch.total_points() + batch.len() + 1);
    assert!(bytes(&batch, Format::Tck).ends_with(&given[given.len() - points..]));
}

#[test]
fn tables_become_tracts_and_tracts_tables() {
    let wanted = reference();
    let trk = parsed(&bytes(&wanted, Format::Trk), Format::Trk).unwrap();
    let tck = parsed(&bytes(&wanted.clone().with_columns(vec![]).unwrap(), Format::Tck), Format::Tck).unwrap();
    assert_eq!(bits(tck.coords()), bits(wanted.coords()), "nibabel's numbers are single already");
    let far = trk.coords().iter().zip(wanted.coords()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(far < 1e-5, "{far}");
    assert_same_columns(&trk, &wanted);
    let closed = parsed(&bytes(&wanted.clone().closed_each(vec![true; 5]).unwrap(), Format::Tck), Format::Tck);
    let closed = closed.unwrap();
    assert_eq!((closed.count(0), closed.is_closed(0)), (7, false), "the first point is repeated");
    assert_eq!(closed.points(0)[..3], closed.points(0)[18..]);
    let options = ReadOptions { closed: Closed::Yes, ..ReadOptions::default() };
    assert!(io::read_with(data("tracts.tck"), &options).unwrap().is_closed(2));
}

/// A TCK file with this field and these numbers.
fn tck(field: &str, numbers: &[u8]) -> Vec<u8> {
    let head = format!("mrtrix tracks\nroi: seed a\nroi: mask b\n{field}\ncount: 1\nfile: . 100\nEND\n");
    let mut bytes = head.into_bytes();
    bytes.resize(100, b'\n');
    bytes.extend(numbers);
    bytes
}

#[test]
fn every_datatype_of_mrtrix_is_read_and_written_as_it_was() {
    let numbers = [1.5, -2.0, 3.25, 4.0, 5.0, 6.0].into_iter().chain([f64::NAN; 3]).chain([f64::INFINITY; 3]);
    let of = |encode: &dyn Fn(f64) -> Vec<u8>| numbers.clone().flat_map(encode).collect::<Vec<u8>>();
    let files = [
        ("Float32LE", of(&|x| (x as f32).to_le_bytes().into())),
        ("Float32BE", of(&|x| (x as f32).to_be_bytes().into())),
        ("Float64LE", of(&|x| x.to_le_bytes().into())),
        ("Float64BE", of(&|x| x.to_be_bytes().into())),
    ];
    for (datatype, numbers) in files {
        let batch = parsed(&tck(&format!("datatype: {datatype}"), &numbers), Format::Tck).unwrap();
        assert_eq!((batch.len(), batch.points(0)), (1, &[1.5, -2.0, 3.25, 4.0, 5.0, 6.0][..]), "{datatype}");
        let written = bytes(&batch, Format::Tck);
        assert!(written.ends_with(&numbers), "{datatype}");
        let text = String::from_utf8_lossy(&written);
        assert!(
            text.starts_with(&format!(
                "mrtrix tracks\nroi: seed a\nroi: mask b\ndatatype: {datatype}\ncount: 1\nfile: . "
            )),
            "{text}"
        );
    }
}

/// The file with its numbers in the other order of bytes.
fn big_endian(trk: &[u8]) -> Vec<u8> {
    let mut bytes = trk.to_vec();
    let mut turn = |at: usize, size: usize| bytes[at..at + size].reverse();
    (0..3).for_each(|k| turn(6 + 2 * k, 2));
    (0..6).for_each(|k| turn(12 + 4 * k, 4));
    [36, 238].into_iter().for_each(|at| turn(at, 2));
    (0..16).for_each(|k| turn(440 + 4 * k, 4));
    (0..6).for_each(|k| turn(956 + 4 * k, 4));
    (988..trk.len()).step_by(4).for_each(|at| turn(at, 4));
    bytes
}

#[test]
fn the_other_order_of_bytes_is_read_and_written_as_it_was() {
    let given = std::fs::read(data("tracts_las.trk")).unwrap();
    let [little, big] = [given.clone(), big_endian(&given)].map(|bytes| parsed(&bytes, Format::Trk).unwrap());
    assert_eq!(bits(little.coords()), bits(big.coords()));
    assert_eq!(little.columns(), big.columns());
    assert_eq!(big_endian(&bytes(&big, Format::Trk)), bytes(&little, Format::Trk));
}

#[test]
fn damaged_tracts_are_sentences() {
    let trk = std::fs::read(data("tracts_las.trk")).unwrap();
    let with = |at: usize, bytes: &[u8]| {
        let mut damaged = trk.clone();
        damaged[at..at + bytes.len()].copy_from_slice(bytes);
        damaged
    };
    let sentences = [
        (Format::Trk, b"TRICK".to_vec(), "it does not begin with TRACK and 1,000 bytes of header"),
        (Format::Trk, with(996, &[1, 2, 3, 4]), "its header does not say that it has 1,000 bytes"),
        (Format::Trk, with(12, &[0; 4]), "a matrix without an inverse, or voxels without a size"),
        (Format::Trk, with(440, &[0; 48]), "a matrix without an inverse, or voxels without a size"),
        (Format::Trk, with(36, &[255, 255]), "fewer than 0 values"),
        (Format::Trk, with(1000, &[255; 4]), "streamline 0 has -1 points"),
        (Format::Trk, with(1000, &[0, 0, 0, 127]), "it ends within streamline 0"),
        (Format::Trk, trk[..trk.len() - 3].to_vec(), "it ends within streamline 4"),
        (Format::Tck, b"tracks".to_vec(), "it does not begin with \"mrtrix tracks\""),
        (Format::Tck, b"mrtrix tracks 2\nfile: . 30\nEND\n".to_vec(), "it does not begin with \"mrtrix tracks\""),
        (Format::Tck, b"mrtrix tracks\nENDPOINTS: a\n END\n".to_vec(), "its header has no END"),
        (Format::Tck, b"mrtrix tracks\ncount: 1\n".to_vec(), "its header has no END"),
        (Format::Tck, b"mrtrix tracks\ncount: 1\nEND\n".to_vec(), "no line such as \"file: . 67\""),
        (Format::Tck, tck("datatype: Int8", &[]), "its datatype is \"Int8\""),
        (Format::Tck, tck("datatype: Float32LE", &[0; 20]), "it ends within streamline 0"),
    ];
    for (format, bytes, sentence) in sentences {
        let found = parsed(&bytes, format).map(|batch| batch.len()).unwrap_err();
        assert!(found.contains(sentence), "{found}, not {sentence}");
    }
}

#[test]
fn a_line_that_is_end_and_nothing_else_ends_a_header() {
    let numbers: Vec<u8> = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0_f32]
        .into_iter()
        .chain([f32::NAN; 3])
        .chain([f32::INFINITY; 3])
        .flat_map(f32::to_le_bytes)
        .collect();
    for line in ["ENDPOINTS: roi: left", "END: 3", "ENDING", "ends: x", "label: END", "note: gr\u{f6}\u{df}e"] {
        // In Latin-1: what is no UTF-8 stays as it is.
        let head: Vec<u8> = format!("mrtrix tracks    \n{line}\nfile: . 80\nEND\n").chars().map(|c| c as u8).collect();
        let mut file = head.clone();
        file.resize(80, 0);
        file.extend(&numbers);
        let batch = parsed(&file, Format::Tck).unwrap();
        assert_eq!((batch.len(), batch.points(0)), (1, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0][..]), "{line}");
        let field: Vec<u8> = line.chars().map(|c| c as u8).collect();
        let written = bytes(&batch, Format::Tck);
        assert!(written.windows(field.len()).any(|part| part == field), "{line}");
        assert_eq!(parsed(&written, Format::Tck).unwrap().coords(), batch.coords());
    }
}

/// A TRK file: a scalar of points and a property of streamlines, in the header under these names.
fn trk(names: [&[u8]; 2], streamlines: &[(&[[f32; 4]], f32)]) -> Vec<u8> {
    let mut bytes = std::fs::read(data("tracts_las.trk")).unwrap()[..1000].to_vec();
    for (at, name) in [36, 238].into_iter().zip(names) {
        bytes[at..at + 202].fill(0);
        bytes[at] = 1;
        bytes[at + 2..at + 2 + name.len()].copy_from_slice(name);
    }
    bytes[988..992].copy_from_slice(&(streamlines.len() as i32).to_le_bytes());
    for (points, property) in streamlines {
        bytes.extend((points.len() as i32).to_le_bytes());
        bytes.extend(points.iter().flatten().chain([property]).flat_map(|x| x.to_le_bytes()));
    }
    bytes
}

#[test]
fn what_belongs_to_a_streamline_stays_with_or_without_points() {
    let good: &[[f32; 4]] = &[[1.0, 2.0, 3.0, 0.5], [4.0, 5.0, 6.0, 0.75], [7.0, 9.0, 9.0, 1.0]];
    let blank: &[[f32; 4]] = &[[1.0, f32::NAN, 3.0, 0.25], [4.0, 5.0, 6.0, 0.125]];
    let names: [&[u8]; 2] = [b"gr\xf6\xdfe\0\x31", b"id"];
    let given = trk(names, &[(good, 100.0), (&[], 101.0), (blank, 102.0), (&[], 103.0), (&good[..1], 104.0)]);
    let batch = parsed(&given, Format::Trk).unwrap();
    assert_eq!(batch.columns()[0].name, "größe");
    let fit = faircurve::spline::Natural::default().fit(&batch, &faircurve::Device::cpu()).unwrap();
    let sampled = |sampling: faircurve::Sampling| {
        faircurve::tracks::sample(&batch, &fit, &faircurve::tracks::At::Along(sampling), &[]).unwrap()
    };
    let samples = [faircurve::Sampling::PerSpan(1), faircurve::Sampling::Points(4)].map(sampled);
    for (batch, points) in [(&batch, [3, 2, 1]), (&samples[0], [3, 2, 1]), (&samples[1], [4, 0, 4])] {
        let written = bytes(batch, Format::Trk);
        assert_eq!(written[..1000], given[..1000], "the header stays, bit for bit");
        let mut at = 1000;
        let number = |at: usize| f32::from_le_bytes(written[at..at + 4].try_into().unwrap());
        let [good, blank, alone] = points;
        for (count, scalar, property) in
            [(good, 0.5, 100.0), (0, 0.0, 101.0), (blank, 0.25, 102.0), (0, 0.0, 103.0), (alone, 0.5, 104.0)]
        {
            assert_eq!(written[at..at + 4], (count as i32).to_le_bytes());
            if count > 0 {
                assert_eq!(number(at + 16), scalar);
            }
            at += 4 + 16 * count;
            assert_eq!(number(at), property);
            at += 4;
        }
    }
    assert_eq!(
        parsed(&given[..1000], Format::Trk).unwrap().notes()[0],
        "no curve was found: there is no streamline after the header"
    );
}

#[test]
fn what_tracts_cannot_hold_is_refused() {
    let refused = |batch: &CurveBatch, format: Format| {
        let options = WriteOptions { format: Some(format), ..WriteOptions::default() };
        io::write_to(Vec::new(), batch, &options).unwrap_err().to_string()
    };
    let flat = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 0.0]][..]]).unwrap();
    assert!(
        refused(&flat, Format::Tck).starts_with("TCK holds points of 3 dimensions, but the curves have 2: write CSV")
    );
    let line = CurveBatch::from_ragged(3, vec![0.0; 6], vec![0, 2]).unwrap();
    let text = Column { name: "name".into(), values: Values::Texts(vec!["a".into(), "b".into()]) };
    let batch = line.clone().with_columns(vec![text]).unwrap();
    assert!(refused(&batch, Format::Trk).contains("TRK holds numbers, and the column name is text"));
    let many = (0..11).map(|k| Column { name: format!("q{k}"), values: Values::Numbers(vec![0.0; 2]) }).collect();
    assert!(
        refused(&line.with_columns(many).unwrap(), Format::Trk).contains("names 10 columns at most, and there are 11")
    );
}
