//! Points, tangents and curvatures along smooth connection segments.

use std::f64::consts::PI;

use faircurve::scf::Segment;

use crate::universal::gauss;

/// Segments of every kind: with and without inflections, flat, steep.
fn samples() -> Vec<Segment> {
    let angles = [
        [0.5, -0.7],
        [0.5, -0.5],
        [0.7, 0.4],
        [-0.3, -0.3],
        [0.0, 1.0],
        [1.2, -1.1],
        [0.02, -0.01],
        [0.02, 0.015],
        [1e-5, 2e-5],
        [-0.9, 0.1],
    ];
    let exponents = [1.2, 1.5, 2.0, 3.0, 4.0, 20.0];
    exponents.iter().flat_map(|&nu| angles.map(|angles| Segment::between(2.5, angles, nu).unwrap())).collect()
}

fn apart(p: [f64; 2], q: [f64; 2]) -> f64 {
    (p[0] - q[0]).hypot(p[1] - q[1])
}

#[test]
fn points_at_arc_lengths_have_the_tangents_and_curvatures_that_lead_there() {
    let rule = gauss(0.0);
    for segment in samples() {
        let (nu, length) = (segment.exponent(), segment.length());
        let case = format!("ν = {nu}, cost {}", segment.cost());
        assert_eq!(segment.at(-1.0), segment.at(0.0));
        assert_eq!(segment.at(2.0 * length), segment.at(length));
        assert!(
            apart(segment.at(0.0).point, [0.0, 0.0]) == 0.0 && apart(segment.at(length).point, [2.5, 0.0]) <= 1e-14,
            "{case}"
        );
        let ends = [segment.at(0.0).curvature, segment.at(length).curvature];
        assert!((0..2).all(|k| (ends[k] - segment.curvatures()[k]).abs() <= 1e-12 * ends[k].abs()), "{case}");
        const PANELS: usize = 256;
        let step = length / PANELS as f64;
        let (mut point, mut cost) = ([0.0; 2], 0.0);
        let mut last = segment.at(0.0);
        let most = (0..=64)
            .map(|k| segment.at(length * f64::from(k) / 64.0))
            .map(|site| site.curvature.abs())
            .fold(0.0, f64::max);
        for panel in 0..PANELS {
            let mut turning = 0.0;
            for &[x, weight] in &rule {
                let site = segment.at((panel as f64 + x) * step);
                let (sine, cosine) = site.angle.sin_cos();
                point = [point[0] + weight * step * cosine, point[1] + weight * step * sine];
                turning += weight * step * site.curvature;
                cost += weight * step * site.curvature.abs().powf(nu);
            }
            let site = segment.at((panel + 1) as f64 * step);
            // Of the quadrature, where an inflection lies inside a panel: some κ step²/24².
            assert!(apart(site.point, point) <= 1e-7 * length, "{case}, panel {panel}: {:?} {point:?}", site.point);
            // At an inflection, here or in the panels beside, the curvature is a root.
            let beside = [panel as f64 - 1.0, panel as f64 + 2.0].map(|k| segment.at(k * step).curvature);
            let allowed = if beside[0] * beside[1] > 0.0 && site.curvature * last.curvature > 0.0 { 1e-9 } else { 0.1 };
            assert!(
                (site.angle - last.angle - turning).abs() <= allowed * most * step,
                "{case}, panel {panel}: {} {turning}",
                site.angle - last.angle
            );
            last = site;
        }
        assert!((cost / segment.cost() - 1.0).abs() <= 1e-6, "{case}: {cost}");
    }
}

#[test]
fn the_curvature_to_the_power_nu_is_a_component_of_the_tangent() {
    for segment in samples() {
        let (nu, length, force) = (segment.exponent(), segment.length(), segment.force_direction());
        let sites: Vec<_> = (0..=100).map(|k| segment.at(length * f64::from(k) / 100.0)).collect();
        // The size from the site of the largest component.
        let component = |k: usize| (sites[k].angle - force).cos();
        let most = (0..sites.len()).max_by(|&i, &j| component(i).total_cmp(&component(j))).unwrap();
        let c = sites[most].curvature.abs().powf(nu) / component(most);
        for (k, site) in sites.iter().enumerate() {
            let error = (site.curvature.abs().powf(nu) - c * component(k)).abs();
            // Components good to the rounding of angles about π/2.
            assert!(
                error <= c * (1e-11 * component(most) + 4.0 * f64::EPSILON),
                "ν = {nu}, {k}: {error:.1e} of {c:.1e}"
            );
        }
        let inflected = sites.windows(2).any(|pair| pair[0].curvature * pair[1].curvature < 0.0);
        assert_eq!(inflected, segment.has_inflection(), "ν = {nu}");
    }
}

