//! [`Rounds`]: curves that stay on the device, round after round, until all have ended.

use bytemuck::Pod;

use super::{Buffer, Downloaded, Pending, Recording, Step, unwritten};
use crate::error::Result;

/// The standing word of a running curve.
///
/// The words from 2 to [`LAST`] say how it ended. The host writes 0 first.
const RUNNING: u32 = 1;
const LAST: u32 = 7;

/// The arrays of a chunk, by name.
pub(crate) type Arrays = Vec<(&'static str, Buffer)>;

/// A chunk on the device, with a layout of its curves.
///
/// Its array `states` has a state for each curve. The first word of a state is the curve's
/// standing.
pub(crate) struct Rounds<'g, Layout> {
    kernel: &'static str,
    curves: usize,
    /// Curves that ran at the last look.
    running: usize,
    state_words: usize,
    layout: Layout,
    arrays: Arrays,
    /// Arrays that come back after every round, besides the states.
    looked_at: &'static [&'static str],
    /// Whether all wanted arrays come back with this round.
    is_last: bool,
    pending: Pending<'g>,
}

impl<'g, Layout> Rounds<'g, Layout> {
    /// Submits the first round of a kernel for a number of curves, with the wanted arrays: most
    /// curves end in it, and all of gentle ones.
    ///
    /// `round` records the work of the listed curves. It finds the arrays by name.
    pub fn start<State: Pod>(
        (kernel, curves): (&'static str, usize),
        recording: Recording<'g>,
        (layout, arrays): (Layout, Arrays),
        wanted: &'static [&'static str],
        round: impl Fn(&mut Recording<'g>, &Layout, &[(&str, &Buffer)], &[u32]) -> Result<()>,
    ) -> Result<Self> {
        let own = Self::looking::<State>((kernel, curves), recording, (layout, arrays), &wanted[1..], round)?;
        Ok(Rounds { looked_at: &[], is_last: true, ..own })
    }

    /// The same, with named arrays that the host sees after every round.
    pub fn looking<State: Pod>(
        (kernel, curves): (&'static str, usize),
        recording: Recording<'g>,
        (layout, arrays): (Layout, Arrays),
        looked_at: &'static [&'static str],
        round: impl Fn(&mut Recording<'g>, &Layout, &[(&str, &Buffer)], &[u32]) -> Result<()>,
    ) -> Result<Self> {
        let all: Vec<u32> = (0..curves as u32).collect();
        let pending = submit(recording, &layout, &arrays, (&all, looked_at), round)?;
        let state_words = size_of::<State>() / 4;
        Ok(Rounds { kernel, curves, running: curves, state_words, layout, arrays, looked_at, is_last: false, pending })
    }

    /// Waits for a round, and submits the next round, of the curves that run.
    ///
    /// When all have ended, the last results are the `wanted` arrays. `ended` gets the number of curves
    /// that have ended since its last call.
    pub fn advance(
        self,
        round: impl Fn(&mut Recording<'g>, &Layout, &[(&str, &Buffer)], &[u32]) -> Result<()>,
        wanted: &[&str],
        ended: impl FnMut(usize),
    ) -> Result<Step<Self, (Layout, Vec<Downloaded>)>> {
        self.answer(|recording, layout, arrays, slots, _| round(recording, layout, arrays, slots), wanted, ended)
    }

    /// The same, but `round` gets the states and the arrays that the host looks at.
    pub fn answer(
        self,
        round: impl Fn(&mut Recording<'g>, &Layout, &[(&str, &Buffer)], &[u32], &[Downloaded]) -> Result<()>,
        wanted: &[&str],
        mut ended: impl FnMut(usize),
    ) -> Result<Step<Self, (Layout, Vec<Downloaded>)>> {
        let (gpu, precision) = (self.pending.gpu(), self.pending.precision());
        let found = self.pending.wait()?;
        if self.running == 0 {
            return Ok(Step::Done((self.layout, found)));
        }
        let mut slots = Vec::new();
        for (slot, state) in found[0].as_slice::<u32>().chunks_exact(self.state_words).take(self.curves).enumerate() {
            match state[0] {
                RUNNING => slots.push(slot as u32),
                word if word > LAST || word == 0 => {
                    return Err(unwritten(self.kernel, format_args!("slot {slot}"), word));
                }
                _ => {}
            }
        }
        if slots.len() < self.running {
            ended(self.running - slots.len());
        }
        if slots.is_empty() && self.is_last {
            return Ok(Step::Done((self.layout, found)));
        }
        let mut recording = gpu.record(precision);
        let pending = if slots.is_empty() {
            wanted.iter().for_each(|name| recording.download(named(&self.arrays, name)));
            recording.submit()?
        } else {
            let round = |recording: &mut Recording<'g>, layout: &Layout, arrays: &[(&str, &Buffer)], slots: &[u32]| {
                round(recording, layout, arrays, slots, &found)
            };
            submit(recording, &self.layout, &self.arrays, (&slots, self.looked_at), round)?
        };
        Ok(Step::Again(Rounds { running: slots.len(), is_last: false, pending, ..self }))
    }
}

fn submit<'g, Layout>(
    mut recording: Recording<'g>,
    layout: &Layout,
    arrays: &Arrays,
    (slots, looked_at): (&[u32], &[&str]),
    round: impl Fn(&mut Recording<'g>, &Layout, &[(&str, &Buffer)], &[u32]) -> Result<()>,
) -> Result<Pending<'g>> {
    let bound: Vec<(&str, &Buffer)> = arrays.iter().map(|(name, array)| (*name, array)).collect();
    round(&mut recording, layout, &bound, slots)?;
    recording.download(named(arrays, "states"));
    looked_at.iter().for_each(|name| recording.download(named(arrays, name)));
    recording.submit()
}

fn named<'b>(arrays: &'b Arrays, name: &str) -> &'b Buffer {
    &arrays.iter().find(|(own, _)| *own == name).expect("a name of the list").1
}
