//! The programme of the sparse Laplacian rules, asked about curves: it finds the rule of natural
//! cubic splines, and linear interpolation.

use faircurve::laplacian::Reproduces;
use faircurve::spline::uniform::subdivide;
use faircurve::{CurveBatch, Device};
use faircurve_papers::programmes::{Class, Energy, Programme, Unknown};

use crate::programmes::optimum;

/// Interior and end masks, and the larger of their maxima.
fn found(programme: &Programme) -> (Vec<f64>, f64) {
    let (at_interior, mut entries) = optimum(programme, Class::Interior, &[]);
    let (at_end, ends) = optimum(programme, Class::Border, &entries);
    entries.extend(ends);
    assert!(programme.unknowns(Class::Corner).is_empty());
    (entries, at_interior.max(at_end))
}

#[test]
fn the_programme_of_the_bending_energy_gives_the_rule_of_natural_cubic_splines() {
    let programme = Programme::new(Energy::CurveBending, 2, Reproduces::Linear);
    let (entries, maximum) = found(&programme);
    assert!(maximum < 1e-10, "{maximum}");
    let unknowns = [Class::Interior, Class::Border].into_iter().flat_map(|class| programme.unknowns(class));
    let unknowns: Vec<Unknown> = unknowns.collect();
    assert_eq!(unknowns.len(), entries.len());

    // S as spline subdivision has it, column by column, against 3/4, 1/2, 1/8, and the end that
    // stays.
    let (count, middle) = (12, 6);
    let mut coords = vec![0.0; 2 * count * count];
    (0..count).for_each(|k| coords[2 * (k * count + k)] = 1.0);
    let offsets = (0..=count).map(|k| k * count).collect();
    let units = CurveBatch::from_ragged(2, coords, offsets).unwrap().closed(false);
    let columns = subdivide(&units, 1, &Device::cpu()).unwrap();
    let spline = |fine: usize, coarse: usize| columns.points(coarse)[2 * fine];
    for (unknown, entry) in unknowns.into_iter().zip(&entries) {
        let (expected, known) = match unknown {
            Unknown::Interior { far, near: 0 } => (spline(2 * middle + far, middle), [0.75, 0.5, 0.125][far]),
            Unknown::Border { row: 0, from_border, along: 0 } => {
                (spline(from_border, 0), [1.0, 0.5, 0.125][from_border])
            }
            Unknown::Border { row: 1, from_border, along: 0 } => {
                (spline(from_border, 1), [0.0, 0.5, 0.75, 0.5, 0.125][from_border])
            }
            other => panic!("{other:?} of a curve"),
        };
        assert_eq!(expected, known, "{unknown:?}");
        assert!((entry - expected).abs() < 1e-9, "{unknown:?}: {entry}, spline {expected}");
    }
}

#[test]
fn with_less_support_the_bending_energy_cannot_be_right_in_every_row() {
    // Only linear interpolation has support 3 and keeps lines.
    let programme = Programme::new(Energy::CurveBending, 1, Reproduces::Linear);
    let (entries, maximum) = found(&programme);
    assert!((entries[0] - 1.0).abs() < 1e-9 && (entries[1] - 0.5).abs() < 1e-9, "{entries:?}");
    assert!(maximum > 0.5, "{maximum}");
}

#[test]
fn the_programme_of_the_dirichlet_energy_of_curves_gives_linear_interpolation() {
    let programme = Programme::new(Energy::CurveDirichlet, 1, Reproduces::Constants);
    let (entries, maximum) = found(&programme);
    assert!(maximum < 1e-10, "{maximum}");
    // Inside 1 and ½ beside it; at the end likewise.
    for (entry, expected) in entries.iter().zip([1.0, 0.5, 1.0, 0.5]) {
        assert!((entry - expected).abs() < 1e-9, "{entries:?}");
    }
    assert_eq!(entries.len(), 4);
}
