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
            .stderr(contains("1 <text> passed over: only elements with a shape are read"));
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
        [(12, true), (12, true), (12, true)],
        "within a millionth of their sizes"
    );
    assert_eq!(back.points(0)[..2], [7.0, -6.0]);
}

#[test]
fn what_cannot_be_read_stays_and_is_said() {
    let text = "<svg><defs><path id='d' d='M0,0L1,1'/></defs><text>a</text><text>b</text><use href='#d'/><image/>\
                <path id='p' d='M0,0L1,0 2,1'/></svg>";
    let folder = drawing(text);
    run(&folder, "fit in.svg -o out.svg --device cpu")
        .code(0)
        .stderr(contains("1 <image>, 2 <text>, 1 <use> passed over: only elements with a shape are read"));
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
        .stderr(contains("205 cubics became ").and(contains("15 curves")));
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

/// What reads drawings, each with its output.
const COMMANDS: [&str; 5] = [
    "bezier in.svg -o out.svg",
    "bezier in.svg -o out.svg --simplify --tolerance 0.1",
    "bezier in.svg -o out.svg --known joints --joints g1",
    "fit in.svg -o out.svg --method smoothing --deviation 0.5",
    "fit in.svg -o out.svg --as bezier --tolerance 0.1",
];

const GOOD: &str = "<path id='good' d='M10 10C20 0 30 0 40 10S60 20 70 10'/>";

#[test]
fn an_element_that_cannot_be_read_is_its_trouble_alone() {
    for (bad, sentence) in [
        ("<path id='bad' d='M10 50H20L-nan -nanL30 60'/>", "<path> \"bad\": its path data cannot be read from \"-nan"),
        ("<path id='bad' d='MNaN,NaN'></path>", "cannot be read from \"NaN,NaN\" on: mend it"),
        ("<path id='bad' d='M0,0L1,2 3,1;'/>", "cannot be read from \";\" on: mend it"),
        ("<polyline id='bad' points='0,0 10,20 30'/>", "ends with an x, 30, that has no y"),
        ("<path id='bad' transform='rotate(45deg)' d='M0,0L1,2 3,1'/>", "with numbers without units"),
        (
            "<g transform='turn(4)'><rect id='bad' width='5' height='5'/></g>",
            "<g>: its transform cannot be read from \"turn(4)\" on",
        ),
        ("<circle id='bad' cx='5' r='1rem'/>", "r is \"1rem\": give a number, or a length in px"),
        ("<path id='bad' d='M1e308 0l1e308 0 5 5'/>", "its coordinates are too large for f64: scale it down"),
    ] {
        let folder = drawing(&format!("<svg>\n{GOOD}\n{bad}<path id='none' d='none'/></svg>"));
        for command in COMMANDS {
            run(&folder, &format!("{command} --device cpu --force"))
                .code(1)
                .stderr(contains("1 of 2 curves is not usable").and(contains("invalid: in.svg, line 3: <")))
                .stderr(contains(sentence));
            let out = read(&folder, "out.svg");
            assert!(out.ends_with(&format!("\n{bad}<path id='none' d='none'/></svg>")), "{command}: {out}");
            let alone = drawing(&format!("<svg>{GOOD}</svg>"));
            run(&alone, &format!("{command} --device cpu")).code(0);
            assert_eq!(data(&out, "'good'"), data(&read(&alone, "out.svg"), "'good'"), "{command}");
        }
        for command in [
            "fit in.svg -o out.csv --device cpu",
            "bezier in.svg -o out.csv --device cpu",
            "exponent in.svg -o out.csv --dots 3",
        ] {
            run(&folder, &format!("{command} --force")).code(1).stderr(contains(sentence));
            assert!(read(&folder, "out.csv").contains("\ngood,"), "{command}");
        }
    }
}

#[test]
fn what_was_not_fitted_stays_byte_for_byte() {
    let dots = "<path id='dot' d=' m 5e1 50 z'/><polyline points=' 3,3 '/>";
    let folder = drawing(&format!("<svg>{GOOD}{dots}</svg>"));
    for command in COMMANDS {
        run(&folder, &format!("{command} --device cpu --force")).code(0).stderr(contains("2 curves are single points"));
        let out = read(&folder, "out.svg");
        assert!(out.ends_with(&format!("{dots}</svg>")), "{command}: {out}");
    }
    // A dot is drawn where it is closed, and not where it is a move alone.
    let folder = drawing("<svg><path d='M10 10C20 0 30 0 40 10M50 50zm7 7'/></svg>");
    for command in COMMANDS {
        run(&folder, &format!("{command} --device cpu --force")).code(0).stderr(contains("2 curves are single points"));
        let out = read(&folder, "out.svg");
        assert!(data(&out, "path").ends_with("M50,50ZM57,57"), "{command}: {out}");
    }
}

#[test]
fn what_a_transform_without_an_inverse_hides_stays_and_is_said() {
    let hidden = "<g transform='translate(50,50) scale(0)'><path id='a' d='M1 1C1 2 3 2 4 4'/></g>\
                  <path id='b' transform='scale(1,0)' d='M1 1C1 2 3 2 4 4'/>\
                  <circle id='c' transform='matrix(.1 .2 .3 .6 0 0)' r='5'/>\
                  <g transform='rotate(30) scale(0 3)'><line id='d' transform='rotate(20)' x2='5'/></g>\
                  <rect id='e' transform='scale(1e200)' width='3' height='4'/>\
                  <path id='f' transform='skewX(90)' d='M1 1C1 2 3 2 4 4'/>";
    let folder = drawing(&format!("<svg>{GOOD}{hidden}</svg>"));
    for command in COMMANDS {
        run(&folder, &format!("{command} --device cpu --force")).code(0).stderr(contains(
            "hidden by a transform without an inverse, and left as it is: <path> \"a\", <path> \"b\", <circle> \"c\", <line> \"d\", \
             <rect> \"e\", <path> \"f\"",
        ));
        let out = read(&folder, "out.svg");
        assert!(out.ends_with(&format!("{hidden}</svg>")) && !out.contains("NaN"), "{command}: {out}");
    }
}

#[test]
fn what_an_entity_draws_stays_and_is_said() {
    let text = "<!DOCTYPE svg [<!ENTITY data 'M0 0L1 1 2 0'><!ENTITY path '<path id=\"p\" d=\"M0 0L1 1 2 0\"/>'>]>\
                <svg><text>Title</text>&path;<g transform='scale(2)'>&path;</g><path d='&data;'/></svg>";
    let folder = drawing(text);
    run(&folder, "fit in.svg -o out.svg --samples 1 --device cpu").code(0).stderr(
        contains("3 curves").and(contains("drawn by an entity, and left as it is: <path> \"p\", <path> \"p\"")),
    );
    assert_eq!(read(&folder, "out.svg"), text.replace("'&data;'", "'M0,0L1,1 2,0'"));
}

#[test]
fn small_coordinates_keep_their_digits_through_a_transform() {
    let text = "<svg><g transform='scale(1e15)'><path d='M1.234567e-15,0C1e-15,2e-15 3e-15,2e-15 5e-15,0'/></g></svg>";
    let folder = drawing(text);
    run(&folder, "bezier in.svg -o out.svg --device cpu").code(0);
    let out = read(&folder, "out.svg");
    let x: f64 = data(&out, "path").trim_start_matches('M').split(',').next().unwrap().parse().unwrap();
    assert!((x / 1.234567e-15 - 1.0).abs() < 1e-12, "{out}");
}

/// Arcs of the circle of this radius about the origin, in every way that a drawing has.
const RADIUS: f64 = 360.0;
const CIRCLES: &str = "<svg><path d='M360 0A360 360 0 010 360'/><path d='M0 360a360 360 77 1 0-360-360'/>\
    <path d='M360 0A1 1 0 0 0-360 0A-360 360 0 0 0 360 0Z'/><circle r='360'/><ellipse rx='360' ry='360'/>\
    <rect x='-360' y='-360' width='720' height='720' rx='360'/><g transform='scale(1e-3)'><circle r='360000'/></g>\
    <g transform='rotate(40) scale(90 3)'><ellipse rx='4' ry='120'/></g>\
    <path d='M 0,-360 a360,360 0 0,0 -254.5584412271571,105.4415587728429'/></svg>";

fn off_circle(x: f64, y: f64) -> f64 {
    (x.hypot(y) - RADIUS).abs()
}

#[test]
fn arcs_are_as_exact_as_the_tolerance_asks() {
    let folder = drawing(CIRCLES);
    for (command, tolerance) in [
        ("bezier in.svg -o out.svg --simplify --tolerance 1", 1.0),
        ("bezier in.svg -o out.svg --simplify --tolerance 0.01", 0.01),
        ("bezier in.svg -o out.svg --simplify --tolerance 1e-5", 1e-5),
        ("bezier in.svg -o out.svg --elevate 1 --tolerance 1e-4", 1e-4),
        ("bezier in.svg -o out.svg", 1e-6 * 2.0 * RADIUS),
    ] {
        run(&folder, &format!("{command} --device cpu --force")).code(0);
        let options = io::ReadOptions { controls: true, ..Default::default() };
        let back = io::read_with(folder.path().join("out.svg"), &options).unwrap();
        assert_eq!(back.len(), 9);
        for i in 0..back.len() {
            let (points, count) = (back.points(i), back.count(i));
            for piece in 0..back.spans(i) / 3 {
                let control: [[f64; 2]; 4] =
                    std::array::from_fn(|j| [0, 1].map(|axis| points[(3 * piece + j) % count * 2 + axis]));
                for u in (0..=16).map(|k| f64::from(k) / 16.0) {
                    let weights = [(1.0 - u).powi(3), 3.0 * u * (1.0 - u).powi(2), 3.0 * u * u * (1.0 - u), u.powi(3)];
                    let [x, y] = [0, 1].map(|axis| (0..4).map(|j| weights[j] * control[j][axis]).sum::<f64>());
                    assert!(off_circle(x, y) <= tolerance, "{command}, curve {i}: {}", off_circle(x, y));
                }
            }
        }
    }
}

#[test]
fn points_along_arcs_are_on_them_and_near_enough() {
    let folder = drawing(CIRCLES);
    for within in [100.0, 0.5, 0.01] {
        let options = io::ReadOptions { flatness: Some(io::Flatness::Within(within)), ..Default::default() };
        let batch = io::read_with(folder.path().join("in.svg"), &options).unwrap();
        assert_eq!(batch.len(), 9);
        for i in 0..batch.len() {
            let points = batch.points(i).as_chunks::<2>().0;
            assert!(points.iter().all(|&[x, y]| off_circle(x, y) < 1e-12 * RADIUS), "curve {i}");
            let closing = batch.is_closed(i).then(|| [points[points.len() - 1], points[0]]);
            for [a, b] in points.windows(2).map(|pair| [pair[0], pair[1]]).chain(closing) {
                let off = off_circle(0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]));
                assert!(off <= within, "curve {i}: {off} at {within}");
            }
        }
    }
}

