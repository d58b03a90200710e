use std::f64::consts::TAU;

use glam::DVec3;
use roxmltree::{Document, Node};

use super::*;
use crate::Device;
use crate::curve::{Curve, Jet, Polygon, Sampling};
use crate::report::{CurveReport, CurveSet};

/// Cubics through the points with central differences as tangents; curves with a problem stay
/// polygons.
struct Hermite(CurveBatch);

struct One<'a> {
    batch: &'a CurveBatch,
    i: usize,
    knots: Vec<f64>,
}

impl One<'_> {
    fn at(&self, k: isize) -> DVec3 {
        let count = self.batch.count(self.i) as isize;
        let k = if self.batch.is_closed(self.i) { k.rem_euclid(count) } else { k.clamp(0, count - 1) };
        vector(&self.batch.points(self.i)[k as usize * self.batch.dimension()..][..self.batch.dimension()])
    }
}

impl Curve for One<'_> {
    fn dimension(&self) -> usize {
        self.batch.dimension()
    }
    fn is_closed(&self) -> bool {
        self.batch.is_closed(self.i)
    }
    fn knots(&self) -> &[f64] {
        &self.knots
    }
    fn jet(&self, span: usize, u: f64) -> Jet {
        let k = span as isize;
        let [before, a, b, after] = [-1, 0, 1, 2].map(|step| self.at(k + step));
        let (m, n) = ((b - before) * 0.5, (after - a) * 0.5);
        let (c, d) = ((b - a) * 3.0 - m * 2.0 - n, (a - b) * 2.0 + m + n);
        let point = a + (m + (c + d * u) * u) * u;
        Jet { point, first: m + (c * 2.0 + d * 3.0 * u) * u, second: c * 2.0 + d * 6.0 * u, third: d * 6.0 }
    }
}

impl CurveSet for Hermite {
    fn curve(&self, i: usize) -> Box<dyn Curve + '_> {
        let batch = &self.0;
        match batch.problem(i) {
            None if batch.count(i) > 1 => {
                Box::new(One { batch, i, knots: (0..=batch.spans(i)).map(|k| k as f64).collect() })
            }
            _ => Box::new(Polygon::new(batch.points(i), batch.dimension(), batch.is_closed(i))),
        }
    }
    fn polylines(&self, _: Sampling) -> CurveBatch {
        self.0.clone()
    }
}

fn fit(batch: &CurveBatch) -> Fit {
    let report = |i| match batch.problem(i) {
        Some(problem) => CurveReport::unfitted(problem.status, problem.message.clone()),
        None => CurveReport::solved(1.0),
    };
    Fit::new(Hermite(batch.clone()), (0..batch.len()).map(report).collect(), Device::cpu().report(true).unwrap())
}

fn draw(picture: &Picture, batch: &CurveBatch) -> String {
    let text = picture.draw(batch, &fit(batch));
    let document = Document::parse(&text).unwrap();
    let values = document.descendants().flat_map(|node| node.attributes()).map(|attribute| attribute.value());
    for value in values.filter(|value| !value.starts_with("system-ui")) {
        assert!(!value.contains("NaN") && !value.contains("inf"), "{value}");
    }
    text
}

/// The path data of the group with this stroke colour.
fn layer<'a>(document: &'a Document, colour: &str) -> Vec<&'a str> {
    let group = document.descendants().find(|n| n.has_tag_name("g") && n.attribute("stroke") == Some(colour));
    group.map(|g| g.children().filter_map(|n| n.attribute("d")).collect()).unwrap_or_default()
}

fn texts(document: &Document) -> String {
    document.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).collect::<Vec<_>>().join("\n")
}

fn attribute(node: Node, name: &str) -> f64 {
    node.attribute(name).unwrap().parse().unwrap()
}

/// The numbers of absolute or relative path data that has a blank or a command between any two of
/// them.
fn numbers(data: &str) -> Vec<f64> {
    let spaced = data.replace('-', " -").replace(|c: char| c.is_ascii_alphabetic(), " ");
    spaced.split_whitespace().map(|n| n.parse().unwrap()).collect()
}

