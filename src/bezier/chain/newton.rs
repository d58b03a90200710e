//! Chains with G1 joints: Newton's method finds directions and speeds of p′ at joints.
//!
//! The energy is a quadratic function of p′ on both sides of the joints: e^(−σ) T before a joint
//! and e^σ T after it, so that speeds stay positive.
//!
//! Newton's matrix is block tridiagonal. Its blocks have one row more than there are coordinates.
//! If it is not positive definite, a multiple of its diagonal is added.

// Index loops read as the formulas do.
#![allow(clippy::needless_range_loop)]

use std::collections::HashMap;

use glam::DVec3;

use super::blocks::{Blocks, MOST_ROWS, Row};
use super::layout::{Layout, Trouble, invalid};
use super::piece::{Piece, Sized, combined};
use super::speeds::{Side, Velocity};
use super::system::{Done, done, finish_piece};
use crate::status::CurveStatus;

/// The most iterations. 5 to 10 are usual.
const MOST: u32 = 200;

/// The gradient at which the iteration ends.
///
/// The gradient is measured by the steps of each joint alone: changes of speeds, relative to the
/// curve's mean speed, and changes of their logarithms.
const SMALL: f64 = 1e-11;

/// A speed below this, relative to the mean speed, counts as going to 0.
const STILL: f64 = 1e-4;

/// The least accepted pivot, for a diagonal of about 1.
const LEAST_PIVOT: f64 = 1e-10;

/// The largest change of a speed's logarithm in a step.
const MOST_RATIO: f64 = 1.5;

/// The energy of a piece: a|u|² + 2b u·w + c|w|² + 2g·u + 2e·w + ….
///
/// u is p′ at its start and w is p′ at its end.
struct Form {
    a: f64,
    b: f64,
    c: f64,
    g: DVec3,
    e: DVec3,
}

/// What is minimised.
struct Problem<'l, 'a> {
    layout: &'l Layout<'a>,
    forms: Vec<Form>,
    /// The mean speed of the chords.
    speed: f64,
}

/// How the minimisation ended.
enum End {
    Converged,
    NotConverged,
    /// A speed at this joint goes to 0.
    Still(usize),
}

/// Completes a curve.
///
/// # Errors
/// - Joints that are unknown.
/// - Joints with contradictory directions.
/// - Speeds that go to 0.
pub(super) fn complete(layout: Layout, pieces: &HashMap<u32, Piece>) -> Result<Done, Trouble> {
    if let Some(place) = (0..layout.joints()).map(|k| layout.joint_place(k)).find(|&place| !layout.is_known(place)) {
        let what = "it is a joint and unknown, and G1 joints must be known: give it, or take C1 joints";
        return Err(invalid(place, what));
    }
    let pieces: Vec<(&Piece, Sized)> = (0..layout.pieces)
        .map(|k| {
            let piece = &pieces[&layout.inner(k, 1)];
            (piece, piece.sized(layout.lengths[k]))
        })
        .collect();
    let chord = |k: usize| layout.relative(layout.place(k, layout.degree)) - layout.relative(layout.place(k, 0));
    let total: f64 = (0..layout.pieces).map(|k| chord(k).length()).sum();
    let speed = total / layout.lengths.iter().sum::<f64>();
    let own_speed = |piece: Option<usize>| {
        let own = piece.map_or(0.0, |k| chord(k).length() / layout.lengths[k]);
        if own > 0.0 { own } else { speed }
    };
    let new = |joint: usize| Velocity::new(&layout, joint, layout.around(joint).map(own_speed));
    let asked: Vec<Velocity> = (0..layout.joints()).map(new).collect::<Result<_, Trouble>>()?;
    let d = layout.dimension();
    let has_unknowns = asked.iter().any(|joint| joint.unknowns(d) > 0);
    if has_unknowns && speed == 0.0 {
        let what = "all joints coincide, and leave the chain no direction: give handles, or joints at different places";
        return Err((CurveStatus::Degenerate, 0, what.into()));
    }
    let forms = pieces.iter().enumerate().map(|(k, (piece, sized))| Form::new(&layout, k, piece, sized)).collect();
    let problem = Problem { layout: &layout, forms, speed };
    let (joints, end, iterations, gradient_norm) = match has_unknowns {
        false => (asked, End::Converged, 1, 0.0),
        true => problem.solve(asked, &chord),
    };
    if let End::Still(joint) = end {
        let what = "the energy falls while the speed on one side of this joint goes to 0: give a handle or a tangent \
         there, divide the chain, or take C1 joints";
        return Err((CurveStatus::NoMinimiser, layout.joint_place(joint), what.into()));
    }
    let mut coords = layout.coords();
    let mut energy = 0.0;
    for (k, (piece, sized)) in pieces.iter().enumerate() {
        let (next, h) = (layout.next(k), layout.lengths[k]);
        let jet = |joint: usize, v: DVec3| [layout.relative(layout.joint_place(joint)), h * v];
        let jets = [jet(k, joints[k].vectors()[1]), jet(next, joints[next].vectors()[0])];
        energy += finish_piece(&layout, k, piece, sized, jets.each_ref().map(|jet| &jet[..]), &mut coords);
    }
    let done = Done { iterations, gradient_norm, ..done(coords, energy, CurveStatus::Converged)? };
    Ok(match end {
        End::NotConverged => {
            let what = format!(
                "the gradient is {gradient_norm:.1e} after {iterations} iterations, not {SMALL:e}: give more \
                 handles, or take C1 joints"
            );
            Done { status: CurveStatus::NotConverged, message: Some((0, what)), ..done }
        }
        _ => done,
    })
}

