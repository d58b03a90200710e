//! Bad files: every one is a sentence with the file, the place, the value and the remedy, or a
//! status of one curve.

use std::io::Write;
use std::path::Path;

use faircurve::io::{self, Closed, Columns, Format, ReadOptions, WriteOptions};
use faircurve::{CurveBatch, CurveStatus};

pub fn without_folder(sentence: &str, folder: &Path) -> String {
    sentence.replace(&format!("{}{}", folder.display(), std::path::MAIN_SEPARATOR), "")
}

/// Writes a file into a fresh folder and returns what reading it says, without the folder's name.
pub fn complaint_with(name: &str, bytes: &[u8], options: &ReadOptions) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let error = io::read_with(&path, options).expect_err("a bad file must not be read");
    without_folder(&error.to_string(), folder.path())
}

fn complaint(name: &str, text: &str) -> String {
    complaint_with(name, text.as_bytes(), &ReadOptions::default())
}

fn complaint_columns(text: &str, columns: &str) -> String {
    let columns = columns.parse().unwrap();
    complaint_with("a.csv", text.as_bytes(), &ReadOptions { columns, ..ReadOptions::default() })
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut zipped = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    zipped.write_all(bytes).unwrap();
    zipped.finish().unwrap()
}

const KNOWN: &str = "curve, x, y, z, t, weight, tx, ty, tz, kx, ky, kz, nu, known, pinned, kmax, corridor, corridor_left, corridor_right, closed";

#[test]
fn csv_cells_that_are_no_numbers_are_named_with_line_and_column() {
    assert_eq!(
        complaint("a.csv", "curve,x,y\na,0,0\na,oops,1\n"),
        "a.csv, line 3: column \"x\" holds \"oops\", which is no number: mend it, or remove the row"
    );
    assert_eq!(
        complaint("a.csv", "curve,x,y,known\na,0,1,2\n"),
        "a.csv, line 2: column \"known\" holds \"2\", which is neither 1 nor 0: write 1 for a given control point, 0 else"
    );
    for value in ["yes", "", "0.5", "nan"] {
        assert_eq!(
            complaint("a.csv", &format!("curve,x,y,known\na,0,1,1\na,0,1,{value}\n")),
            format!(
                "a.csv, line 3: column \"known\" holds {value:?}, which is neither 1 nor 0: write 1 for a given control \
                 point, 0 else"
            )
        );
    }
    assert_eq!(
        complaint("a.csv", "curve,x,y,known\na,0,oops,0\n"),
        "a.csv, line 2: column \"y\" holds \"oops\", which is no number: mend it, or remove the row"
    );
    assert_eq!(
        complaint("a.csv", "curve,x,y,tx,ty\na,0,1,,3\n"),
        "a.csv, line 2: column \"tx\" holds \"\", but its vector has other components: give all of them, or none"
    );
}

