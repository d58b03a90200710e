//! The jobs `map`, `draw`, `track`, `path` and `tracts`: `fit` with the options that are right for them.

use std::ffi::OsString;

use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Args, Command};

use super::fit::FitArgs;

/// A job, and the options of `fit` that it stands for.
struct Job {
    name: &'static str,
    about: &'static str,
    /// The option that is asked for.
    asks: &'static str,
    /// What it is called here, if not as in `fit`.
    called: Option<&'static str>,
    /// Whether it may be left out.
    optional: bool,
    /// Options of `fit` that its help lists, beside the common ones. It takes all.
    options: &'static [&'static str],
    /// Options of `fit`, as they are written, with the values that they have here.
    presets: &'static [(&'static str, &'static str)],
    examples: &'static str,
}

/// Options that the help of every job lists.
const COMMON: [&str; 7] = ["input", "output", "picture", "report", "force", "quiet", "verbose"];

const JOBS: [Job; 5] = [
    Job {
        name: "map",
        about: "Smooth a map: borders stay shared, corners sharp, areas and long straight lines what they are",
        asks: "within",
        called: None,
        optional: false,
        options: &["tolerance", "corners", "only", "selected", "snap", "digits"],
        presets: &[
            ("method", "smoothing"),
            ("tolerance", "auto"),
            ("corners", "straight"),
            ("topology", "yes"),
            ("crossings", "mend"),
        ],
        examples: "  faircurve map world.topojson -o smooth.topojson --within 5km
  faircurve map parcels.geojson -o smooth.geojson --within 2 --only coast",
    },
    Job {
        name: "draw",
        about: "Smooth a drawing: traced noise becomes few smooth Béziers, with sharp corners",
        asks: "within",
        called: None,
        optional: false,
        options: &["tolerance", "corners", "extremes", "only", "selected", "digits"],
        presets: &[
            ("method", "smoothing"),
            ("as", "bezier"),
            ("tolerance", "auto"),
            ("corners", "auto"),
            ("only", "paths"),
            ("topology", "yes"),
        ],
        examples: "  faircurve draw logo.svg -o smooth.svg --within 0.5
  faircurve draw plan.svg -o smooth.svg --within 1 --where class=traced",
    },
    Job {
        name: "track",
        about: "Smooth tracks in time, within a distance of every point, or as their noise asks",
        asks: "tube",
        called: Some("within"),
        optional: true,
        options: &[
            "within_height",
            "columns",
            "max_speed",
            "robust",
            "stops",
            "dropped",
            "gap",
            "every",
            "at",
            "write",
        ],
        presets: &[
            ("method", "smoothing"),
            ("smoothing", "gcv"),
            ("within-height", "gcv"),
            ("pin", "none"),
            ("carry", "all"),
            ("duplicates", "first"),
        ],
        examples: "  faircurve track run.csv -o smooth.csv --within 5m --write speed
  faircurve track ships.csv -o hourly.csv --columns curve=mmsi,x=lon,y=lat,t=time --within 50m --gap 6h --every 1h",
    },
    Job {
        name: "path",
        about: "Plan paths through points, or near them, that turn no sharper than a radius",
        asks: "min_radius",
        called: None,
        optional: false,
        options: &[
            "deviation",
            "corridor",
            "keep_out",
            "obstacles",
            "limits",
            "clearance",
            "tolerance",
            "spacing",
            "write",
            "speed",
        ],
        presets: &[("method", "fair")],
        examples: "  faircurve path route.csv -o drive.csv --min-radius 5 --deviation 1
  faircurve path route.csv -o drive.csv --min-radius 5 --spacing 0.1 --speed 15 --lateral 3 --accelerate 2 --brake 4",
    },
    Job {
        name: "tracts",
        about: "Smooth streamlines within a distance of every point, in millimetres",
        asks: "deviation",
        called: None,
        optional: false,
        options: &["points", "tolerance", "write"],
        presets: &[("method", "smoothing")],
        examples: "  faircurve tracts brain.trk -o smooth.trk --deviation 1
  faircurve tracts brain.tck -o smooth.tck --deviation 0.5 --points 20",
    },
];

/// The jobs as subcommands.
pub fn commands() -> impl Iterator<Item = Command> {
    JOBS.iter().map(Job::command)
}

