//! The progress bar: on stderr, only where a person can see it.

use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// Steps of a run, shown one after the other; silent when stderr is no terminal or quiet was asked for.
pub struct Progress {
    bar: ProgressBar,
    started: Instant,
}

impl Progress {
    pub fn new(quiet: bool) -> Self {
        let bar = if quiet || !stderr().is_terminal() { ProgressBar::hidden() } else { ProgressBar::new_spinner() };
        // A run that is over at once shows no bar at all.
        bar.enable_steady_tick(Duration::from_millis(200));
        Progress { bar, started: Instant::now() }
    }

    /// Starts a step of unknown length; returns the seconds since the last step began.
    pub fn step(&mut self, what: impl Into<String>) -> f64 {
        let style = ProgressStyle::with_template("{spinner} {msg} {elapsed}").expect("a fixed template");
        self.bar.set_style(style);
        self.bar.set_length(0);
        self.bar.set_message(what.into());
        self.lap()
    }

    /// Starts a step that handles `curves` one by one; returns the seconds since the last step began.
    pub fn count(&mut self, what: impl Into<String>, curves: usize) -> f64 {
        let template = "{spinner} {msg} {wide_bar} {human_pos}/{human_len} curves, {eta} left";
        self.bar.set_style(ProgressStyle::with_template(template).expect("a fixed template"));
        self.bar.set_length(curves as u64);
        self.bar.set_position(0);
        self.bar.set_message(what.into());
        self.lap()
    }

    /// `curves` more are done.
    pub fn advance(&self, curves: usize) {
        self.bar.inc(curves as u64);
    }

    /// Takes the bar away; returns the seconds since the last step began.
    pub fn finish(&mut self) -> f64 {
        self.bar.finish_and_clear();
        self.lap()
    }

    fn lap(&mut self) -> f64 {
        let seconds = self.started.elapsed().as_secs_f64();
        self.started = Instant::now();
        seconds
    }
}
