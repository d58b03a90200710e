//! [`Functional`]: energies of a planar curve as functions of the angles of its edges and the
//! logarithms of their lengths.
//!
//! For the turn d at a vertex and the mean a of the adjacent lengths, the energies of polygons are
//!
//! | | |
//! |---|---|
//! | variation | Σ (sin d′/a′ − sin d/a)²/s over edges of length s |
//! | bending | Σ (2 − 2 cos d)/a |
//! | length, tautness | Σ w s |
//! | tension | ½ m Σ s² |
//!
//! These are exactly the sums of [`energy`](super::super::energy), not approximations for short
//! edges.

// Loops over unknowns by index match the formulas.
#![allow(clippy::needless_range_loop)]

use super::shape::{Curve, Shape};
use crate::discrete::energy;
use crate::linalg::skyline::Skyline;

/// The weights of energies that have an angle form.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Functional {
    pub variation: f64,
    pub bending: f64,
    /// The weight of length in each span.
    pub length: Vec<f64>,
    /// The weight of tension times the number m of edges.
    pub tension: f64,
}

/// A function of a few unknowns, with its derivatives.
struct Local<const N: usize> {
    value: f64,
    first: [f64; N],
    second: [[f64; N]; N],
}

impl Functional {
    /// The weights at size 1 of an energy. `None` if any of its terms has no angle form.
    ///
    /// `taut` holds tautness per edge, and is empty if the energy does not contain it.
    pub fn of(energy: &energy::Energy, weights: &[f64], taut: &[f64], shape: &Shape) -> Option<Functional> {
        let mut own = Functional { length: vec![0.0; shape.spans.len()], ..Functional::default() };
        for (&weight, (_, functional)) in weights.iter().zip(energy.terms()).filter(|(weight, _)| **weight > 0.0) {
            match functional {
                energy::Functional::Variation(_) => own.variation += weight,
                energy::Functional::Bending(bending) if bending.exponent == 2.0 => own.bending += weight,
                energy::Functional::Length(_) => own.length.iter_mut().for_each(|length| *length += weight),
                energy::Functional::Tautness(_) => {
                    for (length, edges) in own.length.iter_mut().zip(&shape.spans) {
                        *length += weight * taut[edges.start];
                    }
                }
                energy::Functional::Tension(_) => own.tension += weight * shape.edges() as f64,
                _ => return None,
            }
        }
        Some(own)
    }

    /// The energy.
    pub fn value(&self, shape: &Shape, curve: &Curve) -> f64 {
        self.sum(shape, curve, &mut |_, _, _| {}, &mut |_, _, _| {}, &mut |_, _, _| {})
    }

    /// Adds the gradient and the Hessian, and returns the energy.
    pub fn add(&self, shape: &Shape, curve: &Curve, gradient: &mut [f64], matrix: &mut Skyline) -> f64 {
        let to = std::cell::RefCell::new((gradient, matrix));
        self.sum(
            shape,
            curve,
            &mut |rows: [usize; 6], weight, local| scatter(&mut to.borrow_mut(), rows, weight, local),
            &mut |rows: [usize; 4], weight, local| scatter(&mut to.borrow_mut(), rows, weight, local),
            &mut |row: usize, first, second| {
                let (gradient, matrix) = &mut *to.borrow_mut();
                gradient[row] += first;
                matrix.add(row, row, second);
            },
        )
    }

    /// Sums all terms, and passes each with its unknowns to a callback: variation, bending, and the
    /// terms of a span's length.
    fn sum(
        &self,
        shape: &Shape,
        curve: &Curve,
        of_three: &mut dyn FnMut([usize; 6], f64, &Local<6>),
        of_two: &mut dyn FnMut([usize; 4], f64, &Local<4>),
        of_span: &mut dyn FnMut(usize, f64, f64),
    ) -> f64 {
        let mut energy = 0.0;
        if self.variation > 0.0 {
            for j in 0..shape.windows(3) {
                let edges = [0, 1, 2].map(|k| (j + k) % shape.edges());
                let turns = [shape.turn(curve, j), shape.turn(curve, (j + 1) % shape.edges())];
                let local = variation(turns, edges.map(|edge| curve.length(shape, edge)));
                energy += self.variation * local.value;
                let [a, b, c] = edges;
                let [u, v, w] = edges.map(|edge| shape.row_of_length(edge));
                let rows = [shape.row(a), shape.row(b), shape.row(c), u, v, w];
                of_three(rows, self.variation, &local);
            }
        }
        if self.bending > 0.0 {
            for j in 0..shape.windows(2) {
                let edges = [j, (j + 1) % shape.edges()];
                let d = shape.turn(curve, j);
                let f = [2.0 - 2.0 * d.cos(), 2.0 * d.sin(), 2.0 * d.cos()];
                let local = over_length(f, edges.map(|edge| curve.length(shape, edge)));
                // A turn next to an end also represents the half edge there.
                let ends = if shape.closed { 0 } else { u8::from(j == 0) + u8::from(j + 2 == shape.edges()) };
                let weight = self.bending * (1.0 + 0.5 * f64::from(ends));
                energy += weight * local.value;
                let [u, v] = edges.map(|edge| shape.row_of_length(edge));
                of_two([shape.row(edges[0]), shape.row(edges[1]), u, v], weight, &local);
            }
        }
        for (k, edges) in shape.spans.iter().enumerate() {
            let (count, s) = (edges.len() as f64, curve.sizes[k].exp());
            let (length, tension) = (self.length[k] * count * s, self.tension * count * s * s);
            energy += length + 0.5 * tension;
            of_span(shape.row_of_length(edges.start), length + tension, length + 2.0 * tension);
        }
        energy
    }
}