impl Form {
    fn new(layout: &Layout, k: usize, piece: &Piece, sized: &Sized) -> Self {
        let (columns, h) = (piece.columns(), layout.lengths[k]);
        let ends = [0, layout.degree].map(|j| layout.relative(layout.place(k, j)));
        let jets = ends.map(|p| [p, DVec3::ZERO]);
        let inner = |j: usize| layout.relative(layout.place(k, j));
        let data = piece.data(jets.each_ref().map(|jet| &jet[..]), inner, ends[0]);
        let row = |i: usize| &sized.gram[i * columns..][..columns];
        let linear = |i: usize| combined(&row(i).iter().map(|x| h * x).collect::<Vec<f64>>(), &data);
        Form { a: h * h * row(1)[1], b: h * h * row(1)[3], c: h * h * row(3)[3], g: linear(1), e: linear(3) }
    }

    /// Half the derivatives with respect to u and w.
    fn halves(&self, u: DVec3, w: DVec3) -> [DVec3; 2] {
        [self.g + self.a * u + self.b * w, self.e + self.b * u + self.c * w]
    }
}

impl Problem<'_, '_> {
    /// Minimises with C1 joints, then with G1 joints.
    fn solve(&self, asked: Vec<Velocity>, chord: &dyn Fn(usize) -> DVec3) -> (Vec<Velocity>, End, u32, f64) {
        let smooth = asked.iter().map(|joint| match joint {
            Velocity::Along(direction, _) => Velocity::Along(*direction, joint.vectors().map(Side::Known)),
            even => *even,
        });
        let mut smooth: Vec<Velocity> = smooth.collect();
        let (_, linear, _) = self.minimise(&mut smooth);
        let start = |(joint, (asked, smooth)): (usize, (&Velocity, &Velocity))| match (asked, smooth) {
            (Velocity::Even(_), Velocity::Even(v)) => match self.layout.around(joint) {
                [Some(_), Some(_)] if v.length() > 1e-3 * self.speed => Velocity::Turning(*v, 0.0),
                [Some(before), Some(after)] => {
                    let along = [chord(before) + chord(after), chord(after), chord(before), DVec3::X];
                    let along = along.into_iter().find(|x| x.length() > 0.0).expect("the last one is not 0");
                    Velocity::Turning(0.1 * self.speed / along.length() * along, 0.0)
                }
                _ => Velocity::Even(*v),
            },
            (asked, _) => *asked,
        };
        let mut joints: Vec<Velocity> = asked.iter().zip(&smooth).enumerate().map(start).collect();
        let (end, iterations, gradient) = self.minimise(&mut joints);
        (joints, end, linear + iterations, gradient)
    }

