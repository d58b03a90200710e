//! Chunks one after the other. The next is prepared and uploaded while the device works on the
//! last.

use std::collections::VecDeque;
use std::ops::Range;

use crate::error::{Error, Result};

/// Chunks under way at once: one on the device, one on its way there.
const IN_FLIGHT: usize = 2;

/// A run that ended early. Everything before `finished` is done and kept.
#[derive(Debug)]
pub struct Interrupted {
    /// What happened.
    pub error: Error,
    /// First curve that is not finished.
    pub finished: usize,
}

/// An error before the first chunk.
impl From<Error> for Interrupted {
    fn from(error: Error) -> Self {
        Interrupted { error, finished: 0 }
    }
}

impl From<Interrupted> for Error {
    fn from(interrupted: Interrupted) -> Self {
        interrupted.error
    }
}

/// Where a run lost its device, and why. The curves from this one on are not finished.
pub(crate) struct Lost {
    pub finished: usize,
    pub why: String,
}

/// Keeps what was finished when the device is lost or does not answer in time.
///
/// Every method with a status for each curve calls it. The statuses say which curves were not
/// finished. If no curve was finished it is an error, like any other.
///
/// # Errors
/// That of the run, unless it lost its device after curves were finished.
pub(crate) fn kept(done: Result<(), Interrupted>) -> Result<Option<Lost>> {
    match done {
        Ok(()) => Ok(None),
        Err(Interrupted { error: error @ (Error::DeviceLost(_) | Error::Timeout { .. }), finished })
            if finished > 0 =>
        {
            Ok(Some(Lost { finished, why: error.to_string() }))
        }
        Err(interrupted) => Err(interrupted.error),
    }
}

/// The error of a curve whose status word is not one that the kernel writes.
pub(crate) fn unwritten(kernel: &str, curve: impl std::fmt::Display, word: u32) -> Error {
    let message = format!("{curve} has the status word {word}: no kernel wrote it");
    Error::Kernel { kernel: kernel.into(), message }
}

/// Submits the chunks (ranges of curves) in order, and finishes each as its results arrive.
///
/// Chunks are finished in order, too. If the device has no memory for a chunk, the chunks under way
/// are finished and those left are halved, once.
///
/// # Errors
/// The first error of `submit`, `wait` or `finish`, with the number of curves finished before.
pub fn pipeline<P, R>(
    chunks: Vec<Range<usize>>,
    mut submit: impl FnMut(&Range<usize>) -> Result<P>,
    mut wait: impl FnMut(P) -> Result<R>,
    mut finish: impl FnMut(&Range<usize>, R) -> Result<()>,
) -> Result<(), Interrupted> {
    let mut finished = chunks.first().map_or(0, |chunk| chunk.start);
    let mut waiting: VecDeque<Range<usize>> = chunks.into();
    let mut under_way: VecDeque<(Range<usize>, P)> = VecDeque::with_capacity(IN_FLIGHT);
    let mut halved = false;
    loop {
        if under_way.len() < IN_FLIGHT
            && let Some(chunk) = waiting.pop_front()
        {
            match submit(&chunk) {
                Ok(pending) => under_way.push_back((chunk, pending)),
                Err(Error::OutOfMemory { .. }) if !halved => {
                    halved = true;
                    waiting.push_front(chunk);
                    waiting = waiting.iter().flat_map(halves).collect();
                    // The memory of the chunks under way is free again before the next is tried.
                    drain(&mut under_way, &mut finished, &mut wait, &mut finish, 0)?;
                }
                Err(error) => {
                    // Chunks that were submitted before may still end well.
                    drain(&mut under_way, &mut finished, &mut wait, &mut finish, 0)?;
                    return Err(Interrupted { error, finished });
                }
            }
        } else if under_way.is_empty() {
            return Ok(());
        } else {
            let left = under_way.len() - 1;
            drain(&mut under_way, &mut finished, &mut wait, &mut finish, left)?;
        }
    }
}

/// Finishes chunks until only `left` are under way.
fn drain<P, R>(
    under_way: &mut VecDeque<(Range<usize>, P)>,
    finished: &mut usize,
    wait: &mut impl FnMut(P) -> Result<R>,
    finish: &mut impl FnMut(&Range<usize>, R) -> Result<()>,
    left: usize,
) -> Result<(), Interrupted> {
    while under_way.len() > left {
        let (chunk, pending) = under_way.pop_front().expect("there are more than are to be left");
        let done = wait(pending).and_then(|results| finish(&chunk, results));
        done.map_err(|error| Interrupted { error, finished: *finished })?;
        *finished = chunk.end;
    }
    Ok(())
}

fn halves(chunk: &Range<usize>) -> Vec<Range<usize>> {
    let middle = chunk.start + chunk.len().div_ceil(2);
    [chunk.start..middle, middle..chunk.end].into_iter().filter(|half| !half.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs chunks of ten curves on a device that has memory for `room` curves, and is lost before
    /// curve `lost`.
    fn run(room: usize, lost: usize) -> (Result<(), Interrupted>, Vec<Range<usize>>) {
        let mut done = Vec::new();
        let result = pipeline(
            vec![0..10, 10..20, 20..27],
            |chunk| match chunk.len() <= room {
                true => Ok(chunk.clone()),
                false => Err(Error::OutOfMemory { chunk_bytes: chunk.len() as u64 }),
            },
            |chunk: Range<usize>| if chunk.end > lost { Err(Error::DeviceLost("gone".into())) } else { Ok(chunk) },
            |chunk, results| {
                assert_eq!(*chunk, results);
                done.push(results);
                Ok(())
            },
        );
        (result, done)
    }

    #[test]
    fn every_chunk_is_finished_once_and_in_order() {
        let (result, done) = run(10, 100);
        assert!(result.is_ok());
        assert_eq!(done, [0..10, 10..20, 20..27]);
    }

    #[test]
    fn chunks_are_halved_once_when_memory_runs_out() {
        let (result, done) = run(5, 100);
        assert!(result.is_ok());
        assert_eq!(done, [0..5, 5..10, 10..15, 15..20, 20..24, 24..27]);
        let (result, done) = run(4, 100);
        assert!(matches!(result, Err(Interrupted { error: Error::OutOfMemory { .. }, finished: 0 })));
        assert!(done.is_empty());
    }

    #[test]
    fn what_was_finished_before_the_device_was_lost_is_kept() {
        let (result, done) = run(10, 20);
        assert!(matches!(result, Err(Interrupted { error: Error::DeviceLost(_), finished: 20 })));
        assert_eq!(done, [0..10, 10..20]);
        assert!(kept(Ok(())).unwrap().is_none());
        let lost = kept(result).unwrap().expect("two chunks were finished");
        assert_eq!((lost.finished, lost.why.as_str()), (20, "the device was lost: gone; run again, or use the CPU"));
        let timeout = Interrupted { error: Error::Timeout { seconds: 60 }, finished: 20 };
        assert_eq!(kept(Err(timeout)).unwrap().expect("as before").finished, 20);
    }

    #[test]
    fn a_device_lost_before_anything_was_finished_is_an_error() {
        assert!(matches!(kept(run(10, 0).0), Err(Error::DeviceLost(_))));
        let other = Interrupted { error: Error::OutOfMemory { chunk_bytes: 1 }, finished: 20 };
        assert!(matches!(kept(Err(other)), Err(Error::OutOfMemory { .. })));
    }
}