#[test]
fn arcs_of_any_radius_are_drawn() {
    // A flat arc is a line, but for its sagitta c²/8r; a radius too small grows until the arc is half a circle.
    for (radius, sagitta) in
        [(1e300, 0.0), (1e15, 12.5e-15), (1e9, 12.5e-9), (1e5, 12.5e-5), (1e-9, 5.0), (1e-200, 5.0)]
    {
        let folder = drawing(&format!("<svg><path d='M7,3A{radius:e} {radius:e} 0 0 1 17,3'/></svg>"));
        let options = io::ReadOptions { flatness: Some(io::Flatness::Within(0.01)), ..Default::default() };
        for controls in [false, true] {
            let options = io::ReadOptions { controls, ..options.clone() };
            let batch = io::read_with(folder.path().join("in.svg"), &options).unwrap();
            let points = batch.points(0).as_chunks::<2>().0;
            assert_eq!((points[0], points[points.len() - 1]), ([7.0, -3.0], [17.0, -3.0]));
            // A single cubic's handles rise to 4/3 of it.
            let highest = points.iter().map(|[_, y]| y + 3.0).fold(0.0, f64::max);
            assert!((0.0..1.35 * sagitta + 1e-14).contains(&highest), "{radius}: {highest}");
        }
    }
}

