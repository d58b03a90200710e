//! Planar curves of a batch do not cross each other where the polygons of their points do not.

use faircurve::discrete::{Fair, Limits, bending, length, tautness};
use faircurve::{Constraints, CurveBatch, CurveStatus, Device, Fit};

use crate::common::*;

const SEGMENTS: usize = 16;

fn apart() -> Fair {
    Fair { limits: Limits { no_crossing: true, ..Limits::default() }, ..Fair::default() }
}

fn batch(curves: &[(Vec<Planar>, bool)]) -> CurveBatch {
    let points: Vec<&[Planar]> = curves.iter().map(|(points, _)| &points[..]).collect();
    let closed = curves.iter().map(|(_, closed)| *closed).collect();
    CurveBatch::from_slices(&points).unwrap().closed_each(closed).unwrap()
}

/// A rectangle of 4 by 1, larger by an offset on all sides, with so many points a side.
fn rectangle(offset: f64, per_side: usize) -> (Vec<Planar>, bool) {
    let [x, y] = [2.0 + offset, 0.5 + offset];
    let corners = [[-x, -y], [x, -y], [x, y], [-x, y]];
    let side = |k: usize| {
        let [a, b] = [corners[k], corners[(k + 1) % 4]];
        (0..per_side)
            .map(move |j| j as f64 / per_side as f64)
            .map(move |t| std::array::from_fn(|c| a[c] + t * (b[c] - a[c])))
    };
    ((0..4).flat_map(side).collect(), true)
}

/// Three rings: the bulge of the first and the third reaches over that between, whose points are close.
fn rings() -> Vec<(Vec<Planar>, bool)> {
    vec![rectangle(0.0, 1), rectangle(0.12, 9), rectangle(0.3, 2)]
}

/// Two lanes up the same stairs: one of few points, which swings out at each step, and one of many, close above it.
fn lanes() -> Vec<(Vec<Planar>, bool)> {
    let few = [[0.0, 0.0], [1.0, 0.0], [1.2, 1.0], [2.2, 1.0], [2.4, 2.0], [3.4, 2.0]];
    let mut many: Vec<Planar> = vec![];
    for ends in few.windows(2) {
        let between = (0..8).map(|k| f64::from(k) / 8.0);
        many.extend(
            between.map(|t| std::array::from_fn(|c| ends[0][c] + t * (ends[1][c] - ends[0][c]) + [-0.03, 0.03][c])),
        );
    }
    vec![(few.to_vec(), false), (many, false)]
}

/// The vertices of a curve, or its points, and the first once more where it is closed.
fn line(coords: &[f64], closed: bool) -> Vec<Planar> {
    let mut points = coords.as_chunks::<2>().0.to_vec();
    points.extend(closed.then(|| points[0]));
    points
}

/// The number of pairs of edges of two polylines that have a point in common.
fn meetings(a: &[Planar], b: &[Planar]) -> usize {
    let side = |p: Planar, q: Planar, r: Planar| {
        let [u, v] = [minus(q, p), minus(r, p)];
        u[0] * v[1] - u[1] * v[0]
    };
    let boxes_meet = |e: &[Planar], f: &[Planar]| {
        (0..2).all(|c| e[0][c].max(e[1][c]) >= f[0][c].min(f[1][c]) && f[0][c].max(f[1][c]) >= e[0][c].min(e[1][c]))
    };
    let meet = |e: &[Planar], f: &[Planar]| {
        boxes_meet(e, f)
            && side(e[0], e[1], f[0]) * side(e[0], e[1], f[1]) <= 0.0
            && side(f[0], f[1], e[0]) * side(f[0], f[1], e[1]) <= 0.0
    };
    a.windows(2).map(|e| b.windows(2).filter(|f| meet(e, f)).count()).sum()
}

/// The pairs of curves that meet.
fn pairs(batch: &CurveBatch, line_of: impl Fn(usize) -> Vec<Planar>) -> Vec<[usize; 2]> {
    let lines: Vec<Vec<Planar>> = (0..batch.len()).map(line_of).collect();
    let all = (0..lines.len()).flat_map(|b| (0..b).map(move |a| [a, b]));
    all.filter(|[a, b]| meetings(&lines[*a], &lines[*b]) > 0).collect()
}

fn fitted_pairs(batch: &CurveBatch, fit: &Fit) -> Vec<[usize; 2]> {
    let samples = fit.polylines(faircurve::Sampling::PerSpan(SEGMENTS));
    pairs(batch, |i| line(samples.points(i), batch.is_closed(i)))
}

