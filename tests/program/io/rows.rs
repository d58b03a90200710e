//! Rows as people have them: mixed, unsorted, with other separators, without a header.

use faircurve::CurveBatch;
use faircurve::io::{self, Format, ReadOptions};

fn read_with(text: &str, columns: &str, sorted: bool) -> Result<CurveBatch, String> {
    let columns = columns.parse().unwrap();
    let options = ReadOptions { format: Some(Format::Csv), columns, sorted, ..ReadOptions::default() };
    io::read_from(text.as_bytes(), &options).map_err(|error| error.to_string())
}

fn read(text: &str) -> CurveBatch {
    read_with(text, "", false).unwrap()
}

#[test]
fn rows_of_several_curves_may_be_mixed_and_keep_their_order_within_each() {
    let mixed = read(
        "curve,x,y,weight,tx,ty,closed\na,0,0,1,1,0,0\nb,5,5,2,,,1\na,1,1,3,,,0\nb,6,5,4,0,1,1\nb,6,6,5,,,1\na,2,0,6,,,0\n",
    );
    let sorted = read(
        "curve,x,y,weight,tx,ty,closed\na,0,0,1,1,0,0\na,1,1,3,,,0\na,2,0,6,,,0\nb,5,5,2,,,1\nb,6,5,4,0,1,1\nb,6,6,5,,,1\n",
    );
    assert_eq!((mixed.offsets(), mixed.coords()), (sorted.offsets(), sorted.coords()));
    for i in 0..2 {
        assert_eq!((mixed.name(i), mixed.weights(i)), (sorted.name(i), sorted.weights(i)));
        assert_eq!((mixed.is_closed(i), mixed.tangent(i, 1)), (sorted.is_closed(i), sorted.tangent(i, 1)));
    }
    assert_eq!(mixed.tangent(1, 1), Some(&[0.0, 1.0][..]));
    // A blank is the trouble of its curve alone, in mixed rows too.
    let blank = read("curve,x,y\na,0,0\nb,5,5\na,1,NA\nb,6,5\n");
    assert_eq!(blank.problem(1), None);
    let message = &blank.problem(0).unwrap().message;
    assert!(message.ends_with("curve a, point 1: column \"y\" is blank: fill it in, or remove the row"), "{message}");
}

#[test]
fn rows_are_sorted_by_time_on_demand() {
    let text = "curve,t,x,y\na,2,2,0\nb,1,9,9\na,0,0,0\nb,0,8,8\na,1,1,0\n";
    let sorted = read_with(text, "", true).unwrap();
    assert_eq!(
        (sorted.points(0), sorted.parameters(0)),
        (&[0.0, 0.0, 1.0, 0.0, 2.0, 0.0][..], Some(&[0.0, 1.0, 2.0][..]))
    );
    assert_eq!((sorted.points(1), sorted.problem(1)), (&[8.0, 8.0, 9.0, 9.0][..], None));
    let as_it_is = read(text);
    assert!(as_it_is.problem(0).unwrap().message.contains("its parameter decreases from 2 to 0"));
    let error = read_with("curve,x,y\na,0,0\n", "", true).unwrap_err();
    assert_eq!(error, "input, line 1: there is no column t to sort by: map one with `ReadOptions::columns`, as in t=…");
}

#[test]
fn cells_are_separated_by_commas_semicolons_or_tabs() {
    let wanted = read("curve,x,y\na,0.5,1\na,2,3.25\n");
    for text in
        ["curve;x;y\na;0.5;1\na;2;3.25\n", "curve\tx\ty\na\t0.5\t1\na\t2\t3.25\n", "curve;x;y\na;0,5;1\na;2;3,25\n"]
    {
        let batch = read(text);
        assert_eq!((batch.coords(), batch.name(0)), (wanted.coords(), wanted.name(0)), "{text}");
    }
    assert_eq!(read("0;1\n2;3\n").coords(), [0.0, 1.0, 2.0, 3.0]);
}

