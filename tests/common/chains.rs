//! Chains of Béziers of which some control points are known.

use faircurve::bezier::{Chain, Joints, PieceLengths};
use faircurve::{Constraints, CurveBatch};
use rand::RngExt;
use rand::rngs::StdRng;

/// Orders of continuity.
pub const QS: [(usize, Joints); 3] = [(0, Joints::Free), (1, Joints::C1), (2, Joints::C2)];

/// Control points, known ones true and others anything.
#[derive(Debug)]
pub struct Case {
    pub dimension: usize,
    pub closed: bool,
    pub points: Vec<f64>,
    pub known: Vec<bool>,
}

/// What unknown points are about before.
const ANYTHING: f64 = -77.0;

impl Case {
    /// A chain whose joints are as asked for, of which joints and other points are known with these
    /// probabilities.
    pub fn random(
        chain: &Chain,
        dimension: usize,
        pieces: usize,
        closed: bool,
        known: [f64; 2],
        rng: &mut StdRng,
    ) -> Self {
        let q = QS.iter().find(|(_, joints)| *joints == chain.joints).map_or(1, |(q, _)| *q);
        let (degree, joints) = (chain.degree, pieces + usize::from(!closed));
        let count = degree * pieces + usize::from(!closed);
        let known: Vec<bool> =
            (0..count).map(|k| rng.random_range(0.0..1.0) < known[usize::from(k % degree != 0)]).collect();
        let mut jets = vec![[[0.0_f64; 3]; 3]; joints];
        jets.iter_mut().flatten().flatten().for_each(|x| *x = rng.random_range(-1.0..1.0));
        let chord = |k: usize| {
            let ends = [jets[k][0], jets[(k + 1) % joints][0]];
            (0..dimension).map(|c| (ends[1][c] - ends[0][c]).powi(2)).sum::<f64>().sqrt()
        };
        let all_joints = (0..joints).all(|k| known[k * degree]) && joints > 1;
        let lengths: Vec<f64> = match chain.lengths {
            PieceLengths::Chords if all_joints => (0..pieces).map(chord).collect(),
            _ => vec![1.0; pieces],
        };
        let mut points = vec![0.0; count * dimension];
        for k in 0..pieces {
            let (h, d) = (lengths[k], degree as f64);
            for j in 0..=degree {
                let at = (k * degree + j) % count * dimension;
                for c in 0..dimension {
                    let of = |jet: &[[f64; 3]; 3], h: f64, i: usize| {
                        let i = i as f64;
                        let second = if i > 1.0 { i * (i - 1.0) / 2.0 * h * h / (d * (d - 1.0)) } else { 0.0 };
                        jet[0][c] + i * h / d * jet[1][c] + second * jet[2][c]
                    };
                    points[at + c] = match j {
                        j if j <= q => of(&jets[k], h, j),
                        j if j + q >= degree => of(&jets[(k + 1) % joints], -h, degree - j),
                        _ => rng.random_range(-1.0..1.0),
                    };
                }
            }
        }
        for (k, is_known) in known.iter().enumerate() {
            if !is_known {
                points[k * dimension..(k + 1) * dimension].fill(ANYTHING - k as f64);
            }
        }
        Case { dimension, closed, points, known }
    }
}

/// Chains as a batch. They have the same dimension.
pub fn batch(cases: &[Case]) -> CurveBatch {
    let (mut coords, mut offsets, mut known) = (Vec::new(), vec![0], Vec::new());
    for case in cases {
        coords.extend_from_slice(&case.points);
        known.extend_from_slice(&case.known);
        offsets.push(known.len());
    }
    CurveBatch::from_ragged(cases[0].dimension, coords, offsets)
        .and_then(|batch| batch.closed_each(cases.iter().map(|case| case.closed).collect()))
        .and_then(|batch| batch.with_constraints(Constraints { known: Some(known), ..Constraints::default() }))
        .unwrap()
}

/// The largest difference.
pub fn spread(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()))
}
