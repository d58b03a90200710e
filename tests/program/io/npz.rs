//! NPZ: what NumPy writes is read; arrays that do not fit are named.

use std::io::Write;
use std::path::Path;

use faircurve::io::{self, Format, ReadOptions, WriteOptions};
use faircurve::{CurveBatch, Values};
use zip::write::SimpleFileOptions;

use super::errors::{complaint_with, without_folder};

#[test]
fn what_numpy_writes_is_read_compressed_or_not() {
    for name in ["savez.npz", "savez_compressed.npz"] {
        let batch = io::read(Path::new("tests/data").join(name)).unwrap();
        assert_eq!((batch.len(), batch.dimension(), batch.offsets()), (2, 3, &[0, 2, 5][..]), "{name}");
        let coords: Vec<f64> = (0..15).map(|k| f64::from(k) / 8.0).collect();
        assert_eq!(batch.coords(), coords, "{name}");
        assert_eq!((batch.name(0).as_ref(), batch.name(1).as_ref()), ("näme", ""), "{name}");
        assert_eq!((batch.is_closed(0), batch.is_closed(1)), (false, true), "{name}");
        assert_eq!(batch.parameters(1), Some(&[0.5, 1.0, 4.0][..]), "{name}");
        assert_eq!(batch.weights(0), Some(&[1.0, 2.0][..]), "{name}");
    }
}

/// An archive of arrays given as type, shape and bytes, written with the crate that NPZ is read
/// with.
pub fn npz(path: &Path, arrays: &[(&str, &str, &str, &[u8])]) {
    npz_in_order(path, "False", arrays);
}