fn circle(radius: f64, n: usize) -> CurveBatch {
    let points = (0..n).map(|k| (TAU * k as f64 / n as f64).sin_cos()).map(|(s, c)| [radius * c, radius * s]);
    CurveBatch::from_slices(&[&points.collect::<Vec<_>>()[..]]).unwrap().closed(true)
}

#[test]
fn an_empty_batch_gives_a_valid_picture_that_says_so() {
    let batch = CurveBatch::from_slices::<[f64; 2]>(&[]).unwrap();
    let text = draw(&Picture { comb: Some(1.0), ..Picture::default() }, &batch);
    let document = Document::parse(&text).unwrap();
    assert!(texts(&document).contains("0 curves, 0 points"), "{text}");
    assert!(text.len() < 10_000);
}

#[test]
fn single_points_flat_lines_and_huge_numbers_give_a_valid_picture() {
    let curves: [&[[f64; 2]]; 5] = [
        &[[3.0, 4.0]],
        &[[0.0, 2.0], [1.0, 2.0], [7.0, 2.0]],
        &[],
        &[[1e300, 0.0], [-1e300, 1.0]],
        &[[5.0, 5.0], [5.0, 5.0]],
    ];
    for k in 0..curves.len() {
        let batch = CurveBatch::from_slices(&curves[k..=k]).unwrap();
        let text = draw(&Picture { comb: Some(1.0), ..Picture::default() }, &batch);
        Document::parse(&text).unwrap();
    }
    let text = draw(&Picture { width: f64::NAN, ..Picture::default() }, &CurveBatch::from_slices(&curves).unwrap());
    Document::parse(&text).unwrap();
}

#[test]
fn curves_that_are_not_usable_are_dashed_in_another_colour_and_say_why() {
    let curves: [&[[f64; 2]]; 2] =
        [&[[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]], &[[0.0, 1.0], [1.0, f64::NAN], [2.0, 1.0], [3.0, 2.0]]];
    let batch = CurveBatch::from_slices(&curves).unwrap().with_names(vec!["good".into(), "<bad> & worse".into()]);
    let text = draw(&Picture::default(), &batch.unwrap());
    let document = Document::parse(&text).unwrap();
    assert_eq!(layer(&document, FITTED).len(), 1);
    assert_eq!(layer(&document, NOT_USABLE).len(), 1);
    let dashed = document.descendants().find(|n| n.attribute("stroke") == Some(NOT_USABLE) && n.has_tag_name("g"));
    assert!(dashed.unwrap().attribute("stroke-dasharray").is_some());
    assert!(texts(&document).contains("not usable: 1 invalid"), "{text}");
    let titles: Vec<_> = document.descendants().filter(|n| n.has_tag_name("title")).filter_map(|n| n.text()).collect();
    assert!(titles.contains(&"good"), "{titles:?}");
    assert!(titles.iter().any(|t| t.starts_with("<bad> & worse: invalid (") && t.contains("y is NaN")), "{titles:?}");
}

#[test]
fn y_points_up_and_one_unit_is_as_long_in_x_as_in_y() {
    let batch = CurveBatch::from_slices(&[&[[10.0, 20.0], [14.0, 23.0]][..]]).unwrap();
    let text = draw(&Picture::default(), &batch);
    let document = Document::parse(&text).unwrap();
    let [_, _, dx, dy] = numbers(layer(&document, GIVEN)[0])[..] else { panic!("{text}") };
    assert!(dx > 0.0 && dy < 0.0 && (dx / 4.0 + dy / 3.0).abs() < 0.01, "{dx} {dy}");
}

