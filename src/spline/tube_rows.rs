//! [`Rows`]: the least-squares problem ‖Ax + b‖² + ‖Wx‖² of a [`Tube`](super::tube::Tube), factored
//! from knot to knot.
//!
//! A state is u and m of one knot, d numbers each; rows couple neighbours. Householder reflections
//! eliminate one state after the other and carry the rest over to the next one. The first state of
//! a closed curve is eliminated last: the border. Solutions satisfy the seminormal equations RᵀR x
//! = …, with one step of refinement, which makes them as accurate as solutions by the reflections
//! themselves (Å. Björck, Stability analysis of the method of seminormal equations, 1987).

/// The rows of A and b, and the triangle of the last [`factor`](Rows::factor).
pub(super) struct Rows<'a> {
    dimension: usize,
    closed: bool,
    spans: &'a [f64],
    centres: &'a [f64],
    /// Knots whose u is 0.
    held: Vec<bool>,
    /// Of every state in order of elimination: `width` rows over itself, the next one and the
    /// border.
    triangle: Vec<f64>,
    /// The border's own.
    corner: Vec<f64>,
    scratch: Vec<f64>,
}

/// The two rows of a span that are the same for each coordinate, over u₀, m₀, u₁, m₁.
fn span_rows(h: f64) -> [[f64; 4]; 2] {
    let (first, second) = (1.0 / h.sqrt(), (3.0 / h).sqrt());
    [[0.0, -first, 0.0, first], [2.0 * second / h, second, -2.0 * second / h, second]]
}

impl<'a> Rows<'a> {
    pub fn new(dimension: usize, closed: bool, held: &[bool], spans: &'a [f64], centres: &'a [f64]) -> Self {
        let knots = centres.len() / dimension;
        let columns = 2 * dimension * if closed { 3 } else { 2 };
        let triangle = vec![0.0; knots * 2 * dimension * columns];
        Rows {
            dimension,
            closed,
            spans,
            centres,
            held: held.to_vec(),
            triangle,
            corner: Vec::new(),
            scratch: Vec::new(),
        }
    }

    pub fn knots(&self) -> usize {
        self.held.len()
    }

    fn width(&self) -> usize {
        2 * self.dimension
    }

    /// The number of columns that a state's rows have.
    fn columns(&self) -> usize {
        self.width() * if self.closed { 3 } else { 2 }
    }

    fn after(&self, knot: usize) -> usize {
        if knot + 1 == self.knots() { 0 } else { knot + 1 }
    }

    /// The interpolating spline: u = 0, and the slopes of least energy.
    pub fn interpolate(&mut self) -> Vec<f64> {
        let held = std::mem::take(&mut self.held);
        self.held = vec![true; held.len()];
        self.factor(std::iter::empty());
        let mut rhs = self.transposed(&self.residual(&vec![0.0; self.knots() * self.width()]));
        rhs.iter_mut().for_each(|x| *x = -*x);
        let x = self.solve(&rhs, |_, _| ());
        self.held = held;
        x
    }

    /// Ax + b, two numbers a coordinate of every span.
    pub fn residual(&self, x: &[f64]) -> Vec<f64> {
        self.energies(x, |at| self.centres[at])
    }

    fn energies(&self, x: &[f64], centre: impl Fn(usize) -> f64) -> Vec<f64> {
        let (d, w) = (self.dimension, self.width());
        let mut out = vec![0.0; self.spans.len() * w];
        for (k, (&h, out)) in self.spans.iter().zip(out.chunks_exact_mut(w)).enumerate() {
            let next = self.after(k);
            let rows = span_rows(h);
            for c in 0..d {
                let moved = (x[next * w + c] - x[k * w + c]) + (centre(next * d + c) - centre(k * d + c));
                let (from, to) = (x[k * w + d + c], x[next * w + d + c]);
                out[c] = rows[0][3] * (to - from);
                out[d + c] = rows[1][1] * (from + to) + rows[1][2] * moved;
            }
        }
        out
    }

