//! What is written of fair curves between their vertices is what was asked for, and what is long says so.

use faircurve::discrete::{Fair, Limits, Region, Segments, bending, length, variation};
use faircurve::{CurveBatch, CurveStatus, Device, Fit, Sampling};

use crate::common::*;
use crate::rough::Family;

fn limited(limits: Limits) -> Fair {
    Fair { energy: bending(2.0) + 0.2 * length(), limits, ..Fair::default() }
}

fn wavy(curves: usize) -> CurveBatch {
    Family { dimension: 2, closed: false, points: 6, sigma: 0.5 }.batch(curves, 7)
}

/// The curves that keep what was asked of them, at points that lie close.
fn dense(fit: &Fit) -> Vec<Vec<Planar>> {
    let samples = fit.polylines(Sampling::Points(4001));
    let kept = (0..fit.len()).filter(|&i| fit.reports()[i].status == CurveStatus::Converged);
    kept.map(|i| samples.points(i).as_chunks::<2>().0.to_vec()).collect()
}

/// The largest curvature of a dense polygon.
fn curvature(points: &[Planar]) -> f64 {
    let turn = |w: &[Planar]| {
        let [a, b] = [minus(w[1], w[0]), minus(w[2], w[1])];
        2.0 * norm(minus(unit(b), unit(a))) / (norm(a) + norm(b))
    };
    points.windows(3).map(turn).fold(0.0, f64::max)
}

#[test]
fn curvatures_between_vertices_are_bounded_too() {
    // 3.81 and 1.52 with tangents halfway between edges of unequal lengths.
    for (bound, most) in [(1.5, 1.2), (1.0, 1.2)] {
        let fit = fit(&limited(Limits { curvature: Some(bound), ..Limits::default() }), &wavy(40));
        let mut found: Vec<f64> = dense(&fit).iter().map(|points| curvature(points) / bound).collect();
        found.sort_unstable_by(f64::total_cmp);
        println!("{} of 40 converged, largest {:?}", found.len(), found.last());
        assert!(found.len() >= 10 && found[found.len() - 1] < most && found[found.len() / 2] < 1.05, "{found:?}");
    }
}

#[test]
fn curvatures_of_finer_curves_come_nearer_to_their_bound() {
    let batch = one(&[[0.0, 0.0], [0.4, 0.1], [3.0, 0.0]], false);
    let excess = |n: usize| {
        let limits = Limits { curvature: Some(0.4), ..Limits::default() };
        let fit = fit(&Fair { segments: Segments::PerSpan(n), ..limited(limits) }, &batch);
        assert_eq!(fit.reports()[0].status, CurveStatus::Converged, "{:?}", fit.reports()[0]);
        curvature(&dense(&fit)[0]) / 0.4 - 1.0
    };
    let found = [16, 64].map(excess);
    assert!(found[0] < 0.05 && found[1] < 0.5 * found[0].max(0.002), "{found:?}");
}

#[test]
fn a_curve_does_not_go_back_between_vertices() {
    for (axes, batch) in [
        (&[0][..], wavy(40)),
        (&[1], wavy(40)),
        (&[0, 1], wavy(40)),
        (&[1], one(&[[0.0, -2.3], [1.9, 2.0], [3.2, -0.9], [4.0, 0.2]], false)),
        (&[1], one(&[[0.0, 0.0], [1.0, 2.0], [3.0, 1.0], [1.0, -1.0]], true)),
        (&[1, 0], one(&[[0.0, 0.0], [1.0, 2.0], [3.0, 1.0], [2.0, -1.0]], true)),
        // A step up.
        (&[0, 1], one(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 5.0], [4.0, 5.0], [5.0, 5.0]], false)),
    ] {
        let direction = |axis: usize| std::array::from_fn(|c| f64::from(u8::from(c == axis)));
        let limits = Limits { monotone: axes.iter().map(|&axis| direction(axis)).collect(), ..Limits::default() };
        let fit = fit(&limited(limits), &batch);
        let n = 500;
        let samples = fit.polylines(Sampling::PerSpan(n));
        let mut converged = 0;
        for i in (0..fit.len()).filter(|&i| fit.reports()[i].status == CurveStatus::Converged) {
            converged += 1;
            let own = samples.points(i).as_chunks::<2>().0;
            let points = batch.points(i).as_chunks::<2>().0;
            for k in 0..points.len() - 1 {
                for &axis in axes {
                    let rise = points[k + 1][axis] - points[k][axis];
                    let way = if rise == 0.0 { 0.0 } else { rise.signum() };
                    let back = own[n * k..=n * (k + 1)].windows(2).map(|w| -way * (w[1][axis] - w[0][axis]));
                    let back = back.fold(0.0, f64::max);
                    // That of the limit at vertices.
                    assert!(back < 1e-6, "curve {i}, span {k}: {back:e}");
                }
            }
        }
        println!("along {axes:?}: {converged} of {} converged", batch.len());
        assert!(2 * converged > batch.len());
    }
}

