//! [`Groups`]: the curves of a fit in groups that one thread takes, or that descend side by side.

/// The indices of curves, group after group.
pub(super) struct Groups {
    order: Vec<usize>,
    /// The start of each group in `order`, and the end of the last.
    offsets: Vec<usize>,
}

impl Groups {
    /// Cuts an order into groups. `is_full` is called with the group so far and the next curve, and
    /// says whether that curve begins a new group.
    pub fn of(order: Vec<usize>, mut is_full: impl FnMut(&[usize], usize) -> bool) -> Self {
        let (mut offsets, mut first) = (vec![0], 0);
        for k in 1..order.len() {
            if is_full(&order[first..k], order[k]) {
                offsets.push(k);
                first = k;
            }
        }
        offsets.extend((!order.is_empty()).then_some(order.len()));
        Groups { order, offsets }
    }

    pub fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    pub fn get(&self, k: usize) -> &[usize] {
        &self.order[self.offsets[k]..self.offsets[k + 1]]
    }

    /// Sorts results from group order into curve order.
    pub fn restore<T>(&self, found: impl Iterator<Item = T>) -> Vec<T> {
        let mut all: Vec<Option<T>> = self.order.iter().map(|_| None).collect();
        self.order.iter().zip(found).for_each(|(&i, found)| all[i] = Some(found));
        all.into_iter().map(|found| found.expect("every curve is in one group")).collect()
    }
}