/// The same, with what the headers say of Fortran's order.
pub fn npz_in_order(path: &Path, fortran: &str, arrays: &[(&str, &str, &str, &[u8])]) {
    let mut zip = zip::ZipWriter::new(std::fs::File::create(path).unwrap());
    for (name, dtype, shape, bytes) in arrays {
        zip.start_file(format!("{name}.npy"), SimpleFileOptions::default()).unwrap();
        let header = format!("{{'descr': '{dtype}', 'fortran_order': {fortran}, 'shape': {shape}, }}\n");
        zip.write_all(b"\x93NUMPY\x01\x00").unwrap();
        zip.write_all(&(header.len() as u16).to_le_bytes()).unwrap();
        zip.write_all(header.as_bytes()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap();
}

#[test]
fn npz_arrays_that_do_not_fit_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    let say = |arrays: &[(&str, &str, &str, &[u8])]| {
        npz(&path, arrays);
        without_folder(&io::read(&path).unwrap_err().to_string(), folder.path())
    };
    let zeros = [0u8; 64];
    let coords = ("coords", "<f8", "(2, 2)", &zeros[..32]);
    let offsets = ("offsets", "|u1", "(2,)", &[0u8, 2][..]);
    let wanted = "wanted are coords and offsets, and perhaps t, weight, known, closed, names; or nibabel's data, offsets and lengths";
    assert_eq!(say(&[]), format!("a.npz: the arrays are none: {wanted}"));
    assert_eq!(say(&[("xy", "<f8", "(2, 2)", &zeros[..32])]), format!("a.npz: the arrays are xy: {wanted}"));
    assert_eq!(
        say(&[("coords", "<f8", "(4,)", &zeros[..32]), offsets]),
        "a.npz: array coords has the shape (4,): it must be (N, 2) or (N, 3)"
    );
    assert_eq!(
        say(&[("coords", "<f8", "(1, 4)", &zeros[..32]), offsets]),
        "a.npz: array coords has the shape (1, 4): it must be (N, 2) or (N, 3)"
    );
    assert_eq!(
        say(&[("coords", "<c16", "(1, 2)", &zeros[..32]), offsets]),
        "a.npz: array coords has the type '<c16': it must hold numbers, such as float64"
    );
    assert_eq!(
        say(&[coords, ("offsets", "<f8", "(2,)", &zeros[..16])]),
        "a.npz: array offsets has the type '<f8': it must hold integers"
    );
    assert_eq!(
        say(&[coords, ("offsets", "|i1", "(2,)", &[0u8, 0xff][..])]),
        "a.npz: array offsets holds -1: offsets count points from 0"
    );
    assert_eq!(
        say(&[coords, ("offsets", "|i1", "(3,)", &[0u8, 2, 1][..])]),
        "a.npz: offsets decrease at curve 1: 2 is followed by 1"
    );
    assert_eq!(
        say(&[coords, ("offsets", "|i1", "(2,)", &[0u8, 3][..])]),
        "a.npz: offsets end at 3, but there are 2 points"
    );
    assert_eq!(
        say(&[coords, offsets, ("t", "<f8", "(3,)", &zeros[..24])]),
        "a.npz: array t has 3 entries for 2 points: give one per point"
    );
    assert_eq!(
        say(&[coords, offsets, ("closed", "|b1", "(1, 1)", &zeros[..1])]),
        "a.npz: array closed has the shape (1, 1): it must have one axis"
    );
    assert_eq!(
        say(&[coords, offsets, ("names", "<i8", "(1,)", &zeros[..8])]),
        "a.npz: array names has the type '<i8': it must hold text, such as numpy.array([\"a\", \"b\"]), and no Python objects"
    );
    assert_eq!(
        say(&[coords, offsets, ("known", "|b1", "(3,)", &zeros[..3])]),
        "a.npz: array known has 3 entries for 2 points: give one per point"
    );
    assert_eq!(
        say(&[coords, offsets, ("known", "<f8", "(2,)", &zeros[..16])]),
        "a.npz: array known has the type '<f8': it must hold booleans or integers, 1 for a given control point and 0 else"
    );
    assert_eq!(
        say(&[coords, offsets, ("known", "|u1", "(2,)", &[1u8, 7][..])]),
        "a.npz: array known holds 7 for point 1, which is neither 1 nor 0: write 1 for a given control point, 0 else"
    );
    assert_eq!(
        say(&[("coords", "<f8", "(4611686018427387904, 2)", &zeros[..32]), offsets]),
        "a.npz: array coords has the shape (4611686018427387904, 2), but holds less: write the file again"
    );
    npz(&path, &[("coords", "<f8", "(0, 2)", &[]), ("offsets", "|u1", "(1,)", &[0])]);
    let note = "no curve was found: offsets has one entry, and needs one more than there are curves";
    assert_eq!(io::read(&path).unwrap().notes(), [note]);
    npz(&path, &[coords, offsets]);
    let whole = std::fs::read(&path).unwrap();
    assert_eq!(
        complaint_with("a.npz", &whole[..whole.len() / 2], &ReadOptions::default()),
        "a.npz: this is no NPZ archive, or it was cut off (invalid Zip archive: Could not find EOCD): \
         write it with numpy.savez"
    );
}

#[test]
fn known_flags_are_booleans_or_integers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    let coords: Vec<u8> = [0.0, 0.0, f64::NAN, f64::NAN, 1.0, 0.0].iter().flat_map(|x: &f64| x.to_le_bytes()).collect();
    let coords = ("coords", "<f8", "(3, 2)", &coords[..]);
    let offsets = ("offsets", "|u1", "(2,)", &[0u8, 3][..]);
    let wide = [1i64, 0, 1].map(i64::to_le_bytes).concat();
    for known in [("known", "|b1", "(3,)", &[1u8, 0, 1][..]), ("known", "<i8", "(3,)", &wide[..])] {
        npz(&path, &[coords, offsets, known]);
        let batch = io::read(&path).unwrap();
        assert_eq!(batch.constraints().known, Some(vec![true, false, true]), "{}", known.1);
        assert_eq!(batch.problem(0), None);
    }
    npz(&path, &[coords, offsets]);
    let problem = io::read(&path).unwrap().problem(0).unwrap().message.clone();
    assert!(
        problem.ends_with(
            "curve 0, point 1: x is NaN; every coordinate must be a finite number: mend or remove the point"
        )
    );
}

#[test]
fn other_arrays_travel_along_on_demand_and_are_passed_over_with_a_note_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    let (points, winds) = ([0u8; 32], [1.5f64, 2.5].map(f64::to_le_bytes).concat());
    let arrays: [(&str, &str, &str, &[u8]); 5] = [
        ("coords", "<f8", "(2, 2)", &points),
        ("offsets", "|u1", "(2,)", &[0, 2]),
        ("wind", "<f8", "(2,)", &winds),
        ("kind", "|S1", "(2,)", b"ab"),
        ("total", "<f8", "(1,)", &winds[..8]),
    ];
    npz(&path, &arrays);
    let batch = io::read(&path).unwrap();
    assert!(batch.columns().is_empty());
    let read = ": coords, offsets, t, weight, known, closed and names are read";
    assert_eq!(batch.notes(), [format!("arrays kind, total, wind passed over{read}")]);
    let carried = |text: &str| ReadOptions { carried: text.parse().unwrap(), ..ReadOptions::default() };
    let batch = io::read_with(&path, &carried("all")).unwrap();
    let names: Vec<&str> = batch.columns().iter().map(|column| &*column.name).collect();
    assert_eq!(names, ["kind", "wind"]);
    assert_eq!(batch.columns()[1].values, Values::Numbers(vec![1.5, 2.5]));
    assert_eq!(batch.notes(), [format!("array total passed over{read}")]);
    let error = io::read_with(&path, &carried("total")).unwrap_err().to_string();
    assert!(error.contains("array total has 1 entries for 2 points"), "{error}");
    let out = folder.path().join("b.npz");
    io::write(&out, &batch).unwrap();
    assert_eq!(io::read_with(&out, &carried("all")).unwrap().columns(), batch.columns());
}