#[test]
fn columns_are_named_by_number_with_or_without_a_header() {
    let wanted = [1.0, 2.0, 3.0, 4.0];
    for text in ["a,7,1,2\na,8,3,4\n", "id,time,east,north\na,7,1,2\na,8,3,4\n"] {
        let batch = read_with(text, "curve=1,t=2,x=3,y=4", false).unwrap();
        assert_eq!((batch.coords(), batch.parameters(0)), (&wanted[..], Some(&[7.0, 8.0][..])), "{text}");
    }
    // Headings that are numbers are headings.
    let batch = read_with("3,4,5\n0,1,2\n", "x=4,y=5", false).unwrap();
    assert_eq!(batch.coords(), [1.0, 2.0]);
    let error = read_with("a,7\n", "x=2,y=3", false).unwrap_err();
    assert!(error.starts_with("input, line 1: there is no column \"2\" for x: the columns are "), "{error}");
}

/// The rows of two curves, cells separated so.
fn separated(separator: &str, decimal: &str) -> String {
    let rows = [
        ["curve", "lon", "lat", "t"],
        ["A", "8.5", "47.25", "0.5"],
        ["A", "8.75", "47.5", "1.5"],
        ["B", "9.5", "48.5", "2.5"],
    ];
    let row = |row: &[&str; 4]| row.join(separator) + "\r\n";
    let first = row(&rows[0]);
    first + &rows[1..].iter().map(row).collect::<String>().replace('.', decimal)
}

#[test]
fn tables_are_read_as_spreadsheets_write_them() {
    let wanted = read(&separated(",", "."));
    for text in [
        format!("sep=;\r\n{}", separated(";", ",")),
        format!("SEP=,\n{}", separated(",", ".")),
        format!("\"sep=|\"\r\n{}", separated("|", ",")),
        format!("sep=\t\r\n{}", separated("\t", ",")),
        separated("\t", ","),
    ] {
        // Excel's Unicode text is UTF-16.
        let units = |mark: &str| format!("{mark}{text}").encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>();
        for bytes in [text.clone().into_bytes(), units("\u{feff}"), units(""), format!("\u{feff}{text}").into_bytes()] {
            let options = ReadOptions { format: Some(Format::Csv), ..ReadOptions::default() };
            let batch = io::read_from(&bytes[..], &options).unwrap();
            assert_eq!((batch.coords(), batch.offsets()), (wanted.coords(), wanted.offsets()), "{text}");
            assert_eq!((batch.parameters(0), batch.name(1)), (wanted.parameters(0), wanted.name(1)), "{text}");
        }
        let bad = text.replace("48", "oops");
        let line = if text.to_ascii_lowercase().contains("sep=") { 5 } else { 4 };
        let error = read_with(&bad, "", false).unwrap_err();
        assert!(error.starts_with(&format!("input, line {line}: column \"lat\" holds \"oops")), "{error}");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("times.csv");
        std::fs::write(&path, text.replace("lon", "x").replace("A", "B")).unwrap();
        assert!(io::read_times(&path).is_ok(), "{text}");
    }
    let error = read_with("sep=;\nx;w\n1;2\n", "", false).unwrap_err();
    assert!(error.starts_with("input, line 2: unknown columns \"w\""), "{error}");
    assert_eq!(read_with("sep=;", "", false).unwrap_err(), "input: the file is empty: there is nothing to read");
    // A letter of two units at the end of what is read at once, and half a letter at the end of all.
    let long = format!("curve,x,y\n{}a,1,2\n", "𝄞,1,2\n".repeat(20_000));
    for padding in ["", "b"] {
        let bytes: Vec<u8> = format!("{long}{padding}𝄞,3,4\n").encode_utf16().flat_map(u16::to_be_bytes).collect();
        let options = ReadOptions { format: Some(Format::Csv), ..ReadOptions::default() };
        assert_eq!(io::read_from(&bytes[..], &options).unwrap().name(0), "𝄞");
        assert!(
            io::read_from(&bytes[..bytes.len() - 1], &options).unwrap_err().to_string().contains("damaged or cut off")
        );
    }
}

