//! Command line of a mission: which scenario is run, its size and its seed.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use scenario::limits::TIME;
use scenario::time::seconds;
use scenario::{
    ParameterFile, Problem, Profile, Scenario, Setup, StepOrder, Vocabulary, decode_text,
    name_remedy,
};
use terminal::stderr_line;

use crate::mission::MissionRegistry;
use crate::size::SizeArgs;
use crate::weights::include_weights;

/// The scenarios, missions and worlds that a program contains.
#[derive(Clone, Debug)]
pub struct Known {
    /// The names that scenarios may use, and the built-in scenarios.
    pub vocabulary: Vocabulary,
    pub worlds: MissionRegistry,
}

/// The scenario of a run and its overrides.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Mission")]
pub struct MissionArgs {
    /// Name of a built-in scenario, or a TOML file
    #[arg(value_name = "SCENARIO|FILE", help_heading = None::<&str>)]
    pub scenario: Option<String>,
    #[command(flatten)]
    pub size: SizeArgs,
    /// Seed of all random streams
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = seed, allow_negative_numbers = true)]
    pub seed: u64,
    /// Parameter file in the thesis' form (Fig. 3.4); overrides the scenario
    #[arg(long, value_name = "FILE")]
    pub params: Option<PathBuf>,
    /// File of learned times; read if it exists, and written by `alliance run`
    #[arg(long, value_name = "FILE")]
    pub profile: Option<PathBuf>,
    /// Robots step 'simultaneous' or 'in-order' [default: the preset's]
    #[arg(long, value_name = "ORDER", value_parser = step_order)]
    pub step_order: Option<StepOrder>,
    /// Allocator of all robots; see `alliance list allocators`
    #[arg(long, value_name = "ALLOCATOR")]
    pub allocator: Option<String>,
    /// End the run after this much simulated time, such as 60s or 2min [default: the scenario's]
    #[arg(long, value_name = "TIME", value_parser = positive_time, allow_negative_numbers = true)]
    pub limit: Option<f64>,
}

impl MissionArgs {
    /// Reads the scenario and the parameter file. Lists unused keys of the parameter file on stderr.
    ///
    /// # Errors
    /// Returns one line with the file, the position, the problem and the remedy.
    pub fn setup(&self, known: &Known) -> anyhow::Result<Setup> {
        self.resolve(self.scenario(known)?, known)
    }

    /// Returns the selected scenario without the overrides.
    pub fn scenario(&self, known: &Known) -> anyhow::Result<Scenario> {
        let requested = self.scenario.as_deref();
        match (self.size.scenario(requested, &known.vocabulary)?, requested) {
            (Some(sized), _) => Ok(sized),
            (None, Some(requested)) => read_scenario(requested, known),
            (None, None) => Ok(known.vocabulary.default_scenario()?),
        }
    }

    /// Applies all overrides to a scenario. Lists unused keys of the parameter file on stderr.
    pub fn resolve(&self, mut scenario: Scenario, known: &Known) -> anyhow::Result<Setup> {
        if let Some(limit) = self.limit {
            scenario.limit_s = limit;
        }
        if let Some(order) = self.step_order {
            scenario.set_step_order(order);
        }
        if let Some(name) = &self.allocator {
            scenario.set_allocator(name);
        }
        scenario.check_allocators(&known.vocabulary.allocators)?;
        include_weights(&mut scenario)?;
        let parameters = match &self.params {
            None => None,
            Some(path) => Some(ParameterFile::parse(
                &path.display().to_string(),
                &terminal::read_file(path)?,
            )?),
        };
        let mut resolved = Setup::resolve(scenario, self.seed, parameters.as_ref())?;
        if let Some(path) = &self.profile {
            resolved.setup.profile =
                read_profile(path, &resolved.setup.scenario, &known.vocabulary)?;
        }
        let scenario = &resolved.setup.scenario;
        if let Err(error) = known.worlds.find(scenario)?.start_poses(scenario) {
            let requested = self.scenario.as_deref().unwrap_or(&scenario.name);
            bail!("{requested}: {}", error.describe(scenario));
        }
        if !resolved.skipped.is_empty() {
            let skipped: Vec<String> = resolved.skipped.iter().map(ToString::to_string).collect();
            stderr_line!(
                "skipped because the scenario has no such robot or behavior set: {}",
                skipped.join(", ")
            );
        }
        Ok(resolved.setup)
    }
}