fn data_pairs(batch: &CurveBatch) -> Vec<[usize; 2]> {
    pairs(batch, |i| line(batch.points(i), batch.is_closed(i)))
}

fn bits(fit: &Fit, i: usize) -> Vec<u64> {
    vertices::<2>(fit, i, SEGMENTS).as_flattened().iter().map(|x| x.to_bits()).collect()
}

#[test]
fn curves_whose_points_do_not_meet_do_not_meet() {
    for (name, curves) in [("rings", rings()), ("lanes", lanes())] {
        for energy in [bending(2.0) + tautness(), bending(2.0) + 0.1 * length()] {
            let batch = batch(&curves);
            let fair = Fair { energy, ..apart() };
            let free = fit(&Fair { limits: Limits::default(), ..fair.clone() }, &batch);
            let found = fit(&fair, &batch);
            println!("{name}: {:?} {:#?}", fitted_pairs(&batch, &free), found.reports());
            assert_eq!(data_pairs(&batch), [[0; 2]; 0], "{name}");
            assert!(!fitted_pairs(&batch, &free).is_empty(), "{name}");
            assert_eq!(fitted_pairs(&batch, &found), [[0; 2]; 0], "{name}");
            for (i, report) in found.reports().iter().enumerate() {
                assert_eq!(report.status, CurveStatus::Converged, "{name}: {report:?}");
                let kept = report.limits.unwrap();
                assert!(kept.violation == 0.0 && kept.touching == 0, "{name}: {report:?}");
                // Every point stays where it is.
                let own = vertices::<2>(&found, i, SEGMENTS);
                let points = batch.points(i).as_chunks::<2>().0;
                points.iter().enumerate().for_each(|(k, point)| assert_eq!(own[SEGMENTS * k], *point));
            }
            let held: Vec<_> = found.reports().iter().filter(|report| report.limits.unwrap().active > 0).collect();
            assert!(!held.is_empty() && held.iter().all(|report| report.limits.unwrap().neighbours > 0));
            assert!(held.iter().all(|report| report.limits.unwrap().cost > 0.0), "{held:?}");
        }
    }
}

#[test]
fn curves_that_do_not_cross_keep_their_bits() {
    // The last ones are far, or near and do not cross.
    let mut curves = rings();
    curves.push((vec![[10.0, 0.0], [11.0, 1.0], [12.0, -0.5], [13.0, 0.3]], false));
    curves.push((vec![[10.0, 0.4], [11.0, 1.4], [12.0, -0.1], [13.0, 0.7]], false));
    curves.push(rectangle(4.0, 3));
    let batch = batch(&curves);
    let (free, found) = (fit(&Fair::default(), &batch), fit(&apart(), &batch));
    for i in 3..6 {
        assert_eq!(bits(&free, i), bits(&found, i), "{i}");
        let report = &found.reports()[i];
        let kept = report.limits.unwrap();
        assert_eq!((kept.violation, kept.active, kept.cost, kept.neighbours), (0.0, 0, 0.0, 0), "{i}");
        assert!(kept.stretch >= 1.0 && report.energy == free.reports()[i].energy, "{report:?}");
    }
    assert!((0..3).any(|i| bits(&free, i) != bits(&found, i)));
    // One alone crosses none.
    let alone = batch.select(&[0]);
    assert_eq!(bits(&fit(&apart(), &alone), 0), bits(&free, 0));
}

#[test]
fn the_order_of_the_curves_does_not_count() {
    let batch = batch(&rings());
    let turned = batch.select(&[2, 0, 1]);
    let (found, other) = (fit(&apart(), &batch), fit(&apart(), &turned));
    for (i, k) in [(2, 0), (0, 1), (1, 2)] {
        assert_eq!(bits(&found, i), bits(&other, k), "{i}");
    }
}

