//! Chunks one after the other, the next being prepared and uploaded while the device works on the last.

use super::record::{Downloaded, Pending};
use crate::error::Result;

/// Chunks under way at once: one on the device, one on its way there.
const IN_FLIGHT: usize = 2;

/// Submits every chunk in order and finishes each as its results arrive.
///
/// # Errors
/// The first of `submit`, of a submission, or of `finish`; chunks finished before stay finished.
pub fn pipeline<'g, C>(
    chunks: impl IntoIterator<Item = C>,
    mut submit: impl FnMut(&C) -> Result<Pending<'g>>,
    mut finish: impl FnMut(&C, &[Downloaded]) -> Result<()>,
) -> Result<()> {
    let mut under_way = std::collections::VecDeque::with_capacity(IN_FLIGHT);
    for chunk in chunks {
        let pending = submit(&chunk)?;
        under_way.push_back((chunk, pending));
        if under_way.len() == IN_FLIGHT {
            let (chunk, pending) = under_way.pop_front().expect("it was just filled");
            finish(&chunk, &pending.wait()?)?;
        }
    }
    under_way.into_iter().try_for_each(|(chunk, pending)| finish(&chunk, &pending.wait()?))
}
