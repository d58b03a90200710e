//! Grids in and out: the same bits come back, bad files are sentences, meshes have the vertices and
//! faces they should.

use std::path::Path;

use faircurve::io::grids::{self, GridFormat, GridWrite};
use faircurve::laplacian::Grids;
use tempfile::TempDir;

use super::bits;
use super::errors::without_folder;
use super::npz::{npz, npz_in_order};

/// Numbers of every kind and size.
const ODD: [f64; 12] = [
    0.1,
    -0.0,
    1e-320,
    f64::MAX,
    f64::NAN,
    f64::INFINITY,
    -2.5e17,
    1.0 / 3.0,
    f64::NEG_INFINITY,
    7.0,
    -1e-9,
    0.2 + 0.1,
];

fn assert_same(found: &Grids, wanted: &Grids, what: &str) {
    assert_eq!((found.dimension(), found.shapes()), (wanted.dimension(), wanted.shapes()), "{what}");
    assert_eq!(bits(found.values()), bits(wanted.values()), "{what}");
}

/// Writes and reads back.
fn through(grids: &Grids, name: &str) -> Grids {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join(name);
    grids::write(&path, grids, &GridWrite::default()).unwrap();
    let found = grids::read(&path, None).unwrap();
    assert_eq!(found.file(), Some(path.display().to_string().as_str()));
    found
}

/// What a file of grids says as text.
fn written(grids: &Grids, name: &str, options: &GridWrite) -> String {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join(name);
    grids::write(&path, grids, options).unwrap();
    std::fs::read_to_string(path).unwrap()
}

/// What reading says, without the folder's name.
fn complaint_of(name: &str, bytes: &[u8]) -> String {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    without_folder(&grids::read(&path, None).unwrap_err().to_string(), folder.path())
}

fn complaint(text: &str) -> String {
    complaint_of("a.csv", text.as_bytes())
}

#[test]
fn what_is_written_reads_back_to_the_same_bits() {
    let one = Grids::new(1, vec![[3, 4]], ODD.to_vec()).unwrap();
    let alike = Grids::uniform(1, [2, 3], ODD.to_vec()).unwrap();
    let ragged = Grids::new(1, vec![[1, 5], [3, 1], [2, 2]], ODD.to_vec()).unwrap();
    for (grids, what) in [(&one, "one"), (&alike, "alike"), (&ragged, "ragged")] {
        for extension in ["csv", "npz", "csv.gz", "npz.gz", "CSV", "Npz"] {
            assert_same(&through(grids, &format!("a.{extension}")), grids, &format!("{what} in {extension}"));
        }
    }
    let points = Grids::new(3, vec![[1, 1], [1, 3]], ODD.to_vec()).unwrap();
    let flat = Grids::uniform(2, [3, 2], ODD.to_vec()).unwrap();
    let empty = Grids::new(2, vec![[2, 3], [0, 4]], ODD.to_vec()).unwrap();
    for grids in [&points, &flat, &empty] {
        assert_same(&through(grids, "a.npz"), grids, "several values a point");
    }
    let many = Grids::new(1, (1..=12).map(|k| [k, 1]).collect(), vec![0.5; 78]).unwrap();
    assert_same(&through(&many, "a.npz"), &many, "grids_10 comes after grids_9");
}

#[test]
fn csv_is_rows_of_numbers_with_a_blank_line_between_grids() {
    let grids = Grids::new(1, vec![[2, 2], [1, 3]], vec![1.0, 0.1, -2.0, 1e300, 5.0, f64::NAN, 7.0]).unwrap();
    assert_eq!(written(&grids, "a.csv", &GridWrite::default()), "1,0.1\n-2,1e+300\n\n5,NaN,7\n");
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("b.csv");
    // A mark, returns, blanks, several blank lines, none at the end.
    std::fs::write(&path, "\u{feff}\r\n 1, 0.1\r\n-2 ,1e300\r\n  \r\n\r\n5,nan,7").unwrap();
    assert_same(&grids::read(&path, None).unwrap(), &grids, "blanks and blank lines");
}

