//! [`Layout`]: the positions of a chunk's grids on the device.

use std::ops::Range;

use super::super::refine::refined;
use super::{GROUP, Grids};

/// Grids of one shape, stored side by side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Family {
    pub shape: [usize; 2],
    /// The first of its grids among the members.
    first: usize,
    pub count: usize,
}

/// The grids of a chunk that are sent, sorted by shapes.
pub(super) struct Layout {
    chunk: Range<usize>,
    pub dimension: usize,
    /// Indices of the grids, sorted by shape, then by index.
    pub members: Vec<usize>,
    pub families: Vec<Family>,
}

impl Layout {
    pub fn new(grids: &Grids, chunk: &Range<usize>, sent: &[bool]) -> Self {
        let mut members: Vec<usize> = chunk.clone().filter(|&i| sent[i]).collect();
        members.sort_by_key(|&i| grids.shape(i));
        let mut families: Vec<Family> = Vec::new();
        for (k, &i) in members.iter().enumerate() {
            match families.last_mut() {
                Some(family) if family.shape == grids.shape(i) => family.count += 1,
                _ => families.push(Family { shape: grids.shape(i), first: k, count: 1 }),
            }
        }
        Layout { chunk: chunk.clone(), dimension: grids.dimension(), members, families }
    }

    /// The shapes of all families after some rounds.
    pub fn shapes(&self, rounds: u32) -> impl Iterator<Item = [usize; 2]> {
        self.families.iter().map(move |family| refined(family.shape, rounds).expect("the last shapes have fitted"))
    }

    /// The first number of every family's grids after some rounds, and the total of numbers.
    pub fn offsets(&self, rounds: u32) -> (Vec<usize>, usize) {
        self.numbers(rounds, |[rows, columns]| rows * columns)
    }

    /// The same for arrays with `points` points for a grid of this shape.
    pub fn numbers(&self, rounds: u32, points: impl Fn([usize; 2]) -> usize) -> (Vec<usize>, usize) {
        let mut total = 0;
        let mut offsets = Vec::with_capacity(self.families.len());
        for (family, shape) in self.families.iter().zip(self.shapes(rounds)) {
            offsets.push(total);
            total += family.count * points(shape) * self.dimension;
        }
        (offsets, total)
    }

    /// The first workgroup of every family, and how many workgroups there are.
    ///
    /// `threads` is the number of threads for a grid of this shape.
    pub fn workgroups(&self, rounds: u32, threads: impl Fn([usize; 2]) -> usize) -> (Vec<u32>, usize) {
        let mut total = 0;
        let mut starts = Vec::with_capacity(self.families.len());
        for (family, shape) in self.families.iter().zip(self.shapes(rounds)) {
            starts.push(total as u32);
            total += (family.count * threads(shape)).div_ceil(GROUP);
        }
        (starts, total)
    }

    /// The position of every grid of the chunk, if it was sent.
    ///
    /// The entries are its index among the members, and the first of its numbers after some rounds.
    pub fn places(&self, rounds: u32) -> Vec<Option<(usize, usize)>> {
        let mut places = vec![None; self.chunk.len()];
        let (offsets, _) = self.offsets(rounds);
        for ((family, shape), offset) in self.families.iter().zip(self.shapes(rounds)).zip(offsets) {
            let size = shape[0] * shape[1] * self.dimension;
            for k in 0..family.count {
                let member = family.first + k;
                places[self.members[member] - self.chunk.start] = Some((member, offset + k * size));
            }
        }
        places
    }
}
