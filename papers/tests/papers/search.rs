//! The searches of Alon & Bergmann over real segments: they come near what Newton's method finds,
//! and never below.

use faircurve::scf::Smooth;
use faircurve::{CurveBatch, Device, Fit};
use faircurve_papers::searches::{
    GaussianAdaptation, Greedy, Request, SegmentCosts, Segments, initial_slopes, total_cost,
};
use glam::DVec2;

use serde::Deserialize;

/// A row of the reference values: the least ∫|κ|^ν ds through points.
#[derive(Deserialize)]
struct Exact {
    name: String,
    closed: bool,
    nu: f64,
    points: Vec<[f64; 2]>,
}

fn exact() -> Vec<Exact> {
    serde_json::from_str(include_str!("../../../tests/data/scf_splines.json")).unwrap()
}

/// The points of a set of that name, and whether it is closed.
fn set(name: &str) -> (Vec<[f64; 2]>, bool) {
    let row = exact().into_iter().find(|row| row.name == name).unwrap();
    (row.points, row.closed)
}

fn of(exponent: f64) -> Smooth {
    Smooth { exponent, ..Smooth::default() }
}

fn fit(smooth: &Smooth, batch: &CurveBatch) -> Fit {
    smooth.fit(batch, &Device::cpu()).unwrap()
}

fn one(points: &[[f64; 2]], closed: bool) -> CurveBatch {
    CurveBatch::from_slices(&[points]).unwrap().closed(closed)
}

/// The directions of the fitted curve at its data points.
fn slopes(fit: &Fit) -> Vec<f64> {
    let curve = fit.curve(0);
    let spans = curve.spans();
    let ends = (0..spans).map(|span| (span, 0.0)).chain((!curve.is_closed()).then_some((spans - 1, 1.0)));
    ends.map(|(span, u)| curve.jet(span, u).first).map(|first| first.y.atan2(first.x)).collect()
}

fn dots(points: &[[f64; 2]]) -> Vec<DVec2> {
    points.iter().copied().map(DVec2::from).collect()
}

fn segments(points: &[[f64; 2]], closed: bool, exponent: f64) -> Segments {
    Segments::new(&dots(points), closed, exponent, &Device::cpu()).unwrap()
}

/// Sets, with exponents from which both searches leave the paper's start.
const CASES: [(&str, f64); 5] = [("open_ten", 2.0), ("open_ten", 4.0), ("quad", 2.0), ("quad", 4.0), ("quad", 20.0)];

#[test]
fn newtons_slopes_cost_what_newtons_method_says() {
    for row in exact() {
        let found = fit(&of(row.nu), &one(&row.points, row.closed));
        let cost = total_cost(&mut segments(&row.points, row.closed, row.nu), &slopes(&found)).unwrap();
        let energy = found.reports()[0].energy;
        assert!((cost / energy - 1.0).abs() <= 1e-10, "{} ν = {}: {cost} {energy}", row.name, row.nu);
    }
}

#[test]
fn neither_search_beats_newtons_method_and_both_come_near_it() {
    for (name, nu) in CASES {
        let (points, closed) = set(name);
        let newton = fit(&Smooth { starts: 32, ..of(nu) }, &one(&points, closed)).reports()[0].energy;
        let (mut costs, start) = (segments(&points, closed, nu), initial_slopes(&dots(&points), closed));
        let still = vec![false; points.len()];
        let greedy = Greedy { step: 0.1, smallest_step: Some(1e-4), ..Greedy::default() };
        let greedy = greedy.search(&mut costs, &start, &still).unwrap();
        let adapted = GaussianAdaptation { seed: 1, ..GaussianAdaptation::default() };
        let adapted = adapted.search(&mut costs, &start, &still).unwrap();
        for (search, outcome) in [("greedy", greedy), ("Gaussian", adapted)] {
            let above = outcome.cost / newton - 1.0;
            println!(
                "{name} ν = {nu}, {search}: {above:.1e} above {newton}, {} iterations, {} segments",
                outcome.iterations, outcome.segment_solves
            );
            assert!(outcome.settled, "{name} ν = {nu}, {search}");
            assert!(above >= -1e-6, "{name} ν = {nu}, {search}: {above:.1e}");
            assert!(above <= 1e-5, "{name} ν = {nu}, {search}: {above:.1e}");
            let again = total_cost(&mut costs, &outcome.slopes).unwrap();
            assert!((again / outcome.cost - 1.0).abs() <= 1e-12, "{again} {}", outcome.cost);
        }
    }
}