/// The arguments with a `fit` in place of the job, which `-v` prints, or `None` without a job. `matches` is the
/// whole command line. A preset gives way to its option, and to options that exclude it.
pub fn expanded(arguments: &[OsString], matches: &ArgMatches) -> Option<Vec<OsString>> {
    let (name, own) = matches.subcommand()?;
    let job = JOBS.iter().find(|job| job.name == name)?;
    let place = arguments.iter().skip(1).position(|argument| argument == name).map_or(1, |at| at + 1);
    let fit = FitArgs::augment_args(Command::new(""));
    let gives_way = |option: &str| {
        let preset =
            fit.get_arguments().find(|argument| argument.get_long() == Some(option)).expect("an option of fit");
        // Either of two options may say that it excludes the other.
        let named = |a: &Arg, b: &Arg| fit.get_arg_conflicts_with(a).iter().any(|own| own.get_id() == b.get_id());
        let excludes = |other: &Arg| named(preset, other) || named(other, preset);
        is_given(own, preset) || fit.get_arguments().any(|other| is_given(own, other) && excludes(other))
    };
    let presets = job.presets.iter().filter(|(option, _)| !gives_way(option));
    let presets = presets.flat_map(|(option, value)| [format!("--{option}"), value.to_string()]);
    let mut expanded = arguments.to_vec();
    if let Some(called) = job.called {
        let (here, there) = (format!("--{called}"), format!("--{}", job.asks));
        for word in expanded[place + 1..].iter_mut() {
            let text = word.to_string_lossy();
            if *text == here || text.starts_with(&format!("{here}=")) {
                *word = text.replacen(&here, &there, 1).into();
            }
        }
    }
    expanded.splice(place..=place, ["fit".to_string()].into_iter().chain(presets).map(OsString::from));
    if own.get_flag("verbose") {
        let words = expanded[1..].iter().map(|word| quoted(&word.to_string_lossy()));
        eprintln!("faircurve: {name} is short for: faircurve {}", words.collect::<Vec<_>>().join(" "));
    }
    Some(expanded)
}

impl Job {
    /// Its options are made once it is asked for: those of all jobs take as long as a small fit.
    fn command(&self) -> Command {
        let help = format!(
            "Examples:\n{}\n\n-v prints the fit command that it is short for. The other options of faircurve fit work here, too.",
            self.examples
        );
        Command::new(self.name).about(self.about).after_help(help).defer(|command| {
            let job = JOBS.iter().find(|job| job.name == command.get_name()).expect("made for a job");
            let fit = FitArgs::augment_args(Command::new(""));
            let taken = |argument: &&Arg| job.called != Some(argument.get_id().as_str());
            command.args(fit.get_arguments().filter(taken).map(|argument| job.argument(argument)))
        })
    }

    /// An option of `fit` as the job has it: with one line of help, and what it is by default.
    fn argument(&self, argument: &Arg) -> Arg {
        let id = argument.get_id().as_str();
        let preset = self.presets.iter().find(|(option, _)| argument.get_long() == Some(*option));
        let help = argument.get_help().map(ToString::to_string).unwrap_or_default();
        let help = help.split(" [default:").next().unwrap_or_default().to_string();
        let help = preset.map_or(help.clone(), |(_, value)| format!("{help} [default: {value}]"));
        // `fit` checks values and conflicts.
        let mut own = Arg::new(id.to_string())
            .help(help)
            .action(argument.get_action().clone())
            .hide(!(id == self.asks || COMMON.contains(&id) || self.options.contains(&id)))
            .required(id == self.asks && !self.optional || argument.is_required_set());
        if argument.get_action().takes_values() {
            own = own.allow_hyphen_values(argument.is_allow_hyphen_values_set());
            own = own.allow_negative_numbers(argument.is_allow_negative_numbers_set());
            own = own.value_parser(clap::value_parser!(OsString));
            own = own.value_names(argument.get_value_names().unwrap_or_default().iter().map(|name| name.to_string()));
        }
        if let Some(long) = argument.get_long() {
            own = match self.called.filter(|_| id == self.asks) {
                Some(called) => own.long(called).alias(long.to_string()),
                None => own.long(long.to_string()),
            };
        }
        match argument.get_short() {
            Some(short) => own.short(short),
            None => own,
        }
    }
}

fn is_given(matches: &ArgMatches, option: &Arg) -> bool {
    let option = option.get_id().as_str();
    matches.try_contains_id(option).unwrap_or(false) && matches.value_source(option) == Some(ValueSource::CommandLine)
}

/// A word as a shell reads it.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:%+@".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.into()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}