    /// p′ at the start and the end of piece k.
    fn ends(&self, vectors: &[[DVec3; 2]], k: usize) -> (DVec3, DVec3) {
        (vectors[k][1], vectors[self.layout.next(k)][0])
    }

    /// Derivatives of the energy with respect to p′ on both sides of each joint.
    fn forces(&self, vectors: &[[DVec3; 2]]) -> Vec<[DVec3; 2]> {
        let mut forces = vec![[DVec3::ZERO; 2]; vectors.len()];
        for (k, form) in self.forms.iter().enumerate() {
            let (u, w) = self.ends(vectors, k);
            let [of_u, of_w] = form.halves(u, w);
            forces[k][1] += 2.0 * of_u;
            forces[self.layout.next(k)][0] += 2.0 * of_w;
        }
        forces
    }

    /// The rise of the energy from one state to another, without cancellation.
    fn rise(&self, from: &[[DVec3; 2]], to: &[[DVec3; 2]]) -> f64 {
        let piece = |(k, form): (usize, &Form)| {
            let ((u, w), (u_to, w_to)) = (self.ends(from, k), self.ends(to, k));
            let (du, dw) = (u_to - u, w_to - w);
            let [of_u, of_w] = form.halves(u + 0.5 * du, w + 0.5 * dw);
            2.0 * (of_u.dot(du) + of_w.dot(dw))
        };
        self.forms.iter().enumerate().map(piece).sum()
    }

    /// Newton's method. Returns how it ended, the iterations and the gradient's norm.
    fn minimise(&self, joints: &mut [Velocity]) -> (End, u32, f64) {
        let mut damping = 0.0;
        let mut iteration = 0;
        loop {
            let newton = Newton::new(self, joints);
            if newton.norm <= SMALL {
                return (End::Converged, iteration, newton.norm);
            }
            let slow = |joint: &Velocity| joint.slowest().is_some_and(|speed| speed < STILL * self.speed);
            if let Some(joint) = joints.iter().position(slow) {
                return (End::Still(joint), iteration, newton.norm);
            }
            if iteration == MOST {
                return (End::NotConverged, iteration, newton.norm);
            }
            let (moved, is_whole) = loop {
                if let Some(taken) = self.descended(&newton, joints, damping) {
                    break taken;
                }
                damping = f64::max(1e-3, 4.0 * damping);
                if damping > 1e12 {
                    return (End::NotConverged, iteration, newton.norm);
                }
            };
            joints.copy_from_slice(&moved);
            damping = if damping > 1e-6 && is_whole { 0.1 * damping } else { damping };
            damping = if damping <= 1e-6 { 0.0 } else { damping };
            iteration += 1;
        }
    }

    /// The joints after a step that lowers the energy, and whether the whole step was taken.
    fn descended(&self, newton: &Newton, joints: &[Velocity], damping: f64) -> Option<(Vec<Velocity>, bool)> {
        let d = self.layout.dimension();
        let (step, slope) = newton.step(damping)?;
        let mut largest = 0.0;
        for (step, joint) in step.iter().zip(joints) {
            for i in (0..joint.unknowns(d)).filter(|&i| joint.is_ratio(i, d)) {
                largest = f64::max(largest, step[i].abs());
            }
        }
        let mut factor = (MOST_RATIO / largest).min(1.0);
        while factor > 1e-6 {
            let moved: Vec<Velocity> =
                joints.iter().zip(&step).map(|(joint, step)| joint.moved(step, factor, d)).collect();
            let vectors: Vec<[DVec3; 2]> = moved.iter().map(Velocity::vectors).collect();
            // Close to the minimum a rise is rounding.
            if newton.norm < 1e-8 || self.rise(&newton.vectors, &vectors) <= 1e-4 * factor * slope {
                return Some((moved, factor == 1.0));
            }
            factor *= 0.5;
        }
        None
    }
}

