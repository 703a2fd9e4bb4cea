//! How large a mission is made: `--robots N --size M`, or for `--size` the word that the mission has for it.

use alliance_proto::scenario::{MAX_ROBOTS, Scenario, Vocabulary};
use anyhow::bail;
use clap::parser::ArgMatches;
use clap::{Arg, ArgGroup, Args, Command, FromArgMatches, Id};

/// Robots of a mission whose size alone is asked for.
const DEFAULT_ROBOTS: usize = 3;
/// Most that there is to do in a mission of any size.
const MAX_SIZE: usize = 10_000;
/// The argument that all missions have.
const SIZE: &str = "size";
/// It and the words of the missions, of which one is given at most.
const WORDS: &str = "size-words";

/// How large a mission is made.
#[derive(Args, Clone, Debug, Default)]
pub struct SizeArgs {
    /// The mission with so many robots, in a room that grows with them [default: 3]
    #[arg(long, value_name = "N", value_parser = count::<MAX_ROBOTS>, allow_negative_numbers = true)]
    robots: Option<usize>,
    #[command(flatten)]
    work: Work,
}

/// So much to do, and the word that it was asked for with.
#[derive(Clone, Debug, Default)]
struct Work(Option<(String, usize)>);

/// The command and all below it that know `--size` know the words of the missions.
#[must_use]
pub fn with_size_words(mut command: Command, vocabulary: &Vocabulary) -> Command {
    if command.get_arguments().any(|known| known.get_id() == SIZE) {
        let mut group = ArgGroup::new(WORDS).arg(SIZE);
        for mission in vocabulary.missions.iter() {
            if let Some(word) = mission.size_word() {
                let help = format!("--size of the mission '{}'", mission.scenario_name());
                command = command.arg(amount(word).help(help));
                group = group.arg(word);
            }
        }
        command = command.group(group);
    }
    command.mut_subcommands(|part| with_size_words(part, vocabulary))
}

impl SizeArgs {
    /// The default scenario of a mission in that size: of the one that is asked for, or else the one with the word that was
    /// given, or else the first known one; `None` if no size is asked for, but a scenario of its own.
    ///
    /// # Errors
    /// One line, when another scenario is asked for, or the mission comes in one size or goes by another word.
    pub fn scenario(
        &self,
        asked: Option<&str>,
        vocabulary: &Vocabulary,
    ) -> anyhow::Result<Option<Scenario>> {
        let is_sized = self.robots.is_some() || self.work.0.is_some();
        if !is_sized && !asked.is_some_and(|asked| is_of_any_size(asked, vocabulary)) {
            return Ok(None);
        }
        let word = self.work.word();
        let mut missions = vocabulary.missions.iter();
        let mission = match (asked, word) {
            (Some(asked), _) => missions.find(|mission| mission.scenario_name() == asked),
            (None, Some(word)) => missions.find(|mission| mission.size_word() == Some(word)),
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
            bail!(
                "--robots and --size: '{}' has its own; they go with '{}' only",
                asked.unwrap_or_default(),
                names.join("' and '")
            );
        };
        if let Some(word) = word
            && mission.size_word() != Some(word)
        {
            bail!(
                "--{word}: '{}' goes by --{}",
                mission.scenario_name(),
                mission.size_word().unwrap_or(SIZE)
            );
        }
        Ok(Some(sized))
    }

    /// As they are given to a process.
    #[must_use]
    pub fn arguments(&self) -> Vec<String> {
        let robots = self.robots.map(|robots| format!("--robots={robots}"));
        let work = self.work.0.as_ref();
        let work = work.map(|(word, size)| format!("--{word}={size}"));
        robots.into_iter().chain(work).collect()
    }
}

/// Whether that is a mission that comes in any size, and no scenario of its own.
fn is_of_any_size(asked: &str, vocabulary: &Vocabulary) -> bool {
    let mut missions = vocabulary.missions.iter();
    let mission = missions.find(|mission| mission.scenario_name() == asked);
    mission.is_some_and(|it| it.family(1, 1).is_some()) && vocabulary.builtin(asked).is_none()
}

impl Work {
    /// The word of a mission.
    fn word(&self) -> Option<&str> {
        let word = self.0.as_ref().map(|(word, _)| word.as_str());
        word.filter(|word| *word != SIZE)
    }
}

// By hand, for which words there are depends on the missions of the program.
impl Args for Work {
    fn augment_args(command: Command) -> Command {
        command.arg(
            amount(SIZE)
                .help("The mission with so much to do [default: two for every three robots]"),
        )
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
        // A program that knows no missions has no group.
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
        .value_parser(count::<MAX_SIZE>)
        .allow_negative_numbers(true)
}

fn count<const MOST: usize>(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count) if (1..=MOST).contains(&count) => Ok(count),
        _ => Err(format!("use a whole number from 1 to {MOST}")),
    }
}
