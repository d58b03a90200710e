//! [`Numbers`]: many numbers, in pages of memory that are kept for those after them.
//!
//! The system hands out memory in pages of 4 KiB, and a page that is touched for the first time takes as long as the samples of
//! a spline that fill it. Huge pages, of 2 MiB, take less, and kept ones nothing.

use std::ops::{Deref, DerefMut};

#[cfg(target_os = "linux")]
use pages::Pages;

/// Numbers, as [`Vec`] has them.
#[derive(Debug)]
pub(crate) enum Numbers {
    Few(Vec<f64>),
    /// Linux alone has huge pages on request.
    #[cfg(target_os = "linux")]
    Many(Pages),
}

impl Numbers {
    /// Room for n numbers of any value, all of which must be written: NaN with debug assertions.
    pub fn room(n: usize) -> Self {
        let mut room = Self::unset(n);
        if cfg!(debug_assertions) {
            room.fill(f64::NAN);
        }
        room
    }

    fn unset(n: usize) -> Self {
        #[cfg(target_os = "linux")]
        if let Some(pages) = Pages::of(n) {
            return Numbers::Many(pages);
        }
        Numbers::Few(vec![0.0; n])
    }

    /// The numbers as a vector, which is a copy of many.
    pub fn into_vec(self) -> Vec<f64> {
        match self {
            Numbers::Few(numbers) => numbers,
            #[cfg(target_os = "linux")]
            Numbers::Many(pages) => pages.to_vec(),
        }
    }

    /// The numbers as a vector that can be shortened.
    pub fn as_vec(&mut self) -> &mut Vec<f64> {
        *self = Numbers::Few(std::mem::take(self).into_vec());
        match self {
            Numbers::Few(numbers) => numbers,
            #[cfg(target_os = "linux")]
            Numbers::Many(_) => unreachable!("they are a vector now"),
        }
    }
}

impl Deref for Numbers {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        match self {
            Numbers::Few(numbers) => numbers,
            #[cfg(target_os = "linux")]
            Numbers::Many(pages) => pages,
        }
    }
}

impl DerefMut for Numbers {
    fn deref_mut(&mut self) -> &mut [f64] {
        match self {
            Numbers::Few(numbers) => numbers,
            #[cfg(target_os = "linux")]
            Numbers::Many(pages) => pages,
        }
    }
}

impl Default for Numbers {
    fn default() -> Self {
        Numbers::Few(Vec::new())
    }
}

impl Clone for Numbers {
    fn clone(&self) -> Self {
        Numbers::Few(self.to_vec())
    }
}

impl From<Vec<f64>> for Numbers {
    fn from(numbers: Vec<f64>) -> Self {
        Numbers::Few(numbers)
    }
}

#[cfg(target_os = "linux")]
mod pages {
    use std::ops::{Deref, DerefMut};
    use std::sync::{Mutex, PoisonError};

    use memmap2::{Advice, MmapMut};

    /// Fewer numbers are in a vector: two huge pages would not be full.
    pub const MANY: usize = 4 << 20 >> 3;

    /// The most bytes that are kept.
    const MOST_KEPT: usize = 256 << 20;

    static KEPT: Mutex<Kept> = Mutex::new(Kept(Vec::new()));

    /// Memory that was given back, the oldest first.
    struct Kept(Vec<MmapMut>);

    impl Kept {
        /// Takes memory of this many bytes at least, and of twice as many at most.
        fn take(&mut self, bytes: usize) -> Option<MmapMut> {
            let k = self.0.iter().position(|own| (bytes..=2 * bytes).contains(&own.len()))?;
            Some(self.0.remove(k))
        }

        /// Keeps memory, and lets the oldest go that is too much with it.
        fn give(&mut self, memory: MmapMut) {
            self.0.push(memory);
            while self.bytes() > MOST_KEPT {
                self.0.remove(0);
            }
        }

        fn bytes(&self) -> usize {
            self.0.iter().map(|own| own.len()).sum()
        }
    }

    /// Memory of at least n numbers.
    #[derive(Debug)]
    pub struct Pages {
        memory: Option<MmapMut>,
        n: usize,
    }

    impl Pages {
        /// Room for many numbers. `None` for few, and where the system gives no memory so.
        pub fn of(n: usize) -> Option<Self> {
            if n < MANY {
                return None;
            }
            let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
            let memory = kept.take(8 * n).or_else(|| {
                let memory = MmapMut::map_anon(8 * n).ok()?;
                // Where there are no huge pages small ones do.
                let _ = memory.advise(Advice::HugePage);
                Some(memory)
            });
            Some(Pages { memory: Some(memory?), n })
        }

        fn memory(&self) -> &MmapMut {
            self.memory.as_ref().expect("pages have memory until they are dropped")
        }
    }

    impl Deref for Pages {
        type Target = [f64];

        fn deref(&self) -> &[f64] {
            bytemuck::cast_slice(&self.memory()[..8 * self.n])
        }
    }

    impl DerefMut for Pages {
        fn deref_mut(&mut self) -> &mut [f64] {
            let memory = self.memory.as_mut().expect("pages have memory until they are dropped");
            bytemuck::cast_slice_mut(&mut memory[..8 * self.n])
        }
    }

    impl Drop for Pages {
        fn drop(&mut self) {
            let memory = self.memory.take().expect("pages have memory until they are dropped");
            KEPT.lock().unwrap_or_else(PoisonError::into_inner).give(memory);
        }
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn memory_is_taken_again_and_the_oldest_goes_where_it_is_too_much() {
            let memory = |mib: usize| MmapMut::map_anon(mib << 20).unwrap();
            let mut kept = Kept(vec![]);
            let mut own = memory(8);
            own[5] = 7;
            kept.give(own);
            assert!(kept.take(9 << 20).is_none() && kept.take(3 << 20).is_none());
            assert_eq!(kept.take(5 << 20).map(|own| (own.len(), own[5])), Some((8 << 20, 7)));
            [100, 90, 60, 20].into_iter().for_each(|mib| kept.give(memory(mib)));
            assert_eq!(kept.bytes(), 170 << 20, "the oldest has gone");
            kept.give(memory(300));
            assert_eq!(kept.bytes(), 0, "more than may be kept");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_and_many_numbers_are_the_same_to_who_uses_them() {
        // As many as lie in pages, where there are any.
        let many = 4 << 20 >> 3;
        for n in [0, 1, many - 1, many, many + 7, many] {
            let mut numbers = Numbers::room(n);
            assert_eq!(numbers.len(), n);
            numbers.iter_mut().enumerate().for_each(|(k, x)| *x = k as f64);
            let mut copy = numbers.clone();
            copy.as_vec().truncate(n / 2);
            assert_eq!(copy.len(), n / 2);
            assert!(numbers.into_vec().into_iter().eq((0..n).map(|k| k as f64)), "{n}");
        }
    }
}
