//! [`Given`]: which options stand on the command line, of any struct of options.

use clap::{ArgMatches, Args, Command, FromArgMatches, Id};

/// The options that stand on the command line, by the groups that clap makes of structs.
#[derive(Clone, Debug, Default)]
pub struct Given(Vec<(Id, Vec<String>)>);

impl Given {
    /// Those of a struct in the order in which they are given, such as `--max-curvature`.
    pub fn of<A: Args>(&self) -> impl Iterator<Item = &str> {
        let group = A::group_id();
        let groups = self.0.iter().filter(move |(own, _)| Some(own) == group.as_ref());
        groups.flat_map(|(_, options)| options.iter().map(String::as_str))
    }

    /// These without one option.
    pub fn without(&self, option: &str) -> Self {
        let mut given = self.clone();
        given.0.iter_mut().for_each(|(_, options)| options.retain(|own| own != option));
        given
    }
}

impl FromArgMatches for Given {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let option = |id: &Id| format!("--{}", id.as_str().replace('_', "-"));
        let group = |id: &Id| Some((id.clone(), matches.try_get_many(id.as_str()).ok()??.map(option).collect()));
        Ok(Given(matches.ids().filter_map(group).collect()))
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
