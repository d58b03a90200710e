//! Curves stay out of obstacles.

use faircurve::discrete::{Fair, Limits, Obstacle};
use faircurve::{CurveBatch, CurveStatus};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::common::*;

fn obstacle(name: &str, corners: &[Planar]) -> Obstacle {
    Obstacle { corners: corners.to_vec(), name: name.into(), curve: None }
}

fn around(obstacles: Vec<Obstacle>) -> Fair {
    Fair { limits: Limits { curvature: Some(1.0), obstacles, ..Limits::default() }, ..Fair::default() }
}

/// Whether two segments have a point in common, by the signs of four areas.
fn meet([a, b]: [Planar; 2], [c, d]: [Planar; 2]) -> bool {
    let side = |p: Planar, q: Planar, r: Planar| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
    side(a, b, c) * side(a, b, d) <= 0.0 && side(c, d, a) * side(c, d, b) <= 0.0
}

/// Whether an edge of a polyline meets an edge of a polygon.
fn meets(line: &[Planar], corners: &[Planar]) -> bool {
    let edge = |k: usize| [corners[k], corners[(k + 1) % corners.len()]];
    line.windows(2).any(|pair| (0..corners.len()).any(|k| meet([pair[0], pair[1]], edge(k))))
}

#[test]
fn curves_go_round_obstacles_and_no_edge_meets_one() {
    let seed = 4;
    println!("seed {seed}");
    let mut rng = StdRng::seed_from_u64(seed);
    // Stars with notches, in cells of 20 with room between them.
    let mut obstacles = Vec::new();
    for cell in 0..9 {
        let middle = [20.0 * f64::from(cell % 3), 20.0 * f64::from(cell / 3)];
        let n = [3, 4, 7, 9][rng.random_range(0..4)];
        let corner = |k: i32, rng: &mut StdRng| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(n)).sin_cos();
            let radius = rng.random_range(2.0..7.0);
            [middle[0] + radius * cos, middle[1] + radius * sin]
        };
        let corners: Vec<Planar> = (0..n).map(|k| corner(k, &mut rng)).collect();
        obstacles.push(obstacle(&cell.to_string(), &corners));
    }
    // Points on the lines between the cells.
    let lists: Vec<Vec<Planar>> = (0..60)
        .map(|_| {
            let mut point = || {
                let [line, along] = [10.0 + 20.0 * f64::from(rng.random_range(-1..3)), rng.random_range(-10.0..50.0)];
                if rng.random_bool(0.5) { [line, along] } else { [along, line] }
            };
            (0..4).map(|_| point()).collect()
        })
        .collect();
    let batch = CurveBatch::from_slices(&lists.iter().map(Vec::as_slice).collect::<Vec<_>>()).unwrap();
    let fair = around(obstacles.clone());
    let fit = fit(&fair, &batch);
    let (mut converged, mut crossed) = (0, 0);
    for (i, report) in fit.reports().iter().enumerate() {
        let own = vertices::<2>(&fit, i, 16);
        crossed += usize::from(obstacles.iter().any(|obstacle| meets(&lists[i], &obstacle.corners)));
        if report.status == CurveStatus::Converged {
            converged += 1;
            assert!(obstacles.iter().all(|obstacle| !meets(&own, &obstacle.corners)), "{i}: {report:?}");
        } else {
            assert!(report.message.is_some(), "{i}: {report:?}");
        }
    }
    println!("{converged} of {} converged, {crossed} polygons meet obstacles", batch.len());
    assert!(crossed >= 30 && converged >= 50, "{converged} {crossed}");
    // A curve has its bits alone, and with its points and obstacles in another order.
    let alone = crate::common::fit(
        &Fair { limits: Limits { obstacles: obstacles.into_iter().rev().collect(), ..fair.limits }, ..fair },
        &batch.select(&[7]),
    );
    assert_eq!(vertices::<2>(&alone, 0, 16), vertices::<2>(&fit, 7, 16));
}

#[test]
fn obstacles_are_for_curves_of_a_name_and_have_a_clearance() {
    let points = [[0.0, 0.0], [20.0, 0.1], [30.0, 0.0]];
    let square = [[8.0, -1.0], [10.0, -1.0], [10.0, 2.0], [8.0, 2.0]];
    let batch = CurveBatch::from_slices(&[&points[..], &points]).unwrap();
    let own = Obstacle { curve: Some("1".into()), ..obstacle("square", &square) };
    let free = fit(&around(vec![]), &batch);
    let both = fit(&around(vec![own]), &batch);
    assert_eq!(vertices::<2>(&both, 0, 16), vertices::<2>(&free, 0, 16));
    let below = |fit: &faircurve::Fit| vertices::<2>(fit, 1, 16).iter().map(|v| v[1]).fold(f64::INFINITY, f64::min);
    // The shorter way is below, where the curve touches two corners.
    assert!(below(&both) < -1.0 && below(&both) > -1.5, "{}", below(&both));
    let fair = around(vec![obstacle("square", &square)]);
    let clear = fit(&Fair { limits: fair.limits.with_clearance(0.5), ..fair }, &batch);
    let near = vertices::<2>(&clear, 1, 16);
    let away = |v: &Planar| {
        let off = [0, 1].map(|c| (square[0][c] - v[c]).max(v[c] - square[2][c]).max(0.0));
        off[0].hypot(off[1])
    };
    let least = near.iter().map(away).fold(f64::INFINITY, f64::min);
    assert!((0.5..0.6).contains(&least), "{least}");
}

#[test]
fn what_lies_in_an_obstacle_or_cannot_pass_is_named() {
    let square = [[8.0, -1.0], [10.0, -1.0], [10.0, 2.0], [8.0, 2.0]];
    let status = |points: &[Planar], fair: &Fair| {
        let report = fitted::<2>(fair, &one(points, false), 16).1;
        (report.status, report.message.unwrap_or_default())
    };
    let (found, message) = status(&[[0.0, 0.0], [9.0, 0.0], [20.0, 0.0]], &around(vec![obstacle("house", &square)]));
    assert_eq!(found, CurveStatus::Invalid);
    assert!(message.contains("point 1: it lies in obstacle house"), "{message}");
    // No turn of radius 9 leads round a wall next to the start.
    let wall = [[1.0, -3.0], [1.5, -3.0], [1.5, 3.0], [1.0, 3.0]];
    let mut fair = around(vec![obstacle("wall", &wall)]);
    fair.limits.curvature = Some(1.0 / 9.0);
    let (found, message) = status(&[[0.0, 0.0], [4.0, 0.0]], &fair);
    assert_eq!(found, CurveStatus::Infeasible, "{message}");
    assert!(message.contains("obstacle wall") || message.contains("radius"), "{message}");
    let refused = |obstacle: Obstacle, points: &CurveBatch| {
        around(vec![obstacle]).fit(points, &faircurve::Device::cpu()).unwrap_err().to_string()
    };
    let planar = one(&[[0.0, 0.0], [4.0, 0.0]], false);
    assert!(refused(obstacle("line", &wall[..2]), &planar).contains("obstacle line needs three corners or more"));
    let space = one(&[[0.0, 0.0, 0.0], [4.0, 0.0, 1.0]], false);
    assert!(refused(obstacle("wall", &wall), &space).contains("only planar curves stay out of it"));
}