#[test]
fn csv_that_is_no_grid_is_named_by_line_and_column() {
    assert_eq!(
        complaint("1,2\n3\n"),
        "a.csv, line 2: the row has 1 numbers, but the rows of its grid, which began on line 1, have 2: add or remove numbers, or put a \
         blank line between two grids"
    );
    assert!(
        complaint("1\n\n1,2\n3,4\n5,6,7\n").starts_with(
            "a.csv, line 5: the row has 3 numbers, but the rows of its grid, which began on line 3, have 2"
        )
    );
    assert_eq!(complaint("1,2\n3,high\n"), "a.csv, line 2: column 2 holds \"high\", which is no number: mend it");
    assert_eq!(
        complaint("1;2\n"),
        "a.csv, line 1: column 1 holds \"1;2\", which is no number: separate numbers by commas"
    );
    assert_eq!(
        complaint("1 2\t3\n"),
        "a.csv, line 1: column 1 holds \"1 2\\t3\", which is no number: separate numbers by commas"
    );
    assert_eq!(
        complaint("\nx,y,z,u,v\n1,2,3,4,5\n"),
        "a.csv, line 2: the row holds \"x\", \"y\", \"z\", \"u\", \"v\" as a header does, but grids have none: remove the line, so that \
         all rows are numbers"
    );
    assert!(complaint(&"q".repeat(100)).contains(&format!("\"{}…\"", "q".repeat(79))));
    assert_eq!(
        complaint_of("a.csv", b"1,\xff\n"),
        "a.csv, line 1: column 2 holds \"\u{fffd}\", which is no number: mend it"
    );
    for nothing in ["", "\n \n"] {
        assert_eq!(complaint(nothing), "a.csv: the file is empty: there is nothing to read");
    }
}

#[test]
fn npz_arrays_of_every_kind_are_read() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.npz");
    let read = |arrays: &[(&str, &str, &str, &[u8])]| {
        npz(&path, arrays);
        grids::read(&path, None).unwrap()
    };
    let bytes: Vec<u8> = (1..=12).collect();
    let floats: Vec<u8> = (1..=12).flat_map(|x| (x as f32).to_le_bytes()).collect();
    let numbers: Vec<f64> = (1..=12).map(f64::from).collect();
    let single = read(&[("grids", "|u1", "(3, 4)", &bytes)]);
    assert_same(&single, &Grids::uniform(1, [3, 4], numbers.clone()).unwrap(), "one grid of small integers");
    let batch = read(&[("grids", "<f4", "(2, 3, 2)", &floats)]);
    assert_same(&batch, &Grids::uniform(1, [3, 2], numbers.clone()).unwrap(), "two grids in f32");
    let points = read(&[("grids", "<f4", "(1, 2, 2, 3)", &floats)]);
    assert_same(&points, &Grids::uniform(3, [2, 2], numbers.clone()).unwrap(), "one grid of points");
    let several = read(&[("grids_1", "|u1", "(1, 2, 2)", &bytes[..4]), ("grids_0", "|u1", "(2, 1, 2)", &bytes[..4])]);
    assert_eq!((several.dimension(), several.shapes()), (2, &[[2, 1], [1, 2]][..]));
}

#[test]
fn npz_stored_column_after_column_is_turned() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.npz");
    let bytes: Vec<u8> = (0..24).collect();
    npz_in_order(&path, "True", &[("grids", "|u1", "(2, 3, 4)", &bytes)]);
    let grids = grids::read(&path, None).unwrap();
    let wanted =
        (0..2).flat_map(|i| (0..3).flat_map(move |row| (0..4).map(move |column| f64::from(i + 2 * row + 6 * column))));
    assert_same(&grids, &Grids::uniform(1, [3, 4], wanted.collect()).unwrap(), "Fortran order");
}