#[test]
fn a_blank_cell_is_one_curve_s_trouble_and_comes_out_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    let read = |text: &str| {
        std::fs::write(&path, text).unwrap();
        io::read(&path).unwrap()
    };
    let message = |batch: &CurveBatch, i: usize| {
        batch.problem(i).map(|problem| {
            assert_eq!(problem.status, CurveStatus::Invalid);
            without_folder(&problem.message, folder.path())
        })
    };
    let fill = "is blank: fill it in, or remove the row";
    let batch = read("curve,x,y\na,0,0\na,1,1\nb,0,0\nb,1, \nb,,2\nc,5,5\nc,6,6\n");
    assert_eq!((message(&batch, 0), message(&batch, 2)), (None, None));
    assert_eq!(message(&batch, 1), Some(format!("a.csv, line 5, curve b, point 1: column \"y\" {fill}")));
    assert_eq!((batch.points(0), batch.points(2)), (&[0.0, 0.0, 1.0, 1.0][..], &[5.0, 5.0, 6.0, 6.0][..]));
    let fit = faircurve::spline::Natural::default().fit(&batch, &faircurve::Device::cpu()).unwrap();
    let usable: Vec<bool> = fit.reports().iter().map(|report| report.status.is_usable()).collect();
    assert_eq!(usable, [true, false, true]);
    let out = super::through(folder.path(), &fit.polylines(faircurve::Sampling::PerSpan(1)), "csv");
    assert_eq!(super::bits(out.points(1)), super::bits(batch.points(1)), "the input, NaN for what is blank");
    let batch = read("curve,Lon,LAT,t,weight\na,0,1,0,\na,1,1,1,1\nb,0,1,0,1\nb,0,1,,1\nc,0,1,0,1\n");
    assert_eq!(message(&batch, 0), Some(format!("a.csv, line 2, curve a, point 0: column \"weight\" {fill}")));
    assert_eq!(message(&batch, 1), Some(format!("a.csv, line 5, curve b, point 1: column \"t\" {fill}")));
    assert_eq!(message(&batch, 2), None);
    let batch = read("curve,x,y,known\na,0,1,1\na,,,0\na,3,,1\nb,3,,0\nb,3,1,1\n");
    let known = "column \"y\" is blank, but its point is known: fill it in, or write 0 in column known";
    assert_eq!(message(&batch, 0), Some(format!("a.csv, line 4, curve a, point 2: {known}")));
    assert_eq!(message(&batch, 1), None);
}

#[test]
fn a_position_that_lacks_a_number_is_one_curve_s_trouble() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.json");
    let lines = ["[[0,0],[1,1]]", "[[0,0],null,[2,2]]", "[[0,0],[null,1]]", "[[5],[6,6],[]]", "[[7,7],[8,8]]"];
    let read = |lines: &[&str], last: &str| {
        let text = format!("{{\"type\":\"MultiLineString\",\"coordinates\":[{}{last}]}}", lines.join(","));
        std::fs::write(&path, text).unwrap();
        io::read(&path).unwrap()
    };
    let batch = read(&lines, "");
    let lacks = "its position is null, or lacks a number: fill it in, or remove it";
    for (i, point) in [(1, 1), (2, 1), (3, 0)] {
        let problem = batch.problem(i).unwrap();
        assert_eq!(problem.status, CurveStatus::Invalid);
        let sentence = format!("a.json, curve 0/{i}, point {point}: {lacks}");
        assert_eq!(without_folder(&problem.message, folder.path()), sentence);
    }
    assert_eq!((batch.problem(0), batch.problem(4)), (None, None));
    assert_eq!((batch.points(0), batch.points(4)), (&[0.0, 0.0, 1.0, 1.0][..], &[7.0, 7.0, 8.0, 8.0][..]));
    // Altitudes stay with their points.
    let batch = read(&["[null,[0,0,5]]", "[[1,1,6],[2,2,7]]", "[[1,1,null],[2,2,8]]"], "");
    assert_eq!((batch.dimension(), batch.points(1)), (3, &[1.0, 1.0, 6.0, 2.0, 2.0, 7.0][..]));
    assert_eq!((batch.points(0)[3..].to_vec(), batch.points(2)[5]), (vec![0.0, 0.0, 5.0], 8.0));
    assert!(batch.problem(0).is_some() && batch.problem(1).is_none() && batch.problem(2).is_some());
}

