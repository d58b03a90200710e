use glam::DVec3;
use roxmltree::{Document, Node};

use super::*;

fn relief<'a>(dimension: usize, shape: [usize; 2], values: &'a [f64]) -> Relief<'a> {
    Relief { title: String::new(), dimension, shape, values, net: None, range: None }
}

/// Heights over a grid.
fn heights([rows, columns]: [usize; 2], height: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    (0..rows)
        .flat_map(|row| (0..columns).map(move |column| [row, column]))
        .map(|[row, column]| height(column as f64, row as f64))
        .collect()
}

fn sheet(reliefs: Vec<Relief>) -> String {
    let svg = ReliefSheet { reliefs, ..ReliefSheet::default() }.draw();
    let document = Document::parse(&svg).unwrap();
    for value in document.descendants().flat_map(|n| n.attributes()).map(|a| a.value()) {
        assert!(value.starts_with("system-ui") || !(value.contains("NaN") || value.contains("inf")), "{value}");
    }
    svg
}

fn class<'a>(document: &'a Document, name: &str) -> Vec<Node<'a, 'a>> {
    document.descendants().filter(|n| n.attribute("class") == Some(name)).collect()
}

fn faces(svg: &str) -> usize {
    class(&Document::parse(svg).unwrap(), "faces")
        .iter()
        .map(|group| group.children().filter(Node::is_element).count())
        .sum()
}

fn texts(svg: &str) -> String {
    let document = Document::parse(svg).unwrap();
    document.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).collect::<Vec<_>>().join("\n")
}

#[test]
fn every_quadrangle_is_a_face_and_heights_stand_on_two_walls() {
    let hill = heights([5, 7], |x, y| -(x - 3.0).powi(2) - (y - 2.0).powi(2));
    let net = heights([3, 4], |x, y| x * y);
    let svg = sheet(vec![Relief { net: Some(Net { shape: [3, 4], values: &net }), ..relief(1, [5, 7], &hill) }]);
    assert_eq!(faces(&svg), 4 * 6);
    let document = Document::parse(&svg).unwrap();
    assert_eq!(class(&document, "walls")[0].children().filter(Node::is_element).count(), 2);
    // Three rows and four columns of the net, and its twelve points.
    assert_eq!(class(&document, "net")[0].attribute("d").unwrap().matches('M').count(), 7);
    assert_eq!(class(&document, "dots")[0].attribute("d").unwrap().matches("h0").count(), 12);
    let texts = texts(&svg);
    for words in ["control points", "5 × 7 points from 3 × 4", "1 grid, 35 points", "height -13", "parallel view"] {
        assert!(texts.contains(words), "{words}: {texts}");
    }
}

#[test]
fn faces_come_from_the_back_to_the_front() {
    let ramp = heights([9, 6], |x, y| (3.0 * x).sin() * y);
    let scene = Scene::of(&relief(1, [9, 6], &ramp), 1000);
    // The eye is in front, above the first row and the last column; the first face painted is that
    // of the last row and the first column.
    let rear = View::Oblique.project(DVec3::new(0.0, 1.0, 0.0));
    let near = View::Oblique.project(DVec3::new(5.0 / 8.0, 0.0, 0.0));
    assert!(rear.z > near.z && rear.y > near.y);
    let nearest = |at: DVec3, face: &scene::Face| {
        let ground = face.corners.iter().map(|corner| (corner.x - at.x).abs()).fold(f64::INFINITY, f64::min);
        assert!(ground < 1e-12, "{ground}");
    };
    nearest(rear, &scene.faces[0]);
    nearest(near, scene.faces.last().unwrap());
    // Three walls of a room, standing: the one behind, the one on the right, the one in front.
    let places = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    let room: Vec<f64> = [0.0, 1.0].iter().flat_map(|&z| places.map(|[x, y]| [x, y, z])).flatten().collect();
    let scene = Scene::of(&relief(3, [2, 4], &room), 1000);
    let middle: Vec<DVec2> = scene.faces.iter().map(|face| face.corners.iter().sum::<DVec2>() / 4.0).collect();
    assert!(middle[0].y > middle[1].y && middle[1].y > middle[2].y && middle[1].x > middle[2].x, "{middle:?}");
}

#[test]
fn higher_is_lighter_and_a_given_range_is_kept() {
    // Plateaus: the shades are alike, only the tint differs.
    let plateaus = heights([2, 8], |x, _| (x / 2.0).floor());
    let scene = Scene::of(&relief(1, [2, 8], &plateaus), 1000);
    let level: Vec<f64> = scene.faces.iter().map(|face| face.colour.element_sum()).collect();
    let by_place = {
        let mut faces: Vec<_> = scene.faces.iter().collect();
        faces.sort_by(|a, b| a.corners[0].x.total_cmp(&b.corners[0].x));
        faces.iter().step_by(2).map(|face| face.colour.element_sum()).collect::<Vec<_>>()
    };
    assert!(by_place.windows(2).all(|pair| pair[0] < pair[1]), "{by_place:?} of {level:?}");
    assert_eq!(scene.tints(), Some([0.0, 3.0]));
    let low = Scene::of(&Relief { range: Some([0.0, 300.0]), ..relief(1, [2, 8], &plateaus) }, 1000);
    assert_eq!(low.tints(), Some([0.0, 300.0]));
    assert!(low.bounds.high.y < scene.bounds.high.y);
}

