//! The fast path of the CPU: L systems side by side, one in each lane of the vector registers.
//!
//! Both forms of a matrix are eliminated from the first row down to
//!
//! ```text
//! x_i = de_i + ga_i·x_{i+1} + al_i·x_0        (al only in a cyclic system, whose row 0 is kept for the end)
//! ```
//!
//! and substituted back from the last row up. A lane's operations and their order depend on its
//! system alone, and no products and sums are fused. So a system's bits depend neither on its
//! neighbours nor on the processor.

// Loops over lanes by number become vector instructions.
#![allow(clippy::needless_range_loop)]

use super::elimination::{Bands, Carry, Form, Network};
use super::group::{BLOCK, Group};
use super::scalar::{Lanes, Real, Scalar};
use super::singular;
use super::systems::{Matrix, Part, Scratch, Solutions, TridiagonalBatch};
use super::tasks::{take, tasks};
use super::wide::{Operation, has_wide_registers};
use crate::parallel;
use crate::status::CurveStatus;

/// The systems that a pass is compiled for. A pass for lanes knows whether they are cyclic. A pass for
/// single systems takes an argument, whose cost is negligible next to the divisions.
const OPEN: u8 = 0;
const CYCLIC: u8 = 1;
const EITHER: u8 = 2;

/// All threads of the CPU, a run of systems each at a time.
pub(super) fn solve_on_cpu<T: Real>(systems: &TridiagonalBatch<T>, rhs: &[T], columns: usize) -> Solutions<T> {
    let offsets = systems.offsets;
    let mut x = vec![T::ZERO; rhs.len()];
    let mut status = vec![CurveStatus::Converged; offsets.len() - 1];
    let (mut x_rest, mut status_rest) = (&mut x[..], &mut status[..]);
    let work: Vec<_> = tasks(offsets)
        .into_iter()
        .map(|range| {
            let rows = offsets[range.end] - offsets[range.start];
            let (x, status) = (take(&mut x_rest, rows * columns), take(&mut status_rest, range.len()));
            (Part { systems, range, rhs, columns }, x, status)
        })
        .collect();
    parallel::of(work, |(part, x, status)| T::solve_part(&part, x, status, &mut Scratch::default()));
    Solutions { x, status }
}

/// Solves the systems of a part; `x` and `status` begin with its first system.
pub(super) fn solve_part<T: Real, const L: usize>(
    part: &Part<T>,
    x: &mut [T],
    status: &mut [CurveStatus],
    scratch: &mut Scratch<T>,
) {
    let offsets = part.systems.offsets;
    let length = |i: usize| offsets[i + 1] - offsets[i];
    // Cyclic systems after open ones, short before long; then by number.
    let mut order = std::mem::take(&mut scratch.order);
    order.clear();
    order.extend(part.range.clone().map(|i| {
        let place = (i - part.range.start) as u64;
        u64::from(part.systems.cyclic.contains(i)) << 63 | (length(i).min(i32::MAX as usize) as u64) << 32 | place
    }));
    if order.windows(2).any(|pair| pair[0] > pair[1]) {
        order.sort_unstable();
    }
    let mut rest = &order[..];
    while let Some(&last) = rest.last() {
        let cyclic = last >> 63 == 1;
        let system = |key: u64| part.range.start + (key & u64::from(u32::MAX)) as usize;
        let longest = length(system(last));
        let suits =
            |&&key: &&u64| key >> 63 == last >> 63 && (2 * length(system(key)) >= longest || longest <= 2 * BLOCK);
        let count = rest.iter().rev().take(L).take_while(suits).count();
        let (before, members) = rest.split_at(rest.len() - count);
        rest = before;
        if longest == 0 {
            continue;
        }
        // One system after the other has the same bits.
        if 4 * count <= L || !has_wide_registers() {
            for &key in members {
                let group = Group::<1>::new(offsets, &[system(key)]);
                group.solve::<T, T, EITHER>(part, cyclic, x, status, &mut scratch.eliminated);
            }
        } else {
            let mut numbers = [0; L];
            numbers.iter_mut().zip(members).for_each(|(number, &key)| *number = system(key));
            let group = Group::<L>::new(offsets, &numbers[..count]);
            if cyclic {
                group.solve::<T, Lanes<T, L>, CYCLIC>(part, cyclic, x, status, &mut scratch.eliminated);
            } else {
                group.solve::<T, Lanes<T, L>, OPEN>(part, cyclic, x, status, &mut scratch.eliminated);
            }
        }
    }
    scratch.order = order;
}

impl<const L: usize> Group<L> {
    /// Solves the systems with the registers of S.
    fn solve<T: Real, S: Scalar, const KIND: u8>(
        &self,
        part: &Part<T>,
        cyclic: bool,
        x: &mut [T],
        status: &mut [CurveStatus],
        eliminated: &mut Vec<T>,
    ) {
        // ga, at most three columns of de, and al.
        let streams = 1 + part.columns.min(3) + usize::from(cyclic);
        let needed = self.longest.next_multiple_of(BLOCK) * L * streams;
        if eliminated.len() < needed {
            eliminated.resize(needed, T::ZERO);
        }
        let mut sound = [T::ZERO; L];
        let mut column = 0;
        while column < part.columns {
            let width = (part.columns - column).min(3);
            let work = Work { group: self, part, column, cyclic, x, eliminated, sound: &mut sound };
            match part.systems.matrix {
                Matrix::Bands { lower, diagonal, upper } => {
                    work.columns::<S, _, KIND>(width, Bands { lower, diagonal, upper });
                }
                Matrix::Network { excess, weights } => work.columns::<S, _, KIND>(width, Network { excess, weights }),
            }
            column += width;
        }
        for lane in 0..self.count {
            let (i, columns) = (self.system[lane], part.columns);
            let first = part.systems.offsets[part.range.start];
            let rows = (self.start[lane] - first) * columns..(self.start[lane] - first + self.rows[lane]) * columns;
            // Every non-finite number on the way has made this NaN.
            status[i - part.range.start] =
                if sound[lane] == T::ZERO { CurveStatus::Converged } else { singular::solve(part, i, &mut x[rows]) };
        }
    }
}