#[test]
fn csv_rows_that_do_not_belong_together_are_named() {
    let ragged = "the header has 3: add or remove a comma; a file cut off ends so";
    assert_eq!(
        complaint("a.csv", "curve,x,y\na,0,0\na,1\na,2,2\n"),
        format!("a.csv, line 3: the row has 2 cells, but {ragged}")
    );
    assert_eq!(
        complaint("a.csv", "curve,x,y\na,0,0\na,1,1\na,2,2,2\n"),
        format!("a.csv, line 4: the row has 4 cells, but {ragged}")
    );
    assert_eq!(
        complaint("a.csv", "curve,x,y\r\na,0,0\r\n\r\na,1,1\r\na,2"),
        format!("a.csv, line 5: the row has 2 cells, but {ragged}")
    );
    assert_eq!(
        complaint("a.csv", "curve,x,y\r\na,0,0\r\n\r\na,?,1\r\na,2,2\r\n"),
        "a.csv, line 4: column \"x\" holds \"?\", which is no number: mend it, or remove the row"
    );
    assert_eq!(
        complaint("a.csv", "curve,x,y\n\n\"a\n\n\",0,0\n\na,1\n"),
        format!("a.csv, line 7: the row has 2 cells, but {ragged}")
    );
    assert_eq!(
        complaint("a.csv", "curve,x,y\na,0,0\na,1,1\na,2"),
        format!("a.csv, line 4: the row has 2 cells, but {ragged}")
    );
}

#[test]
fn csv_headers_are_checked() {
    assert_eq!(
        complaint("a.csv", "curve,lon,y,hours\na,0,0,0\n"),
        format!(
            "a.csv, line 1: unknown columns \"lon\", \"hours\": map them with `ReadOptions::columns`, as in x=lon,y=lat \
             (which drops the others), or carry them (`ReadOptions::carried`); known are {KNOWN}"
        )
    );
    assert_eq!(
        complaint("a.csv", "curve x y\na 0 0\n"),
        format!(
            "a.csv, line 1: unknown columns \"curve x y\": separate columns by commas; map them with `ReadOptions::columns`, as in \
             x=lon,y=lat (which drops the others), or carry them (`ReadOptions::carried`); known are {KNOWN}"
        )
    );
    assert_eq!(
        complaint("a.csv", "curve,x\na,0\n"),
        "a.csv, line 1: there is no column y: the columns are \"curve\", \"x\"; map one with `ReadOptions::columns`, as in y=…"
    );
    assert_eq!(
        complaint("a.csv", "curve,x,x,y\na,0,0,0\n"),
        "a.csv, line 1: two columns are called \"x\": rename one of them"
    );
    assert_eq!(
        complaint("a.csv", "curve,x,y,tx\na,0,0,0\n"),
        "a.csv, line 1: the columns tx, ty, tz do not fit the points: give t for x and y"
    );
    assert_eq!(
        complaint("a.csv", "curve,x,y,z,kx,ky\na,0,0,0,0,0\n"),
        "a.csv, line 1: the columns kx, ky, kz do not fit the points: give k for x, y and z"
    );
    assert_eq!(
        complaint("a.csv", "0,1,2,3\n4,5,6,7\n"),
        "a.csv, line 1: there is no header, but a row of numbers, 4 of them: two are read as x and y, three as x, y and z; put \
         a line above that names the columns, such as curve,x,y,t, or give `ReadOptions::columns` by number, as in x=1,y=2"
    );
    assert_eq!(
        complaint("a.csv", "curve,X,x,y\na,0,0,0\n"),
        format!(
            "a.csv, line 1: unknown columns \"X\": map them with `ReadOptions::columns`, as in x=lon,y=lat (which \
             drops the others), or carry them (`ReadOptions::carried`); known are {KNOWN}"
        )
    );
    let same = "1 in all rows of a closed curve, 0 else";
    assert_eq!(
        complaint("a.csv", "curve,x,y,closed\na,0,0,yes\n"),
        format!("a.csv, line 2: column \"closed\" holds \"yes\", which is neither 1 nor 0: write {same}")
    );
    assert_eq!(
        complaint("a.csv", "curve,x,y,closed\na,0,0,1\nb,0,0,0\nb,0,0,0\nb,0,0,1\n"),
        "a.csv, line 5: column \"closed\" holds \"1\", but line 3, of the same curve, holds the other: give all rows of a \
         curve the same"
    );
    assert_eq!(
        complaint_columns("id,lon,lat\na,0,0\n", "x=lon,y=latitude"),
        "a.csv, line 1: there is no column \"latitude\" for y: the columns are \"id\", \"lon\", \"lat\""
    );
}