#[test]
fn streamlines_of_nibabel_are_read_in_any_order_and_written_as_they_were() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    let data: Vec<u8> = (0..12u8).flat_map(|k| f32::from(k).to_le_bytes()).collect();
    let arrays = |lengths: &'static [u8]| {
        let arrays: [(&str, &str, &str, &[u8]); 3] = [
            ("data", "<f4", "(4, 3)", &data),
            ("offsets", "|u1", "(2,)", &[3, 0]),
            ("lengths", "|u1", "(2,)", lengths),
        ];
        npz(&path, &arrays);
    };
    arrays(&[1, 3]);
    let batch = io::read(&path).unwrap();
    assert_eq!((batch.offsets(), batch.points(0)), (&[0, 1, 4][..], &[9.0, 10.0, 11.0][..]));
    let out = folder.path().join("b.npz");
    io::write(&out, &batch).unwrap();
    let mut archive = zip::ZipArchive::new(std::fs::File::open(&out).unwrap()).unwrap();
    let mut names: Vec<String> =
        (0..archive.len()).map(|k| archive.by_index(k).unwrap().name().unwrap().to_string()).collect();
    names.sort();
    assert_eq!(names, ["data.npy", "lengths.npy", "offsets.npy"]);
    assert_eq!(io::read(&out).unwrap().coords(), batch.coords());
    arrays(&[2, 3]);
    let error = io::read(&path).unwrap_err().to_string();
    assert!(error.contains("streamline 0 begins at point 3 and has 2 points, but data has 4"), "{error}");
}

#[test]
fn an_array_of_numpy_is_curves_of_one_length() {
    let parsed = |shape: &str, order: &str, numbers: &[f64]| {
        let header = format!("{{'descr': '<f8', 'fortran_order': {order}, 'shape': {shape}, }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.into_bytes());
        bytes.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
        let options = ReadOptions { format: Some(Format::Npy), ..ReadOptions::default() };
        io::read_from(&bytes[..], &options).map_err(|error| error.to_string())
    };
    let numbers: Vec<f64> = (0..12).map(f64::from).collect();
    let two = parsed("(2, 3, 2)", "False", &numbers).unwrap();
    assert_eq!((two.len(), two.points(1)), (2, &numbers[6..]));
    let one = parsed("(4, 3)", "False", &numbers).unwrap();
    assert_eq!((one.len(), one.dimension(), one.coords()), (1, 3, &numbers[..]));
    let turned = parsed("(2, 3, 2)", "True", &numbers).unwrap();
    assert_eq!(turned.points(0), [0.0, 6.0, 2.0, 8.0, 4.0, 10.0]);
    let mut bytes = Vec::new();
    let options = WriteOptions { format: Some(Format::Npy), ..WriteOptions::default() };
    io::write_to(&mut bytes, &two, &options).unwrap();
    let options = ReadOptions { format: Some(Format::Npy), ..ReadOptions::default() };
    let back = io::read_from(&bytes[..], &options).unwrap();
    assert_eq!((back.coords(), back.offsets()), (two.coords(), two.offsets()));
    for (shape, sentence) in [
        ("(12,)", "the array has the shape (12,), and must be (B, n, 2)"),
        ("(3, 3, 2)", "the array has the shape (3, 3, 2), but holds 96 bytes"),
    ] {
        assert!(parsed(shape, "False", &numbers).unwrap_err().contains(sentence), "{sentence}");
    }
    let ragged = CurveBatch::from_ragged(2, numbers.clone(), vec![0, 2, 6]).unwrap();
    let options = WriteOptions { format: Some(Format::Npy), ..WriteOptions::default() };
    let error = io::write_to(Vec::new(), &ragged, &options).unwrap_err().to_string();
    assert!(error.contains("NPY holds curves of one length, and these have 2 to 4 points"), "{error}");
}