#[test]
fn text_that_is_not_utf_8_is_named_and_never_replaced() {
    let latin = |text: &str| text.chars().map(|c| c as u8).collect::<Vec<u8>>();
    let read = |text: &str, columns: &str| {
        let options = ReadOptions {
            format: Some(Format::Csv),
            columns: columns.parse().unwrap(),
            carried: if columns.is_empty() { "all".parse().unwrap() } else { Default::default() },
            ..ReadOptions::default()
        };
        io::read_from(&latin(text)[..], &options).map_err(|error| error.to_string())
    };
    let save = "is not UTF-8 text: save the file as UTF-8";
    let place = "curve,x,y,place\na,0,0,Bern\na,1,1,Zürich\n";
    assert_eq!(read(place, "").unwrap_err(), format!("input, line 3: column \"place\" {save}"));
    assert_eq!(
        read("größe,x,y\n1,0,0\n", "").unwrap_err(),
        format!("input, line 1: the name of column \"gr\u{fffd}\u{fffd}e\" {save}")
    );
    assert_eq!(read("curve,x,y\nZürich,0,0\n", "").unwrap_err(), format!("input, line 2: the curve's name {save}"));
    // What is dropped is nobody's trouble.
    assert_eq!(read(place, "curve=curve,x=x,y=y").unwrap().count(0), 2);
}

#[test]
fn words_for_a_blank_are_their_curve_s_trouble_alone() {
    for word in ["\\N", "NULL", "#N/A", "<NA>", "(null)", "None", "NaT", " "] {
        let batch = read(&format!("curve,x,y,t\nA,0,0,0\nA,{word},1,1\nB,5,5,0\nB,6,6,1\nC,7,7,0\nC,8,8,{word}\n"));
        let blank = |i: usize| batch.problem(i).map(|problem| problem.message.clone());
        let wanted = |place: &str, column: &str| {
            Some(format!("input, {place}: column {column:?} is blank: fill it in, or remove the row"))
        };
        assert_eq!(blank(0), wanted("line 3, curve A, point 1", "x"), "{word}");
        assert_eq!((blank(1), blank(2)), (None, wanted("line 7, curve C, point 1", "t")), "{word}");
    }
    // One bad place makes no other curve's longitudes plain numbers.
    assert!(read("curve,lon,lat\nA,8,\nA,9,47\nB,8,47\nB,9,48\n").is_geographic());
}

#[test]
fn a_curve_whose_times_are_all_blank_has_none() {
    let batch = read("curve,x,y,t\nA,0,0,\nA,1,2,\nA,3,3,\nB,0,0,2024-01-01\nB,1,2,2024-01-02\nB,3,3,2024-01-03\n");
    assert_eq!((batch.parameters(0), batch.problem(0), batch.problem(1)), (None, None, None));
    let alone = read("curve,x,y\nA,0,0\nA,1,2\nA,3,3\n");
    let polylines = |batch: &CurveBatch| {
        let fit = faircurve::spline::Natural::default().fit(batch, &faircurve::Device::cpu()).unwrap();
        fit.polylines(faircurve::Sampling::PerSpan(2))
    };
    let samples = polylines(&batch);
    assert_eq!(samples.points(0), polylines(&alone).points(0));
    for format in [Format::Csv, Format::Npz] {
        let mut bytes = Vec::new();
        let options = io::WriteOptions { format: Some(format), ..Default::default() };
        io::write_to(&mut bytes, &samples, &options).unwrap();
        let back = io::read_from(&bytes[..], &ReadOptions { format: Some(format), ..ReadOptions::default() }).unwrap();
        assert_eq!((back.parameters(0), back.parameters(1)), (None, samples.parameters(1)), "{format}");
    }
    let closed = batch.clone().closed_each(vec![true, true]).unwrap();
    assert!(closed.select(&[1, 0]).parameters(1).is_none() && closed.select(&[1, 0]).parameters(0).is_some());
    let split = faircurve::tracks::split(&batch, 100_000.0).unwrap();
    assert_eq!((split.len(), split.parameters(0)), (2, None));
    let given =
        faircurve::spline::Natural { parametrisation: faircurve::spline::Parametrisation::Given, ..Default::default() };
    let reports = given.fit(&batch, &faircurve::Device::cpu()).unwrap();
    let message = reports.reports()[0].message.as_deref().unwrap();
    assert!(
        message.contains("curve A, point 0: the given parametrisation needs a parameter for every point"),
        "{message}"
    );
    assert!(reports.reports()[1].status.is_usable());
}
