//! [`Cell`]: the bicubic patch of a place.

use glam::DVec2;

use super::HeightField;

/// A position along one axis: its span, and the weights of value and second derivative at both
/// ends.
pub(super) struct AxisPosition {
    pub span: usize,
    /// t within the span, from 0 to 1, and by how much the place is beyond the grid.
    pub t: f64,
    beyond: f64,
    /// 1/Δ
    rate: f64,
}

impl AxisPosition {
    pub fn of(x: f64, origin: f64, spacing: f64, count: usize) -> Self {
        let u = (x - origin) / spacing;
        let inside = u.clamp(0.0, (count - 1) as f64);
        let span = (inside.floor() as usize).min(count - 2);
        AxisPosition { span, t: inside - span as f64, beyond: u - inside, rate: 1.0 / spacing }
    }

    /// The weights, for a derivative by x, of f₀, f₀″, f₁ and f₁″.
    fn weights(&self, order: usize) -> [f64; 4] {
        let scale = self.rate.powi(order as i32);
        self.within(order).map(|weight| scale * weight)
    }

    /// Those by u. Beyond the grid the tangent goes on.
    fn within(&self, order: usize) -> [f64; 4] {
        let (a, b) = (1.0 - self.t, self.t);
        let slopes = || [-1.0, -(3.0 * a * a - 1.0) / 6.0, 1.0, (3.0 * b * b - 1.0) / 6.0];
        match order {
            0 => {
                let own = [a, (a * a - 1.0) * a / 6.0, b, (b * b - 1.0) * b / 6.0];
                if self.beyond == 0.0 {
                    return own;
                }
                let slopes = slopes();
                std::array::from_fn(|k| own[k] + self.beyond * slopes[k])
            }
            1 => slopes(),
            _ if self.beyond != 0.0 => [0.0; 4],
            2 => [0.0, a, 0.0, b],
            _ => [0.0, -1.0, 0.0, 1.0],
        }
    }
}

/// The patch of a place.
pub(super) struct Cell<'a> {
    nodes: [&'a [[f64; 4]]; 2],
    x: AxisPosition,
    y: AxisPosition,
}

impl<'a> Cell<'a> {
    pub(super) fn of(field: &'a HeightField, x: f64, y: f64) -> Self {
        let [rows, columns] = field.shape;
        let x = AxisPosition::of(x, field.origin[0], field.spacing[0], columns);
        let y = AxisPosition::of(y, field.origin[1], field.spacing[1], rows);
        let first = y.span * columns + x.span;
        let nodes = [first, first + columns].map(|first| &field.nodes[first..first + 2]);
        Cell { nodes, x, y }
    }

    /// ∂ⁱ⁺ʲh/∂xⁱ∂yʲ
    pub(super) fn derivative(&self, i: usize, j: usize) -> f64 {
        let (x, y) = (self.x.weights(i), self.y.weights(j));
        let row = |[left, right]: [&[f64; 4]; 2], bent: usize| {
            x[0] * left[bent] + x[1] * left[bent + 1] + (x[2] * right[bent] + x[3] * right[bent + 1])
        };
        let ends = self.nodes.map(|nodes| [&nodes[0], &nodes[1]]);
        y[0] * row(ends[0], 0) + y[1] * row(ends[0], 2) + (y[2] * row(ends[1], 0) + y[3] * row(ends[1], 2))
    }

    pub(super) fn slope(&self) -> DVec2 {
        DVec2::new(self.derivative(1, 0), self.derivative(0, 1))
    }

    /// h_xx, h_xy, h_yy
    pub(super) fn bend(&self) -> [f64; 3] {
        [self.derivative(2, 0), self.derivative(1, 1), self.derivative(0, 2)]
    }
}
