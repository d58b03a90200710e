//! A run from file to file, as `fit`, `bezier` and `grid` make it:
//!
//! ```text
//! read ─► device ─► work ─► write ─► draw ─► report ─► judge
//! ```

use std::fmt::Display;
use std::path::{Path, PathBuf};

use clap::Args;
use faircurve::{CurveStatus, Device, DeviceReport, Result, Work};
use serde_json::Value;

use super::device::{self, DeviceArgs};
use super::html::Page;
use super::output;
use super::progress::Progress;
use super::report::{self, Seconds};
use super::words::with_options;
use super::{Talk, count, has_extension, thousands};

/// The most unusable curves or grids that are listed. --report and -v list them all.
const MOST_LISTED: usize = 20;

/// Whether a report is to be a page.
pub fn is_html(path: &Path) -> bool {
    has_extension(path, &["html", "htm"])
}

/// What every run takes.
#[derive(Args, Clone, Debug)]
pub struct RunArgs {
    #[command(flatten)]
    pub device: DeviceArgs,
    /// Writes a report as JSON, one line per curve or grid, or as a page with pictures (.html)
    #[arg(long, value_name = "FILE.json|FILE.html", help_heading = "Run")]
    pub report: Option<PathBuf>,
    /// Replaces outputs that exist
    #[arg(long, help_heading = "Run")]
    pub force: bool,
    #[command(flatten)]
    pub talk: Talk,
}

impl RunArgs {
    /// Checks the places of all files that will be written, and that a picture's name ends in .svg.
    ///
    /// # Errors
    /// As [`output::check`].
    pub fn check(&self, output: Option<&Path>, picture: Option<&Path>, dropped: Option<&Path>) -> Result<()> {
        output::check_picture(picture)?;
        let report = self.report.as_deref();
        let files = [("--output", output), ("--report", report), ("--picture", picture), ("--dropped", dropped)];
        let files: Vec<_> = files.into_iter().filter_map(|(option, path)| Some((option, path?))).collect();
        output::check(&files, self.force)
    }
}

/// A run under way.
pub struct Run<'a> {
    args: &'a RunArgs,
    /// What is worked on: `curve` or `grid`.
    what: &'static str,
    /// What is done, and what was: `fitting`, `fitted`.
    verbs: [&'static str; 2],
    /// "2 curves, 7 points".
    volume: String,
    /// What does the work.
    device: Option<Device>,
    /// Why this device.
    reason: String,
    seconds: Seconds,
    progress: Progress,
}

impl<'a> Run<'a> {
    /// Begins with reading.
    pub fn start(args: &'a RunArgs, what: &'static str, verbs: [&'static str; 2]) -> Self {
        let mut progress = Progress::new(args.talk.quiet);
        progress.step("reading");
        let (device, volume, reason, seconds) = (None, String::new(), String::new(), Seconds::default());
        Run { args, what, verbs, volume, device, reason, seconds, progress }
    }

    /// Opens the device for the work, which then begins. Of curves those that are finished are
    /// counted: `counted` says how many there are.
    ///
    /// # Errors
    /// As [`device::open`].
    pub fn device(&mut self, work: &Work, volume: String, counted: Option<usize>) -> Result<Device> {
        self.seconds.read = self.progress.step("preparing the device");
        let device = device::open(self.args.device, work, self.args.talk)?;
        match counted {
            Some(curves) => self.progress.count(self.verbs[0], curves, self.what),
            None => self.progress.step(format!("{} {volume}", self.verbs[0])),
        };
        (self.volume, self.reason) = (volume, device.reason().into());
        self.device = Some(device.clone());
        Ok(device.with_counter(self.progress.counter()))
    }

    /// Tells what is done with the fitted curves now.
    pub fn step(&mut self, what: &str) {
        self.seconds.fit += self.progress.step(what);
    }

    /// Writes what was made.
    pub fn write(&mut self, path: &Path, write: impl FnOnce() -> Result<()>) -> Result<()> {
        self.seconds.fit += self.progress.step(format!("writing {}", path.display()));
        write()?;
        self.seconds.write = self.progress.step("drawing");
        Ok(())
    }

    /// Draws a picture where one was asked for.
    pub fn draw(&mut self, path: Option<&Path>, draw: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
        if let Some(path) = path {
            draw(path)?;
            let drawn = self.progress.step("");
            self.args.talk.detail(format_args!("drew {} in {drawn:.3} s", path.display()));
        }
        Ok(())
    }

    /// Writes a report where one was asked for, with one line for each of all.
    pub fn report(
        &mut self,
        [usable, all]: [usize; 2],
        head: impl FnOnce() -> Value,
        line: impl Fn(usize) -> Value + Sync,
        picture: impl Fn(usize) -> Option<String>,
    ) -> Result<()> {
        let Some(path) = &self.args.report else { return Ok(()) };
        self.progress.count("measuring", all, self.what);
        let totals = report::totals(self.what, [usable, all], self.seconds);
        output::write(path, self.args.force, |out| {
            if !is_html(path) {
                return report::write(out, &head(), self.what, all, line, &totals, &self.progress);
            }
            let (head, lines) = (head(), report::lines(all, line, &self.progress));
            let title = self.volume.clone();
            Page { title, what: self.what, head, totals: &totals, lines }.write(out, picture)
        })
    }

    /// Says what was done; `to` is what came of it, where the verb does not say it.
    pub fn tell(&mut self, to: &str, device: &DeviceReport) {
        self.progress.finish();
        let (talk, done, Run { volume, reason, .. }) = (self.args.talk, self.verbs[1], &*self);
        talk.say(format_args!("{volume}: {done}{to} on {device} ({reason})"));
        let Seconds { read, fit, write } = self.seconds;
        talk.detail(format_args!("read in {read:.3} s, {done} in {fit:.3} s, written in {write:.3} s"));
        if let Some(gpu) = self.device.as_ref().and_then(Device::as_gpu) {
            gpu.take_notes().iter().for_each(|note| talk.detail(note));
        }
    }

    /// A line for people.
    pub fn say(&self, line: impl Display) {
        self.args.talk.say(line);
    }

    /// Lists the curves or grids that are not usable, and why. Returns whether all are usable. `of`
    /// gives status, message and name.
    pub fn judge<'r>(
        &self,
        all: usize,
        unusable: &[usize],
        of: impl Fn(usize) -> (CurveStatus, Option<&'r str>, String),
    ) -> bool {
        if unusable.is_empty() {
            return true;
        }
        let (are, total) = (if unusable.len() == 1 { "is" } else { "are" }, count(all, self.what));
        let said = format!("{} of {total} {are} not usable", thousands(unusable.len()));
        if self.args.talk.quiet {
            eprintln!("faircurve: {said}");
            return false;
        }
        self.args.talk.say(format_args!("{said}:"));
        let listed = if self.args.talk.verbose { unusable.len() } else { unusable.len().min(MOST_LISTED) };
        for &i in &unusable[..listed] {
            let (status, message, name) = of(i);
            let message = message.map_or_else(|| format!("{} {name}", self.what), with_options);
            eprintln!("  {}: {message}", status.word());
        }
        if unusable.len() > listed {
            let more = thousands(unusable.len() - listed);
            eprintln!("  and {more} more: --report FILE.json and -v list them all");
        }
        false
    }
}
