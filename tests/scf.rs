//! Curves of least ∫|κ|^ν ds are what they say they are.

#[path = "common/fair.rs"]
mod fair;
#[path = "common/rough.rs"]
mod rough;
#[path = "common/scf.rs"]
mod scf;

use std::f64::consts::{PI, TAU};

use fair::{Planar, constrained, one};
use faircurve::scf::{Smooth, Start};
use faircurve::{Constraints, Curve, CurveBatch, CurveStatus, Device, Sampling};
use glam::DVec2;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use rough::Family;
use scf::{exact, fit, of, set, slopes, total_costs, wrap};

const SCALENE: [Planar; 3] = [[0.0, 0.0], [2.0, 0.2], [0.7, 1.4]];

const S: [Planar; 5] = [[0.0, 0.0], [1.0, 0.8], [2.0, 0.1], [3.2, -0.5], [4.0, 0.3]];

#[test]
fn every_reference_spline_is_met_within_a_dozen_iterations() {
    for row in exact() {
        let found = fit(&of(row.nu), &one(&row.points, row.closed));
        let report = &found.reports()[0];
        let case = format!("{} ν = {}: {report:?}", row.name, row.nu);
        assert_eq!(report.status, CurveStatus::Converged, "{case}");
        assert!((report.energy / row.total_cost - 1.0).abs() <= 1e-8, "{case}");
        assert!(report.iterations <= 12, "{case}");
        let slopes = slopes(&found, 0);
        let wrong =
            row.slopes_radians.iter().flatten().zip(&slopes).map(|(a, b)| wrap(a - b).abs()).fold(0.0, f64::max);
        println!(
            "{} ν = {}: {} iterations, cost {:.1e}, slopes {wrong:.1e} apart",
            row.name,
            row.nu,
            report.iterations,
            report.energy / row.total_cost - 1.0
        );
        // As good as the reference: near its minimum the cost does not tell slopes apart.
        assert!(wrong <= 1e-5, "{case}: {wrong:.1e}");
        let again = total_costs(&row.points, row.closed, row.nu, &[slopes])[0];
        assert!((again / report.energy - 1.0).abs() <= 1e-10, "{case}: {again}");
    }
}

#[test]
fn curves_go_by_arc_length_through_their_points_and_cost_what_their_curvature_says() {
    for (name, nu) in [("open_ten", 2.0), ("open_ten", 4.0), ("quad", 1.5), ("quad", 3.0), ("triangle", 4.0)] {
        let (points, closed) = set(name);
        let found = fit(&of(nu), &one(&points, closed));
        let (curve, report) = (found.curve(0), &found.reports()[0]);
        let knots = curve.knots();
        assert_eq!(curve.length(), knots[knots.len() - 1]);
        let spans = if closed { points.len() } else { points.len() - 1 };
        assert_eq!(curve.spans(), spans);
        const STEPS: usize = 2000;
        let (mut energy, mut largest_step) = (0.0, 0.0_f64);
        for span in 0..spans {
            let jet = |k: usize| curve.jet(span, k as f64 / STEPS as f64);
            let length = knots[span + 1] - knots[span];
            assert_eq!([jet(0).point.x, jet(0).point.y], points[span]);
            assert_eq!([jet(STEPS).point.x, jet(STEPS).point.y], points[(span + 1) % points.len()]);
            for k in 0..STEPS {
                let middle = curve.jet(span, (k as f64 + 0.5) / STEPS as f64);
                assert!((middle.first.length() - 1.0).abs() <= 1e-14);
                energy += length / STEPS as f64 * middle.curvature(2).abs().powf(nu);
                let step = (jet(k + 1).point - jet(k).point).length() * STEPS as f64 / length;
                largest_step = largest_step.max((step - 1.0).abs());
            }
        }
        // Chords of arcs that turn by 1e-3 are shorter by 1e-6 of 1/24; the sum's error falls with the square of the step.
        assert!(largest_step <= 1e-6, "{name} ν = {nu}: {largest_step:.1e}");
        assert!((energy / report.energy - 1.0).abs() <= 1e-5, "{name} ν = {nu}: {energy} {}", report.energy);
    }
}