/// What a pass reads and writes.
struct Work<'a, 'b, T, const L: usize> {
    group: &'a Group<L>,
    part: &'a Part<'b, T>,
    /// The first column.
    column: usize,
    cyclic: bool,
    x: &'a mut [T],
    eliminated: &'a mut [T],
    sound: &'a mut [T; L],
}

impl<T: Real, const L: usize> Work<'_, '_, T, L> {
    fn columns<S: Scalar, F: Form<T>, const KIND: u8>(self, width: usize, form: F) {
        match width {
            1 => S::run(Pass::<T, F, L, 1, KIND> { work: self, form }),
            2 => S::run(Pass::<T, F, L, 2, KIND> { work: self, form }),
            _ => S::run(Pass::<T, F, L, 3, KIND> { work: self, form }),
        }
    }
}

/// Eliminates and substitutes back C columns. Each pass is compiled as a separate function.
struct Pass<'a, 'b, T, F, const L: usize, const C: usize, const KIND: u8> {
    work: Work<'a, 'b, T, L>,
    form: F,
}

impl<T: Real, F: Form<T>, const L: usize, const C: usize, const KIND: u8> Operation for Pass<'_, '_, T, F, L, C, KIND> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Pass { work: Work { group, part, column, cyclic, x, eliminated, sound }, form } = self;
        let cyclic = if KIND == EITHER { cyclic } else { KIND == CYCLIC };
        let columns = part.columns;
        let streams = C + 1 + usize::from(cyclic);
        let blocks = group.longest.div_ceil(BLOCK);
        let mut matrix = [[[T::ONE; L]; BLOCK]; 3];
        let mut rhs = [[[T::ZERO; L]; BLOCK]; C];
        let mut carry = Carry::<T, L, C>::default();
        let (stored, _) = eliminated[..blocks * BLOCK * streams * L].as_chunks_mut::<L>();
        for block in 0..blocks {
            let row = block * BLOCK;
            form.load(group, row, &mut matrix, cyclic);
            for (c, rhs) in rhs.iter_mut().enumerate() {
                group.gather(part.rhs, columns, column + c, row, 0, rhs);
            }
            if block == 0 && cyclic {
                form.keep(&mut carry, &matrix, &rhs);
            }
            let from = usize::from(cyclic && block == 0);
            let to = BLOCK.min(group.longest - row);
            let rows = &mut stored[row * streams..(row + to) * streams];
            let masked = L > 1 && row + BLOCK > group.shortest;
            for (b, out) in rows.chunks_exact_mut(streams).enumerate().skip(from) {
                let lanes = [&matrix[0][b], &matrix[1][b], &matrix[2][b]];
                let d: [&[T; L]; C] = std::array::from_fn(|c| &rhs[c][b]);
                let before = if masked { carry } else { Carry::default() };
                let (ga, al, de) = form.eliminate(&mut carry, lanes, d, cyclic);
                if masked {
                    carry.restore(&before, &group.rows.map(|rows| row + b < rows));
                }
                out[0] = ga;
                out[1..=C].copy_from_slice(&de);
                if cyclic {
                    out[C + 1] = al;
                }
            }
        }
        let mut first = [[T::ZERO; L]; C];
        if cyclic {
            first = form.close(&mut carry);
        }
        // x_n is x_0 in a cyclic system, and multiplied by 0 in an open one. The sum makes −0 to +0.
        let mut current = first.map(|x| x.map(|x| x + T::ZERO));
        let mut finite = carry.sound;
        let mut solution = [[[T::ZERO; L]; BLOCK]; C];
        for block in (0..blocks).rev() {
            let row = block * BLOCK;
            let from = usize::from(cyclic && block == 0);
            let to = BLOCK.min(group.longest - row);
            let rows = &stored[row * streams..(row + to) * streams];
            let masked = L > 1 && row + BLOCK > group.shortest;
            for (b, saved) in rows.chunks_exact(streams).enumerate().skip(from).rev() {
                for c in 0..C {
                    let mut next = current[c];
                    for j in 0..L {
                        next[j] = saved[1 + c][j] + saved[0][j] * next[j];
                    }
                    if cyclic {
                        for j in 0..L {
                            next[j] += saved[C + 1][j] * first[c][j];
                        }
                    }
                    if masked {
                        for j in 0..L {
                            next[j] = if row + b < group.rows[j] { next[j] } else { current[c][j] };
                        }
                    }
                    for j in 0..L {
                        finite[j] += next[j] * T::ZERO;
                    }
                    current[c] = next;
                    solution[c][b] = next;
                }
            }
            if from == 1 {
                for c in 0..C {
                    solution[c][0] = first[c];
                    for j in 0..L {
                        finite[j] += first[c][j] * T::ZERO;
                    }
                }
            }
            let start = part.systems.offsets[part.range.start];
            for (c, solution) in solution.iter().enumerate() {
                group.scatter(solution, x, columns, column + c, row, start);
            }
        }
        for j in 0..L {
            sound[j] += finite[j];
        }
    }
}
