//! `faircurve` on drawings: the document stays, and only what its paths draw changes.

use std::fs;

use super::ran::run;
use faircurve::io;
use predicates::prelude::*;
use predicates::str::{contains, is_empty};
use tempfile::TempDir;

const LETTERING: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/data/lettering.svg");

/// A folder with in.svg.
fn drawing(text: &str) -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("in.svg"), text).unwrap();
    folder
}

fn read(folder: &TempDir, name: &str) -> String {
    fs::read_to_string(folder.path().join(name)).unwrap()
}

/// The value of an attribute `d` and what follows, from its quotation mark on.
fn value(part: &str) -> (&str, &str) {
    let mark = part.chars().next().unwrap();
    part[1..].split_once(mark).unwrap()
}

/// The text without the values of `d`.
fn without_data(text: &str) -> String {
    let mut parts = text.split(" d=");
    let first = parts.next().unwrap().to_string();
    parts.fold(first, |text, part| text + " d=" + value(part).1)
}

/// The data of the path with this in its element.
fn data(text: &str, attribute: &str) -> String {
    let element = text.split('<').find(|element| element.contains(attribute)).unwrap();
    value(element.split_once(" d=").unwrap().1).0.to_string()
}

#[test]
fn all_of_a_document_stays_but_the_paths_data() {
    let text = fs::read_to_string(LETTERING).unwrap();
    let only_paths: String = text
        .lines()
        .filter(|line| !line.contains("<rect") && !line.contains("<circle"))
        .map(|line| format!("{line}\n"))
        .collect();
    let folder = drawing(&only_paths);
    for command in ["bezier in.svg -o out.svg --simplify --tolerance 0.2", "fit in.svg -o out.svg --as bezier"] {
        run(&folder, &format!("{command} --device cpu --force"))
            .code(0)
            .stderr(contains("1 <text> passed over: only what has a shape of its own is read"));
        let out = read(&folder, "out.svg");
        assert_ne!(out, only_paths);
        assert_eq!(without_data(&out), without_data(&only_paths), "{command}");
    }
}

#[test]
fn a_drawing_comes_back_where_it_was_through_nested_transforms_and_upright() {
    let folder = drawing(
        "<svg viewBox='0 0 90 90'><g transform='translate(10 20) rotate(30)'><g transform='scale(2 -3) skewX(10)'>\
         <path id='a' d='M0,0C1,2 3,2 5,0L7,9' class='x'/></g></g><path id='b' d='M0,0L0,50'/></svg>",
    );
    // Nothing is free here: all control points are known.
    run(&folder, "bezier in.svg -o out.svg --device cpu").code(0).stderr(contains("2 curves"));
    assert_eq!(read(&folder, "out.svg"), read(&folder, "in.svg"));
}

#[test]
fn shapes_are_read_become_paths_and_keep_what_else_they_have() {
    let shapes = [
        ("<rect id='r' x='1' y='2' width='10' height='5' class='a'/>", "M1,2L11,2 11,7 1,7Z"),
        ("<line style='x:y' x1='1' y1='2' x2='3' y2='4'/>", "M1,2L3,4"),
        ("<polyline points='1,2 3,4 5,0' fill='none'/>", "M1,2L3,4 5,0"),
        ("<polygon points='1,2 3,4 5,0'></polygon>", "M1,2L3,4 5,0Z"),
    ];
    for (shape, wanted) in shapes {
        let folder = drawing(&format!("<svg>{shape}</svg>"));
        run(&folder, "bezier in.svg -o out.svg --device cpu").code(0);
        let out = read(&folder, "out.svg");
        assert_eq!(data(&out, "path"), wanted, "{out}");
        for kept in ["id='r'", "class='a'", "style='x:y'", "fill='none'", "</svg>"] {
            assert_eq!(out.contains(kept), shape.contains(kept) || kept == "</svg>", "{out}");
        }
        assert!(!["rect", "line ", "poly", "points", "width", "x1"].iter().any(|gone| out.contains(gone)), "{out}");
    }
    let folder = drawing(
        "<svg><circle cx='5' cy='6' r='2'/><ellipse cx='5' cy='6' rx='3' ry='1'/><rect width='9' height='4' rx='1'/></svg>",
    );
    run(&folder, "bezier in.svg -o out.svg --device cpu").code(0);
    let back = io::read_with(folder.path().join("out.svg"), &io::ReadOptions { controls: true, ..Default::default() })
        .unwrap();
    assert_eq!(
        (0..3).map(|i| (back.spans(i) / 3, back.is_closed(i))).collect::<Vec<_>>(),
        [(4, true), (4, true), (8, true)]
    );
    assert_eq!(back.points(0)[..2], [7.0, -6.0]);
}

