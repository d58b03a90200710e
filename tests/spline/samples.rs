//! Samples of splines: the curve itself, and the same however they are taken.

use faircurve::{CurveBatch, Sampling};

use crate::oracle::{fit, random};

#[test]
fn samples_in_the_callers_memory_are_those_of_polylines() {
    let (many, one) = (random(2, 40, 23), [[0.3, 0.7]]);
    let repeated = [[0.0, 0.0], [1.0, 2.0], [1.0, 2.0], [1.0, 2.0], [3.0, 1.0], [3.0, 1.0]];
    let broken = [[0.0, 0.0], [f64::NAN, 2.0], [3.0, 1.0]];
    // The steps of the parameter have no reciprocal.
    let tiny = [[0.0, 0.0], [1e-309, 2e-309], [3e-309, 1e-309]];
    let nasty = CurveBatch::from_slices(&[&repeated[..], &broken, &one, &[], &tiny, &repeated]).unwrap();
    let nasty = nasty.closed_each(vec![false, false, false, false, false, true]).unwrap();
    for batch in [many, random(3, 40, 29), nasty, CurveBatch::from_ragged(2, vec![], vec![0]).unwrap()] {
        let fit = fit(&batch);
        for sampling in
            [Sampling::PerSpan(1), Sampling::PerSpan(7), Sampling::Count(0), Sampling::Count(1), Sampling::Count(81)]
        {
            let wanted = fit.polylines(sampling);
            assert_eq!(fit.sample_offsets(sampling).unwrap(), wanted.offsets());
            let mut coords = vec![f64::INFINITY; wanted.coords().len()];
            fit.sample_into(sampling, &mut coords);
            let bits = |coords: &[f64]| coords.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&coords), bits(wanted.coords()), "{sampling:?}");
        }
        let by_length = Sampling::Points(9);
        assert_eq!(fit.sample_offsets(by_length), None);
        let mut coords = vec![f64::INFINITY; fit.polylines(by_length).coords().len()];
        fit.sample_into(by_length, &mut coords);
        assert!(coords.iter().all(|x| *x != f64::INFINITY));
    }
}

#[test]
fn samples_are_the_curve_and_data_points_keep_their_bits() {
    for dimension in [2, 3] {
        let batch = random(dimension, 50, 13);
        let fit = fit(&batch);
        for sampling in [
            Sampling::PerSpan(8),
            Sampling::PerSpan(1),
            Sampling::PerSpan(5),
            Sampling::Count(333),
            Sampling::Count(80),
            Sampling::Count(0),
            Sampling::Count(1),
            Sampling::Count(2),
            Sampling::Spacing(0.1),
        ] {
            let out = fit.polylines(sampling);
            assert_eq!((out.len(), out.dimension()), (50, dimension));
            for i in 0..50 {
                let curve = fit.curve(i);
                let sites = curve.sites(sampling);
                assert_eq!(out.count(i), sites.len(), "{sampling:?}");
                assert_eq!(out.is_closed(i), batch.is_closed(i));
                let t = out.parameters(i).unwrap();
                assert!(t.windows(2).all(|pair| pair[0] < pair[1]));
                let knots = curve.knots();
                for (k, &(span, u)) in sites.iter().enumerate() {
                    let point = &out.points(i)[k * dimension..(k + 1) * dimension];
                    let wanted = curve.jet(span, u).point.to_array();
                    let at = knots[span] + u * (knots[span + 1] - knots[span]);
                    assert!((t[k] - at).abs() <= 1e-14 * knots[knots.len() - 1]);
                    for c in 0..dimension {
                        assert!((point[c] - wanted[c]).abs() < 1e-12, "{sampling:?}: {} for {}", point[c], wanted[c]);
                    }
                }
                if let Sampling::PerSpan(n) = sampling {
                    // Closed curves of few spans are divided further, into three samples at least.
                    let step = (out.count(i) - usize::from(!batch.is_closed(i))) / batch.spans(i);
                    assert!(step == n || (batch.is_closed(i) && n * batch.spans(i) < 4), "{step} samples a span");
                    for k in 0..batch.count(i) {
                        let found = &out.points(i)[k * step * dimension..][..dimension];
                        let bits = |point: &[f64]| point.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
                        assert_eq!(bits(found), bits(&batch.points(i)[k * dimension..][..dimension]));
                    }
                }
                if batch.is_closed(i) {
                    let whole = t[t.len() - 1] + out.closing_span(i).unwrap();
                    assert!((whole - knots[knots.len() - 1]).abs() <= 1e-14 * whole);
                }
            }
        }
    }
}