#[test]
fn npz_arrays_that_do_not_fit_are_named_with_their_shapes() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.npz");
    let say = |arrays: &[(&str, &str, &str, &[u8])]| {
        npz(&path, arrays);
        without_folder(&grids::read(&path, None).unwrap_err().to_string(), folder.path())
    };
    let zeros = [0u8; 64];
    let wanted = "wanted is grids of the shape (B, rows, columns) or (B, rows, columns, d), or, for grids of several shapes, grids_0, \
                  grids_1 and so on, of (rows, columns) or (rows, columns, d)";
    assert_eq!(say(&[]), format!("a.npz: the arrays are none: {wanted}"));
    assert_eq!(say(&[("heights", "|u1", "(2, 2)", &zeros[..4])]), format!("a.npz: the arrays are heights: {wanted}"));
    assert_eq!(
        say(&[("grids_0", "|u1", "(2, 2)", &zeros[..4]), ("grids_2", "|u1", "(2, 2)", &zeros[..4])]),
        format!("a.npz: the arrays are grids_0, grids_2: {wanted}")
    );
    assert_eq!(
        say(&[("grids", "|u1", "(4,)", &zeros[..4])]),
        "a.npz: array grids has the shape (4,): it must be (B, rows, columns) or (B, rows, columns, d), or (rows, columns) for a single grid"
    );
    assert_eq!(
        say(&[("grids", "|u1", "(3, 0, 5)", &[])]),
        "a.npz: array grids has the shape (3, 0, 5) and holds no point: there is nothing to read"
    );
    assert_eq!(
        say(&[("grids_0", "|u1", "(4,)", &zeros[..4])]),
        "a.npz: array grids_0 has the shape (4,): it must be (rows, columns) or (rows, columns, d)"
    );
    assert_eq!(
        say(&[("grids_0", "|u1", "(2, 2)", &zeros[..4]), ("grids_1", "|u1", "(1, 2, 2)", &zeros[..4])]),
        "a.npz: array grids_1 has the shape (1, 2, 2), 2 values a point, but grids_0 has 1: grids of one file have equally many"
    );
    assert_eq!(
        say(&[("grids", "<c16", "(1, 2)", &zeros[..32])]),
        "a.npz: array grids has the type '<c16': it must hold numbers, such as float64"
    );
    assert_eq!(
        say(&[("grids", "<f8", "(1000, 1000)", &zeros[..32])]),
        "a.npz: array grids has the shape (1000, 1000), but holds less: write the file again"
    );
    assert!(complaint_of("a.npz", b"no archive").starts_with("a.npz: this is no NPZ archive, or it was cut off"));
}

#[test]
fn meshes_stand_over_columns_and_rows_and_are_counterclockwise_from_above() {
    let grids =
        Grids::new(1, vec![[2, 3], [1, 3], [1, 1]], vec![5.0, 6.0, 7.0, 8.0, 9.0, 0.5, 1.0, 2.0, 3.0, 4.0]).unwrap();
    let wanted = "o grid_0\nv 0 0 5\nv 0.25 0 6\nv 0.5 0 7\nv 0 0.25 8\nv 0.25 0.25 9\nv 0.5 0.25 0.5\nf 1 2 5 4\nf 2 3 6 5\n\
                  o grid_1\nv 0 0 1\nv 0.25 0 2\nv 0.5 0 3\nl 7 8 9\no grid_2\nv 0 0 4\np 10\n";
    assert_eq!(written(&grids, "a.obj", &GridWrite { spacing: 0.25, ..GridWrite::default() }), wanted);
    let flat = Grids::uniform(2, [2, 1], vec![1.0, 2.0, 3.0, 4.0]).unwrap();
    assert_eq!(written(&flat, "a.obj", &GridWrite::default()), "o grid_0\nv 1 2 0\nv 3 4 0\nl 1 2\n");
    let space = Grids::uniform(3, [1, 2], vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).unwrap();
    assert_eq!(written(&space, "a.obj", &GridWrite::default()), "o grid_0\nv 1 2 3\nv 4 5 6\nl 1 2\n");
}

#[test]
fn grids_that_are_not_finite_are_left_out_of_meshes_and_said() {
    let grids = Grids::new(1, vec![[1, 2], [0, 3], [1, 2]], vec![1.0, f64::NAN, 2.0, 3.0]).unwrap();
    assert_eq!(
        written(&grids, "a.obj", &GridWrite::default()),
        "# grid_0 has values that are not finite and is left out\n# grid_1 has no points and is left out\no grid_2\nv 0 0 2\nv 1 0 3\nl 1 2\n"
    );
}

#[test]
fn pictures_show_the_net_over_the_surface() {
    let coarse = Grids::uniform(1, [2, 2], vec![0.0, 1.0, 1.0, 0.0]).unwrap();
    let fine = Grids::uniform(1, [3, 3], vec![0.0, 0.5, 1.0, 0.5, 0.5, 0.5, 1.0, 0.5, 0.0]).unwrap();
    let options =
        GridWrite { net: Some(&coarse), title: Some("A & B".into()), caption: "words".into(), ..GridWrite::default() };
    let text = written(&fine, "a.svg", &options);
    let document = roxmltree::Document::parse(&text).unwrap();
    let class = |name: &str| document.descendants().find(|node| node.attribute("class") == Some(name));
    assert_eq!(class("faces").unwrap().children().filter(|node| node.is_element()).count(), 4);
    assert_eq!(class("dots").unwrap().attribute("d").unwrap().matches("h0").count(), 4);
    assert!(text.contains("A &amp; B") && text.contains("1 grid, 9 points · words"));
    let bare = written(&fine, "a.svg", &GridWrite::default());
    assert!(!bare.contains("class=\"net\""));
}

