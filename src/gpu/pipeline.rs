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

/// What waiting for a chunk comes to.
pub enum Step<P, R> {
    /// It has been submitted again, to go on.
    Again(P),
    /// Its results.
    Done(R),
}

/// For chunks that are submitted once: waiting for one brings its results.
pub fn once<P, R>(mut wait: impl FnMut(P) -> Result<R>) -> impl FnMut(P) -> Result<Step<P, R>> {
    move |pending| wait(pending).map(Step::Done)
}

/// Submits the chunks (ranges of curves) in order, and finishes each as its results arrive.
///
/// Chunks are finished in order, too. A chunk that has to be submitted several times shares the
/// device with the next: the one whose submission is the oldest is waited for. If the device has no
/// memory for a chunk, the chunks under way are finished and those left are halved, once.
///
/// # Errors
/// The first error of `submit`, `wait` or `finish`, with the number of curves finished before.
pub fn pipeline<P, R>(
    chunks: Vec<Range<usize>>,
    mut submit: impl FnMut(&Range<usize>) -> Result<P>,
    wait: impl FnMut(P) -> Result<Step<P, R>>,
    finish: impl FnMut(&Range<usize>, R) -> Result<()>,
) -> Result<(), Interrupted> {
    let finished = chunks.first().map_or(0, |chunk| chunk.start);
    let mut waiting: VecDeque<Range<usize>> = chunks.into();
    let mut flight = Flight { chunks: VecDeque::with_capacity(IN_FLIGHT), finished, submissions: 0, wait, finish };
    let mut halved = false;
    loop {
        if flight.chunks.len() < IN_FLIGHT
            && let Some(chunk) = waiting.pop_front()
        {
            match submit(&chunk) {
                Ok(pending) => flight.add(chunk, pending),
                Err(Error::OutOfMemory { .. }) if !halved => {
                    halved = true;
                    waiting.push_front(chunk);
                    waiting = waiting.iter().flat_map(halves).collect();
                    // The memory of the chunks under way is free again before the next is tried.
                    flight.land()?;
                }
                Err(error) => {
                    // Chunks that were submitted before may still end well.
                    flight.land()?;
                    return Err(Interrupted { error, finished: flight.finished });
                }
            }
        } else if flight.chunks.is_empty() {
            return Ok(());
        } else {
            flight.advance()?;
        }
    }
}

/// The chunks under way, in order.
struct Flight<P, R, W, F> {
    chunks: VecDeque<UnderWay<P, R>>,
    /// First curve that is not finished.
    finished: usize,
    /// Submissions so far.
    submissions: usize,
    wait: W,
    finish: F,
}

struct UnderWay<P, R> {
    curves: Range<usize>,
    state: State<P, R>,
}

enum State<P, R> {
    /// Submitted, as which submission.
    Submitted(usize, P),
    Done(R),
}

impl<P, R, W, F> Flight<P, R, W, F>
where
    W: FnMut(P) -> Result<Step<P, R>>,
    F: FnMut(&Range<usize>, R) -> Result<()>,
{
    fn add(&mut self, curves: Range<usize>, pending: P) {
        let state = self.submitted(pending);
        self.chunks.push_back(UnderWay { curves, state });
    }

    fn submitted(&mut self, pending: P) -> State<P, R> {
        self.submissions += 1;
        State::Submitted(self.submissions, pending)
    }

    /// Finishes all chunks.
    fn land(&mut self) -> Result<(), Interrupted> {
        while !self.chunks.is_empty() {
            self.advance()?;
        }
        Ok(())
    }

    /// Waits for the oldest submission, and finishes the chunks that are done.
    fn advance(&mut self) -> Result<(), Interrupted> {
        let submission = |chunk: &UnderWay<P, R>| match &chunk.state {
            State::Submitted(submission, _) => *submission,
            State::Done(_) => usize::MAX,
        };
        let oldest = (0..self.chunks.len()).min_by_key(|&k| submission(&self.chunks[k])).expect("a chunk is under way");
        let UnderWay { curves, state } = self.chunks.remove(oldest).expect("a chunk of the list");
        let step = match state {
            State::Submitted(_, pending) => (self.wait)(pending),
            State::Done(results) => Ok(Step::Done(results)),
        };
        let state = match step {
            Ok(Step::Again(pending)) => self.submitted(pending),
            Ok(Step::Done(results)) => State::Done(results),
            Err(error) => {
                // Chunks before this one may still end well.
                self.chunks.truncate(oldest);
                self.land()?;
                return Err(Interrupted { error, finished: self.finished });
            }
        };
        self.chunks.insert(oldest, UnderWay { curves, state });
        while let Some(UnderWay { state: State::Done(_), .. }) = self.chunks.front() {
            let first = self.chunks.pop_front().expect("there is a first");
            let State::Done(results) = first.state else { unreachable!("it is done") };
            let done = (self.finish)(&first.curves, results);
            done.map_err(|error| Interrupted { error, finished: self.finished })?;
            self.finished = first.curves.end;
        }
        Ok(())
    }
}

fn halves(chunk: &Range<usize>) -> Vec<Range<usize>> {
    let middle = chunk.start + chunk.len().div_ceil(2);
    [chunk.start..middle, middle..chunk.end].into_iter().filter(|half| !half.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

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
            |chunk: Range<usize>| match chunk.end > lost {
                true => Err(Error::DeviceLost("gone".into())),
                false => Ok(Step::Done(chunk)),
            },
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
    fn a_chunk_that_goes_on_shares_the_device_with_the_next() {
        let (waited, mut done) = (RefCell::new(Vec::new()), Vec::new());
        let rounds = [3, 1, 2, 1];
        let result = pipeline(
            (0..4).map(|k| k..k + 1).collect(),
            |chunk| Ok((chunk.start, 0)),
            |(chunk, round)| {
                waited.borrow_mut().push((chunk, round));
                Ok(if round + 1 == rounds[chunk] { Step::Done(chunk) } else { Step::Again((chunk, round + 1)) })
            },
            |chunk, results| {
                assert_eq!(chunk.start, results);
                done.push(results);
                Ok(())
            },
        );
        assert!(result.is_ok());
        assert_eq!(done, [0, 1, 2, 3]);
        // The first two in turns; once the first is done, so is the second, and the next follow.
        assert_eq!(waited.into_inner(), [(0, 0), (1, 0), (0, 1), (0, 2), (2, 0), (3, 0), (2, 1)]);
    }

    #[test]
    fn a_chunk_behind_the_one_that_was_lost_is_not_finished() {
        let mut done = Vec::new();
        let result = pipeline(
            (0..3).map(|k| k..k + 1).collect(),
            |chunk| Ok((chunk.start, 0)),
            |(chunk, round)| match (chunk, round) {
                (1, _) => Err(Error::DeviceLost("gone".into())),
                (0, 0) => Ok(Step::Again((0, 1))),
                _ => Ok(Step::Done(chunk)),
            },
            |_, results| {
                done.push(results);
                Ok(())
            },
        );
        assert!(matches!(result, Err(Interrupted { error: Error::DeviceLost(_), finished: 1 })));
        assert_eq!(done, [0]);
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
