//! The options of a system: its aliases for knobs.

use clap::{Arg, ArgAction, ArgMatches, Args, Command, Error, FromArgMatches, ValueHint};
use ratelab::{Depth, Hz, Knob, KnobKind};
use ratelab_experiment::sweep::SweepAxis;
use ratelab_system::Alias;

use super::heading;
use crate::program::Program;

/// The values of the system's options: settings of a run, or axes of a sweep.
#[derive(Clone, Debug)]
pub struct SystemArgs<T> {
    /// The values of its aliases.
    pub given: Vec<T>,
    /// Whether `--break` is set.
    pub broken: bool,
    /// Whether `--theory` is set.
    pub theory: bool,
}

/// The name of an alias, and the knobs that it sets.
pub type Setting = (&'static str, Vec<Knob>);

/// The default axis of a sweep, if the first alias of its system is a rate.
pub const DEFAULT_RATES: &str = "1..30";

/// Name of the option that breaks a system.
const BREAK: &str = "break";

/// Name of the option that adds linear theory.
const THEORY: &str = "theory";

/// Adds the system's options before the options of `command`: a value for each alias.
pub fn with_run_options(command: Command, program: &Program) -> Command {
    let mut options = Vec::new();
    for alias in program.system.knobs().aliases() {
        let help = match alias.kind() {
            KnobKind::Rate => {
                let (least, most) = (Hz::MIN.get(), Hz::MAX.get());
                format!("{} ({least} to {most} Hz)", alias.help)
            }
            KnobKind::Depth => format!("{} (1 to {})", alias.help, Depth::MAX),
            _ => alias.help.to_owned(),
        };
        let name = match alias.kind() {
            KnobKind::Send | KnobKind::Parameter => alias.name.to_uppercase(),
            kind => kind.value_name().to_owned(),
        };
        let read = move |text: &str| alias.set(text).map(|knobs| (alias.name, knobs));
        let option = option(alias, program, &help, alias.default).value_name(name);
        options.push(option.value_parser(read));
    }
    if let Some(knob) = program.system.knobs().broken() {
        let alias = knob.split(' ').next().unwrap_or_default();
        let place = options.iter().position(|option| *option.get_id() == alias);
        let option = flag(BREAK, format!("Break it: {knob}"));
        match place {
            Some(place) => options.insert(place + 1, option.conflicts_with(alias.to_owned())),
            None => options.push(option),
        }
    }
    in_front(options, command)
}

/// Adds the system's options before the options of `command`: a list for each alias.
pub fn with_axes(command: Command, program: &Program) -> Command {
    let knobs = program.knobs();
    let options = program
        .system
        .knobs()
        .aliases()
        .iter()
        .enumerate()
        .map(|(place, alias)| {
            let what = match alias.kind() {
                KnobKind::Rate => "a list or a range (Hz), such as 1..30",
                KnobKind::Depth => "a list or a range",
                kind if kind.is_time() => "several with commas in between",
                _ => "several with commas in between (a comma in one is \\,)",
            };
            let help = format!("{}; {what}", alias.help);
            let read = move |text: &str| SweepAxis::parse(knobs, alias.name, text);
            let default = match (place, alias.kind()) {
                (0, KnobKind::Rate) => DEFAULT_RATES,
                _ => alias.default,
            };
            let option = option(alias, program, &help, default).value_name("LIST");
            let action = match alias.kind() {
                KnobKind::Send => ArgAction::Append,
                _ => ArgAction::Set,
            };
            option.action(action).value_parser(read)
        });
    let command = in_front(options.collect(), command);
    if !program.course {
        return command;
    }
    let what = "Add linear theory to the measurement: how fast a small deviation grows (1/s), and \
                the edges between rows or cells from which on it does";
    let theory = flag(THEORY, what.to_owned()).help_heading(heading::OUTPUT);
    command.arg(theory.display_order(0))
}

fn option(alias: &'static Alias, program: &Program, help: &str, default: &str) -> Arg {
    let option = Arg::new(alias.name)
        .long(alias.name)
        .help(format!("{help} [default: {default}]"))
        .help_heading(if alias.kind().is_time() {
            heading::TIME
        } else {
            heading::GRAPH
        });
    let underscored = alias.name.replace('-', "_");
    let with_aliases = option.aliases(Some(underscored).filter(|name| name != alias.name));
    match alias.kind() {
        KnobKind::Send if takes_files(alias, program) => {
            with_aliases.value_hint(ValueHint::FilePath)
        }
        KnobKind::Send => with_aliases,
        _ => with_aliases.allow_hyphen_values(true),
    }
}

/// Returns whether the messages of `alias` may name a file.
fn takes_files(alias: &Alias, program: &Program) -> bool {
    alias
        .knobs
        .iter()
        .map(|(_, node)| node)
        .any(|node| program.system.knobs().file(node, "file").is_some())
}

fn flag(name: &'static str, help: String) -> Arg {
    let flag = Arg::new(name).long(name).help(help);
    flag.action(ArgAction::SetTrue).help_heading(heading::GRAPH)
}

/// Puts `options` before the options of `command`.
fn in_front(options: Vec<Arg>, command: Command) -> Command {
    let count = options.len();
    command
        .mut_args(|arg| {
            let place = arg.get_display_order() + count;
            arg.display_order(place)
        })
        .args(
            options
                .into_iter()
                .enumerate()
                .map(|(place, option)| option.display_order(place)),
        )
}

fn is_set(flag: &str, matches: &ArgMatches) -> bool {
    let given = matches.try_get_one::<bool>(flag);
    given.ok().flatten().copied().unwrap_or(false)
}

impl<T: Clone + Send + Sync + 'static> FromArgMatches for SystemArgs<T> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let options = matches
            .ids()
            .map(|id| matches.try_get_many::<T>(id.as_str()));
        let values = options.filter_map(|values| values.ok().flatten());
        Ok(Self {
            given: values.flatten().cloned().collect(),
            broken: is_set(BREAK, matches),
            theory: is_set(THEORY, matches),
        })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// The options are added later, when the system is known.
impl<T: Clone + Send + Sync + 'static> Args for SystemArgs<T> {
    fn augment_args(command: Command) -> Command {
        command
    }

    fn augment_args_for_update(command: Command) -> Command {
        command
    }
}