#[test]
fn curves_whose_points_meet_are_not_asked_to_keep_apart_and_say_so() {
    // A cross, two that meet at an end, and a pair that keeps apart from both.
    let mut curves = vec![
        (vec![[0.0, 0.0], [1.0, 0.3], [2.0, 0.0]], false),
        (vec![[1.0, -1.0], [1.2, 0.1], [1.0, 1.0]], false),
        (vec![[2.0, 0.0], [3.0, 0.5], [4.0, 0.0]], false),
    ];
    curves.extend(
        rings().into_iter().map(|(points, closed)| (points.iter().map(|[x, y]| [x + 9.0, *y]).collect(), closed)),
    );
    let batch = batch(&curves);
    assert_eq!(data_pairs(&batch), [[0, 1], [0, 2]]);
    let (free, found) = (fit(&Fair::default(), &batch), fit(&apart(), &batch));
    for (i, touching, said) in [
        (0, 2, "curve 0, point 1: from here to the next point its polygon meets that of curve 1 and 1 other curve"),
        (
            1,
            1,
            "curve 1, point 1: from here to the next point its polygon meets that of curve 0: curves whose points do",
        ),
        (2, 1, "curve 2, point 0: from here to the next point its polygon meets that of curve 0"),
    ] {
        let report = &found.reports()[i];
        assert_eq!((report.status, report.limits.unwrap().touching), (CurveStatus::Converged, touching), "{report:?}");
        let message = report.message.as_deref().unwrap();
        assert!(message.contains(said), "{message}");
        assert_eq!(bits(&free, i), bits(&found, i));
    }
    assert_eq!(fitted_pairs(&batch, &found), [[0, 1], [0, 2]]);
}

#[test]
fn within_a_deviation_and_other_limits_curves_keep_apart_too() {
    for (name, curves) in [("rings", rings()), ("lanes", lanes())] {
        let batch = batch(&curves);
        let limits = Limits { corridor: Some(0.6), curvature: Some(12.0), ..apart().limits };
        for fair in [
            Fair { deviation: Some(0.03.into()), ..apart() },
            Fair { limits: limits.clone(), ..apart() },
            Fair { limits, deviation: Some(0.03.into()), ..apart() },
        ] {
            let free = Limits { no_crossing: false, ..fair.limits.clone() };
            let free = fit(&Fair { limits: free, ..fair.clone() }, &batch);
            let found = fit(&fair, &batch);
            let what = format!("{name}, {:?}, {:?}", fair.deviation, fair.limits);
            println!("{what}: {:?} {:#?}", fitted_pairs(&batch, &free), found.reports());
            assert!(!fitted_pairs(&batch, &free).is_empty(), "{what}");
            assert_eq!(fitted_pairs(&batch, &found), [[0; 2]; 0], "{what}");
            for report in found.reports() {
                assert_eq!(report.status, CurveStatus::Converged, "{what}: {report:?}");
                assert!(report.limits.unwrap().violation == 0.0, "{what}: {report:?}");
                assert!(report.max_deviation <= fair.deviation.map_or(0.0, |_| 0.03), "{what}: {report:?}");
            }
        }
    }
}

#[test]
fn pieces_between_corners_keep_apart_from_other_curves() {
    let batch = batch(&rings());
    let cut = Fair { corners: Some(1.0), limits: Limits::default(), energy: bending(2.0) + 0.01 * length(), ..apart() };
    // Only the corners of the rectangles turn so much: their sides are straight.
    let found = fit(&Fair { limits: apart().limits, ..cut.clone() }, &batch);
    assert_eq!(fitted_pairs(&batch, &found), [[0; 2]; 0]);
    for report in found.reports() {
        assert_eq!((report.status, report.limits.unwrap().touching), (CurveStatus::Converged, 0), "{report:?}");
    }
}

#[test]
fn a_tangent_that_leads_across_a_neighbour_is_infeasible_and_names_it() {
    let curves = vec![
        (vec![[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], false),
        (vec![[0.0, 0.02], [0.7, 0.02], [1.0, 0.01], [1.3, 0.02], [2.0, 0.02]], false),
    ];
    // Straight up at the middle of the first.
    let mut tangents = vec![f64::NAN; 16];
    (tangents[2], tangents[3]) = (0.0, 1.0);
    let batch =
        batch(&curves).with_constraints(Constraints { tangents: Some(tangents), ..Constraints::default() }).unwrap();
    // Without these it finds a way in large loops, or turns back at the point.
    let limits = Limits { curvature: Some(5.0), stretch: Some(1.5), ..apart().limits };
    let found = fit(&Fair { limits, ..apart() }, &batch);
    println!("{:#?}", found.reports());
    let report = &found.reports()[0];
    assert_eq!(report.status, CurveStatus::Infeasible, "{report:?}");
    let message = report.message.as_deref().unwrap();
    assert!(message.contains("curve 0, point") && message.contains("curve 1") && message.contains('('), "{message}");
}

#[test]
fn curves_in_space_are_refused() {
    let spatial = one(&[[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [2.0, 0.0, 0.0]], false);
    let refused = apart().fit(&spatial, &Device::cpu()).unwrap_err().to_string();
    assert!(refused.contains("curves in space pass by each other without crossing"), "{refused}");
}
