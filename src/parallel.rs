//! Work shared between threads. Rayon is instantiated here, once, and not for every closure: its iterators made an
//! eighth of the library's machine code.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// So many parts a thread even out what takes unequally long.
const PARTS: usize = 16;

/// `of` 0 … n − 1, in that order. Threads take `together` of them at a time, at least.
pub(crate) fn map<T: Send>(n: usize, together: usize, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
    map_with(n, together, || (), |(), k| of(k))
}

/// [`map`] with something that a thread uses again from one to the next, such as memory.
pub(crate) fn map_with<T: Send, W>(
    n: usize,
    together: usize,
    new: impl Fn() -> W + Sync,
    of: impl Fn(&mut W, usize) -> T + Sync,
) -> Vec<T> {
    let part = together.max(n.div_ceil(PARTS * rayon::current_num_threads())).max(1);
    let parts: Vec<Mutex<Vec<T>>> = (0..n.div_ceil(part)).map(|_| Mutex::default()).collect();
    run(0..parts.len(), &|k| {
        let mut with = new();
        let own = (k * part..n.min((k + 1) * part)).map(|k| of(&mut with, k)).collect();
        *parts[k].lock().unwrap_or_else(PoisonError::into_inner) = own;
    });
    let mut all = Vec::with_capacity(n);
    for part in parts {
        all.append(&mut part.into_inner().unwrap_or_else(PoisonError::into_inner));
    }
    all
}

/// `of` every item, in their order.
pub(crate) fn of<T: Send, U: Send>(items: impl IntoIterator<Item = T>, of: impl Fn(T) -> U + Sync) -> Vec<U> {
    let items: Vec<Mutex<Option<T>>> = items.into_iter().map(|item| Mutex::new(Some(item))).collect();
    let item = |k: usize| items[k].lock().unwrap_or_else(PoisonError::into_inner).take();
    map(items.len(), 1, |k| of(item(k).expect("every item is taken once")))
}

/// `work` on every part of an array: part k is what lies between `ends[k]` and `ends[k + 1]`, less
/// `ends[0]`. Threads take parts of some [`TOGETHER`] entries at a time, at least.
pub(crate) fn parts<T: Send>(array: &mut [T], ends: &[usize], work: impl Fn(usize, &mut [T]) + Sync) {
    divide(array, ends, 0, &work);
}

/// Entries that are worth a task.
const TOGETHER: usize = 1 << 14;

fn divide<T: Send>(array: &mut [T], ends: &[usize], first: usize, work: &(dyn Fn(usize, &mut [T]) + Sync)) {
    let count = ends.len().saturating_sub(1);
    if count > 1 && array.len() > TOGETHER {
        let middle = count / 2;
        let (before, after) = array.split_at_mut(ends[middle] - ends[0]);
        let halves = (&ends[..=middle], &ends[middle..]);
        rayon::join(|| divide(before, halves.0, first, work), || divide(after, halves.1, first + middle, work));
        return;
    }
    let mut rest = array;
    for k in 0..count {
        let (part, behind) = rest.split_at_mut(ends[k + 1] - ends[k]);
        work(first + k, part);
        rest = behind;
    }
}

fn run(parts: Range<usize>, work: &(dyn Fn(usize) + Sync)) {
    let middle = parts.start + parts.len() / 2;
    match parts.len() {
        0 => {}
        1 => work(parts.start),
        _ => {
            rayon::join(|| run(parts.start..middle, work), || run(middle..parts.end, work));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_is_worked_on_once_and_is_where_its_ends_say() {
        let ends: Vec<usize> = (0..=500).map(|k| 7 + k * (k + 3) / 2).collect();
        let mut array = vec![0; ends[500] - 7];
        assert!(array.len() > 2 * TOGETHER);
        parts(&mut array, &ends, |k, part| {
            assert_eq!(part.len(), ends[k + 1] - ends[k]);
            part.iter_mut().for_each(|x| *x += k + 1);
        });
        for (k, pair) in ends.windows(2).enumerate() {
            assert!(array[pair[0] - 7..pair[1] - 7].iter().all(|&x| x == k + 1), "part {k}");
        }
        parts(&mut array[..0], &[], |_, _| unreachable!("there is no part"));
    }
}