/// Newton's system at a state.
///
/// It is scaled by the diagonal without second derivatives of p′.
struct Newton {
    vectors: Vec<[DVec3; 2]>,
    matrix: Blocks,
    gradient: Vec<Row>,
    scale: Vec<Row>,
    norm: f64,
}

impl Newton {
    fn new(problem: &Problem, joints: &[Velocity]) -> Self {
        let (layout, d) = (problem.layout, problem.layout.dimension());
        let vectors: Vec<[DVec3; 2]> = joints.iter().map(Velocity::vectors).collect();
        let forces = problem.forces(&vectors);
        let slopes: Vec<_> = joints.iter().map(|joint| joint.slopes(d)).collect();
        let unknowns: Vec<usize> = joints.iter().map(|joint| joint.unknowns(d)).collect();
        // Directions in the plane or in space, and a ratio of speeds.
        let rows = if d == 2 { 3 } else { 4 };
        let mut newton = Newton {
            vectors,
            matrix: Blocks::new(layout.closed, rows, unknowns.iter().map(|&count| count > 0).collect()),
            gradient: vec![Row::default(); joints.len()],
            scale: vec![[1.0; MOST_ROWS]; joints.len()],
            norm: 0.0,
        };
        let blocks = &mut newton.matrix.blocks;
        for (k, form) in problem.forms.iter().enumerate() {
            let next = layout.next(k);
            for (joint, side, factor) in [(k, 1, form.a), (next, 0, form.c)] {
                for (i, j) in pairs(unknowns[joint], unknowns[joint]) {
                    blocks[joint][0][i][j] += 2.0 * factor * slopes[joint][side][i].dot(slopes[joint][side][j]);
                }
            }
            for (i, j) in pairs(unknowns[k], unknowns[next]) {
                blocks[k][1][i][j] += 2.0 * form.b * slopes[k][1][i].dot(slopes[next][0][j]);
            }
        }
        for (k, joint) in joints.iter().enumerate() {
            let curvatures = joint.curvatures(forces[k], d);
            for i in 0..unknowns[k] {
                newton.scale[k][i] = 1.0 / blocks[k][0][i][i].sqrt();
                let gradient = slopes[k][0][i].dot(forces[k][0]) + slopes[k][1][i].dot(forces[k][1]);
                newton.gradient[k][i] = gradient;
                let unit = if joint.is_ratio(i, d) { 1.0 } else { problem.speed };
                newton.norm = newton.norm.max((gradient / blocks[k][0][i][i] / unit).abs());
            }
            for (i, j) in pairs(unknowns[k], unknowns[k]) {
                blocks[k][0][i][j] += curvatures[i][j];
            }
            for i in unknowns[k]..rows {
                blocks[k][0][i][i] = 1.0;
            }
        }
        newton.matrix.scale(&newton.scale);
        newton
    }

    /// The step with `damping` added to the diagonal, and the energy's slope along it.
    ///
    /// `None` if the matrix is not positive definite.
    fn step(&self, damping: f64) -> Option<(Vec<Row>, f64)> {
        let mut rhs = self.gradient.clone();
        for (rhs, scale) in rhs.iter_mut().zip(&self.scale) {
            *rhs = std::array::from_fn(|i| -rhs[i] * scale[i]);
        }
        let (mut steps, smallest) = self.matrix.solve(&[rhs], damping);
        if smallest.is_nan() || smallest <= LEAST_PIVOT {
            return None;
        }
        let mut step = steps.remove(0);
        let mut slope = 0.0;
        for ((x, scale), gradient) in step.iter_mut().zip(&self.scale).zip(&self.gradient) {
            *x = std::array::from_fn(|i| x[i] * scale[i]);
            slope += (0..self.matrix.rows).map(|i| x[i] * gradient[i]).sum::<f64>();
        }
        Some((step, slope))
    }
}

/// All pairs (i, j) with i < m and j < n.
fn pairs(m: usize, n: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..m).flat_map(move |i| (0..n).map(move |j| (i, j)))
}
