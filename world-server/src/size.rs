//! The size of a mission on the command line: `--robots N --size M`, or the mission's own option instead of `--size`.

use anyhow::bail;
use clap::parser::ArgMatches;
use clap::{Arg, ArgGroup, Args, Command, FromArgMatches, Id};
use scenario::{MAX_ROBOTS, MAX_TASKS, Problem, Scenario, Vocabulary};

/// The number of robots if only `--size` is given.
const DEFAULT_ROBOTS: usize = 3;
const SIZE: &str = "size";
const SIZE_HELP: &str = "Amount of work [default: two thirds of the robots]";
/// The group of all size options, of which at most one may be given.
const WORDS: &str = "size-words";

#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Mission")]
pub struct SizeArgs {
    /// Number of robots; the room grows with it [default: 3]
    #[arg(long, value_name = "N", value_parser = count::<MAX_ROBOTS>, allow_negative_numbers = true)]
    robots: Option<usize>,
    #[command(flatten)]
    work: Work,
}

/// The requested size and the name of the option that set it.
#[derive(Clone, Debug, Default)]
struct Work(Option<(String, usize)>);

/// Adds the missions' own size options to each command that has `--size`.
#[must_use]
pub fn with_size_options(mut command: Command, vocabulary: &Vocabulary) -> Command {
    // The id is not enough: faults have positional arguments with the same id.
    if command
        .get_arguments()
        .any(|known| known.get_long() == Some(SIZE))
    {
        let mut group = ArgGroup::new(WORDS).arg(SIZE);
        let mut words = Vec::new();
        for mission in vocabulary.missions.iter() {
            if let Some(word) = mission.vocabulary().size_option {
                // Not in the help, because each has the same meaning as --size.
                command = command.arg(amount(word).hide(true));
                group = group.arg(word);
                words.push(format!("--{word}"));
            }
        }
        command = command.group(group);
        if !words.is_empty() {
            let help = format!("{SIZE_HELP}; also {}", words.join(", "));
            command = command.mut_arg(SIZE, |size| size.help(help));
        }
    }
    command.mut_subcommands(|part| with_size_options(part, vocabulary))
}

impl SizeArgs {
    /// Returns the default scenario of a mission in the requested size, or `None` if no size is given and `requested` is not a mission
    /// of variable size. Without `requested`, the size option selects the mission, or else it is the first one.
    ///
    /// # Errors
    /// Returns one line if the scenario has a fixed size or the mission has another size option.
    pub fn scenario(
        &self,
        requested: Option<&str>,
        vocabulary: &Vocabulary,
    ) -> anyhow::Result<Option<Scenario>> {
        let is_sized = self.robots.is_some() || self.work.0.is_some();
        if !is_sized && !requested.is_some_and(|requested| is_of_any_size(requested, vocabulary)) {
            return Ok(None);
        }
        let word = self.work.word();
        let mut missions = vocabulary.missions.iter();
        let mission = match (requested, word) {
            (Some(requested), _) => missions.find(|mission| mission.scenario_name() == requested),
            (None, Some(word)) => {
                missions.find(|mission| mission.vocabulary().size_option == Some(word))
            }
            (None, None) => missions.next(),
        };
        let robots = self.robots.unwrap_or(DEFAULT_ROBOTS);
        let default = (2 * robots).div_ceil(3);
        let size = self.work.0.as_ref().map_or(default, |(_, size)| *size);
        let Some((mission, sized)) =
            mission.and_then(|mission| Some((mission, mission.family(robots, size)?)))
        else {
            let of_any_size = vocabulary.missions.iter();
            let of_any_size = of_any_size.filter(|mission| mission.family(1, 1).is_some());
            let names: Vec<&str> = of_any_size.map(|mission| mission.scenario_name()).collect();
            let what = format!("'{}' has a fixed size", requested.unwrap_or_default());
            let remedy = format!("use one of {}", names.join(", "));
            bail!(Problem::with_source("--robots and --size", what, remedy));
        };
        if let Some(word) = word
            && mission.vocabulary().size_option != Some(word)
        {
            let what = format!("'{}' has another size option", mission.scenario_name());
            let remedy = format!("use --{}", mission.vocabulary().size_option.unwrap_or(SIZE));
            bail!(Problem::with_source(format!("--{word}"), what, remedy));
        }
        Ok(Some(sized))
    }

    #[must_use]
    pub fn arguments(&self) -> Vec<String> {
        let robots = self.robots.map(|robots| format!("--robots={robots}"));
        let work = self.work.0.as_ref();
        let work = work.map(|(word, size)| format!("--{word}={size}"));
        robots.into_iter().chain(work).collect()
    }
}

/// Returns `true` if this is a mission of variable size without a scenario file of its own.
fn is_of_any_size(requested: &str, vocabulary: &Vocabulary) -> bool {
    let mut missions = vocabulary.missions.iter();
    let mission = missions.find(|mission| mission.scenario_name() == requested);
    mission.is_some_and(|mission| mission.family(1, 1).is_some())
        && vocabulary.builtin(requested).is_none()
}

impl Work {
    /// Returns the mission's own size option, or `None` for `--size`.
    fn word(&self) -> Option<&str> {
        let word = self.0.as_ref().map(|(word, _)| word.as_str());
        word.filter(|word| *word != SIZE)
    }
}

// Implemented by hand, because the options depend on the missions of the program.
impl Args for Work {
    fn augment_args(command: Command) -> Command {
        command.arg(amount(SIZE).help(SIZE_HELP))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for Work {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut work = Self::default();
        work.update_from_arg_matches(matches)?;
        Ok(work)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        // A program without missions has no such group.
        let given = matches.try_get_one::<Id>(WORDS).ok().flatten();
        let word = given.map_or(SIZE, Id::as_str);
        if let Some(size) = matches.get_one::<usize>(word) {
            self.0 = Some((word.to_owned(), *size));
        }
        Ok(())
    }
}

fn amount(word: &'static str) -> Arg {
    Arg::new(word)
        .long(word)
        .value_name("M")
        .value_parser(count::<MAX_TASKS>)
        .allow_negative_numbers(true)
}

fn count<const MOST: usize>(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count) if (1..=MOST).contains(&count) => Ok(count),
        _ => Err(format!("use a whole number from 1 to {MOST}")),
    }
}