/// Reads a built-in scenario by name, or else a scenario file.
pub fn read_scenario(requested: &str, known: &Known) -> anyhow::Result<Scenario> {
    if let Some(builtin) = known.vocabulary.builtin(requested) {
        return Ok(Scenario::parse(requested, builtin.text, &known.vocabulary)?);
    }
    let path = Path::new(requested);
    // Only a path can contain these characters.
    if !path.exists() && !requested.contains(['/', '.']) {
        let builtins = known.vocabulary.builtins().map(|builtin| builtin.name);
        let what = format!("'{requested}' is neither a built-in scenario nor a file");
        bail!(Problem::of_value(what, name_remedy(requested, builtins)));
    }
    let bytes = terminal::read_file(path)?;
    let text = decode_text(requested, bytes)?;
    let has_content = |line: &str| !matches!(line.trim_start().chars().next(), None | Some('#'));
    if !text.lines().any(has_content) {
        let remedy = "state at least its mission, such as [service]";
        bail!(Problem::with_source(
            requested,
            "the scenario is empty",
            remedy
        ));
    }
    Ok(Scenario::parse(requested, &text, &known.vocabulary)?)
}

fn read_profile(
    path: &Path,
    scenario: &Scenario,
    vocabulary: &Vocabulary,
) -> anyhow::Result<Profile> {
    let name = path.display().to_string();
    let option = format!("--profile {name}");
    let mut robots = scenario.robots.iter();
    if !robots.any(|robot| vocabulary.learns(scenario.decider_of(robot))) {
        let learners = vocabulary
            .allocators
            .iter()
            .filter(|spec| spec.learns_times);
        let learners: Vec<&str> = learners.map(|spec| spec.name).collect();
        let allocators = scenario.allocator_list();
        let what = format!("the robots' allocator is {allocators}, which learns nothing");
        let remedy = format!("use one that learns: {}", learners.join(", "));
        bail!(Problem::with_source(option, what, remedy));
    }
    if path.is_dir() {
        bail!(Problem::with_source(
            option,
            "that is a folder",
            "name a file"
        ));
    }
    match std::fs::read(path) {
        Ok(bytes) => {
            let text = decode_text(&name, bytes)?;
            Ok(Profile::parse(&name, &text, scenario, vocabulary)?)
        }
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(Profile::default()),
        Err(error) => Err(error).with_context(|| option),
    }
}

fn seed(text: &str) -> Result<u64, String> {
    text.parse()
        .map_err(|_| format!("use a whole number from 0 to {}", u64::MAX))
}

fn step_order(text: &str) -> Result<StepOrder, String> {
    match text {
        "simultaneous" => Ok(StepOrder::Simultaneous),
        "in-order" => Ok(StepOrder::InOrder),
        _ => Err("use 'simultaneous' or 'in-order'".to_owned()),
    }
}

/// Parses a time above 0, such as `60`, `60s` or `2min`, and returns it in seconds.
///
/// # Errors
/// Returns an error for another text, and for a time that is too long.
pub fn positive_time(text: &str) -> Result<f64, Problem> {
    let span_s = seconds(text)?;
    TIME.check((), span_s).map(|()| span_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_or_missing_file_is_no_scenario() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        let name = path.to_str().unwrap();
        let known = Known {
            vocabulary: scenario::testkit::vocabulary(),
            worlds: MissionRegistry::default(),
        };
        let refusal = || read_scenario(name, &known).unwrap_err().to_string();
        assert_eq!(refusal(), format!("{name}: no such file; correct the path"));
        let empty = "the scenario is empty; state at least its mission, such as [service]";
        for text in ["", "\n  \n", "# name = 'a'\n"] {
            std::fs::write(&path, text).unwrap();
            assert_eq!(refusal(), format!("{name}: {empty}"));
        }
        std::fs::write(&path, "# a comment\n[drill]").unwrap();
        assert!(read_scenario(name, &known).is_ok());
    }

    #[test]
    fn times_of_options_have_units() {
        for (text, span_s) in [("60", 60.0), ("60s", 60.0), ("2min", 120.0), ("500ms", 0.5)] {
            assert_eq!(positive_time(text), Ok(span_s));
        }
        for text in ["0", "-1", "1h", "inf", "1e10", ""] {
            assert!(positive_time(text).is_err(), "{text}");
        }
    }

    #[test]
    fn an_error_about_invalid_utf_8_contains_the_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        std::fs::write(&path, b"step_ms = 50\nname = \"\xff\"\n").unwrap();
        let name = path.to_str().unwrap();
        let known = Known {
            vocabulary: scenario::testkit::vocabulary(),
            worlds: MissionRegistry::default(),
        };
        let error = read_scenario(name, &known).unwrap_err();
        assert_eq!(
            error.to_string(),
            format!("{name}:2: the bytes are not UTF-8 text; save the file as UTF-8")
        );
    }
}
