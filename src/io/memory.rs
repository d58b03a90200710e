//! How much memory reading may take.
//!
//! The system is asked once how much is free. All memory that grows with the input is requested
//! before it is used.

use std::cell::Cell;
use std::fmt;

use crate::memory::free_bytes;

/// The part of the free memory that reading may fill.
///
/// A fit takes as much again, and some needs are only estimated.
const SHARE: f64 = 0.5;

/// Vectors up to this size grow without a request.
const SMALL_BYTES: usize = 1 << 16;

/// The memory that reading a file may take.
///
/// Systems that promise more memory than they have (as Linux does) kill the process that uses it.
/// There `/proc/meminfo`, the limits of the process and the limits of its control group tell the
/// free memory. Elsewhere the allocator's refusal is the limit.
pub(super) struct Room {
    free_bytes: u64,
    taken_bytes: Cell<u64>,
}

/// The error that there is no room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Full {
    /// Bytes asked for, with those given before.
    pub wanted_bytes: u64,
    /// Bytes that may be taken, if known.
    pub free_bytes: Option<u64>,
}

impl fmt::Display for Full {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mib = |bytes: u64| bytes.div_ceil(1 << 20);
        write!(f, "reading it takes {} MiB of memory or more", mib(self.wanted_bytes))?;
        match self.free_bytes {
            Some(free) => write!(f, ", but only {} MiB may be taken", mib(free))?,
            None => f.write_str(", which the system does not give")?,
        }
        f.write_str(": give it in smaller files, or close other programs")
    }
}

impl std::error::Error for Full {}

impl From<Full> for std::io::Error {
    fn from(full: Full) -> Self {
        std::io::Error::new(std::io::ErrorKind::OutOfMemory, full)
    }
}

impl Room {
    /// The room that the system has now.
    pub fn of_system() -> Self {
        let free = free_bytes().map_or(u64::MAX, |bytes| (SHARE * bytes as f64) as u64);
        Room::of(free)
    }

    fn of(free_bytes: u64) -> Self {
        Room { free_bytes, taken_bytes: Cell::new(0) }
    }

    /// Counts bytes that other code allocates, by an upper estimate.
    pub fn take(&self, bytes: usize) -> Result<(), Full> {
        let wanted_bytes = self.taken_bytes.get().saturating_add(bytes as u64);
        if wanted_bytes > self.free_bytes {
            return Err(Full { wanted_bytes, free_bytes: Some(self.free_bytes) });
        }
        self.taken_bytes.set(wanted_bytes);
        Ok(())
    }

    /// Gives back the bytes of memory that is freed.
    pub fn give_back(&self, bytes: usize) {
        self.taken_bytes.set(self.taken_bytes.get().saturating_sub(bytes as u64));
    }

    /// Makes room for more entries. If there is too little, the capacity doubles.
    pub fn grow<T>(&self, values: &mut Vec<T>, more: usize) -> Result<(), Full> {
        if values.capacity() - values.len() >= more {
            return Ok(());
        }
        let least = SMALL_BYTES / size_of::<T>().max(1);
        self.reserve(values, more.max(values.len()).max(least))
    }

    /// Makes room for exactly `more` more entries.
    pub fn reserve<T>(&self, values: &mut Vec<T>, more: usize) -> Result<(), Full> {
        self.take(more.saturating_mul(size_of::<T>()))?;
        values.try_reserve_exact(more).map_err(|_| Full { wanted_bytes: self.taken_bytes.get(), free_bytes: None })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_there_is_refused_before_it_is_allocated() {
        let room = Room::of(100 << 20);
        let mut values: Vec<f64> = Vec::new();
        for k in 0..1_000_000 {
            room.grow(&mut values, 1).unwrap();
            values.push(f64::from(k));
        }
        assert!(values.capacity() <= 2_097_152, "grows by doubling, to {}", values.capacity());
        let error = room.reserve(&mut values, 1 << 40).unwrap_err();
        assert!(error.to_string().starts_with("reading it takes 8388"), "{error}");
        assert!(error.to_string().contains(", but only 100 MiB may be taken"), "{error}");
        assert_eq!(room.take(usize::MAX).unwrap_err().wanted_bytes, u64::MAX);
        let error = Room::of(u64::MAX).reserve(&mut values, usize::MAX / 16).unwrap_err();
        assert!(error.to_string().contains("which the system does not give"), "{error}");
    }
}
