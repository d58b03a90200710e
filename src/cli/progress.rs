//! What is going on, on stderr: a bar where a person can see it, else a line every ten seconds.

use std::io::{IsTerminal, stderr};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use super::{count, thousands};

/// How often a bar moves.
const BAR_MOVES: Duration = Duration::from_millis(200);

/// How often a line is written where there is no bar.
const LINE_AFTER: Duration = Duration::from_secs(10);

/// Steps of a run, shown one after the other; silent when quiet was asked for.
pub struct Progress {
    place: Place,
    started: Instant,
    counter: Arc<AtomicUsize>,
    watch: Option<Watch>,
}

enum Place {
    Nowhere,
    Bar(ProgressBar),
    Lines,
}

impl Progress {
    pub fn new(quiet: bool) -> Self {
        let place = match (quiet, stderr().is_terminal()) {
            (true, _) => Place::Nowhere,
            (_, true) => Place::Bar(ProgressBar::new_spinner()),
            (_, false) => Place::Lines,
        };
        Progress { place, started: Instant::now(), counter: Arc::default(), watch: None }
    }

    /// Starts a step of unknown length; returns the seconds since the last step began.
    pub fn step(&mut self, what: impl Into<String>) -> f64 {
        self.begin(what.into(), None)
    }

    /// Starts a step that handles `all` curves or grids, counted by [`advance`](Self::advance) or
    /// the [`counter`](Self::counter); returns the seconds since the last step began.
    pub fn count(&mut self, what: impl Into<String>, all: usize, unit: &'static str) -> f64 {
        self.begin(what.into(), Some((all, unit)))
    }

    /// The counter of this step.
    pub fn counter(&self) -> Arc<AtomicUsize> {
        self.counter.clone()
    }

    /// Counts `more` as done.
    pub fn advance(&self, more: usize) {
        self.counter.fetch_add(more, Ordering::Relaxed);
    }

    /// Takes the bar away; returns the seconds since the last step began.
    pub fn finish(&mut self) -> f64 {
        self.watch = None;
        if let Place::Bar(bar) = &self.place {
            bar.finish_and_clear();
        }
        self.lap()
    }

    fn begin(&mut self, what: String, of: Option<(usize, &'static str)>) -> f64 {
        self.watch = None;
        self.counter = Arc::default();
        let counter = self.counter.clone();
        let all = of.map_or(0, |(all, _)| all);
        // Some curves are fitted in several parts.
        let done = move || counter.load(Ordering::Relaxed).min(all);
        self.watch = match &self.place {
            Place::Nowhere => None,
            Place::Bar(bar) => {
                let template = match of {
                    None => "{spinner} {msg} {elapsed}".into(),
                    Some((_, unit)) => {
                        format!("{{spinner}} {{msg}} {{wide_bar}} {{human_pos}} of {{human_len}} {unit}s, {{eta}} left")
                    }
                };
                bar.set_style(ProgressStyle::with_template(&template).expect("a fixed template"));
                bar.set_length(of.map_or(0, |(all, _)| all as u64));
                bar.reset();
                bar.set_message(what);
                let bar = bar.clone();
                // A run that is over at once shows no bar at all.
                Some(Watch::every(BAR_MOVES, move |_| {
                    bar.set_position(done() as u64);
                    bar.tick();
                }))
            }
            Place::Lines => Some(Watch::every(LINE_AFTER, move |elapsed| {
                eprintln!("faircurve: {}", line(&what, of.map(|(all, unit)| (done(), all, unit)), elapsed));
            })),
        };
        self.lap()
    }

    fn lap(&mut self) -> f64 {
        let seconds = self.started.elapsed().as_secs_f64();
        self.started = Instant::now();
        seconds
    }
}

/// What is going on, for how long, and how much of it is left.
fn line(what: &str, of: Option<(usize, usize, &str)>, elapsed: Duration) -> String {
    let for_seconds = format!("for {} s", thousands(elapsed.as_secs() as usize));
    match of {
        None => format!("{what}, {for_seconds}"),
        Some((0, all, unit)) => format!("{what}, 0 of {}, {for_seconds}", count(all, unit)),
        Some((done, all, unit)) => {
            let left = elapsed.as_secs_f64() * all.saturating_sub(done) as f64 / done as f64;
            let left = thousands(left.round() as usize);
            format!("{what}, {} of {}, {for_seconds}, about {left} s left", thousands(done), count(all, unit))
        }
    }
}

/// A thread that does something again and again until this is dropped.
struct Watch {
    stop: Option<Sender<()>>,
    thread: Option<thread::JoinHandle<()>>,
}

impl Watch {
    fn every(interval: Duration, act: impl Fn(Duration) + Send + 'static) -> Self {
        let (stop, stopped) = channel();
        let started = Instant::now();
        let watch = move || {
            while stopped.recv_timeout(interval) == Err(RecvTimeoutError::Timeout) {
                act(started.elapsed());
            }
        };
        // Without threads, as in WebAssembly, nothing is shown.
        Watch { stop: Some(stop), thread: thread::Builder::new().spawn(watch).ok() }
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_how_many_curves_are_done_and_how_long_the_others_will_take() {
        let after = Duration::from_secs;
        assert_eq!(line("reading", None, after(10)), "reading, for 10 s");
        assert_eq!(line("fitting", Some((0, 1595, "curve")), after(10)), "fitting, 0 of 1,595 curves, for 10 s");
        let said = line("fitting", Some((1000, 3000, "curve")), after(20));
        assert_eq!(said, "fitting, 1,000 of 3,000 curves, for 20 s, about 40 s left");
        assert_eq!(line("fitting", Some((1, 1, "grid")), after(30)), "fitting, 1 of 1 grid, for 30 s, about 0 s left");
    }

    #[test]
    fn a_watch_acts_until_it_is_dropped() {
        let (tick, ticked) = channel();
        let watch = Watch::every(Duration::from_millis(1), move |elapsed| tick.send(elapsed).unwrap());
        let first = ticked.recv().unwrap();
        assert!(ticked.recv().unwrap() > first && first >= Duration::from_millis(1));
        drop(watch);
        // Iterating ends only because the thread is gone, and its end of the channel with it.
        assert!(ticked.into_iter().all(|elapsed| elapsed > first));
    }
}
