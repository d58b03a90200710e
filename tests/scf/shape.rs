//! Smooth connection functions that keep the shape of their points: signs of curvature at dense samples.

use faircurve::scf::{Cost, Query, Smooth, evaluate_segments};
use faircurve::{Constraints, CurveBatch, CurveStatus, Device, Fit, Sampling};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::sides::{self, turns};

use super::common::{fit, of, slopes, total_costs, wrap};

type Point = [f64; 2];

/// Curvature of these curves is exactly 0 or of a side.
fn breaks(fit: &Fit, i: usize, points: &[Point], closed: bool) -> usize {
    sides::breaks(fit, i, points, closed, 0.0)
}

fn kept(exponent: f64) -> Smooth {
    Smooth { shape: true, ..of(exponent) }
}

/// Points at unit steps with normally distributed heights.
fn rough(random: &mut StdRng, deviation: f64, count: usize) -> Vec<Point> {
    let normal = |random: &mut StdRng| {
        let (a, b): (f64, f64) = (random.random_range(f64::EPSILON..1.0), random.random_range(0.0..1.0));
        (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    };
    (0..count).map(|k| [k as f64, deviation * normal(random)]).collect()
}

/// Points around a circle of normally distributed radii.
fn ring(random: &mut StdRng, deviation: f64, count: usize) -> Vec<Point> {
    let radii = rough(random, deviation, count);
    let point = |[k, height]: &Point| {
        let (sine, cosine) = (std::f64::consts::TAU * k / count as f64).sin_cos();
        [(1.0 + height) * cosine, (1.0 + height) * sine]
    };
    radii.iter().map(point).collect()
}

fn batch_of(curves: &[Vec<Point>]) -> CurveBatch {
    let slices: Vec<&[Point]> = curves.iter().map(Vec::as_slice).collect();
    CurveBatch::from_slices(&slices).unwrap()
}

/// The curves that break the shape of their points.
fn broken(fit: &Fit, curves: &[Vec<Point>], closed: bool) -> Vec<usize> {
    (0..curves.len()).filter(|&i| breaks(fit, i, &curves[i], closed) > 0).collect()
}

/// Of curves with a minimum of their own all keep their shape, but for those that cannot.
#[test]
fn rough_curves_open_and_closed_keep_their_shape() {
    let seed = 7;
    println!("seed {seed}");
    let count = 60;
    for exponent in [2.0, 4.0] {
        let mut random = StdRng::seed_from_u64(seed);
        for (closed, deviation) in [(false, 0.2), (false, 0.6), (false, 1.2), (true, 0.05), (true, 0.15)] {
            let curve =
                |random: &mut StdRng| if closed { ring(random, deviation, 8) } else { rough(random, deviation, 5) };
            let curves: Vec<Vec<Point>> = (0..count).map(|_| curve(&mut random)).collect();
            let batch = batch_of(&curves).closed(closed);
            let free = fit(&of(exponent), &batch);
            let fit = fit(&kept(exponent), &batch);
            let before = broken(&free, &curves, closed);
            let after = broken(&fit, &curves, closed);
            let mut costs = Vec::new();
            let mut counts = [0; 3];
            for (i, (report, own)) in fit.reports().iter().zip(free.reports()).enumerate() {
                let Some(limits) = report.limits else { continue };
                match report.status {
                    CurveStatus::Converged => {
                        counts[0] += 1;
                        assert_eq!((after.contains(&i), limits.violation), (false, 0.0), "curve {i}: {:?}", curves[i]);
                        if own.status == CurveStatus::Converged {
                            assert_eq!(limits.cost > 0.0, before.contains(&i), "curve {i} costs {}", limits.cost);
                            costs.extend((limits.cost > 0.0).then_some(limits.cost));
                        }
                    }
                    CurveStatus::Infeasible => {
                        counts[1] += 1;
                        assert!(limits.violation > 0.0 && after.contains(&i), "curve {i}: {:?}", curves[i]);
                    }
                    _ => {
                        counts[2] += 1;
                        assert_eq!(report.status, CurveStatus::NoMinimiser, "curve {i}: {report:?}, {:?}", curves[i]);
                        // A minimum without sides, and none with: then the curve is the best one reached that keeps them.
                        let is_kept = !after.contains(&i);
                        assert!(
                            is_kept || own.status != CurveStatus::Converged,
                            "curve {i}: {report:?}, {:?}",
                            curves[i]
                        );
                    }
                }
            }
            costs.sort_by(f64::total_cmp);
            println!(
                "ν {exponent}, closed {closed}, σ {deviation}: of {count} {} break it without, {} with; {counts:?} converged, \
                 infeasible, without minimum; the median cost of {} is {:.3}",
                before.len(),
                after.len(),
                costs.len(),
                costs.get(costs.len() / 2).unwrap_or(&0.0)
            );
            assert!(!costs.is_empty(), "none of {count} mended");
        }
    }
}

#[test]
fn a_curve_that_keeps_its_shape_stays_in_every_bit_whatever_its_neighbours() {
    let mut random = StdRng::seed_from_u64(11);
    let curves: Vec<Vec<Point>> = (0..60).map(|_| rough(&mut random, 0.4, 6)).collect();
    let batch = batch_of(&curves);
    let [free, shaped] = [of(2.0), kept(2.0)].map(|smooth| fit(&smooth, &batch));
    let before = broken(&free, &curves, false);
    let sampling = Sampling::PerSpan(7);
    let [all, without] = [&shaped, &free].map(|fit| fit.polylines(sampling));
    let mut mended = 0;
    for (i, curve) in curves.iter().enumerate() {
        let alone = fit(&kept(2.0), &batch_of(std::slice::from_ref(curve)));
        assert_eq!(alone.polylines(sampling).points(0), all.points(i), "curve {i}");
        let is_same = without.points(i) == all.points(i);
        mended += usize::from(!is_same);
        assert!(is_same || before.contains(&i), "curve {i} kept its shape already");
        let is_infeasible = shaped.reports()[i].status == CurveStatus::Infeasible;
        let has_none = free.reports()[i].status == CurveStatus::NoMinimiser;
        assert_eq!(is_same, !before.contains(&i) || is_infeasible || has_none, "curve {i}: {:?}", shaped.reports()[i]);
    }
    assert!(mended > 3, "{mended} of 60 mended");
}

/// A side that holds an end of a span changes what the span asks of both its points.
#[test]
fn curvature_jumps_only_beside_spans_with_an_end_without_curvature() {
    let mut random = StdRng::seed_from_u64(12);
    let curves: Vec<Vec<Point>> = (0..80).map(|_| rough(&mut random, 0.3, 6)).collect();
    let fit = fit(&kept(2.0), &batch_of(&curves));
    let mut held = 0;
    for (i, report) in fit.reports().iter().enumerate().filter(|(_, report)| report.status == CurveStatus::Converged) {
        let curve = fit.curve(i);
        let (spans, largest) = (curve.spans(), curve.max_curvature());
        let curvature = |span: usize, u: f64| {
            let jet = curve.jet(span, u);
            jet.first.cross(jet.second).z
        };
        // Free ends have none, and are not held.
        let is_flat = |span: usize, u: f64| curvature(span, u).abs() < 1e-5 * largest;
        let flat_starts = |span: usize| span > 0 && is_flat(span, 0.0);
        let flat_ends = |span: usize| span + 1 < spans && is_flat(span, 1.0);
        let ends = (0..spans).map(|span| usize::from(flat_starts(span)) + usize::from(flat_ends(span)));
        let active = report.limits.unwrap().active;
        assert!(active <= ends.sum(), "curve {i}: {active} ends are held");
        held += active;
        for dot in 1..spans {
            let jump = (curvature(dot - 1, 1.0) - curvature(dot, 0.0)).abs();
            let is_beside = [dot - 1, dot].into_iter().any(|span| flat_starts(span) || flat_ends(span));
            assert!(jump < 1e-5 * largest || is_beside && active > 0, "curve {i} jumps at {dot} by {jump}");
            let [before, after] = [curve.jet(dot - 1, 1.0), curve.jet(dot, 0.0)].map(|jet| jet.first);
            assert!((before - after).length() < 1e-12, "curve {i}: a corner at {dot}");
        }
        assert_eq!(active > 0, report.limits.unwrap().cost > 0.0, "curve {i}");
    }
    assert!(held > 5, "{held} ends held");
}

/// Least energy, and slopes at the inner points, of four points with given tangents at the ends, on ever finer grids.
fn by_grids(points: &[Point; 4], ends: [f64; 2], exponent: f64) -> f64 {
    let side: Vec<f64> = turns(points, false).into_iter().map(|turn| turn.unwrap_or(0.0)).collect();
    let sides = [side[1], side[1], side[2], side[2]];
    let chord = |k: usize| [points[k + 1][0] - points[k][0], points[k + 1][1] - points[k][1]];
    let direction = |k: usize| chord(k)[1].atan2(chord(k)[0]);
    let middle = |k: usize| direction(k) + 0.5 * wrap(direction(k + 1) - direction(k));
    let (mut at, mut reach, mut least) = ([middle(0), middle(1)], 1.2, f64::INFINITY);
    const STEPS: i32 = 30;
    while reach > 1e-5 {
        let grid = (-STEPS..=STEPS).flat_map(|i| (-STEPS..=STEPS).map(move |j| [i, j]));
        let tried: Vec<[f64; 2]> =
            grid.map(|steps| std::array::from_fn(|k| at[k] + reach * f64::from(steps[k]) / f64::from(STEPS))).collect();
        let slopes: Vec<Vec<f64>> = tried.iter().map(|[a, b]| vec![ends[0], *a, *b, ends[1]]).collect();
        let queries: Vec<Query> = slopes
            .iter()
            .flat_map(|slopes| {
                (0..3).map(|k| Query {
                    chord: chord(k)[0].hypot(chord(k)[1]),
                    angles: [slopes[k], slopes[k + 1]].map(|slope| wrap(slope - direction(k))),
                    exponent,
                })
            })
            .collect();
        let found = evaluate_segments(&queries, &Device::cpu()).unwrap();
        for (tried, spans) in tried.iter().zip(found.chunks(3)) {
            let keeps = |(k, cost): (usize, &Option<Cost>)| {
                // The moments at the ends are −1/ν and 1/ν times the derivatives.
                cost.is_some_and(|cost| -sides[k] * cost.gradient[0] >= 0.0 && sides[k + 1] * cost.gradient[1] >= 0.0)
            };
            let total: f64 = spans.iter().flatten().map(|cost| cost.cost).sum();
            if spans.iter().enumerate().all(keeps) && total < least {
                (least, at) = (total, *tried);
            }
        }
        reach *= 0.3;
    }
    least
}

#[test]
fn the_energy_is_the_least_that_grids_of_directions_find() {
    let points = [[0.0, 0.0], [1.0, 0.5], [2.2, 0.6], [3.0, 0.1]];
    for (exponent, ends) in [(2.0, [1.1f64, -0.9]), (2.0, [1.4, -0.2]), (4.0, [0.75, -1.0]), (1.5, [1.4, -0.9])] {
        let none = [f64::NAN; 2];
        let tangents = [ends[0].cos(), ends[0].sin()].into_iter().chain(none).chain(none);
        let tangents = Some(tangents.chain([ends[1].cos(), ends[1].sin()]).collect());
        let batch = batch_of(&[points.to_vec()]);
        let batch = batch.with_constraints(Constraints { tangents, ..Constraints::default() }).unwrap();
        let [free, shaped] = [of(exponent), kept(exponent)].map(|smooth| fit(&smooth, &batch));
        assert!(breaks(&free, 0, &points, false) > 0, "ν {exponent}, {ends:?} keeps its shape");
        let report = &shaped.reports()[0];
        let least = by_grids(&points, ends, exponent);
        println!("ν {exponent}, {ends:?}: {:?} {} {least}", report.status, report.energy);
        if ends == [1.4, -0.2] {
            assert_eq!((report.status, least), (CurveStatus::Infeasible, f64::INFINITY));
            continue;
        }
        assert_eq!(report.status, CurveStatus::Converged);
        assert_eq!(breaks(&shaped, 0, &points, false), 0);
        assert!(report.energy <= least * (1.0 + 1e-9), "{} and {least}", report.energy);
        assert!(least < report.energy * (1.0 + 1e-3), "{} and {least}", report.energy);
        let slopes = slopes(&shaped, 0);
        let total = total_costs(&points, false, exponent, &[slopes])[0];
        assert!((total / report.energy - 1.0).abs() < 1e-10, "{total} and {}", report.energy);
    }
}

/// Whether some chain of directions, of a grid at every point of a closed polygon, keeps all sides.
fn is_possible_on_a_grid(points: &[Point], exponent: f64) -> bool {
    const DIRECTIONS: usize = 60;
    const REACH: f64 = 0.9;
    let n = points.len();
    let chord = |k: usize| [points[(k + 1) % n][0] - points[k % n][0], points[(k + 1) % n][1] - points[k % n][1]];
    let direction = |k: usize| chord(k % n)[1].atan2(chord(k % n)[0]);
    let at = |dot: usize, number: usize| {
        let before = direction(dot + n - 1);
        let middle = before + 0.5 * wrap(direction(dot) - before);
        middle + REACH * (2.0 * number as f64 / (DIRECTIONS - 1) as f64 - 1.0)
    };
    let side: Vec<f64> = turns(points, true).into_iter().map(|turn| turn.unwrap()).collect();
    // From every direction at the first point, the directions that can be reached at the one after.
    let mut reached: Vec<Vec<bool>> = (0..DIRECTIONS).map(|i| (0..DIRECTIONS).map(|j| i == j).collect()).collect();
    for dot in 0..n {
        let pairs = (0..DIRECTIONS).flat_map(|i| (0..DIRECTIONS).map(move |j| [i, j]));
        let queries: Vec<Query> = pairs
            .map(|[i, j]| Query {
                chord: chord(dot)[0].hypot(chord(dot)[1]),
                angles: [at(dot, i), at((dot + 1) % n, j)].map(|slope| wrap(slope - direction(dot))),
                exponent,
            })
            .collect();
        let found = evaluate_segments(&queries, &Device::cpu()).unwrap();
        let [first, last] = [side[dot], side[(dot + 1) % n]];
        let keeps = |cost: &Option<Cost>| {
            cost.is_some_and(|cost| -first * cost.gradient[0] >= 0.0 && last * cost.gradient[1] >= 0.0)
        };
        let can: Vec<bool> = found.iter().map(keeps).collect();
        for from in &mut reached {
            *from = (0..DIRECTIONS).map(|j| (0..DIRECTIONS).any(|i| from[i] && can[i * DIRECTIONS + j])).collect();
        }
    }
    (0..DIRECTIONS).any(|i| reached[i][i])
}

#[test]
fn curves_are_infeasible_only_where_a_grid_of_directions_has_none_either() {
    let mut random = StdRng::seed_from_u64(13);
    let curves: Vec<Vec<Point>> = (0..30).map(|_| ring(&mut random, 0.12, 8)).collect();
    let shaped = fit(&kept(2.0), &batch_of(&curves).closed(true));
    let all = |status: CurveStatus| {
        let reports = shaped.reports().iter().enumerate();
        reports.filter(|(_, report)| report.status == status).map(|(i, _)| i).take(5).collect::<Vec<_>>()
    };
    let [infeasible, converged] = [CurveStatus::Infeasible, CurveStatus::Converged].map(all);
    assert!(infeasible.len() > 2 && converged.len() > 2, "{infeasible:?}, {converged:?}");
    for i in infeasible {
        assert!(!is_possible_on_a_grid(&curves[i], 2.0), "curve {i}: {:?}", curves[i]);
    }
    // The grid is fine enough to find most of those that there are.
    let found = converged.iter().filter(|&&i| is_possible_on_a_grid(&curves[i], 2.0)).count();
    assert!(2 * found > converged.len(), "{found} of {}", converged.len());
}

#[test]
fn a_curve_that_cannot_keep_its_shape_says_at_which_point_and_side_and_comes_out_as_without() {
    // A sharp turn between two gentle ones of its side.
    let points = vec![[0.0, 0.0], [1.0, 0.0], [2.0, 0.1], [2.1, 1.1], [2.0, 2.1]];
    let batch = batch_of(&[points]);
    let [free, shaped] = [of(2.0), kept(2.0)].map(|smooth| fit(&smooth, &batch));
    let report = &shaped.reports()[0];
    let limits = report.limits.unwrap();
    assert_eq!((report.status, limits.active, limits.cost), (CurveStatus::Infeasible, 0, 0.0));
    assert!(limits.violation > 0.0);
    let message = report.message.as_ref().unwrap();
    let [start, end] = [
        "curve 0, point ",
        " it has to turn left here, and the turns at the points beside leave no directions for that; add points where it \
         turns most, choose an exponent nearer to 1, or choose `discrete::Fair`",
    ];
    assert!(message.starts_with(start) && message.ends_with(end), "{message}");
    println!("{message}");
    let sampling = Sampling::PerSpan(9);
    assert_eq!(free.polylines(sampling).coords(), shaped.polylines(sampling).coords());
    // An exponent nearer to 1 helps, as it says.
    assert_eq!(fit(&kept(1.2), &batch).reports()[0].status, CurveStatus::Converged);
}

#[test]
fn degenerate_points_end_with_a_status_and_never_with_no_number() {
    let curves: [&[Point]; 10] = [
        &[[0.0, 0.0], [1.0, 1.0]],
        &[[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]],
        &[[0.0, 0.0], [1.0, 0.0], [0.5, 0.0], [2.0, 0.0]],
        &[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.9, 3.0], [0.9, 3.0]],
        &[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [4.0, 1.0], [5.0, 0.0], [6.0, 0.0]],
        &[[0.0, 0.0], [1.0, 1e-7], [2.0, 0.0], [3.0, 1.0], [4.0, 0.0]],
        &[[0.0, 0.0], [1.0, 1e-8], [2.0, 3e-8], [3.0, 1e-7], [4.0, 1.1e-7]],
        &[[0.0, 0.0], [1.0, 0.0], [1e-6, 1e-6], [2.0, 1.0]],
        &[[0.0, 0.0]],
        &[[1.0, 1.0], [1.0, 1.0], [1.0, 1.0]],
    ];
    for exponent in [1.3, 2.0, 20.0] {
        for closed in [false, true] {
            for scale in [1e-150, 1.0, 1e150] {
                let scaled: Vec<Vec<Point>> =
                    curves.iter().map(|c| c.iter().map(|p| p.map(|x| scale * x)).collect()).collect();
                let shaped = fit(&kept(exponent), &batch_of(&scaled).closed(closed));
                for (i, report) in shaped.reports().iter().enumerate() {
                    let place = format!("curve {i} at {scale:e}, ν {exponent}, closed {closed}: {report:?}");
                    match report.status {
                        CurveStatus::Converged => {
                            assert!(i < 8 && breaks(&shaped, i, &distinct(&scaled[i]), closed) == 0, "{place}")
                        }
                        CurveStatus::Degenerate => assert!(i >= 8, "{place}"),
                        _ => assert!(i < 8 && report.message.is_some(), "{place}"),
                    }
                }
                assert!(shaped.polylines(Sampling::PerSpan(9)).coords().iter().all(|x| x.is_finite()));
            }
        }
    }
}

/// Points, without those that repeat the one before.
fn distinct(points: &[Point]) -> Vec<Point> {
    let mut points = points.to_vec();
    points.dedup();
    points
}

#[test]
fn a_tension_and_the_shape_of_points_are_refused_together() {
    let smooth = Smooth { tension: 0.5, ..kept(2.0) };
    let error = smooth.fit(&batch_of(&[vec![[0.0, 0.0], [1.0, 1.0]]]), &Device::cpu()).unwrap_err().to_string();
    let sentence = "smooth connection functions keep the shape of their points without a tension, which is 0.5: leave one of \
                    both out, or choose `discrete::Fair`";
    assert_eq!(error, sentence);
}
