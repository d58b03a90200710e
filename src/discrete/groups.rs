//! [`Groups`]: the curves of a fit in groups, which one thread takes or which descend side by side.

/// Curves by their numbers, group after group.
pub(super) struct Groups {
    order: Vec<usize>,
    /// Where each group begins in the order, and where the last ends.
    offsets: Vec<usize>,
}

impl Groups {
    /// Cuts an order into groups. `is_full` says of a group so far whether the next curve begins another.
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

    /// Brings what was found, group after group, into the order of the curves.
    pub fn restore<T>(&self, found: impl Iterator<Item = T>) -> Vec<T> {
        let mut all: Vec<Option<T>> = self.order.iter().map(|_| None).collect();
        self.order.iter().zip(found).for_each(|(&i, found)| all[i] = Some(found));
        all.into_iter().map(|found| found.expect("every curve is in one group")).collect()
    }
}