#[test]
fn sites_of_an_angle_are_all_there_are() {
    for segment in samples() {
        let (nu, length) = (segment.exponent(), segment.length());
        let sites: Vec<_> = (0..=200).map(|k| segment.at(length * f64::from(k) / 200.0)).collect();
        for site in sites.iter().skip(1).take(199) {
            let all = segment.at_angle(site.angle);
            let crossings = sites
                .windows(2)
                .filter(|pair| (pair[0].angle - site.angle) * (pair[1].angle - site.angle) < 0.0)
                .count();
            let touching = sites.iter().filter(|other| other.angle == site.angle).count();
            assert!(all.len() >= crossings.max(1) && all.len() <= 2, "ν = {nu}: {} {crossings} {touching}", all.len());
            assert!(all.iter().all(|found| (found.angle - site.angle).abs() <= 4.0 * f64::EPSILON * PI), "ν = {nu}");
            let nearest = all.iter().map(|found| apart(found.point, site.point)).fold(f64::INFINITY, f64::min);
            let allowed = 1e-12 * length + 64.0 * f64::EPSILON / site.curvature.abs();
            assert!(nearest <= allowed, "ν = {nu}: {nearest:.1e} from {site:?}");
        }
        let (least, most) = sites.iter().fold((PI, -PI), |(l, m), site| (site.angle.min(l), site.angle.max(m)));
        let beyond = [least - 0.1, most + 0.1 + 0.01 * (most - least)];
        assert!(beyond.iter().all(|&angle| segment.at_angle(angle).is_empty()), "ν = {nu}");
    }
}

/// Distance from a point to the nearest edge of a polyline.
fn distance(point: [f64; 2], polyline: &[[f64; 2]]) -> f64 {
    let edge = |pair: &[[f64; 2]]| {
        let (e, p) =
            ([pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]], [point[0] - pair[0][0], point[1] - pair[0][1]]);
        let t = ((p[0] * e[0] + p[1] * e[1]) / (e[0] * e[0] + e[1] * e[1])).clamp(0.0, 1.0);
        apart(p, e.map(|x| t * x))
    };
    polyline.windows(2).map(edge).fold(f64::INFINITY, f64::min)
}

#[test]
fn polylines_and_beziers_keep_within_their_tolerance() {
    for segment in samples() {
        let (nu, length) = (segment.exponent(), segment.length());
        const FINE: usize = 4000;
        let fine: Vec<[f64; 2]> = (0..=FINE).map(|k| segment.at(length * k as f64 / FINE as f64).point).collect();
        let most = (0..=FINE).map(|k| segment.at(length * k as f64 / FINE as f64).curvature.abs()).fold(0.0, f64::max);
        // How far the samples' own polyline may be.
        let own = most * (length / FINE as f64).powi(2) / 8.0;
        for tolerance in [1e-2, 1e-4] {
            let polyline = segment.polyline(tolerance);
            assert_eq!(polyline[0], [0.0, 0.0]);
            assert!(apart(polyline[polyline.len() - 1], [2.5, 0.0]) <= 1e-14);
            let worst = fine.iter().step_by(7).map(|&p| distance(p, &polyline)).fold(0.0, f64::max);
            assert!(worst <= tolerance, "ν = {nu}, {tolerance}: {worst}");
            let pieces = segment.beziers(tolerance);
            assert_eq!(pieces[0][0], [0.0, 0.0]);
            assert!(apart(pieces[pieces.len() - 1][3], [2.5, 0.0]) <= 1e-14);
            let direction = |from: [f64; 2], to: [f64; 2]| (to[1] - from[1]).atan2(to[0] - from[0]);
            for pair in pieces.windows(2) {
                assert_eq!(pair[0][3], pair[1][0]);
                let turn = direction(pair[0][2], pair[0][3]) - direction(pair[1][0], pair[1][1]);
                assert!(turn.abs() <= 1e-10, "ν = {nu}: {turn:.1e}");
            }
            let ends = [
                direction(pieces[0][0], pieces[0][1]),
                direction(pieces[pieces.len() - 1][2], pieces[pieces.len() - 1][3]),
            ];
            let wanted = [segment.at(0.0).angle, segment.at(length).angle];
            assert!((0..2).all(|k| (ends[k] - wanted[k]).abs() <= 1e-10), "ν = {nu}: {ends:?} {wanted:?}");
            let mut worst = 0.0_f64;
            for [p0, p1, p2, p3] in &pieces {
                for k in 0..=10 {
                    let (u, v) = (0.1 * f64::from(k), 1.0 - 0.1 * f64::from(k));
                    let weights = [v * v * v, 3.0 * v * v * u, 3.0 * v * u * u, u * u * u];
                    let point = [0, 1]
                        .map(|c| weights[0] * p0[c] + weights[1] * p1[c] + weights[2] * p2[c] + weights[3] * p3[c]);
                    worst = worst.max(distance(point, &fine));
                }
            }
            assert!(worst <= tolerance + own, "ν = {nu}, {tolerance}: {worst}");
        }
    }
}