#[test]
fn column_options_are_checked() {
    let wrong = |text: &str| text.parse::<Columns>().unwrap_err().to_string();
    assert_eq!(
        wrong("x=lon,latitude=lat"),
        format!("columns: there is no \"latitude\" in \"latitude=lat\": {KNOWN} are possible")
    );
    assert_eq!(
        wrong("x"),
        "columns: \"x\" has no \"=\": write what it means, \"=\", and the column's name, as in x=lon"
    );
    assert_eq!(wrong("x=lon,x=lng"), "columns: x is given twice: once is enough");
}

#[test]
fn files_without_curves_are_said_to_be_so() {
    let empty = "the file is empty: there is nothing to read";
    for (name, text) in
        [("a.csv", ""), ("a.csv", "\n\n"), ("a.geojson", " \n"), ("a.svg", ""), ("a.npz", ""), ("a.csv", "\u{feff}")]
    {
        assert_eq!(complaint(name, text), format!("{name}: {empty}"));
    }
    let folder = tempfile::tempdir().unwrap();
    let shapes = "LineString, MultiLineString, Polygon and MultiPolygon geometries are read";
    for (name, text, lacks) in [
        ("a.csv", "curve,x,y\n", "there is a header, but no row after it"),
        ("a.json", r#"{"type":"Point","coordinates":[1,2]}"#, shapes),
        ("a.geojson", r#"{"type":"FeatureCollection","features":[null]}"#, shapes),
        ("a.topojson", r#"{"type":"Topology","arcs":[],"objects":{}}"#, shapes),
        ("a.svg", "<svg/>", "path, polyline, polygon, line, rect, circle and ellipse elements are read"),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let batch = io::read(&path).unwrap();
        assert_eq!((batch.len(), batch.notes().join("")), (0, format!("no curve was found: {lacks}")), "{name}");
    }
}

#[test]
fn a_geojson_file_cut_off_names_line_and_column() {
    let whole = "{\"type\":\"FeatureCollection\",\"features\":[\n{\"type\":\"Feature\",\"properties\":{},\
                 \"geometry\":{\"type\":\"LineString\",\"coordinates\":[[0,0],[1,1]]}}]}";
    assert_eq!(
        complaint("a.geojson", &whole[..whole.len() - 8]),
        "a.geojson, line 2: column 89: EOF while parsing a list: this is no JSON, or the file was cut off"
    );
    assert_eq!(
        complaint("a.json", "{\"type\":\n\"Feature\" ?}"),
        "a.json, line 2: column 11: expected `,` or `}`: this is no JSON, or the file was cut off"
    );
}

#[test]
fn geojson_that_is_none_is_explained_by_feature() {
    let features = |geometry: &str| {
        let good =
            r#"{"type":"Feature","properties":null,"geometry":{"type":"LineString","coordinates":[[0,0,5],[1,1,5]]}}"#;
        complaint(
            "a.geojson",
            &format!(
                r#"{{"type":"FeatureCollection","features":[{good},{{"type":"Feature","properties":{{}},"geometry":{geometry}}}]}}"#
            ),
        )
    };
    let nest = "a.geojson: feature 1: its coordinates do not nest as its type asks, or are no numbers";
    assert_eq!(
        features(r#"{"type":"LineString","coordinates":[[0,"1"]]}"#),
        format!("{nest}: invalid type: string \"1\", expected f64")
    );
    assert_eq!(
        features(r#"{"type":"Polygon","coordinates":[[0,1],[2,3]]}"#),
        format!("{nest}: invalid type: integer `0`, expected a position of two or three numbers")
    );
    assert_eq!(
        features(r#"{"type":"MultiLineString","coordinates":[0,[[2,3]]]}"#),
        format!("{nest}: invalid type: integer `0`, expected a list of positions")
    );
    assert_eq!(features(r#"{"type":"LineString","coordinates":[[0,1e999]]}"#), format!("{nest}: number out of range"));
    assert_eq!(
        features(r#"{"type":"LineString"}"#),
        "a.geojson: feature 1: its LineString has no \"coordinates\": add them"
    );
    assert_eq!(
        features(r#"{"type":"Circle","coordinates":[]}"#),
        "a.geojson: feature 1: the type \"Circle\" is none of GeoJSON's: FeatureCollection, Feature and the geometries are"
    );
    assert_eq!(features("7"), "a.geojson: feature 1: a geometry is no JSON object: GeoJSON needs one with a \"type\"");
    assert_eq!(
        features("{}"),
        "a.geojson: feature 1: an object has no \"type\": GeoJSON needs one, such as \"Feature\""
    );
    assert_eq!(
        complaint("a.json", r#"{"type":"Map","objects":{}}"#),
        "a.json: feature 0: the type \"Map\" is none of GeoJSON's: FeatureCollection, Feature and the geometries are"
    );
    assert_eq!(
        complaint("a.json", r#"{"type":"FeatureCollection"}"#),
        "a.json: the FeatureCollection has no \"features\": add them"
    );
    let deep = r#"{"type":"GeometryCollection","geometries":["#.repeat(70) + &"]}".repeat(70);
    assert_eq!(complaint("a.json", &deep), "a.json: feature 0: geometry collections nest deeper than 64: flatten them");
}

#[test]
fn a_mixture_of_altitudes_can_be_flattened() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.geojson");
    std::fs::write(&path, r#"{"type":"MultiLineString","coordinates":[[[0,0,5],[1,1,5]],[[2,2],[3,3]]]}"#).unwrap();
    let flat = ReadOptions { columns: "z=".parse().unwrap(), ..ReadOptions::default() };
    let batch = io::read_with(&path, &flat).unwrap();
    assert_eq!((batch.dimension(), batch.coords()), (2, &[0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0][..]));
}

#[test]
fn svg_that_cannot_be_read_names_the_line() {
    assert_eq!(
        complaint("a.svg", "<svg>\n<path d='M0,0 L1,1'/>\n"),
        "a.svg: the root node was opened but never closed: this is no XML, or the file was cut off"
    );
    let trouble = |text: &str| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.svg");
        std::fs::write(&path, text).unwrap();
        let batch = io::read(&path).unwrap();
        let problem = batch.problem(0).unwrap();
        assert_eq!((problem.status, batch.count(0)), (CurveStatus::Invalid, 0));
        without_folder(&problem.message, folder.path())
    };
    for (element, sentence) in [
        (
            "<path id='leaf' d='M0,0 L1,oops'/>",
            "<path> \"leaf\": its path data cannot be read from \"oops\" on: mend it",
        ),
        ("<path d='M0,0 L1'/>", "<path>: its path data ends where a number must follow: complete it"),
        ("<path d='M0,0 L1,1;'/>", "<path>: its path data cannot be read from \";\" on: mend it"),
        ("<path d='L1,1 2,2'/>", "<path>: its path data cannot be read from \"L1,1 2,2\" on: mend it"),
        (
            "<polyline points='1,2 3'/>",
            "<polyline>: its list of points ends with an x, 3, that has no y: add it, or remove the x",
        ),
        ("<polygon points='1,2 L3,4'/>", "<polygon>: its list of points cannot be read from \"L3,4\" on: mend it"),
        (
            "<g transform='turn(3)'><path d='M0,0 L1,1'/></g>",
            "<g>: its transform cannot be read from \"turn(3)\" on: translate, scale, rotate, matrix, skewX and skewY are possible, with numbers without units",
        ),
        (
            "<g transform='scale(1,2,3)'><g><line x2='1'/></g></g>",
            "<g>: its transform cannot be read from \"3)\" on: translate, scale, rotate, matrix, skewX and skewY are possible, with numbers without units",
        ),
        (
            "<line x2='1' transform='rotate(45deg)'/>",
            "<line>: its transform cannot be read from \"deg)\" on: translate, scale, rotate, matrix, skewX and skewY are possible, with numbers without units",
        ),
        (
            "<line x2='1' transform='scale(nan)'/>",
            "<line>: its transform cannot be read from \"nan)\" on: translate, scale, rotate, matrix, skewX and skewY are possible, with numbers without units",
        ),
        ("<circle r='2em'/>", "<circle>: r is \"2em\": sizes of fonts are not read: give it in px"),
        (
            "<circle r='2 apples'/>",
            "<circle>: r is \"2 apples\": give a number, or a length in px, mm, cm, in, pt, pc or %",
        ),
        (
            "<rect width='100%' height='5'/>",
            "<rect>: width is \"100%\": the drawing has no size that this is a part of: give it in px, or <svg> a viewBox",
        ),
        ("<path d='M1e308,0 l1e308,0 5,5'/>", "<path>: its coordinates are too large for f64: scale it down"),
    ] {
        assert_eq!(trouble(&format!("<svg>\n{element}</svg>")), format!("a.svg, line 2: {sentence}"));
    }
    assert_eq!(complaint("a.svg", "<html/>"), "a.svg: the document is <html>, and must be <svg>: give an SVG file");
}

#[test]
fn compressed_files_cut_off_are_said_to_be_so() {
    let zipped = gzip(("curve,x,y\n".to_string() + &"a,0,0\na,1,1\na,2,0\n".repeat(1000)).as_bytes());
    for name in ["a.csv.gz", "a.geojson.gz"] {
        let message = complaint_with(name, &zipped[..zipped.len() / 2], &ReadOptions::default());
        assert_eq!(
            message,
            format!("{name}: the gzip data is damaged or cut off (incomplete deflate stream): fetch the file again")
        );
    }
}

#[test]
fn formats_that_cannot_be_known_are_asked_for() {
    let words = "csv, geojson, topojson, svg, npz, npy, trk, tck, gpx, frames or motion";
    assert_eq!(
        complaint("a.txt", "curve,x,y\n"),
        format!("the format of a.txt is not known from its extension: give `ReadOptions::format` with {words}")
    );
    let error = io::read("-").unwrap_err().to_string();
    assert_eq!(error, format!("- has no extension to tell its format: give `ReadOptions::format` with {words}"));
    let batch = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 1.0]][..]]).unwrap();
    let error = io::write("-", &batch).unwrap_err().to_string();
    assert_eq!(error, format!("- has no extension to tell its format: give `WriteOptions::format` with {words}"));
    assert_eq!(
        "shp".parse::<Format>().unwrap_err().to_string(),
        "there is no format \"shp\": give csv, geojson, topojson, svg, npz, npy, trk, tck, gpx, frames or motion"
    );
    assert_eq!(
        "maybe".parse::<Closed>().unwrap_err().to_string(),
        "closed is \"maybe\": auto, yes and no are possible"
    );
}

#[cfg(unix)]
#[test]
fn a_file_that_is_not_there_is_named() {
    let missing = io::read("no/such/file.csv").unwrap_err().to_string();
    assert_eq!(missing, "cannot read no/such/file.csv: No such file or directory (os error 2)");
}

#[test]
fn what_a_format_cannot_hold_is_refused_before_and_after_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, batch: &CurveBatch, beziers| {
        let path = folder.path().join(name);
        let error = io::write_with(&path, batch, &WriteOptions { beziers, ..WriteOptions::default() }).unwrap_err();
        assert!(!path.exists());
        error.to_string()
    };
    let flat = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 1.0]][..]]).unwrap();
    let solid = CurveBatch::from_slices(&[&[[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]][..]]).unwrap();
    assert_eq!(
        write("a.svg", &solid, false),
        "SVG holds points of 2 dimensions, but the curves have 3: write CSV, GeoJSON, TopoJSON, NPZ, NPY, TRK, TCK or Frames"
    );
    let straight =
        "GeoJSON holds straight lines and no Bézier curves: write CSV, SVG, NPZ or NPY, or ask for polylines";
    assert_eq!(write("a.geojson", &flat, true), straight);
    let options = WriteOptions { beziers: true, ..WriteOptions::default() };
    assert_eq!(io::check_output(folder.path().join("a.geojson"), &options).unwrap_err().to_string(), straight);
    assert_eq!(
        write("a.svg", &flat, true),
        "curve 0 has 2 control points, but a chain of cubic Béziers has three a piece and one more"
    );
    let twice = CurveBatch::from_slices(&[&[[0.0, 0.0]][..], &[[1.0, 1.0]][..]]).unwrap();
    assert_eq!(
        write("a.csv", &twice.with_names(vec!["a".into(), "a".into()]).unwrap(), false),
        "curves 0 and 1 are both called \"a\", and rows of CSV are told apart by the name alone: rename one, or write \
         GeoJSON, SVG or NPZ"
    );
}

#[test]
fn outputs_are_checked_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.csv");
    let (keep, replace) = (WriteOptions::default(), WriteOptions { overwrite: true, ..WriteOptions::default() });
    io::check_output(&path, &keep).unwrap();
    std::fs::write(&path, "old").unwrap();
    let sentence = format!("{} exists already: give `overwrite` to replace it, or another name", path.display());
    assert_eq!(io::check_output(&path, &keep).unwrap_err().to_string(), sentence);
    let batch = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 1.0]][..]]).unwrap();
    assert_eq!(io::write(&path, &batch).unwrap_err().to_string(), sentence);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
    io::check_output(&path, &replace).unwrap();
    io::write_with(&path, &batch, &replace).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "curve,x,y,t\n0,0,0,0\n0,1,1,1\n");
    let unknown = folder.path().join("out.xyz");
    assert_eq!(
        io::check_output(&unknown, &keep).unwrap_err().to_string(),
        format!(
            "the format of {} is not known from its extension: give `WriteOptions::format` with csv, geojson, topojson, svg, npz, npy, trk, tck, gpx, frames or motion",
            unknown.display()
        )
    );
    assert!(matches!(io::check_output(folder.path().join("no/out.csv"), &keep), Err(faircurve::Error::Write { .. })));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_stops_every_format() {
    let batch = io::read("examples/data/countries-110m.geojson").unwrap();
    for format in [Format::Csv, Format::GeoJson, Format::Svg, Format::Npz] {
        let options = WriteOptions { format: Some(format), ..WriteOptions::default() };
        assert_eq!(
            io::write_with("/dev/full", &batch, &options).unwrap_err().to_string(),
            "cannot write /dev/full: No space left on device (os error 28); nothing was left half-written",
            "{format}"
        );
    }
}

