//! Work shared between threads. Rayon is instantiated here, once, and not for every closure: its iterators made an
//! eighth of the library's machine code.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// So many parts a thread even out what takes unequally long.
const PARTS: usize = 16;

/// `of` 0 … n − 1, in that order. Threads take `together` of them at a time, at least.
pub(crate) fn map<T: Send>(n: usize, together: usize, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let part = together.max(n.div_ceil(PARTS * rayon::current_num_threads())).max(1);
    let parts: Vec<Mutex<Vec<T>>> = (0..n.div_ceil(part)).map(|_| Mutex::default()).collect();
    run(0..parts.len(), &|k| {
        let own = (k * part..n.min((k + 1) * part)).map(&of).collect();
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
