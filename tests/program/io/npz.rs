//! NPZ: what NumPy writes is read; arrays that do not fit are named.

use std::io::Write;
use std::path::Path;

use faircurve::io::{self, ReadOptions};
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
    let wanted = "wanted are coords and offsets, and perhaps t, weight, known, closed, names";
    assert_eq!(say(&[]), format!("a.npz: the arrays are none: {wanted}"));
    assert_eq!(say(&[("xy", "<f8", "(2, 2)", &zeros[..32])]), format!("a.npz: the arrays are xy: {wanted}"));
    let extra = say(&[coords, offsets, ("wind", "<f8", "(2,)", &zeros[..16])]);
    assert_eq!(extra, format!("a.npz: the arrays are coords, offsets, wind: {wanted}"));
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
        "a.npz: array t has 3 entries for 2 points: give one a point"
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
        "a.npz: array known has 3 entries for 2 points: give one a point"
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
    let no_curves = say(&[("coords", "<f8", "(0, 2)", &[]), ("offsets", "|u1", "(1,)", &[0])]);
    assert_eq!(no_curves, "a.npz: no curve was found: offsets has one entry, and needs one more than there are curves");
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