#[test]
fn bad_numbers_spoil_one_curve_and_name_file_line_and_point() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    let text =
        "curve,x,y,t\r\na,0,0,0\r\na,1,nan,1\r\nb,0,0,0\r\nb,1,1,1\r\nc,-inf,0,0\r\nd,0,0,0\r\nd,1,1,2\r\nd,2,2,1\r\n";
    std::fs::write(&path, format!("\u{feff}{text}")).unwrap();
    let batch = io::read(&path).unwrap();
    let place = path.display();
    let message = |i: usize| batch.problem(i).map(|problem| (problem.status, problem.message.clone()));
    let invalid = |text: String| Some((CurveStatus::Invalid, text));
    let mend = "every coordinate must be a finite number: mend or remove the point";
    assert_eq!(message(0), invalid(format!("{place}, line 3, curve a, point 1: y is NaN; {mend}")));
    assert_eq!(message(1), None);
    assert_eq!(batch.points(1), [0.0, 0.0, 1.0, 1.0]);
    assert_eq!(message(2), invalid(format!("{place}, line 6, curve c, point 0: x is -inf; {mend}")));
    assert_eq!(
        message(3),
        invalid(format!(
            "{place}, line 9, curve d, point 2: its parameter decreases from 2 to 1: sort the points (`ReadOptions::sorted`), or leave the \
             parameters out"
        ))
    );
}