/// Largest jump of a value of the curvature (and ν) at inner dots, of the largest there is.
fn jump(curve: &dyn Curve, value: impl Fn(usize, f64) -> f64) -> f64 {
    let spans = curve.spans();
    let joints = (0..spans - usize::from(!curve.is_closed())).map(|span| (span, (span + 1) % spans));
    let sides = joints.map(|(before, after)| {
        [value(before, curve.jet(before, 1.0).curvature(2)), value(after, curve.jet(after, 0.0).curvature(2))]
    });
    let sides: Vec<[f64; 2]> = sides.collect();
    let most = sides.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
    sides.iter().map(|[a, b]| (a - b).abs()).fold(0.0, f64::max) / most
}

#[test]
fn the_curvature_is_continuous_and_nothing_at_free_ends() {
    for row in exact() {
        let found = fit(&of(row.nu), &one(&row.points, row.closed));
        let curve = found.curve(0);
        let jump = jump(&*curve, |_, curvature| curvature);
        assert!(jump <= 1e-6, "{} ν = {}: {jump:.1e}", row.name, row.nu);
        if !row.closed {
            let ends = [curve.jet(0, 0.0), curve.jet(curve.spans() - 1, 1.0)];
            assert!(ends.iter().all(|jet| jet.curvature(2) == 0.0), "{} ν = {}: {ends:?}", row.name, row.nu);
        }
    }
}