#[test]
fn lengths_with_units_are_read() {
    let folder = drawing(
        "<svg viewBox='0 0 200 50'><rect x='1in' y='10%' width='50%' height='1pc' class='a'/><circle cx='25.4mm' cy='2.54cm' r='10px'/>\
         <line x1='72pt' x2='1IN' y2='-1e1'/><ellipse cx='50%' rx='10%' ry='10%'/><svg width='10%' height='40'>\
         <line x2='100%' y2='100%'/></svg></svg>",
    );
    let batch = io::read(folder.path().join("in.svg")).unwrap();
    assert_eq!(batch.notes(), [] as [String; 0]);
    let near = |i: usize, wanted: &[f64]| {
        let off = batch.points(i).iter().zip(wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-12 && batch.points(i).len() == wanted.len(), "{:?}", batch.points(i));
    };
    near(0, &[96.0, -5.0, 196.0, -5.0, 196.0, -21.0, 96.0, -21.0]);
    near(1, &[106.0, -96.0, 96.0, -106.0, 86.0, -96.0, 96.0, -86.0]);
    near(2, &[96.0, 0.0, 96.0, 10.0]);
    near(3, &[120.0, 0.0, 100.0, -5.0, 80.0, 0.0, 100.0, 5.0]);
    near(4, &[0.0, 0.0, 20.0, -40.0]);
    run(&folder, "bezier in.svg -o out.svg --device cpu").code(0);
    let out = read(&folder, "out.svg");
    assert!(out.starts_with("<svg viewBox='0 0 200 50'><path d=\"M96,5L196,5 196,21 96,21Z\" class='a'/>"), "{out}");
}

#[test]
fn paths_that_cannot_be_read_say_so_in_every_job() {
    let folder =
        drawing(r#"<svg xmlns="http://www.w3.org/2000/svg"><path d="M 0,0 L 5"/><path d="M1,1L5,5L7,2"/></svg>"#);
    for job in ["fit", "fit --topology yes", "draw --within 1"] {
        let said = contains("its path data ends where a number must follow: complete it");
        run(&folder, &format!("{job} in.svg -o out.svg --force")).code(1).stderr(said);
    }
}
