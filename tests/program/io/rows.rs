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