#[test]
fn with_exponents_of_their_own_spans_have_one_moment_where_they_meet() {
    for (name, exponents) in [
        ("open_ten", [2.0, 3.0, f64::NAN, 1.5, 2.0, 8.0, f64::NAN, 4.0, 2.5, 9.0]),
        ("quad", [2.0, 4.0, f64::NAN, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    ] {
        let (points, closed) = set(name);
        let exponents = exponents[..points.len()].to_vec();
        let nu: Vec<f64> = exponents.iter().map(|nu| if nu.is_nan() { 2.2 } else { *nu }).collect();
        let constraints = Constraints { exponents: Some(exponents), ..Constraints::default() };
        let batch = one(&points, closed).with_constraints(constraints).unwrap();
        let found = fit(&of(2.2), &batch);
        assert_eq!(found.reports()[0].status, CurveStatus::Converged, "{name}: {:?}", found.reports()[0]);
        let curve = found.curve(0);
        let moment = |span: usize, k: f64| nu[span] * k.abs().powf(nu[span] - 1.0) * k.signum();
        let [of_moment, of_curvature] = [jump(&*curve, moment), jump(&*curve, |_, curvature| curvature)];
        println!("{name}: moments jump by {of_moment:.1e}, curvatures by {of_curvature:.1e}");
        assert!(of_moment <= 1e-6 && of_curvature > 0.01, "{name}: {of_moment:.1e} {of_curvature:.1e}");
        // The same exponent in every row is the method's own.
        let constraints = Constraints { exponents: Some(vec![3.0; points.len()]), ..Constraints::default() };
        let same = fit(&of(2.2), &one(&points, closed).with_constraints(constraints).unwrap());
        assert_eq!(same.reports(), fit(&of(3.0), &one(&points, closed)).reports(), "{name}");
    }
}

/// Centre and radius of the circle through three points.
fn circumcircle([a, b, c]: [Planar; 3]) -> (DVec2, f64) {
    let [a, b, c] = [a, b, c].map(DVec2::from);
    let (u, v) = (b - a, c - a);
    let centre = a + (v.length_squared() * u - u.length_squared() * v).perp() / (2.0 * u.perp_dot(v));
    (centre, (centre - a).length())
}

#[test]
fn a_triangle_nears_its_circumcircle_as_the_exponent_grows() {
    let (centre, radius) = circumcircle(SCALENE);
    assert!(SCALENE.iter().all(|&p| ((DVec2::from(p) - centre).length() - radius).abs() <= 1e-12));
    let strays = [4.0, 20.0, 60.0, 200.0].map(|nu| {
        let found = fit(&of(nu), &one(&SCALENE, true));
        assert_eq!(found.reports()[0].status, CurveStatus::Converged, "ν = {nu}: {:?}", found.reports()[0]);
        let samples = found.polylines(Sampling::PerSpan(500));
        let away =
            samples.points(0).as_chunks::<2>().0.iter().map(|&p| (DVec2::from(p) - centre).length() / radius - 1.0);
        away.map(f64::abs).fold(0.0, f64::max)
    });
    println!("{strays:?}");
    assert!((strays[0] - 0.1377).abs() <= 2e-4 && (strays[1] - 0.0193).abs() <= 2e-4, "{strays:?}");
    assert!(strays.windows(2).all(|pair| pair[1] < 0.5 * pair[0]), "{strays:?}");
}

/// Distance from a point to a polygon.
fn to_polygon(point: DVec2, points: &[Planar], closed: bool) -> f64 {
    let n = points.len();
    let edge = |k: usize| {
        let (a, b) = (DVec2::from(points[k]), DVec2::from(points[(k + 1) % n]));
        let t = ((point - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        (a.lerp(b, t) - point).length()
    };
    (0..n - usize::from(!closed)).map(edge).fold(f64::INFINITY, f64::min)
}

#[test]
fn curves_near_their_polygon_as_the_exponent_falls_to_1() {
    for name in ["quad", "open_four", "open_ten"] {
        let (points, closed) = set(name);
        let far = [2.0, 1.5, 1.2, 1.1, 1.05].map(|nu| {
            let found = fit(&of(nu), &one(&points, closed));
            assert_eq!(found.reports()[0].status, CurveStatus::Converged, "{name}, ν = {nu}: {:?}", found.reports()[0]);
            let samples = found.polylines(Sampling::PerSpan(200));
            let all = samples.points(0).as_chunks::<2>().0;
            all.iter().map(|&p| to_polygon(DVec2::from(p), &points, closed)).fold(0.0, f64::max)
        });
        println!("{name}: {far:.4?}");
        assert!(far.windows(2).all(|pair| pair[1] < pair[0]) && far[4] < 0.25 * far[0], "{name}: {far:?}");
    }
}

#[test]
fn tangents_that_are_given_are_met_exactly() {
    // Lengths mean nothing, and directions are not those the curve would take.
    let given = [(0, [0.3, -0.4]), (2, [1e-3, -2e-3]), (4, [0.0, 7.0])];
    for closed in [false, true] {
        for nu in [1.5, 2.0, 4.0, 20.0] {
            let found = fit(&of(nu), &constrained(&S, closed, &given, &[]));
            assert_eq!(found.reports()[0].status, CurveStatus::Converged, "ν = {nu}: {:?}", found.reports()[0]);
            let curve = found.curve(0);
            for (k, [x, y]) in given {
                let wanted = DVec2::new(x, y).normalize();
                let before = (closed || k > 0).then(|| curve.jet((k + curve.spans() - 1) % curve.spans(), 1.0));
                let after = (closed || k < 4).then(|| curve.jet(k, 0.0));
                for jet in before.into_iter().chain(after) {
                    let apart = (jet.first.truncate() - wanted).length();
                    assert!(apart <= 8.0 * f64::EPSILON, "ν = {nu}, point {k}: {apart:.1e}");
                }
            }
            let free = fit(&of(nu), &one(&S, closed));
            let [held, free] = [&found, &free].map(|fit| fit.reports()[0].energy);
            assert!(!free.is_finite() || held > free, "ν = {nu}: {held} {free}");
        }
    }
}

#[test]
fn repeated_points_count_once() {
    let mut points = S.to_vec();
    for k in [4, 2, 2, 0] {
        points.insert(k, S[k]);
    }
    let repeated: Vec<bool> = points.windows(2).map(|pair| pair[0] == pair[1]).collect();
    for closed in [false, true] {
        let [plain, again] = [fit(&of(3.0), &one(&S, closed)), fit(&of(3.0), &one(&points, closed))];
        assert_eq!(plain.reports(), again.reports());
        let curve = again.curve(0);
        assert_eq!(curve.spans(), if closed { 9 } else { 8 });
        assert_eq!(curve.length(), plain.curve(0).length());
        let knots = curve.knots();
        for (span, &repeated) in repeated.iter().enumerate() {
            assert_eq!(knots[span + 1] == knots[span], repeated, "span {span}");
            let point = curve.jet(span, 0.5).point;
            assert!(!repeated || [point.x, point.y] == points[span], "span {span}");
        }
        let samples = again.polylines(Sampling::PerSpan(4));
        assert_eq!(samples.count(0), if closed { 36 } else { 33 });
        assert!(samples.points(0).iter().all(|x| x.is_finite()));
    }
}

#[test]
fn two_points_and_points_on_a_line_are_joined_straight() {
    let on_a_line: Vec<Planar> = [0.0, 1.0, 1.5, 4.0].iter().map(|&t| [3.0 * t, 4.0 * t]).collect();
    for points in [&on_a_line[..2], &on_a_line] {
        for nu in [1.2, 2.0, 20.0] {
            let found = fit(&of(nu), &one(points, false));
            let report = &found.reports()[0];
            assert_eq!((report.status, report.message.as_ref()), (CurveStatus::Converged, None), "ν = {nu}");
            assert!(report.energy.abs() <= 1e-12 && report.iterations <= 2, "ν = {nu}: {report:?}");
            let end = points[points.len() - 1];
            assert!((found.curve(0).length() - end[0].hypot(end[1])).abs() <= 1e-12);
            let samples = found.polylines(Sampling::PerSpan(8));
            assert!(samples.points(0).as_chunks::<2>().0.iter().all(|[x, y]| (4.0 * x - 3.0 * y).abs() <= 1e-7));
        }
    }
    // A bow, where the ends are held.
    let bow = fit(&of(2.0), &constrained(&[[0.0, 0.0], [2.0, 0.0]], false, &[(0, [0.0, 1.0]), (1, [0.0, -1.0])], &[]));
    assert!((bow.reports()[0].energy * 2.0 - 5.742160088369037).abs() <= 1e-12);
}

/// Everything said of one curve.
fn said(nu: f64, batch: &CurveBatch) -> (CurveStatus, String) {
    let found = fit(&of(nu), batch);
    let report = &found.reports()[0];
    (report.status, report.message.clone().unwrap_or_default())
}

#[test]
fn what_cannot_be_fitted_says_why_and_comes_out_as_it_came_in() {
    let same = "curve 0, point 0: all points of the curve are one and the same; at least two different points are needed: add points, or \
                remove the curve";
    for closed in [false, true] {
        for points in [&S[..1], &[S[1]; 4]] {
            let batch = one(points, closed);
            let (status, message) = said(2.0, &batch);
            assert_eq!((status, message.as_str()), (CurveStatus::Degenerate, same));
            let found = fit(&of(2.0), &batch);
            assert!(found.reports()[0].energy.is_nan() && !found.curve(0).is_fitted());
            assert_eq!(found.polylines(Sampling::PerSpan(16)).points(0), batch.points(0));
        }
    }
    let mut points = S;
    points[2][1] = f64::NAN;
    let (status, message) = said(2.0, &one(&points, false));
    assert_eq!(status, CurveStatus::Invalid);
    assert!(message.contains("y is NaN; every coordinate must be a finite number"), "{message}");
    let (status, message) = said(2.0, &constrained(&S, false, &[(3, [0.0, 0.0])], &[]));
    let sentence = "curve 0, point 3: the tangent is 0 long and has no direction: leave it out, or give one";
    assert_eq!((status, message.as_str()), (CurveStatus::Invalid, sentence));
    let constraints = Constraints { exponents: Some(vec![2.0, 1.0, 2.0, 2.0, 2.0]), ..Constraints::default() };
    let (status, message) = said(2.0, &one(&S, false).with_constraints(constraints).unwrap());
    let sentence = "curve 0, point 1: the exponent nu is 1; it must be above 1, such as 2, or left empty";
    assert_eq!((status, message.as_str()), (CurveStatus::Invalid, sentence));
    assert!(fit(&of(2.0), &CurveBatch::from_ragged(2, vec![], vec![0]).unwrap()).is_empty());
    let (status, _) = said(2.0, &CurveBatch::from_ragged(2, vec![], vec![0, 0]).unwrap());
    assert_eq!(status, CurveStatus::Degenerate);
}

#[test]
fn what_makes_no_sense_is_refused_with_a_sentence() {
    let refused = |smooth: Smooth, batch: &CurveBatch| smooth.fit(batch, &Device::cpu()).err().unwrap().to_string();
    let batch = one(&S, false);
    for nu in [1.0, 0.5, -2.0, f64::INFINITY, f64::NAN] {
        assert_eq!(refused(of(nu), &batch), format!("the exponent is {nu}; it must be above 1, such as 2"));
    }
    for tolerance in [0.0, -1.0, f64::NAN] {
        let sentence = format!("the tolerance is {tolerance}; it must be a positive number, such as 1e-10");
        assert_eq!(refused(Smooth { tolerance, ..Smooth::default() }, &batch), sentence);
    }
    assert_eq!(refused(Smooth { starts: 0, ..Smooth::default() }, &batch), "0 starts: at least 1 is needed");
    assert_eq!(
        refused(Smooth::default(), &one(&[[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]], false)),
        "smooth connection functions are planar, and the points have three coordinates: leave z out, or choose --method fair"
    );
    let sentence = "smooth connection functions know neither curvature vectors (columns kx ky kz) nor known control points (column known): \
                    leave the columns out";
    assert_eq!(refused(Smooth::default(), &constrained(&S, false, &[], &[(1, [0.0, 1.0])])), sentence);
    let known = Constraints { known: Some(vec![true; 5]), ..Constraints::default() };
    assert_eq!(refused(Smooth::default(), &batch.with_constraints(known).unwrap()), sentence);
}

#[test]
fn curves_that_grow_without_end_have_no_minimiser_and_say_where() {
    const REMEDY: &str = "; add points where it turns, fix a tangent, or choose an exponent nearer to 1";
    let two = [[0.0, 0.0], [1.0, 0.5]];
    for (name, points, nu) in [("scalene", &SCALENE[..], 1.5), ("scalene", &SCALENE, 2.0), ("oval", &two, 2.0)] {
        let found = fit(&of(nu), &one(points, true));
        let report = &found.reports()[0];
        println!("{name}, ν = {nu}: {report:?}");
        assert_eq!(report.status, CurveStatus::NoMinimiser, "{name}, ν = {nu}");
        let message = report.message.as_ref().unwrap();
        let rest = message.strip_prefix("curve 0, point ").unwrap();
        let (point, rest) = rest.split_once(": ").unwrap();
        assert!(point.parse::<usize>().unwrap() < points.len());
        let nowhere = "from this point to the next there is no curve of least ∫|κ|^ν, from any start tried: it would turn too far, and \
                       larger loops are always cheaper";
        let left = format!(
            "after {} iterations cheaper curves have a segment without minimiser, that from this point to the next, which turns too far: \
             the curve is the best one reached",
            report.iterations
        );
        let said = rest.strip_suffix(REMEDY).unwrap_or_else(|| panic!("{message}"));
        assert!(said == nowhere || said == left, "{message}");
        let samples = found.polylines(Sampling::PerSpan(4));
        assert!(samples.points(0).iter().all(|x| x.is_finite()));
    }
    // Held, the triangle has one.
    let out = |k: usize| {
        let (centre, _) = circumcircle(SCALENE);
        let [x, y] = (DVec2::from(SCALENE[k]) - centre).perp().to_array();
        (k, [x, y])
    };
    let held = fit(&of(2.0), &constrained(&SCALENE, true, &[out(0), out(1), out(2)], &[]));
    println!("{:?}", held.reports()[0]);
}

/// Curves of several lengths, gentle and rough, open ones.
fn ragged(count: usize, seed: u64) -> Vec<Vec<Planar>> {
    let mut rng = StdRng::seed_from_u64(seed);
    let curve = |i: usize| {
        let points = 2 + i % 13;
        (0..points).map(|k| [k as f64, rng.random_range(-0.8..0.8)]).collect()
    };
    (0..count).map(curve).collect()
}

fn together(curves: &[&[Planar]], closed: bool) -> CurveBatch {
    CurveBatch::from_slices(curves).unwrap().closed(closed)
}

#[test]
fn a_curves_bits_depend_on_nothing_but_the_curve() {
    let curves = ragged(3000, 5);
    for (closed, smooth) in [(false, of(3.0)), (true, Smooth { starts: 3, seed: 9, ..of(4.0) })] {
        let take = |which: &[usize]| {
            let chosen: Vec<&[Planar]> = which.iter().map(|&i| &curves[i][..]).collect();
            fit(&smooth, &together(&chosen, closed))
        };
        let all = take(&(0..curves.len()).collect::<Vec<_>>());
        let mut which: Vec<usize> = (0..curves.len()).filter(|i| i % 7 < 3).collect();
        which.reverse();
        let some = take(&which);
        for (place, &i) in which.iter().enumerate() {
            // Messages name the curve's number.
            let [a, b] = [&all.reports()[i], &some.reports()[place]];
            assert_eq!(
                (a.status, a.energy.to_bits(), a.iterations),
                (b.status, b.energy.to_bits(), b.iterations),
                "curve {i}"
            );
            let points = |fit: &faircurve::Fit, i: usize| {
                let curve = fit.curve(i);
                (0..curve.spans()).map(|span| curve.jet(span, 0.3).point.to_array()).collect::<Vec<_>>()
            };
            assert_eq!(points(&all, i), points(&some, place), "curve {i}");
        }
        let alone = take(&which[..1]);
        assert_eq!(alone.reports()[0].energy.to_bits(), some.reports()[0].energy.to_bits());
    }
}

#[test]
fn a_bad_curve_leaves_its_neighbours_bits() {
    let mut curves = ragged(60, 6);
    let take =
        |curves: &[Vec<Planar>]| fit(&of(2.0), &together(&curves.iter().map(|c| &c[..]).collect::<Vec<_>>(), false));
    let good = take(&curves);
    curves[11][1][0] = f64::NAN;
    curves[25] = vec![[1.0, 1.0]; 3];
    curves[38][2][1] = f64::INFINITY;
    let bad = take(&curves);
    let wrong = [(11, CurveStatus::Invalid), (25, CurveStatus::Degenerate), (38, CurveStatus::Invalid)];
    for (i, status) in wrong {
        assert_eq!(bad.reports()[i].status, status);
        assert!(bad.reports()[i].message.as_ref().unwrap().starts_with(&format!("curve {i}, point ")));
    }
    for i in (0..60).filter(|i| wrong.iter().all(|(k, _)| k != i)) {
        assert_eq!(good.reports()[i], bad.reports()[i], "curve {i}");
        assert_eq!(
            good.polylines(Sampling::PerSpan(3)).points(i),
            bad.polylines(Sampling::PerSpan(3)).points(i),
            "curve {i}"
        );
    }
}

#[test]
fn more_starts_are_never_worse_and_the_same_seed_gives_the_same_bits() {
    let batch = Family { dimension: 2, closed: true, points: 9, sigma: 0.25 }.batch(300, 7);
    for nu in [2.0, 4.0] {
        let with = |starts: u32, seed: u64| fit(&Smooth { starts, seed, ..of(nu) }, &batch);
        let [one, several, again, other] = [with(1, 0), with(12, 0), with(12, 0), with(12, 1)];
        assert_eq!(several.reports(), again.reports());
        let (mut better, mut more) = (0, 0);
        for i in 0..batch.len() {
            let [first, best] = [&one.reports()[i], &several.reports()[i]];
            if first.status == CurveStatus::Converged {
                assert_eq!(best.status, CurveStatus::Converged, "curve {i}");
                assert!(best.energy <= first.energy, "curve {i}: {} {}", best.energy, first.energy);
                better += usize::from(best.energy < first.energy * (1.0 - 1e-6));
            } else {
                more += usize::from(best.status == CurveStatus::Converged);
            }
        }
        println!("ν = {nu}: {better} of {} better, {more} found only so", batch.len());
        assert!(other.reports().iter().zip(several.reports()).any(|(a, b)| a.energy != b.energy));
    }
}

#[test]
fn every_start_leads_to_the_same_gentle_curve() {
    let batch = Family { dimension: 2, closed: false, points: 12, sigma: 0.2 }.batch(200, 8);
    let found =
        [Start::Circle, Start::Neighbours, Start::Bisector].map(|start| fit(&Smooth { start, ..of(3.0) }, &batch));
    for i in 0..batch.len() {
        let energies = [0, 1, 2].map(|k| found[k].reports()[i].energy);
        assert!(energies.iter().all(|e| (e / energies[0] - 1.0).abs() <= 1e-9), "curve {i}: {energies:?}");
    }
}

#[test]
fn too_few_iterations_are_said() {
    let (points, closed) = set("quad");
    let found = fit(&Smooth { max_iterations: 1, ..of(4.0) }, &one(&points, closed));
    let report = &found.reports()[0];
    assert_eq!((report.status, report.iterations), (CurveStatus::NotConverged, 1));
    let sentence = format!(
        "curve 0, point 0: 1 iterations were not enough, with a decrement of {:.1e} where 1.0e-10 was asked for: allow more",
        report.gradient_norm
    );
    assert_eq!(report.message.as_deref(), Some(&sentence[..]));
    let best = fit(&of(4.0), &one(&points, closed)).reports()[0].energy;
    assert!(report.energy > best && report.energy < 1.2 * best, "{} {best}", report.energy);
}

/// Families of random curves, and the least share that must have converged.
fn families() -> [(Family, f64); 4] {
    let family = |closed, sigma| Family { dimension: 2, closed, points: 12, sigma };
    [(family(false, 0.1), 1.0), (family(false, 1.0), 0.9), (family(true, 0.03), 1.0), (family(true, 0.2), 0.9)]
}

#[test]
fn random_curves_converge_in_few_iterations_or_say_why_not() {
    for nu in [1.5, 2.0, 4.0, 20.0] {
        for (family, least) in families() {
            const CURVES: usize = 1000;
            let batch = family.batch(CURVES, 9);
            let found = fit(&of(nu), &batch);
            let count = |status| found.reports().iter().filter(|report| report.status == status).count();
            let of_status = [CurveStatus::Converged, CurveStatus::NoMinimiser, CurveStatus::NotConverged].map(count);
            let converged = found.reports().iter().filter(|report| report.status == CurveStatus::Converged);
            let mut iterations: Vec<u32> = converged.map(|report| report.iterations).collect();
            iterations.sort_unstable();
            let at = |share: f64| iterations[((iterations.len() - 1) as f64 * share) as usize];
            println!(
                "ν = {nu}, {family}: {of_status:?} converged, without minimiser, not converged; iterations {} (median), {} (99 %), {} (most)",
                at(0.5),
                at(0.99),
                at(1.0)
            );
            assert_eq!(of_status.iter().sum::<usize>(), CURVES);
            assert!(
                found
                    .reports()
                    .iter()
                    .all(|report| report.message.is_some() == (report.status != CurveStatus::Converged))
            );
            assert!(of_status[0] as f64 >= least * CURVES as f64, "ν = {nu}, {family}: {of_status:?}");
            assert_eq!(of_status[2], 0, "ν = {nu}, {family}");
            assert!(at(0.5) <= 12, "ν = {nu}, {family}: {}", at(0.5));
        }
    }
}

#[test]
fn no_slopes_nearby_are_cheaper() {
    const CURVES: usize = 60;
    let mut rng = StdRng::seed_from_u64(10);
    for nu in [1.5, 2.0, 4.0, 20.0] {
        for (family, _) in families() {
            let batch = family.batch(CURVES, 11);
            let found = fit(&of(nu), &batch);
            let mut nearest = f64::INFINITY;
            for i in (0..CURVES).filter(|&i| found.reports()[i].status == CurveStatus::Converged) {
                let (slopes, energy) = (slopes(&found, i), found.reports()[i].energy);
                let mut around = Vec::new();
                for size in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5] {
                    for _ in 0..10 {
                        around.push(slopes.iter().map(|slope| slope + rng.random_range(-size..size)).collect());
                    }
                    // One slope by itself.
                    for _ in 0..10 {
                        let mut one: Vec<f64> = slopes.clone();
                        one[rng.random_range(0..slopes.len())] += size * if rng.random_bool(0.5) { 1.0 } else { -1.0 };
                        around.push(one);
                    }
                }
                let points = batch.points(i).as_chunks::<2>().0;
                let costs = total_costs(points, family.closed, nu, &around);
                let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
                nearest = nearest.min(least / energy - 1.0);
                // Roundings of the sums and of the slopes, which weigh ν times.
                assert!(least >= energy * (1.0 - 1e-11), "ν = {nu}, {family}, curve {i}: {least} {energy}");
            }
            println!("ν = {nu}, {family}: the nearest is {nearest:.1e} above");
        }
    }
}

#[test]
fn scaling_turning_and_moving_do_nothing_but_that() {
    let (points, closed) = set("open_ten");
    let wanted = fit(&of(3.0), &one(&points, closed)).reports()[0].energy;
    let (sine, cosine) = 2.1_f64.sin_cos();
    for size in [1e-9, 1.0, 1e9] {
        let moved: Vec<Planar> = points
            .iter()
            .map(|[x, y]| [size * (cosine * x - sine * y + 3.0), size * (sine * x + cosine * y - 7.0)])
            .collect();
        let report = fit(&of(3.0), &one(&moved, closed)).reports()[0].clone();
        assert_eq!(report.status, CurveStatus::Converged);
        assert!((report.energy * size * size / wanted - 1.0).abs() <= 1e-12, "{size:e}: {report:?}");
    }
    // Points of a circle are joined by that circle, or nearly, whatever the exponent.
    let circle: Vec<Planar> =
        (0..24).map(|k| TAU * f64::from(k) / 24.0).map(|t| [2.0 * t.cos(), 2.0 * t.sin()]).collect();
    for nu in [1.5, 2.0, 8.0] {
        let report = fit(&of(nu), &one(&circle, true)).reports()[0].clone();
        let exact = 4.0 * PI * 0.5_f64.powf(nu);
        assert!(report.energy < exact && report.energy > exact * (1.0 - 1e-2), "ν = {nu}: {report:?} {exact}");
    }
}
