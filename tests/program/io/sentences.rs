//! Sentences stay short, whatever they were given.

use std::io::Write as _;

use faircurve::io::grids::{self, GridFormat};
use faircurve::io::{self, Closed, Columns, Format, ReadOptions, WriteOptions};
use faircurve::{Constraints, CurveBatch, Grids};
use zip::write::SimpleFileOptions;

/// As long as a name gets by mistake: a file in a cell.
const LONG: usize = 5_000_000;

fn assert_short(sentence: &str, what: &str) {
    let count = sentence.chars().count();
    assert!(
        (20..1000).contains(&count),
        "{what}: {count} characters: {}",
        sentence.chars().take(300).collect::<String>()
    );
}

fn read(format: Format, bytes: &[u8]) -> Result<CurveBatch, String> {
    let options = ReadOptions { format: Some(format), ..ReadOptions::default() };
    io::read_from(bytes, &options).map_err(|error| error.to_string())
}

#[test]
fn csv_is_quoted_in_part() {
    let long = "ä".repeat(LONG / 2);
    let many = (0..LONG / 8).map(|k| format!("c{k}")).collect::<Vec<_>>().join(",");
    for (what, text) in [
        ("cell", format!("x,y\n1,{long}\n")),
        ("heading", format!("x,{long}\n1,2\n")),
        ("headings", format!("{many}\n1,2\n")),
        ("numbers", format!("{}1\n", "0,".repeat(LONG / 2))),
        ("known", format!("x,y,known\n1,2,{long}\n")),
    ] {
        assert_short(&read(Format::Csv, text.as_bytes()).unwrap_err(), what);
    }
    let huge = "1e308";
    let text = format!("curve,x,y,t\n{long},nan,0,0\nb,0,0,{huge}\nb,0,0,-{huge}\n");
    let batch = read(Format::Csv, text.as_bytes()).unwrap();
    assert_short(&batch.problem(0).unwrap().message, "the problem of a curve with a long name");
    let message = &batch.problem(1).unwrap().message;
    assert!(message.contains("decreases from 1e308 to -1e308"), "{message}");
    for columns in [format!("{long}=x"), long.clone(), format!("x={long}")] {
        let sentence = match columns.parse::<Columns>() {
            Err(error) => error.to_string(),
            Ok(columns) => {
                let options = ReadOptions { format: Some(Format::Csv), columns, ..ReadOptions::default() };
                io::read_from(&b"x,y\n1,2\n"[..], &options).unwrap_err().to_string()
            }
        };
        assert_short(&sentence, "columns");
    }
    assert_short(&long.parse::<Format>().unwrap_err().to_string(), "format");
    assert_short(&long.parse::<GridFormat>().unwrap_err().to_string(), "format of grids");
    assert_short(&long.parse::<Closed>().unwrap_err().to_string(), "closed");
}