#[test]
fn no_edge_cuts_a_disc_to_stay_out_of_however_small() {
    let discs = |all: &[[f64; 3]]| {
        let regions = all.iter().map(|&[x, y, radius]| Region::Outside { center: [x, y, 0.0], radius }).collect();
        Limits { regions, ..Limits::default() }
    };
    let cases = [
        (vec![[0.0, 0.19], [6.0, -0.26]], vec![[3.46, -0.49, 0.494], [4.25, 0.0, 0.11], [5.26, 0.15, 0.071]]),
        (
            vec![[0.0, -0.05], [6.0, 0.16]],
            vec![
                [1.82, 0.14, 0.038],
                [5.36, -0.03, 0.081],
                [3.76, 0.27, 0.195],
                [1.97, -0.11, 0.031],
                [3.05, -0.11, 0.274],
                [5.0, 0.07, 0.05],
            ],
        ),
    ];
    for (points, all) in cases {
        let fair = Fair { limits: discs(&all), ..Fair::default() };
        let (vertices, report) = fitted::<2>(&fair, &one(&points, false), 16);
        assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
        for [x, y, radius] in all {
            let nearest = vertices.windows(2).map(|w| {
                let (edge, away) = (minus(w[1], w[0]), minus([x, y], w[0]));
                let t = (dot(edge, away) / dot(edge, edge)).clamp(0.0, 1.0);
                norm(minus(away, edge.map(|e| t * e)))
            });
            let nearest = nearest.fold(f64::INFINITY, f64::min);
            assert!(nearest >= radius * (1.0 - 1e-6), "({x}, {y}): {nearest} of {radius}");
        }
    }
}

#[test]
fn variation_with_a_tangent_converges_on_finer_edges_too() {
    let points = [[0.0, 0.0], [1.0, 0.3], [2.0, 0.0], [3.0, -0.3], [4.0, 0.0]];
    let nan = [f64::NAN; 2];
    let tangents = [nan, nan, [1.0, 0.2], nan, nan].concat();
    let constraints = faircurve::Constraints { tangents: Some(tangents), ..Default::default() };
    let batch = one(&points, false).with_constraints(constraints).unwrap();
    let energy = |n: usize| {
        let fair = Fair { energy: variation() + 0.5 * length(), segments: Segments::PerSpan(n), ..Fair::default() };
        let report = fair.fit(&batch, &Device::cpu()).unwrap().reports()[0].clone();
        assert_eq!(report.status, CurveStatus::Converged, "{n}: {report:?}");
        report.energy
    };
    // By h².
    let found = [16, 32, 64, 128].map(energy);
    let limit = found[3] + (found[3] - found[2]) / 3.0;
    println!("{found:?}, {limit}");
    let ratios = [0, 1].map(|k| (found[k + 1] - found[k]) / (found[k + 2] - found[k + 1]));
    assert!(ratios.iter().all(|ratio| (3.5..4.5).contains(ratio)), "{found:?}, {limit}");
}

#[test]
fn curves_with_loops_say_how_many_times_as_long_they_are() {
    let batch = Family { dimension: 2, closed: false, points: 5, sigma: 3.0 }.batch(60, 11);
    let fair = Fair { energy: bending(2.0) + 0.01 * length(), ..Fair::default() };
    let fit = fit(&fair, &batch);
    let mut looping = 0;
    for (i, report) in fit.reports().iter().enumerate().filter(|(_, report)| report.status.is_usable()) {
        let points = batch.points(i).as_chunks::<2>().0;
        let times = length_of(&vertices::<2>(&fit, i, 16), false) / length_of(points, false);
        assert_eq!(report.loops.is_some(), times > 2.0, "{times} {report:?}");
        if let Some(loops) = report.loops {
            looping += 1;
            assert!((loops - times).abs() < 1e-9 && report.message.as_ref().unwrap().contains("times as long"));
        }
    }
    assert!(looping > 0 && fair.notes(fit.reports())[0].starts_with(&format!("{looping} of 60 curves have loops")));
}