    /// Half the energy that the rounding of values makes: an ε of the largest in every knot.
    pub fn rounding(&self) -> f64 {
        let largest = self.centres.iter().fold(1.0, |largest: f64, y| largest.max(y.abs()));
        let rough = self.spans.iter().map(|h| 12.0 / (h * h * h)).sum::<f64>();
        0.5 * rough * (f64::EPSILON * largest).powi(2)
    }

    /// Aᵀe.
    pub fn transposed(&self, e: &[f64]) -> Vec<f64> {
        let (d, w) = (self.dimension, self.width());
        let mut out = vec![0.0; self.knots() * w];
        for (k, (&h, e)) in self.spans.iter().zip(e.chunks_exact(w)).enumerate() {
            let next = self.after(k);
            let rows = span_rows(h);
            for c in 0..d {
                out[k * w + c] += rows[1][0] * e[d + c];
                out[next * w + c] += rows[1][2] * e[d + c];
                out[k * w + d + c] += rows[0][1] * e[c] + rows[1][1] * e[d + c];
                out[next * w + d + c] += rows[0][3] * e[c] + rows[1][3] * e[d + c];
            }
        }
        self.held.iter().enumerate().filter(|(_, held)| **held).for_each(|(k, _)| out[k * w..k * w + d].fill(0.0));
        out
    }

    /// Factors A with further rows on the u of knots, in the order of the knots: d + 1 rows of d
    /// numbers.
    pub fn factor(&mut self, discs: impl Iterator<Item = (usize, [[f64; 3]; 4])>) {
        let (w, columns, n) = (self.width(), self.columns(), self.knots());
        let mut discs = discs.peekable();
        let mut m = std::mem::take(&mut self.scratch);
        m.clear();
        let first = usize::from(self.closed);
        let border = 2 * w;
        // The border's own rows.
        let mut corner = Vec::new();
        if self.closed {
            self.push_discs(&mut corner, &mut discs, 0, w);
            self.push_span(&mut m, 0, columns, border, 0);
        }
        for i in first..n {
            self.push_discs(&mut m, &mut discs, i, columns);
            if i + 1 < n {
                self.push_span(&mut m, i, columns, 0, w);
            } else if self.closed {
                self.push_span(&mut m, i, columns, 0, border);
            }
            m.resize(m.len().max(w * columns), 0.0);
            triangulate(&mut m, columns);
            self.triangle[i * w * columns..(i + 1) * w * columns].copy_from_slice(&m[..w * columns]);
            // The rows left, which begin with the next state.
            let rows = (m.len() / columns).min(columns);
            for row in w..rows {
                for column in 0..columns {
                    let from = if column < w { column + w } else { column };
                    let kept = column < w || column >= border;
                    m[(row - w) * columns + column] = if kept { m[row * columns + from] } else { 0.0 };
                }
            }
            m.truncate((rows - w) * columns);
        }
        if self.closed {
            m.chunks_exact(columns).for_each(|row| corner.extend_from_slice(&row[border..]));
            corner.resize(corner.len().max(w * w), 0.0);
            triangulate(&mut corner, w);
            corner.truncate(w * w);
            self.corner = corner;
        }
        self.scratch = m;
    }

    fn push_discs(
        &self,
        m: &mut Vec<f64>,
        discs: &mut std::iter::Peekable<impl Iterator<Item = (usize, [[f64; 3]; 4])>>,
        knot: usize,
        columns: usize,
    ) {
        let d = self.dimension;
        let mut push = |row: &[f64]| {
            let start = m.len();
            m.resize(start + columns, 0.0);
            m[start..start + d].copy_from_slice(row);
        };
        if self.held[knot] {
            (0..d).for_each(|c| push(&[0, 1, 2].map(|other| f64::from(u8::from(other == c)))[..d]));
        }
        while let Some((_, rows)) = discs.next_if(|(of, _)| *of == knot) {
            if !self.held[knot] {
                rows[..=d].iter().for_each(|row| push(&row[..d]));
            }
        }
    }

