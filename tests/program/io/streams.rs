//! Bytes in and out: the same batches and the same sentences as from files.

use faircurve::io::grids::{self, GridFormat, GridWrite};
use faircurve::io::{self, Format, ReadOptions, WriteOptions};
use faircurve::{CurveBatch, Grids};

use super::assert_same;

const ALL: [Format; 4] = [Format::Csv, Format::GeoJson, Format::Svg, Format::Npz];

fn batch() -> CurveBatch {
    let (a, b) = ([[0.1, 0.2], [1.0 / 3.0, 5e-9], [2.0, -7.0]], [[4.0, 5.0], [6.0, 5.5]]);
    let batch = CurveBatch::from_slices(&[&a[..], &b[..]]).unwrap();
    batch.with_names(vec!["a".into(), "b c".into()]).unwrap()
}

#[test]
fn bytes_hold_what_files_hold_zipped_or_not() {
    use std::io::Write;
    let folder = tempfile::tempdir().unwrap();
    for format in ALL {
        let mut bytes = Vec::new();
        io::write_to(&mut bytes, &batch(), &WriteOptions { format: Some(format), ..WriteOptions::default() }).unwrap();
        let path = folder.path().join(format!("a.{format}"));
        io::write(&path, &batch()).unwrap();
        assert_eq!(bytes, std::fs::read(path).unwrap(), "{format}");
        let options = ReadOptions { format: Some(format), ..ReadOptions::default() };
        assert_same(&io::read_from(&bytes[..], &options).unwrap(), &batch(), &format.to_string());
        let mut zipped = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        zipped.write_all(&bytes).unwrap();
        let zipped = zipped.finish().unwrap();
        assert_same(&io::read_from(&zipped[..], &options).unwrap(), &batch(), &format!("{format}, zipped"));
    }
}

#[test]
fn grids_come_from_bytes_and_go_into_them() {
    let wanted = Grids::uniform(1, [2, 3], vec![1.0, 0.1, -2.0, 1e300, 5.0, 7.5]).unwrap();
    for format in [GridFormat::Csv, GridFormat::Npz] {
        let mut bytes = Vec::new();
        grids::write_to(&mut bytes, &wanted, &GridWrite { format: Some(format), ..GridWrite::default() }).unwrap();
        assert_eq!(grids::read_from(&bytes[..], format).unwrap(), wanted, "{format}");
    }
    let sentence = grids::read_from(&b""[..], GridFormat::Obj).unwrap_err().to_string();
    assert_eq!(sentence, "OBJ is only written, grids are read from CSV and NPZ: give one of these");
    let sentence = grids::write_to(Vec::new(), &wanted, &GridWrite::default()).unwrap_err().to_string();
    assert_eq!(sentence, "bytes have no extension to tell their format: set GridWrite::format");
}

#[test]
fn sentences_about_bytes_call_them_input_and_ask_for_the_format() {
    let csv = ReadOptions { format: Some(Format::Csv), ..ReadOptions::default() };
    let sentence = io::read_from(&b"x,y\n1,2\n3,oops\n"[..], &csv).unwrap_err().to_string();
    assert_eq!(sentence, "input, line 3: column \"y\" holds \"oops\", which is no number: mend it, or remove the row");
    let sentence = io::read_from(&b""[..], &ReadOptions::default()).unwrap_err().to_string();
    assert_eq!(sentence, "bytes have no extension to tell their format: set ReadOptions::format");
    let sentence = io::write_to(Vec::new(), &batch(), &WriteOptions::default()).unwrap_err().to_string();
    assert_eq!(sentence, "bytes have no extension to tell their format: set WriteOptions::format");
    struct Full;
    impl std::io::Write for Full {
        fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
            Err(std::io::ErrorKind::StorageFull.into())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let csv = WriteOptions { format: Some(Format::Csv), ..WriteOptions::default() };
    let sentence = io::write_to(Full, &batch(), &csv).unwrap_err().to_string();
    assert_eq!(sentence, "cannot write: no storage space; a part may have been written");
}

#[cfg(target_os = "linux")]
#[test]
fn what_a_full_disk_takes_of_standard_output_is_not_said_to_be_nothing() {
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    let mut program = std::process::Command::new(env!("CARGO_BIN_EXE_faircurve"));
    program.args("fit examples/data/countries-110m.geojson -o - --to csv --device cpu".split(' ')).stdout(full);
    let output = program.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(
        said.contains("cannot write: No space left on device (os error 28); a part may have been written"),
        "{said}"
    );
}