#[test]
fn formats_say_what_they_cannot_hold_and_which_can() {
    let folder = TempDir::new().unwrap();
    let say = |grids: &Grids, name: &str| {
        let path = folder.path().join(name);
        let sentence = grids::write(&path, grids, &GridWrite::default()).unwrap_err().to_string();
        assert!(!path.exists());
        without_folder(&sentence, folder.path())
    };
    let of = |d: usize| Grids::uniform(d, [1, 1], vec![0.0; d]).unwrap();
    assert_eq!(
        say(&of(3), "a.csv"),
        "CSV holds grids of heights, one value a point, but these have 3: write NPZ, OBJ or SVG"
    );
    assert_eq!(say(&of(5), "a.csv.gz"), "CSV holds grids of heights, one value a point, but these have 5: write NPZ");
    assert_eq!(
        say(&of(4), "a.obj"),
        "OBJ shows points of the plane or of space, but these have 4 values each: write NPZ"
    );
    assert_eq!(
        say(&of(4), "a.svg"),
        "SVG shows points of the plane or of space, but these have 4 values each: write NPZ"
    );
    let empty = Grids::new(1, vec![[1, 1], [0, 2]], vec![1.0]).unwrap();
    assert_eq!(say(&empty, "a.csv"), "grid 1 has no points, and rows of CSV would lose it: write NPZ, OBJ or SVG");
    assert_eq!(
        say(&of(1), "a.txt"),
        "the format of a.txt is not known from its extension: give `GridWrite::format` with csv, npz, obj or svg"
    );
    let unread = |name: &str| grids::read(Path::new(name), None).unwrap_err().to_string();
    assert_eq!(unread("a.obj"), "OBJ is only written, grids are read from CSV and NPZ: give one of these");
    assert_eq!(unread("a.svg"), "SVG is only written, grids are read from CSV and NPZ: give one of these");
    assert_eq!(unread("a.txt"), "the format of a.txt is not known from its extension: give `format` with csv or npz");
    assert_eq!(unread("-"), "- has no extension to tell its format: give `format` with csv or npz");
    assert!(unread("gone.csv").starts_with("cannot read gone.csv: "));
    let word = "geojson".parse::<GridFormat>().unwrap_err().to_string();
    assert_eq!(word, "there is no format \"geojson\" for grids: csv, npz, obj and svg are possible");
}

#[test]
fn a_file_that_exists_is_kept_unless_it_may_be_replaced() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.csv");
    let grids = Grids::uniform(1, [1, 2], vec![1.0, 2.0]).unwrap();
    std::fs::write(&path, "precious").unwrap();
    let sentence = format!("{} exists already: give `overwrite` to replace it, or another name", path.display());
    assert_eq!(grids::write(&path, &grids, &GridWrite::default()).unwrap_err().to_string(), sentence);
    assert_eq!(grids::check_output(&path, &GridWrite::default()).unwrap_err().to_string(), sentence);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "precious");
    grids::write(&path, &grids, &GridWrite { overwrite: true, ..GridWrite::default() }).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "1,2\n");
    grids::check_output(folder.path().join("b.npz"), &GridWrite::default()).unwrap();
}

#[test]
fn the_examples_are_grids() {
    let landscape = grids::read("examples/data/heights.csv", None).unwrap();
    assert_eq!((landscape.len(), landscape.shape(0)), (1, [9, 13]));
    // The formula of examples/data/NOTICE.
    let hills = [
        [460.0, 3.4, 5.4, 2.2, 1.9],
        [330.0, 8.6, 3.2, 2.5, 1.6],
        [250.0, 10.6, 7.0, 1.9, 1.5],
        [-150.0, 6.2, 1.0, 2.6, 2.0],
        [-120.0, 5.8, 7.6, 1.6, 1.6],
    ];
    for row in 0..9 {
        for column in 0..13 {
            let (y, x) = (row as f64, column as f64);
            let hill = |[h, a, b, c, d]: [f64; 5]| h * (-((x - a) / c).powi(2) - ((y - b) / d).powi(2)).exp();
            let height = 420.0 + 8.0 * y - 5.0 * x + hills.into_iter().map(hill).sum::<f64>();
            assert!((landscape.point(0, row, column)[0] - height).abs() < 0.500001, "row {row}, column {column}");
        }
    }
    let three = grids::read("examples/data/grids.csv", None).unwrap();
    assert_eq!(three.shapes(), [[5, 5], [4, 10], [7, 7]]);
}
