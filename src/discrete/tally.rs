//! [`Tally`]: counts the finished curves of a fit for progress bars.

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::device::Device;

/// Reports finished curves to a device's counter.
///
/// A curve that was cut into pieces counts with its last piece.
pub(super) struct Tally<'a>(Box<dyn Fn(usize) + Sync + 'a>);

impl<'a> Tally<'a> {
    /// A tally of whole curves.
    pub fn whole(device: &'a Device) -> Self {
        Tally(Box::new(|_| device.finished(1)))
    }

    /// A tally of pieces.
    ///
    /// `curves` holds the curve of each piece.
    pub fn of_pieces(device: &'a Device, curves: Vec<usize>) -> Self {
        let count = curves.iter().max().map_or(0, |last| last + 1);
        let left: Vec<AtomicUsize> = (0..count).map(|_| AtomicUsize::new(0)).collect();
        curves.iter().for_each(|&curve| _ = left[curve].fetch_add(1, Ordering::Relaxed));
        Tally(Box::new(move |i| {
            if left[curves[i]].fetch_sub(1, Ordering::Relaxed) == 1 {
                device.finished(1);
            }
        }))
    }

    /// A tally that counts only some of these curves or pieces.
    pub fn of_some<'b>(&'b self, counts: &'b (dyn Fn(usize) -> bool + Sync)) -> Tally<'b> {
        Tally(Box::new(move |i| {
            if counts(i) {
                self.finished(i);
            }
        }))
    }

    /// A tally of a selection of these curves or pieces.
    pub fn of_selected<'b>(&'b self, selected: &'b [usize]) -> Tally<'b> {
        Tally(Box::new(move |k| self.finished(selected[k])))
    }

    /// Records that curve or piece `i` is finished.
    pub fn finished(&self, i: usize) {
        self.0(i);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    #[test]
    fn a_curve_of_several_pieces_is_counted_once_with_its_last() {
        let counter = Arc::new(AtomicUsize::new(0));
        let device = Device::cpu().with_counter(counter.clone());
        let tally = Tally::of_pieces(&device, vec![0, 1, 1, 1, 2]);
        for (piece, finished) in [(1, 0), (3, 0), (0, 1), (2, 2), (4, 3)] {
            tally.finished(piece);
            assert_eq!(counter.load(Ordering::Relaxed), finished, "{piece}");
        }
    }
}