#[test]
fn what_cannot_be_read_stays_and_is_said() {
    let text = "<svg><defs><path id='d' d='M0,0L1,1'/></defs><text>a</text><text>b</text><use href='#d'/><image/>\
                <rect width='100%' height='5'/><path id='p' d='M0,0L1,0 2,1'/></svg>";
    let folder = drawing(text);
    run(&folder, "fit in.svg -o out.svg --device cpu").code(0).stderr(contains(
        "1 <image>, 2 <text>, 1 <use>, 1 shape with lengths such as 100% passed over: only what has a shape of its own is read",
    ));
    assert_eq!(without_data(&read(&folder, "out.svg")), without_data(text));
}

#[test]
fn fits_follow_the_curve_that_a_path_draws_not_its_anchors_alone() {
    // Half a circle with anchors at its ends: by its anchors it would be a straight line.
    let folder = drawing("<svg><path d='M0,0A50 50 0 0 1 100,0'/></svg>");
    run(&folder, "fit in.svg -o out.svg --as bezier --tolerance 0.01 --device cpu").code(0);
    let back = io::read(folder.path().join("out.svg")).unwrap();
    let far = |point: &[f64]| ((point[0] - 50.0).hypot(point[1]) - 50.0).abs();
    let worst = back.points(0).chunks_exact(2).map(far).fold(0.0, f64::max);
    assert!(back.count(0) >= 3 && worst < 0.03, "{worst}");
    assert!(back.points(0).chunks_exact(2).any(|point| point[1] > 49.0), "upwards, as drawn");
}

#[test]
fn maps_and_tables_are_drawn_the_right_way_up() {
    let folder = drawing("");
    fs::write(folder.path().join("in.csv"), "curve,x,y\na,0,0\na,1,5\na,2,9\n").unwrap();
    run(&folder, "fit in.csv -o out.svg --device cpu").code(0);
    // SVG's y points down: what is higher has a smaller y.
    let path = data(&read(&folder, "out.svg"), "path id");
    let last: f64 = path.rsplit(',').next().unwrap().parse().unwrap();
    assert_eq!(last, -9.0, "{path}");
}

#[test]
fn fewer_cubics_say_how_many_and_keep_lines_and_corners() {
    let folder = TempDir::new().unwrap();
    run(&folder, &format!("bezier {LETTERING} -o out.svg --simplify --tolerance 0.2 --device cpu"))
        .code(0)
        .stderr(contains("197 cubics became ").and(contains("15 curves")));
    let out = read(&folder, "out.svg");
    assert!(data(&out, "id=\"v8\"").starts_with("M538,0l-135 0-205 956-121 0 20 107 275 0 180-838c"), "{out}");
    assert_eq!(data(&out, "#f4f1ea").matches('l').count(), 4);
    for (arguments, sentence) in [
        ("--simplify", "--simplify needs to know how far the new curves may be from those given"),
        ("--simplify --tolerance 0", "--tolerance is 0; it must be a positive length"),
        ("--simplify --tolerance 1 --degree 4", "--simplify takes chains of cubics"),
        ("--corners 200", "200 is not between 0 and 180 degrees"),
    ] {
        run(&folder, &format!("bezier {LETTERING} -o no.svg {arguments}"))
            .code(2)
            .stdout(is_empty())
            .stderr(contains(sentence));
    }
    run(&folder, "bezier in.csv -o no.csv --corners 20").code(2).stderr(contains("give --degree D"));
}

#[test]
fn new_handles_leave_corners_alone() {
    // A square with handles everywhere: smooth joints make it round, corners leave it square.
    let folder = drawing("<svg><path d='M0,0C3,0 6,0 9,0C9,3 9,6 9,9C6,9 3,9 0,9C0,6 0,3 0,0Z'/></svg>");
    run(&folder, "bezier in.svg -o round.svg --known joints --joints g1 --device cpu").code(0);
    run(&folder, "bezier in.svg -o square.svg --known joints --joints g1 --corners 30deg --device cpu").code(0);
    let size = |name: &str| {
        let batch =
            io::read_with(folder.path().join(name), &io::ReadOptions { controls: true, ..Default::default() }).unwrap();
        batch.coords().iter().copied().fold(0.0, f64::max)
    };
    assert!(
        size("round.svg") > 9.5 && (size("square.svg") - 9.0).abs() < 1e-12,
        "{} {}",
        size("round.svg"),
        size("square.svg")
    );
}
