//! The order of rows: the rows of a curve are consecutive in a batch, wherever they stood in the
//! file.

use std::cmp::Ordering;

use crate::sort;

/// The curve of every row, as far as rows do not come curve by curve.
#[derive(Default)]
pub(super) struct Owners {
    /// Number of rows of every curve.
    pub counts: Vec<usize>,
    /// The curve of every row, once a curve has gone on after another one.
    mixed: Option<Vec<u32>>,
}

impl Owners {
    /// Whether a curve has gone on after another one.
    pub fn is_mixed(&self) -> bool {
        self.mixed.is_some()
    }

    /// Notes that a curve goes on after another one.
    pub fn mix(&mut self) {
        let counts = &self.counts;
        let so_far = || counts.iter().enumerate().flat_map(|(curve, &rows)| vec![curve as u32; rows]).collect();
        self.mixed.get_or_insert_with(so_far);
    }

    /// Counts a row of a curve.
    pub fn push(&mut self, curve: usize) {
        self.counts[curve] += 1;
        if let Some(mixed) = &mut self.mixed {
            mixed.push(curve as u32);
        }
    }

    /// The rows in the order of the curves, and of `t` within each of them if it is given; `None`
    /// where they stand so already. Equal rows keep their order, and those without a number go
    /// last.
    pub fn order(&self, t: Option<&[f64]>) -> Option<Vec<usize>> {
        if self.mixed.is_none() && t.is_none() {
            return None;
        }
        let owners = match &self.mixed {
            Some(mixed) => mixed.clone(),
            None => self.counts.iter().enumerate().flat_map(|(curve, &rows)| vec![curve as u32; rows]).collect(),
        };
        let later = |a: f64, b: f64| a.partial_cmp(&b).unwrap_or_else(|| a.is_nan().cmp(&b.is_nan()));
        let by_t = |a: usize, b: usize| t.map_or(Ordering::Equal, |t| later(t[a], t[b]));
        Some(sort::order(owners.len(), &|a, b| owners[a].cmp(&owners[b]).then_with(|| by_t(a, b))))
    }
}

/// Entries (`width` a row) in another order of rows.
pub(super) fn arranged<T: Copy>(values: &mut Vec<T>, width: usize, order: &[usize]) {
    *values = order.iter().flat_map(|&row| &values[row * width..(row + 1) * width]).copied().collect();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_brought_together_and_sorted_without_moving_equals() {
        let mut owners = Owners { counts: vec![0, 0], mixed: None };
        owners.push(0);
        owners.push(1);
        assert_eq!(owners.order(None), None);
        owners.mix();
        owners.push(0);
        owners.push(1);
        assert_eq!(owners.order(None), Some(vec![0, 2, 1, 3]));
        assert_eq!(owners.order(Some(&[5.0, f64::NAN, 4.0, 1.0])), Some(vec![2, 0, 3, 1]));
        assert_eq!(owners.order(Some(&[1.0, 2.0, 1.0, 2.0])), Some(vec![0, 2, 1, 3]));
        let mut values = vec![0, 1, 10, 11, 20, 21];
        arranged(&mut values, 2, &[2, 0, 1]);
        assert_eq!(values, [20, 21, 0, 1, 10, 11]);
    }
}