#[test]
fn large_grids_are_thinned_and_the_picture_says_so() {
    let wave = heights([401, 301], |x, y| (0.02 * x).sin() * (0.03 * y).cos());
    let svg = sheet(vec![relief(1, [401, 301], &wave)]);
    let drawn = faces(&svg);
    assert!((5_000..=MOST_QUADS).contains(&drawn), "{drawn}");
    assert!(texts(&svg).contains("401 × 301 points, every 4th line is drawn"), "{}", texts(&svg));
    let tile = heights([101, 101], |x, _| x);
    let svg = sheet(vec![relief(1, [101, 101], &tile); 30]);
    assert!(faces(&svg) <= MOST_QUADS_TOGETHER, "{}", faces(&svg));
    let words = texts(&svg);
    assert!(words.contains("30 grids, 306,030 points · the first 24 are drawn"), "{words}");
    let svg =
        sheet(vec![Relief { net: Some(Net { shape: [101, 101], values: &tile }), ..relief(1, [101, 101], &tile) }]);
    assert!(texts(&svg).contains("101 × 101 points from 101 × 101 (the net is left out)"));
    assert!(class(&Document::parse(&svg).unwrap(), "net").is_empty());
}

#[test]
fn thinned_surfaces_meet_all_control_points_or_every_so_manyth() {
    let every = |fine: usize, coarse: usize, most: usize| {
        let (surface, net) = (vec![0.0; fine * fine], vec![0.0; coarse * coarse]);
        let net = Some(Net { shape: [coarse, coarse], values: &net });
        Scene::of(&Relief { net, ..relief(1, [fine, fine], &surface) }, most).every
    };
    // 10 × 8 intervals: 3 would do for 27², but meets some control points and misses others.
    assert_eq!([every(81, 11, 6400), every(81, 11, 27 * 27), every(81, 11, 10 * 10), every(81, 11, 99)], [1, 4, 8, 16]);
}

#[test]
fn grids_of_one_row_are_curves_and_of_one_point_dots() {
    for shape in [[1, 4], [4, 1]] {
        let svg = sheet(vec![relief(1, shape, &[0.0, 2.0, 1.0, 3.0])]);
        let document = Document::parse(&svg).unwrap();
        let curve = class(&document, "curve")[0].attribute("d").unwrap().to_string();
        assert_eq!((faces(&svg), curve.matches('M').count()), (0, 1), "{curve}");
        assert!(texts(&svg).contains("heights from 0 to 3.00"), "{}", texts(&svg));
    }
    let svg = sheet(vec![relief(1, [1, 1], &[7.0])]);
    assert!(class(&Document::parse(&svg).unwrap(), "curve")[0].attribute("d").unwrap().ends_with("h0"));
}

#[test]
fn points_of_the_plane_are_seen_from_above_in_their_proportions() {
    let points: Vec<f64> = heights([3, 5], |x, y| x + 10.0 * y)
        .iter()
        .flat_map(|code| [code % 10.0 * 2.0, (code / 10.0).floor()])
        .collect();
    let scene = Scene::of(&relief(2, [3, 5], &points), 1000);
    let size = scene.bounds.high - scene.bounds.low;
    assert!((size.x / size.y - 4.0).abs() < 1e-12 && scene.walls.is_empty(), "{size}");
    assert!(texts(&sheet(vec![relief(2, [3, 5], &points)])).contains("seen from above"));
}

#[test]
fn what_is_not_finite_is_left_out_and_said() {
    let mut hole = heights([5, 5], |x, y| x + y);
    hole[12] = f64::NAN;
    let svg = sheet(vec![relief(1, [5, 5], &hole)]);
    assert_eq!(faces(&svg), 16 - 4);
    let nothing = [f64::NAN; 9];
    let huge = [1e300, -1e300, f64::INFINITY, 0.0];
    let words = texts(&sheet(vec![
        relief(1, [3, 3], &nothing),
        relief(1, [2, 2], &huge),
        relief(3, [1, 3], &nothing),
        relief(1, [0, 4], &[]),
        relief(1, [2, 2], &[5.0; 4]),
    ]));
    assert_eq!(words.matches("none of them finite").count(), 4, "{words}");
    assert!(texts(&sheet(Vec::new())).contains("0 grids, 0 points"));
    sheet(vec![relief(1, [1, 3], &[1.0, f64::NAN, 2.0]), relief(2, [2, 2], &[1.0; 8])]);
}

#[test]
fn titles_cannot_break_the_page_and_panels_do_not_overlap() {
    let flat = [0.0, 1.0, 2.0, 3.0];
    let titled = |k: usize| Relief { title: format!("<grid> & {k}"), ..relief(1, [2, 2], &flat) };
    let svg = sheet((0..5).map(titled).collect());
    let words = texts(&svg);
    assert!((0..5).all(|k| words.contains(&format!("<grid> & {k}"))), "{words}");
    let reliefs: Vec<_> = (0..5).map(titled).collect();
    let mut placed = Vec::new();
    let end = place(&reliefs[..3], 300.0, 100, 0.0, &mut placed);
    let next = place(&reliefs[3..], 300.0, 100, end, &mut placed);
    assert!(placed[0].frame.plot[2] < placed[1].frame.plot[0] && placed[0].frame.plot[3] < end);
    assert!(placed[3].frame.plot[1] > end && placed[4].frame.plot[3] < next);
}
