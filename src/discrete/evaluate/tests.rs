//! Evaluations of batches, and their refusals.

use super::super::{attachment, bending, length, tension, torsion, variation};
use super::*;
use crate::ragged;

#[test]
fn a_curve_of_a_batch_has_the_bits_of_the_curve_alone() {
    let counts = [9, 9, 1, 9, 0, 9, 17, 9, 9, 2, 9, 9, 9, 9, 17, 9, 9, 9, 3, 9, 9, 9];
    for (dimension, energy) in [
        (2, bending(2.0)),
        (2, 0.7 * bending(2.5) + 0.3 * tension() + 2.0 * attachment()),
        (3, length() + bending(3.0) + variation() + torsion()),
    ] {
        let offsets = ragged::offsets(counts);
        let wave = |k: usize| (k as f64 * 0.618).fract() + (k / dimension) as f64 * 0.3;
        let mut coords: Vec<f64> = (0..dimension * offsets[counts.len()]).map(wave).collect();
        // Two curves without a value, beside others in their lanes.
        coords[dimension * offsets[3]] = f64::NAN;
        let repeated = dimension * (offsets[7] + 2);
        coords.copy_within(repeated..repeated + dimension, repeated + dimension);
        let closed = (0..counts.len()).map(|i| i % 3 == 0 && counts[i] > 2).collect();
        let batch = CurveBatch::from_ragged(dimension, coords, offsets).unwrap().closed_each(closed).unwrap();
        let targets = batch.with_points(batch.coords().iter().map(|x| x.sin()).collect(), batch.offsets().to_vec());
        let options = Evaluate { targets: Some(&targets), ..Evaluate::default() };
        let together = energy.evaluate(&batch, options, &Device::cpu()).unwrap();
        let bits = |found: &Evaluation| -> Vec<u64> {
            [found.value].iter().chain(&found.gradient).map(|x| x.to_bits()).collect()
        };
        for (i, found) in together.iter().enumerate() {
            let target = targets.select(&[i]);
            let options = Evaluate { targets: Some(&target), ..options };
            let alone = energy.evaluate(&batch.select(&[i]), options, &Device::cpu()).unwrap().remove(0);
            assert_eq!(bits(found), bits(&alone), "{energy}, curve {i}");
            assert_eq!(found.problem.is_some(), [3, 7].contains(&i), "{energy}, curve {i}: {:?}", found.problem);
        }
    }
}