#[test]
fn slopes_that_are_fixed_stay_and_cost_more() {
    let (points, closed) = set("open_ten");
    let (mut costs, mut start) = (segments(&points, closed, 4.0), initial_slopes(&dots(&points), closed));
    let mut fixed = vec![false; points.len()];
    (start[3], fixed[3]) = (0.1, true);
    let greedy = Greedy { step: 0.1, smallest_step: Some(1e-4), ..Greedy::default() };
    let outcome = greedy.search(&mut costs, &start, &fixed).unwrap();
    assert_eq!(outcome.slopes[3], 0.1);
    let mut tangents = [f64::NAN; 20];
    [tangents[6], tangents[7]] = [0.1_f64.cos(), 0.1_f64.sin()];
    let constraints = faircurve::Constraints { tangents: Some(tangents.to_vec()), ..Default::default() };
    let newton = fit(&of(4.0), &one(&points, closed).with_constraints(constraints).unwrap()).reports()[0].energy;
    let free = fit(&of(4.0), &one(&points, closed)).reports()[0].energy;
    assert!((outcome.cost / newton - 1.0).abs() <= 1e-5 && newton > 1.01 * free, "{} {newton} {free}", outcome.cost);
}

#[test]
fn segments_without_minimiser_cost_infinity_and_turns_do_not_count() {
    let mut costs = segments(&[[0.0, 0.0], [-1.0, 0.0], [-1.0, -1.0]], true, 2.0);
    assert_eq!((costs.dots(), costs.is_closed(), costs.segments()), (3, true, 3));
    let request = |segment, slopes| Request { segment, slopes };
    let pi = std::f64::consts::PI;
    // Along the first chord, at its two directions, with whole turns; turning too far; straight.
    let requests = [
        request(0, [pi + 0.5, -pi - 0.5]),
        request(0, [0.5 - pi, 7.0 * pi - 0.5]),
        request(0, [pi + 1.6, pi - 1.6]),
        request(1, [-0.5 * pi, 1.5 * pi]),
    ];
    let mut found = [0.0; 4];
    costs.costs(&requests, &mut found).unwrap();
    assert!((found[0] - found[1]).abs() <= 1e-13 && found[0] > 0.9, "{found:?}");
    assert_eq!(found[2], f64::INFINITY);
    assert!(found[3].abs() <= 1e-28, "{found:?}");
}

#[test]
fn dots_that_have_no_segments_are_refused_with_a_sentence() {
    let refused = |points: &[[f64; 2]], closed: bool, nu: f64| {
        Segments::new(&dots(points), closed, nu, &Device::cpu()).unwrap_err().to_string()
    };
    let two = [[0.0, 0.0], [1.0, 0.0]];
    assert_eq!(refused(&two[..1], true, 2.0), "a search for slopes was given 1 dots: at least two are needed");
    assert_eq!(refused(&[], false, 2.0), "a search for slopes was given 0 dots: at least two are needed");
    assert_eq!(refused(&two, false, 1.0), "the exponent is 1; it must be above 1, such as 2");
    let away = |k: usize, after: usize, away: &str| {
        format!("dots {k} and {after} are {away} apart: give finite points, each away from the one before")
    };
    assert_eq!(refused(&[two[0], two[1], two[1]], false, 2.0), away(1, 2, "0"));
    assert_eq!(refused(&[two[0], two[1], two[0]], true, 2.0), away(2, 0, "0"));
    assert_eq!(refused(&[two[0], [f64::NAN, 0.0]], false, 2.0), away(0, 1, "NaN"));
}
