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
    /// Room for n numbers of any value, which are all to be written.
    pub fn room(n: usize) -> Self {
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

    /// Memory that was given back, the oldest first.
    static KEPT: Mutex<Vec<MmapMut>> = Mutex::new(Vec::new());

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
            let fits = |own: &MmapMut| (8 * n..=16 * n).contains(&own.len());
            let memory = match kept.iter().position(fits) {
                Some(k) => kept.remove(k),
                None => {
                    let memory = MmapMut::map_anon(8 * n).ok()?;
                    // Where there are no huge pages small ones do.
                    let _ = memory.advise(Advice::HugePage);
                    memory
                }
            };
            Some(Pages { memory: Some(memory), n })
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
            let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
            kept.extend(self.memory.take());
            let mut bytes: usize = kept.iter().map(|own| own.len()).sum();
            while bytes > MOST_KEPT {
                bytes -= kept.remove(0).len();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_and_many_numbers_are_the_same_to_who_uses_them() {
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
