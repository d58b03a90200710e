//! The uniform mesh, the data points moved to it, and the start curve of a descent.

use faircurve::{Error, Result};

use super::Refusal;
use crate::banded::Banded;

/// The most mesh points a curve.
///
/// More are refused. A width in another unit than the curve's is a likelier cause than a wish for
/// so many.
const MOST_POINTS: f64 = 1e7;

/// The uniform mesh of a graph.
///
/// It starts at the first data point.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Mesh {
    /// This many points, at least 3, from the first data point to the last.
    Points(usize),
    /// This width, in units of the input.
    ///
    /// The last data point is moved to the nearest mesh point too.
    Width(f64),
}

impl Mesh {
    pub(super) fn check(self) -> Result<()> {
        match self {
            Mesh::Points(n) if n < 3 => {
                Err(Error::argument(format!("a mesh of {n} points has no curvature: take at least 3, such as 241")))
            }
            Mesh::Points(n) if n as f64 > MOST_POINTS => {
                Err(Error::argument(format!("a mesh of {n} points is too fine: take at most {MOST_POINTS:.0}")))
            }
            Mesh::Width(width) if !(width > 0.0 && width.is_finite()) => {
                Err(Error::argument(format!("the mesh width is {width}; it must be positive and finite")))
            }
            _ => Ok(()),
        }
    }
}

/// A mesh with data points on it.
pub(super) struct Placed {
    pub start: f64,
    pub width: f64,
    /// The mesh point of every data point, increasing from 0 to the last mesh point.
    pub data: Vec<usize>,
}

/// The mesh of a graph through the points (t, y), all finite, and its initial ordinates.
pub(super) fn set_up(mesh: Mesh, t: &[f64], y: &[f64]) -> Result<(Placed, Vec<f64>), Refusal> {
    if t.len() < 2 {
        let what = format!("a graph needs two points, and this curve has {}: remove it, or add points", t.len());
        return Err((0, what));
    }
    if let Some(k) = (1..t.len()).find(|&k| t[k] <= t[k - 1]) {
        let (before, here) = (t[k - 1], t[k]);
        let what = format!(
            "x goes from {before} to {here}, and in a graph y(t) it must increase: sort the points, or choose another method"
        );
        return Err((k, what));
    }
    let (start, length) = (t[0], t[t.len() - 1] - t[0]);
    let (points, width) = match mesh {
        Mesh::Points(n) => (n, length / (n - 1) as f64),
        Mesh::Width(width) => ((length / width + 0.5).min(2.0 * MOST_POINTS).floor() as usize + 1, width),
    };
    if points < 3 || points as f64 > MOST_POINTS {
        let (from, to) = (length / MOST_POINTS, length / 2.0);
        let what = format!(
            "the mesh width {width} does not suit a curve that is {length} long in x: take one from {from:.2e} to {to:.2e}"
        );
        return Err((0, what));
    }
    // The nearest mesh point, and of two equally near ones the later.
    let data: Vec<usize> = t.iter().map(|t| (((t - start) / width + 0.5).floor() as usize).min(points - 1)).collect();
    if let Some(k) = (1..data.len()).find(|&k| data[k] == data[k - 1]) {
        let gap = t.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
        let needed = (length / gap).ceil() + 1.0;
        let what = format!(
            "it falls on the same mesh point as the point before, {} away in x on a mesh of width {width}: take {needed} mesh \
             points, or remove one of the two",
            t[k] - t[k - 1]
        );
        return Err((k, what));
    }
    let ordinates = natural_spline(&data, width, y);
    Ok((Placed { start, width, data }, ordinates))
}

/// Second derivatives at the knots of the natural cubic spline through (h·knot, y).
///
/// M = 0 at both ends. Between them h_{i−1} M_{i−1} + 2 (h_{i−1} + h_i) M_i + h_i M_{i+1} = 6
/// (δ_i − δ_{i−1}).
fn natural_second_derivatives(spans: &[f64], y: &[f64]) -> Vec<f64> {
    let slope = |i: usize| (y[i + 1] - y[i]) / spans[i];
    let inner = y.len() - 2;
    let mut matrix = Banded::new(inner, 1);
    let mut second = vec![0.0; y.len()];
    for row in 0..inner {
        matrix[(row, row)] = 2.0 * (spans[row] + spans[row + 1]);
        if row > 0 {
            matrix[(row, row - 1)] = spans[row];
        }
        second[row + 1] = 6.0 * (slope(row + 1) - slope(row));
    }
    matrix.factor();
    matrix.solve(&mut second[1..=inner]);
    second
}

/// The natural cubic spline through the data, evaluated at all mesh points.
fn natural_spline(data: &[usize], width: f64, y: &[f64]) -> Vec<f64> {
    let spans: Vec<f64> = data.windows(2).map(|pair| (pair[1] - pair[0]) as f64 * width).collect();
    let second = natural_second_derivatives(&spans, y);
    let mut ordinates = Vec::with_capacity(data[data.len() - 1] + 1);
    for (k, &h) in spans.iter().enumerate() {
        let cells = data[k + 1] - data[k];
        for cell in 0..cells {
            let b = cell as f64 / cells as f64;
            let a = 1.0 - b;
            let bend = (a * a * a - a) * second[k] + (b * b * b - b) * second[k + 1];
            // At b = 0 this is y[k], bit for bit.
            ordinates.push(a * y[k] + b * y[k + 1] + bend * (h * h / 6.0));
        }
    }
    ordinates.push(y[y.len() - 1]);
    ordinates
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_go_to_the_nearest_mesh_point_and_halves_to_the_later_one() {
        let t = [7.99, 8.09, 8.19, 8.7, 9.2, 10.0, 12.0, 15.0, 20.0];
        let (placed, ordinates) = set_up(Mesh::Width(0.05), &t, &t).unwrap();
        assert_eq!(placed.data, [0, 2, 4, 14, 24, 40, 80, 140, 240]);
        assert_eq!(ordinates.len(), 241);
        let (placed, _) = set_up(Mesh::Points(5), &[0.0, 1.5, 4.0], &[0.0; 3]).unwrap();
        assert_eq!((placed.width, placed.data), (1.0, vec![0, 2, 4]));
    }

    #[test]
    fn the_initial_curve_keeps_the_bits_of_the_data() {
        let y = [0.1, 0.7, -0.3, 1.0 / 3.0];
        let (placed, ordinates) = set_up(Mesh::Points(31), &[0.0, 1.0, 2.0, 3.0], &y).unwrap();
        assert_eq!([0, 1, 2, 3].map(|k| ordinates[placed.data[k]]), y);
    }
}
