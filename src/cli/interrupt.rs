//! Signals that end the program: files that are half written are removed first.

/// From now on signals that end the program remove files that are half written. The exit status
/// stays the signal's.
#[cfg(unix)]
pub fn remove_half_written() {
    use std::sync::{Arc, Once};
    use std::thread;

    use faircurve::io;
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXCPU, SIGXFSZ};
    use signal_hook::flag;
    use signal_hook::iterator::Signals;
    use signal_hook::low_level::{emulate_default_handler, exit};

    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // A file beyond the largest size allowed is then an error of its write.
        let _ = flag::register(SIGXFSZ, Arc::default());
        let ignored = ignored();
        let heard = [SIGHUP, SIGINT, SIGTERM, SIGXCPU].into_iter().filter(|signal| ignored & (1 << (signal - 1)) == 0);
        // Where no handler can be installed, signals end the program as they do anyway.
        let Ok(mut signals) = Signals::new(heard) else { return };
        thread::spawn(move || {
            if let Some(signal) = signals.forever().next() {
                io::give_up(|| {
                    // It does not return for these signals.
                    let _ = emulate_default_handler(signal);
                    exit(128 + signal)
                });
            }
        });
    });
}

/// Elsewhere files that are half written stay.
#[cfg(not(unix))]
pub fn remove_half_written() {}

/// The signals that whoever started the program has it ignore, as `nohup` does: bit n − 1 is signal
/// n.
///
/// Only Linux tells them without unsafe code. Elsewhere SIGHUP counts as ignored.
#[cfg(unix)]
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(1 << (signal_hook::consts::SIGHUP - 1))
}
