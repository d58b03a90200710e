//! Parallel maps. Rayon is instantiated here once, and not for every closure: its iterators made up
//! an eighth of the library's machine code. Generic code only fills vectors.

use std::ops::Range;

/// Parts per thread. Several parts balance unequal times.
const PARTS: usize = 16;

/// Work on a part, with the memory for its results.
pub(crate) type Task<'a> = Box<dyn FnMut() + Send + 'a>;

/// `of` 0 … n − 1, in order. Threads take at least `together` of them at a time.
pub(crate) fn map<T: Send>(n: usize, together: usize, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
    ranges(n, together, &|range| {
        let mut own = Vec::with_capacity(range.len());
        for k in range {
            own.push(of(k));
        }
        own
    })
}

/// [`map`] with state that a thread reuses, such as memory.
pub(crate) fn map_with<T: Send, W>(
    n: usize,
    together: usize,
    new: impl Fn() -> W + Sync,
    of: impl Fn(&mut W, usize) -> T + Sync,
) -> Vec<T> {
    ranges(n, together, &|range| {
        let (mut with, mut own) = (new(), Vec::with_capacity(range.len()));
        for k in range {
            own.push(of(&mut with, k));
        }
        own
    })
}

/// `of` every item, in order.
pub(crate) fn of<T: Send, U: Send>(items: impl IntoIterator<Item = T>, of: impl Fn(T) -> U + Sync) -> Vec<U> {
    let (items, of) = (items.into_iter(), &of);
    let mut waiting = Vec::with_capacity(items.size_hint().0);
    for item in items {
        waiting.push(Some(item));
    }
    let (n, part) = (waiting.len(), part(waiting.len(), 1));
    let mut found = empty(n.div_ceil(part));
    let mut tasks: Vec<Task> = Vec::with_capacity(found.len());
    for (items, found) in waiting.chunks_mut(part).zip(&mut found) {
        tasks.push(Box::new(move || {
            let mut own = Vec::with_capacity(items.len());
            for item in &mut *items {
                own.push(of(item.take().expect("every item is taken once")));
            }
            *found = own;
        }));
    }
    run(&mut tasks);
    drop(tasks);
    joined(n, found)
}

/// `work` on every item.
pub(crate) fn each<T: Send>(items: &mut [T], work: impl Fn(&mut T) + Sync) {
    let mut tasks: Vec<Task> = Vec::new();
    for items in items.chunks_mut(part(items.len(), TOGETHER / 16)) {
        let work = &work;
        tasks.push(Box::new(move || items.iter_mut().for_each(work)));
    }
    run(&mut tasks);
}

/// `work` on every part of an array. Part k goes from `ends[k]` to `ends[k + 1]`, less `ends[0]`.
/// Threads take parts of about [`TOGETHER`] entries at a time, or more.
pub(crate) fn parts<T: Send>(array: &mut [T], ends: &[usize], work: impl Fn(usize, &mut [T]) + Sync) {
    let mut tasks = Vec::new();
    divide(array, ends, 0, &work, &mut tasks);
    run(&mut tasks);
}

/// The fewest entries of a task.
pub(crate) const TOGETHER: usize = 1 << 14;

fn divide<'a, T: Send>(
    array: &'a mut [T],
    ends: &'a [usize],
    first: usize,
    work: &'a (dyn Fn(usize, &mut [T]) + Sync),
    tasks: &mut Vec<Task<'a>>,
) {
    let count = ends.len().saturating_sub(1);
    if count > 1 && array.len() > TOGETHER {
        let middle = count / 2;
        let (before, after) = array.split_at_mut(ends[middle] - ends[0]);
        divide(before, &ends[..=middle], first, work, tasks);
        divide(after, &ends[middle..], first + middle, work, tasks);
        return;
    }
    tasks.push(Box::new(move || {
        let mut rest = &mut *array;
        for k in 0..count {
            let (part, behind) = rest.split_at_mut(ends[k + 1] - ends[k]);
            work(first + k, part);
            rest = behind;
        }
    }));
}

/// The vectors `of` the parts of 0 … n − 1, concatenated.
fn ranges<T: Send>(n: usize, together: usize, of: &(dyn Fn(Range<usize>) -> Vec<T> + Sync)) -> Vec<T> {
    let part = part(n, together);
    let mut found = empty(n.div_ceil(part));
    let mut tasks: Vec<Task> = Vec::with_capacity(found.len());
    for (k, found) in found.iter_mut().enumerate() {
        tasks.push(Box::new(move || *found = of(k * part..n.min((k + 1) * part))));
    }
    run(&mut tasks);
    drop(tasks);
    joined(n, found)
}

/// The size of a part of n.
fn part(n: usize, together: usize) -> usize {
    together.max(n.div_ceil(PARTS * threads())).max(1)
}

/// The number of threads.
pub(crate) fn threads() -> usize {
    rayon::current_num_threads()
}

fn empty<T>(count: usize) -> Vec<Vec<T>> {
    let mut found = Vec::with_capacity(count);
    for _ in 0..count {
        found.push(Vec::new());
    }
    found
}

fn joined<T>(n: usize, found: Vec<Vec<T>>) -> Vec<T> {
    let mut all = Vec::with_capacity(n);
    for mut part in found {
        all.append(&mut part);
    }
    all
}

/// Runs tasks on all threads.
pub(crate) fn run(tasks: &mut [Task]) {
    match tasks {
        [] => {}
        [task] => task(),
        _ => {
            let (before, after) = tasks.split_at_mut(tasks.len() / 2);
            rayon::join(|| run(before), || run(after));
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

    #[test]
    fn results_stand_in_the_order_of_what_they_are_of() {
        for n in [0, 1, 2, 1000] {
            let all: Vec<String> = (0..n).map(|k| k.to_string()).collect();
            let counted = map_with(n, 3, || 0, |count, k| (std::mem::replace(count, *count + 1), k.to_string()));
            assert!(counted.first().is_none_or(|first| first.0 == 0));
            assert!(
                counted.windows(2).all(|pair| pair[1].0 == 0 || pair[1].0 == pair[0].0 + 1),
                "a count begins again"
            );
            assert_eq!(counted.into_iter().map(|(_, text)| text).collect::<Vec<_>>(), all);
            assert_eq!(map(n, 1, |k| k.to_string()), all);
            assert_eq!(of(0..n, |k| k.to_string()), all);
        }
    }
}