#[test]
fn geojson_is_quoted_in_part() {
    let long = "q".repeat(LONG);
    let line = |positions: &str| format!(r#"{{"type":"LineString","coordinates":{positions}}}"#);
    for (what, text) in [
        ("number", line(&format!("[[0,\"{long}\"]]"))),
        ("list", line(&format!("\"{long}\""))),
        ("type", format!(r#"{{"type":"{long}"}}"#)),
        ("feature", format!(r#"{{"type":"FeatureCollection","features":[{{"type":"{long}"}}]}}"#)),
        ("key", format!(r#"{{"{long}":1}}"#)),
        ("no JSON", format!("{{{long}")),
    ] {
        assert_short(&read(Format::GeoJson, text.as_bytes()).unwrap_err(), what);
    }
    let named =
        format!(r#"{{"type":"Feature","properties":{{"curve":"{long}"}},"geometry":{}}}"#, line("[null,[1,2]]"));
    let batch = read(Format::GeoJson, named.as_bytes()).unwrap();
    assert_eq!(batch.name(0).len(), LONG);
    assert_short(&batch.problem(0).unwrap().message, "a long name");
}

#[test]
fn drawings_are_quoted_in_part() {
    let long = "q".repeat(LONG);
    for (what, text) in [
        ("root", format!("<{long}/>")),
        ("id", format!("<svg><path id='{long}' d='M0,0?'/></svg>")),
        ("path", format!("<svg><path d='M{long}'/></svg>")),
        ("number", format!("<svg><path d='M0,0A{} 1 0 1 1 1 1'/></svg>", "9".repeat(LONG))),
        ("transform", format!("<svg><line transform='{long}(3)'/></svg>")),
        ("bracket", format!("<svg><line transform='scale({long}'/></svg>")),
        ("numbers", format!("<svg><line transform='scale({long})'/></svg>")),
        ("name", format!("<svg><{long} transform='scale(x)'><line/></{long}></svg>")),
        ("points", format!("<svg><polygon points='{long}'/></svg>")),
        ("length", format!("<svg><circle r='{long}'/></svg>")),
        ("hidden", format!("<svg><line/><line id='{long}' transform='scale(0)'/></svg>")),
        ("end", format!("<svg><{long}></svg>")),
        ("entity", format!("<svg>&{long};</svg>")),
        ("prefix", format!("<svg><{long}:a/></svg>")),
    ] {
        let sentence = read(Format::Svg, text.as_bytes()).map(|batch| match batch.problem(0) {
            Some(problem) => problem.message.clone(),
            None => batch.notes()[0].clone(),
        });
        assert_short(&sentence.unwrap_or_else(|error| error), what);
    }
}

fn npz(arrays: &[(String, &[u64])]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, shape) in arrays {
        zip.start_file(format!("{name}.npy"), SimpleFileOptions::default()).unwrap();
        let lengths: String = shape.iter().map(|length| format!("{length}, ")).collect();
        let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({lengths}), }}\n");
        zip.write_all(b"\x93NUMPY\x01\x00").unwrap();
        zip.write_all(&(header.len() as u16).to_le_bytes()).unwrap();
        zip.write_all(header.as_bytes()).unwrap();
        zip.write_all(&vec![0; 8 * shape.iter().product::<u64>() as usize]).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

#[test]
fn arrays_are_listed_in_part() {
    // The names of files in archives have 64 KiB at most.
    let long = "q".repeat(60_000);
    for arrays in [vec![(long.clone(), &[1u64][..])], (0..500).map(|k| (format!("{k}{long}"), &[1u64][..])).collect()] {
        let bytes = npz(&arrays);
        assert_short(&read(Format::Npz, &bytes).unwrap_err(), "names");
        assert_short(&grids::read_from(&bytes[..], GridFormat::Npz).unwrap_err().to_string(), "names of grids");
    }
    let axes = [1u64; 3000];
    let bytes = npz(&[("coords".into(), &axes[..]), ("offsets".into(), &[2][..])]);
    assert_short(&read(Format::Npz, &bytes).unwrap_err(), "shape");
    let sentence = grids::read_from(&npz(&[("grids".into(), &axes[..])])[..], GridFormat::Npz).unwrap_err().to_string();
    assert!(sentence.contains("the shape (1, 1, 1, 1, 1, 1, 1, 1 and 2992 more): it must be"), "{sentence}");
    let grid = format!("1,{}\n", "q".repeat(LONG));
    assert_short(&grids::read_from(grid.as_bytes(), GridFormat::Csv).unwrap_err().to_string(), "cell of a grid");
    let header = format!("{}q\n", "q,".repeat(LONG / 2));
    assert_short(&grids::read_from(header.as_bytes(), GridFormat::Csv).unwrap_err().to_string(), "header of a grid");
}

#[test]
fn writers_quote_in_part() {
    let long = "q".repeat(LONG);
    let batch = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 1.0]][..]; 2]).unwrap();
    let batch = batch.with_names(vec![long.clone(), long]).unwrap();
    let say = |format, beziers| {
        let options = WriteOptions { format: Some(format), beziers, ..WriteOptions::default() };
        io::write_to(Vec::new(), &batch, &options).unwrap_err().to_string()
    };
    assert_short(&say(Format::Csv, false), "two curves of one name");
    assert_short(&say(Format::Svg, true), "no chain");
    assert_short(&batch.sentence(0, 1, "is so"), "a sentence about a point");
    let many = CurveBatch::from_slices(&vec![&[[0.0, 0.0]][..]; 60]).unwrap();
    let names = (0..60).map(|i| if i == 0 { batch.name(0).into_owned() } else { i.to_string() }).collect();
    let options = WriteOptions { format: Some(Format::Npz), ..WriteOptions::default() };
    let sentence = io::write_to(Vec::new(), &many.with_names(names).unwrap(), &options).unwrap_err().to_string();
    assert_short(&sentence, "names of NPZ");
    let none =
        batch.with_constraints(Constraints::default()).unwrap().with_weights(vec![1e308, 1e308, -1e308, 1.0]).unwrap();
    assert!(none.problem(1).unwrap().message.contains("its weight is -1e308;"), "{:?}", none.problem(1));
    assert!(Grids::new(1, vec![[usize::MAX, 2]], vec![]).is_err());
}
