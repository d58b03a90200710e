//! [`Given`]: which options stand on the command line, of any struct of options.

use clap::parser::ValueSource;
use clap::{ArgMatches, Args, Command, FromArgMatches, Id};

/// The options that stand on the command line.
///
/// It is the first field of a struct of options: clap takes the options out that other fields read.
#[derive(Clone, Debug, Default)]
pub struct Given(Vec<Id>);

impl Given {
    /// The options of a struct that are given, such as `--max-curvature`, in the order of the help.
    pub fn of<A: Args>(&self) -> Vec<String> {
        let command = A::augment_args(Command::new(""));
        let given = command.get_arguments().filter(|argument| self.0.contains(argument.get_id()));
        given.filter_map(|argument| Some(format!("--{}", argument.get_long()?))).collect()
    }
}

impl FromArgMatches for Given {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let is_given = |id: &&Id| matches.value_source(id.as_str()) == Some(ValueSource::CommandLine);
        Ok(Given(matches.ids().filter(is_given).cloned().collect()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Given::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Args for Given {
    fn augment_args(command: Command) -> Command {
        command
    }

    fn augment_args_for_update(command: Command) -> Command {
        command
    }
}