fn scatter<const N: usize>(to: &mut (&mut [f64], &mut Skyline), rows: [usize; N], weight: f64, local: &Local<N>) {
    for a in 0..N {
        to.0[rows[a]] += weight * local.first[a];
        to.1.add(rows[a], rows[a], weight * local.second[a][a]);
        for b in 0..a {
            // If both are the same unknown, the entry counts twice on the diagonal.
            let times = if rows[a] == rows[b] { 2.0 } else { 1.0 };
            to.1.add(rows[a], rows[b], times * weight * local.second[a][b]);
        }
    }
}

/// f(θ₁ − θ₀)/a with a = (e^u₀ + e^u₁)/2, and its derivatives by θ₀, θ₁, u₀ and u₁.
///
/// `f` holds f with its first and second derivative, and `lengths` holds e^u.
fn over_length(f: [f64; 3], lengths: [f64; 2]) -> Local<4> {
    let r = 2.0 / (lengths[0] + lengths[1]);
    let halves = lengths.map(|length| 0.5 * length);
    let by_turn = [-1.0, 1.0, 0.0, 0.0];
    // The derivatives of r = 1/a are −r² ∂a and 2 r³ ∂a ∂a − r² ∂²a. The second derivative of a by
    // the same u equals the first.
    let by_a = [0.0, 0.0, halves[0], halves[1]];
    let first = std::array::from_fn(|i| f[1] * by_turn[i] * r - f[0] * r * r * by_a[i]);
    let second = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let twice = if i == j { by_a[i] } else { 0.0 };
            f[2] * by_turn[i] * by_turn[j] * r - f[1] * r * r * (by_turn[i] * by_a[j] + by_a[i] * by_turn[j])
                + f[0] * r * r * (2.0 * r * by_a[i] * by_a[j] - twice)
        })
    });
    Local { value: f[0] * r, first, second }
}

/// (sin d′/a′ − sin d/a)²/s with s = e^u₁, and its derivatives by θ₀, θ₁, θ₂, u₀, u₁ and u₂.
fn variation(turns: [f64; 2], lengths: [f64; 3]) -> Local<6> {
    let curvature = |d: f64, lengths| over_length([d.sin(), d.cos(), -d.sin()], lengths);
    let before = curvature(turns[0], [lengths[0], lengths[1]]);
    let after = curvature(turns[1], [lengths[1], lengths[2]]);
    let (mut by, mut twice) = ([0.0; 6], [[0.0; 6]; 6]);
    for (sign, local, at) in [(-1.0, &before, [0, 1, 3, 4]), (1.0, &after, [1, 2, 4, 5])] {
        for i in 0..4 {
            by[at[i]] += sign * local.first[i];
            for j in 0..4 {
                twice[at[i]][at[j]] += sign * local.second[i][j];
            }
        }
    }
    let (q, r) = (after.value - before.value, 1.0 / lengths[1]);
    let value = q * q * r;
    let mut first = by.map(|by| 2.0 * q * r * by);
    let mut second: [[f64; 6]; 6] =
        std::array::from_fn(|i| std::array::from_fn(|j| 2.0 * r * (by[i] * by[j] + q * twice[i][j])));
    // The derivative of 1/s by u₁ is −1/s.
    for i in 0..6 {
        second[4][i] -= first[i];
        second[i][4] -= first[i];
    }
    second[4][4] += value;
    first[4] -= value;
    Local { value, first, second }
}
