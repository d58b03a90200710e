//! Planar curves in bending and tautness that cross themselves where their points do not are drawn anew until they do not.

use faircurve::discrete::Fair;
use faircurve::{CurveStatus, Device, Sampling, io};

use crate::common::*;

/// Whether two edges of a polygon cross that are no neighbours.
fn crosses(points: &[Planar], closed: bool) -> bool {
    let count = points.len();
    let edges = count - usize::from(!closed);
    let edge = |j: usize| [points[j], points[(j + 1) % count]];
    let side = |[a, b]: [Planar; 2], c: Planar| {
        let ([ux, uy], [vx, vy]) = (minus(b, a), minus(c, a));
        ux * vy - uy * vx
    };
    // Boxes of edges on one line do not meet, whatever rounding says of sides.
    let meet = |[a, b]: [Planar; 2], [p, q]: [Planar; 2]| {
        (0..2).all(|c| a[c].max(b[c]) >= p[c].min(q[c]) && p[c].max(q[c]) >= a[c].min(b[c]))
    };
    let cross = |e: [Planar; 2], f: [Planar; 2]| {
        meet(e, f) && side(e, f[0]) * side(e, f[1]) < 0.0 && side(f, e[0]) * side(f, e[1]) < 0.0
    };
    (0..edges).any(|j| (j + 2..edges - usize::from(closed && j == 0)).any(|k| cross(edge(j), edge(k))))
}

#[test]
fn a_ring_that_crosses_with_the_edges_asked_for_has_twice_the_edges() {
    let world = io::read(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/data/world-110m.topojson")).unwrap();
    // Western Sahara: two of its borders run beside each other, at a fiftieth of their length.
    let (i, other) = (3, 7);
    let batch = world.select(&[other, i]);
    let (fit, samples) = Fair::default().fit_sampled(&batch, Sampling::PerSpan(16), &Device::cpu()).unwrap();
    let points = batch.points(1).as_chunks::<2>().0;
    assert!(batch.is_closed(1) && !crosses(points, true), "{points:?}");
    let report = &fit.reports()[1];
    assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
    let message = report.message.as_deref().unwrap();
    assert!(
        message.contains("crossed itself where its points do not") && message.contains("twice the edges"),
        "{message}"
    );
    let sampled = samples.points(1).as_chunks::<2>().0;
    assert_eq!(sampled.len(), 16 * points.len());
    points.iter().enumerate().for_each(|(k, point)| assert_eq!(sampled[16 * k], *point));
    let fine = fit.polylines(Sampling::PerSpan(32));
    assert!(!crosses(fine.points(1).as_chunks::<2>().0, true) && !crosses(sampled, true));
    // Its neighbour keeps its bits.
    let alone = Fair::default().fit_sampled(&world.select(&[other]), Sampling::PerSpan(16), &Device::cpu()).unwrap().1;
    assert_eq!(alone.points(0), samples.points(0));
}

#[test]
fn no_border_crosses_itself_where_its_points_do_not() {
    let batch = io::read(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/data/countries-110m.geojson")).unwrap();
    let (fit, samples) = Fair::default().fit_sampled(&batch, Sampling::PerSpan(16), &Device::cpu()).unwrap();
    let converged = fit.reports().iter().filter(|report| report.status == CurveStatus::Converged).count();
    let of = |batch: &faircurve::CurveBatch, i: usize| crosses(batch.points(i).as_chunks::<2>().0, batch.is_closed(i));
    let crossing: Vec<usize> = (0..batch.len()).filter(|&i| of(&samples, i) && !of(&batch, i)).collect();
    // One is a single point.
    assert_eq!((converged, crossing), (594, vec![]));
}