    /// The rows of span `k`, from the columns `from` to the columns `to`.
    fn push_span(&self, m: &mut Vec<f64>, k: usize, columns: usize, from: usize, to: usize) {
        let d = self.dimension;
        let free = [k, self.after(k)].map(|knot| f64::from(u8::from(!self.held[knot])));
        for row in span_rows(self.spans[k]) {
            for c in 0..d {
                let start = m.len();
                m.resize(start + columns, 0.0);
                m[start + from + c] += free[0] * row[0];
                m[start + from + d + c] += row[1];
                m[start + to + c] += free[1] * row[2];
                m[start + to + d + c] += row[3];
            }
        }
    }

    /// Solves (AᵀA + WᵀW) x = rhs with the factors; `add` adds WᵀWx.
    pub fn solve(&self, rhs: &[f64], add: impl Fn(&[f64], &mut [f64])) -> Vec<f64> {
        let mut x = self.seminormal(rhs);
        let mut product = self.transposed(&self.energies(&x, |_| 0.0));
        add(&x, &mut product);
        let residual: Vec<f64> = rhs.iter().zip(&product).map(|(a, b)| a - b).collect();
        x.iter_mut().zip(self.seminormal(&residual)).for_each(|(x, dx)| *x += dx);
        x
    }

    /// Solves RᵀR x = rhs.
    fn seminormal(&self, rhs: &[f64]) -> Vec<f64> {
        let (w, columns, n) = (self.width(), self.columns(), self.knots());
        let (first, border) = (usize::from(self.closed), 2 * w);
        let mut x = rhs.to_vec();
        let block = |i: usize| &self.triangle[i * w * columns..(i + 1) * w * columns];
        for i in first..n {
            let r = block(i);
            for row in 0..w {
                let y = x[i * w + row] / r[row * columns + row];
                x[i * w + row] = y;
                for column in row + 1..w {
                    x[i * w + column] -= r[row * columns + column] * y;
                }
                for column in 0..w {
                    if i + 1 < n {
                        x[(i + 1) * w + column] -= r[row * columns + w + column] * y;
                    }
                    if self.closed {
                        x[column] -= r[row * columns + border + column] * y;
                    }
                }
            }
        }
        if self.closed {
            for row in 0..w {
                x[row] /= self.corner[row * w + row];
                for column in row + 1..w {
                    x[column] -= self.corner[row * w + column] * x[row];
                }
            }
            for row in (0..w).rev() {
                for column in row + 1..w {
                    x[row] -= self.corner[row * w + column] * x[column];
                }
                x[row] /= self.corner[row * w + row];
            }
        }
        for i in (first..n).rev() {
            let r = block(i);
            for row in (0..w).rev() {
                let mut y = x[i * w + row];
                for column in row + 1..w {
                    y -= r[row * columns + column] * x[i * w + column];
                }
                for column in 0..w {
                    if i + 1 < n {
                        y -= r[row * columns + w + column] * x[(i + 1) * w + column];
                    }
                    if self.closed {
                        y -= r[row * columns + border + column] * x[column];
                    }
                }
                x[i * w + row] = y / r[row * columns + row];
            }
        }
        x
    }
}

/// Makes rows of a number of columns upper triangular by Householder reflections, in place.
fn triangulate(m: &mut [f64], columns: usize) {
    let rows = m.len() / columns;
    for j in 0..columns.min(rows) {
        let square: f64 = (j + 1..rows).map(|i| m[i * columns + j] * m[i * columns + j]).sum();
        if square == 0.0 {
            continue;
        }
        let diagonal = m[j * columns + j];
        let norm = (diagonal * diagonal + square).sqrt();
        let alpha = if diagonal > 0.0 { -norm } else { norm };
        // The reflection's vector is (head, column below); it leaves alpha.
        let head = diagonal - alpha;
        let factor = 2.0 / (head * head + square);
        for column in j + 1..columns {
            let mut sum = head * m[j * columns + column];
            for i in j + 1..rows {
                sum += m[i * columns + j] * m[i * columns + column];
            }
            sum *= factor;
            m[j * columns + column] -= sum * head;
            for i in j + 1..rows {
                m[i * columns + column] -= sum * m[i * columns + j];
            }
        }
        m[j * columns + j] = alpha;
        (j + 1..rows).for_each(|i| m[i * columns + j] = 0.0);
    }
}
