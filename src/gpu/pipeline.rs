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

/// The first curve that was not finished when the device was lost, and why it was lost.
pub(crate) struct Lost {
    pub finished: usize,
    pub why: String,
}

/// Keeps the finished curves if the device is lost or does not answer in time.
///
/// Every method with a status for each curve calls it. The statuses tell which curves were not
/// finished. If no curve was finished, the loss is an error like any other.
///
/// # Errors
/// The run's error, unless it lost its device after curves were finished.
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

/// The result of waiting for a chunk.
pub enum Step<P, R> {
    /// It has been submitted again, to go on.
    Again(P),
    /// Its results.
    Done(R),
}

/// Waits for chunks that are submitted once.
pub fn once<P, R>(mut wait: impl FnMut(P) -> Result<R>) -> impl FnMut(P) -> Result<Step<P, R>> {
    move |pending| wait(pending).map(Step::Done)
}

/// Submits the chunks (ranges of curves) in order, and finishes each as its results arrive.
///
/// Chunks are finished in order, too. A chunk that is submitted several times shares the device with
/// the next chunk: the oldest submission is waited for. If the device has no memory for a chunk, the
/// chunks under way are finished and the remaining chunks are halved, once.
///
/// # Errors
/// The first error of `submit`, `wait` or `finish`, with the number of curves finished before.
pub fn pipeline<P, R>(
    chunks: Vec<Range<usize>>,
    submit: impl FnMut(&Range<usize>) -> Result<P>,
    wait: impl FnMut(P) -> Result<Step<P, R>>,
    finish: impl FnMut(&Range<usize>, R) -> Result<()>,
) -> Result<(), Interrupted> {
    drive(chunks, &mut Steps { slots: [Slot::Empty, Slot::Empty], submit, wait, finish })
}

/// The steps of a chunk, which occupies a slot while it is under way.
trait Work {
    fn submit(&mut self, slot: usize, curves: &Range<usize>) -> Result<()>;
    /// Whether the results are there. If not, the chunk has been submitted again.
    fn wait(&mut self, slot: usize) -> Result<bool>;
    fn finish(&mut self, slot: usize, curves: &Range<usize>) -> Result<()>;
    fn discard(&mut self, slot: usize);
}

/// The part of a run that is compiled for each kind of chunk.
struct Steps<P, R, S, W, F> {
    slots: [Slot<P, R>; IN_FLIGHT],
    submit: S,
    wait: W,
    finish: F,
}

enum Slot<P, R> {
    Empty,
    Submitted(P),
    Done(R),
}

impl<P, R, S, W, F> Work for Steps<P, R, S, W, F>
where
    S: FnMut(&Range<usize>) -> Result<P>,
    W: FnMut(P) -> Result<Step<P, R>>,
    F: FnMut(&Range<usize>, R) -> Result<()>,
{
    fn submit(&mut self, slot: usize, curves: &Range<usize>) -> Result<()> {
        self.slots[slot] = Slot::Submitted((self.submit)(curves)?);
        Ok(())
    }

    fn wait(&mut self, slot: usize) -> Result<bool> {
        let Slot::Submitted(pending) = std::mem::replace(&mut self.slots[slot], Slot::Empty) else {
            unreachable!("the chunk was submitted")
        };
        self.slots[slot] = match (self.wait)(pending)? {
            Step::Again(pending) => Slot::Submitted(pending),
            Step::Done(results) => Slot::Done(results),
        };
        Ok(matches!(self.slots[slot], Slot::Done(_)))
    }

    fn finish(&mut self, slot: usize, curves: &Range<usize>) -> Result<()> {
        let Slot::Done(results) = std::mem::replace(&mut self.slots[slot], Slot::Empty) else {
            unreachable!("the chunk is done")
        };
        (self.finish)(curves, results)
    }

    fn discard(&mut self, slot: usize) {
        self.slots[slot] = Slot::Empty;
    }
}

fn drive(chunks: Vec<Range<usize>>, work: &mut dyn Work) -> Result<(), Interrupted> {
    let finished = chunks.first().map_or(0, |chunk| chunk.start);
    let mut waiting: VecDeque<Range<usize>> = chunks.into();
    let mut flight = Flight { chunks: Vec::with_capacity(IN_FLIGHT), finished, submissions: 0, work };
    let mut halved = false;
    loop {
        if flight.chunks.len() < IN_FLIGHT
            && let Some(chunk) = waiting.pop_front()
        {
            match flight.add(&chunk) {
                Ok(()) => {}
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
struct Flight<'a> {
    chunks: Vec<UnderWay>,
    /// First curve that is not finished.
    finished: usize,
    /// Submissions so far.
    submissions: usize,
    work: &'a mut dyn Work,
}

struct UnderWay {
    curves: Range<usize>,
    slot: usize,
    /// Number of its last submission, or [`DONE`](Self::DONE).
    submission: usize,
}

impl UnderWay {
    const DONE: usize = usize::MAX;
}

impl Flight<'_> {
    fn add(&mut self, curves: &Range<usize>) -> Result<()> {
        let is_free = |slot: &usize| self.chunks.iter().all(|chunk| chunk.slot != *slot);
        let slot = (0..IN_FLIGHT).find(is_free).expect("a slot is free");
        self.work.submit(slot, curves)?;
        self.submissions += 1;
        self.chunks.push(UnderWay { curves: curves.clone(), slot, submission: self.submissions });
        Ok(())
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
        let oldest = (0..self.chunks.len()).min_by_key(|&k| self.chunks[k].submission).expect("a chunk is under way");
        match self.work.wait(self.chunks[oldest].slot) {
            Ok(true) => self.chunks[oldest].submission = UnderWay::DONE,
            Ok(false) => {
                self.submissions += 1;
                self.chunks[oldest].submission = self.submissions;
            }
            Err(error) => {
                // Chunks before this one may still end well.
                for chunk in self.chunks.drain(oldest..) {
                    self.work.discard(chunk.slot);
                }
                self.land()?;
                return Err(Interrupted { error, finished: self.finished });
            }
        }
        while self.chunks.first().is_some_and(|chunk| chunk.submission == UnderWay::DONE) {
            let UnderWay { curves, slot, .. } = self.chunks.remove(0);
            let done = self.work.finish(slot, &curves);
            done.map_err(|error| Interrupted { error, finished: self.finished })?;
            self.finished = curves.end;
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
