//! How much memory is free, and whether a request fits into it.
//!
//! (`sysinfo` does not know the limit of a process's address space, `ulimit -v`.)

use crate::error::{Error, Result, thousands};

pub(crate) use system::free_bytes;

/// A request of less than this is granted without a look at the free memory.
pub(crate) const SMALL_BYTES: f64 = (64 << 20) as f64;

/// More than any process can get, for systems whose free memory is not known: the address space of
/// today's processors.
const MOST_BYTES: u64 = 1 << 47;

/// The most items of `bytes` bytes that fit into the free memory.
pub(crate) fn most(bytes: usize) -> f64 {
    free_bytes().unwrap_or(MOST_BYTES) as f64 / bytes as f64
}

/// Refuses a request of `count` items of `bytes` bytes each if it takes more than the free memory.
///
/// `n` is what was asked for, in proportion to the count; fewer are the remedy.
pub(crate) fn check(count: f64, bytes: usize, what: &str, n: usize) -> Result<()> {
    if count * bytes as f64 <= SMALL_BYTES {
        return Ok(());
    }
    let most = most(bytes);
    if count <= most {
        return Ok(());
    }
    // Less than is free now, since other programs take some of it meanwhile.
    let remedy = match (0.9 * n as f64 * most / count) as usize {
        0 => "ask for fewer".to_string(),
        fewer => format!("ask for {} or fewer", thousands(fewer)),
    };
    Err(Error::argument(format!(
        "{what} make {} of all curves, which take {} of memory, but {} are free: {remedy}, or give the curves in smaller batches",
        number(count),
        mib(count * bytes as f64),
        mib(most * bytes as f64)
    )))
}

/// A number of bytes for a sentence.
pub(crate) fn mib(bytes: f64) -> String {
    format!("{} MiB", number((bytes / f64::from(1 << 20)).ceil()))
}

/// A count for a sentence, with an exponent where it would be long.
pub(crate) fn number(count: f64) -> String {
    if count < 1e9 { thousands(count as usize) } else { format!("{count:.1e}") }
}

#[cfg(target_os = "linux")]
mod system {
    use std::fs::read_to_string;

    /// The least of what the machine, the process's limits and its control group leave free.
    pub fn free_bytes() -> Option<u64> {
        [machine(), address_space(), control_group()].into_iter().flatten().min()
    }

    /// The number after a word at the start of a line.
    fn number(text: &str, word: &str) -> Option<u64> {
        let line = text.lines().find_map(|line| line.strip_prefix(word))?;
        line.split_whitespace().next()?.parse().ok()
    }

    fn machine() -> Option<u64> {
        Some(number(&read_to_string("/proc/meminfo").ok()?, "MemAvailable:")?.saturating_mul(1024))
    }

    fn address_space() -> Option<u64> {
        let limit = number(&read_to_string("/proc/self/limits").ok()?, "Max address space")?;
        let used = number(&read_to_string("/proc/self/status").ok()?, "VmSize:")?.saturating_mul(1024);
        Some(limit.saturating_sub(used))
    }

    fn control_group() -> Option<u64> {
        let file = |name: &str| read_to_string(format!("/sys/fs/cgroup/memory.{name}")).ok();
        let limit: u64 = file("max")?.trim().parse().ok()?;
        let used: u64 = file("current")?.trim().parse().ok()?;
        // File pages that the system caches, and gives up when asked.
        let kept = number(&file("stat")?, "inactive_file ").unwrap_or(0);
        Some(limit.saturating_sub(used.saturating_sub(kept)))
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    /// The free memory is not known on this system.
    pub fn free_bytes() -> Option<u64> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_refused_with_both_sizes() {
        assert!(check(1e6, 64, "samples", 1).is_ok());
        let error = check(1e18, 24, "1000000 samples a span", 1_000_000).unwrap_err().to_string();
        assert!(
            error
                .starts_with("1000000 samples a span make 1.0e18 of all curves, which take 2.3e13 MiB of memory, but "),
            "{error}"
        );
        assert!(error.ends_with(" MiB are free: ask for fewer, or give the curves in smaller batches"), "{error}");
        let error = check(1e18, 24, "10¹⁸ samples a span", 1_000_000_000_000_000_000).unwrap_err().to_string();
        let fewer = error.split("ask for ").nth(1).unwrap().split(' ').next().unwrap().replace(',', "");
        assert!(check(fewer.parse().unwrap(), 24, "samples", 1).is_ok(), "{error}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_free_memory_is_known() {
        let free = free_bytes().unwrap();
        assert!((1 << 20..1 << 50).contains(&free), "{free}");
    }
}