#[test]
fn quills_of_a_circle_stand_outside_and_have_the_promised_length() {
    let batch = circle(7.0, 400);
    for scale in [1.0, 0.5] {
        let text = draw(&Picture { comb: Some(scale), ..Picture::default() }, &batch);
        let document = Document::parse(&text).unwrap();
        let root = document.root_element();
        let centre = attribute(root, "width") / 2.0;
        let given = numbers(layer(&document, GIVEN)[0]);
        let radius = given[0] - centre;
        let quills = layer(&document, COMB)[0];
        for quill in quills.split('M').skip(1) {
            let [x, y, dx, dy] = numbers(quill)[..] else { panic!("{quill}") };
            // Side of the data: two radii. Coordinates of combs are rounded to 0.1 pixel.
            assert!((dx.hypot(dy) - scale * QUILL_OF_TWO_RADII * radius).abs() < 0.3, "{dx} {dy}");
            assert!(dx * (x - centre) + dy * (y - given[1]) > 0.0, "points inward: {quill}");
        }
        assert!(texts(&document).contains("curvature comb (95 % of |κ| ≤ 0.143)"), "{text}");
    }
}

const QUILL_OF_TWO_RADII: f64 = 0.08;

#[test]
fn a_space_curve_is_seen_across_its_narrowest_axis() {
    // A circle that stands upright, in the plane x = 5: seen along z it would be a line.
    let points: Vec<_> =
        (0..50).map(|k| (TAU * f64::from(k) / 50.0).sin_cos()).map(|(s, c)| [5.0, 2.0 * s, 2.0 * c]).collect();
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap().closed(true);
    let text = draw(&Picture::default(), &batch);
    let document = Document::parse(&text).unwrap();
    assert!(texts(&document).contains("two widest principal axes"), "{text}");
    let (mut at, mut low, mut high) = (glam::DVec2::ZERO, glam::DVec2::MAX, glam::DVec2::MIN);
    for step in numbers(layer(&document, GIVEN)[0]).chunks_exact(2) {
        at += glam::DVec2::new(step[0], step[1]);
        (low, high) = (low.min(at), high.max(at));
    }
    let size = high - low;
    assert!((size.x / size.y - 1.0).abs() < 0.01, "{size}");
}

#[test]
fn the_file_grows_with_what_can_be_seen_and_not_with_the_data() {
    let text = draw(&Picture::default(), &circle(1.0, 200_000));
    assert!(text.len() < 120_000, "{} bytes", text.len());
    let curves: Vec<Vec<[f64; 2]>> = (0..5000)
        .map(|k| (0..40).map(|j| [f64::from(k % 100) + 0.02 * f64::from(j), f64::from(k / 100) + 0.5]).collect())
        .collect();
    let slices: Vec<&[[f64; 2]]> = curves.iter().map(|c| &c[..]).collect();
    let text = draw(&Picture::default(), &CurveBatch::from_slices(&slices).unwrap());
    assert!(text.len() < 1_500_000, "{} bytes", text.len());
}

#[test]
fn the_input_can_be_left_out() {
    let batch = circle(1.0, 12);
    let picture = Picture { points: false, title: Some("A < B".into()), ..Picture::default() };
    let text = draw(&picture, &batch);
    let document = Document::parse(&text).unwrap();
    assert!(layer(&document, GIVEN).is_empty() && layer(&document, DOTS).is_empty());
    assert!(texts(&document).starts_with("A < B\n"), "{text}");
}

#[test]
fn corridors_of_two_widths_are_drawn_between_their_borders() {
    let widths = Some(vec![1.0, 2.0, 1.0, 2.0, 0.5, 0.5]);
    let batch = CurveBatch::from_slices(&[&[[0.0, 0.0], [10.0, 0.0], [20.0, 0.0]][..]]).unwrap();
    let batch = batch.with_constraints(crate::Constraints { widths, ..crate::Constraints::default() }).unwrap();
    let text = draw(&Picture::default(), &batch);
    let document = Document::parse(&text).unwrap();
    let areas = layer(&document, CORRIDOR);
    assert!(texts(&document).contains("corridor"));
    // A quadrilateral per span: its first corner, three others and its end.
    assert_eq!(areas[0].matches(['Z', 'z']).count(), 2, "{areas:?}");
    assert_eq!(numbers(areas[0]).len(), 2 * 2 * 4, "{areas:?}");
}
