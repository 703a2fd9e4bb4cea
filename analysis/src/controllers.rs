//! Controllers in Python that a plan names beside the allocators.
//!
//! The command line states their files, because a plan must not start programs. The Python package executes the
//! command with these controllers in its registry.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use scenario::limits::check_name;
use scenario::{Problem, Robot, Scenario, Vocabulary};
use xxhash_rust::xxh3::xxh3_64;

use crate::shell::shell_quoted;

/// A value of `--controller`: `NAME=FILE`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ControllerFile {
    pub name: String,
    pub file: PathBuf,
}

/// The controllers in Python of a command.
#[derive(Args, Clone, Debug, Default)]
pub struct ControllerFiles {
    /// Controller in Python, used under this name like an allocator
    #[arg(long = "controller", value_name = "NAME=FILE", value_parser = parse)]
    pub files: Vec<ControllerFile>,
    /// The other files of these controllers: the modules of their folders that they have imported.
    #[arg(skip)]
    pub modules: Vec<PathBuf>,
}

/// Checks that no allocator has the name of a controller.
///
/// # Errors
/// Returns an error for the name of an allocator.
pub fn check_is_unknown(name: &str, vocabulary: &Vocabulary) -> Result<(), Problem> {
    let mut known = vocabulary.allocators.iter();
    if known.any(|allocator| allocator.name == name) {
        return Err(Problem::with_source(
            format!("--controller {name}"),
            format!("'{name}' is one of the simulator's allocators"),
            "give the class another name",
        ));
    }
    Ok(())
}

fn parse(text: &str) -> Result<ControllerFile, Problem> {
    let parts = text.split_once('=').filter(|(_, file)| !file.is_empty());
    let Some((name, file)) = parts else {
        return Err(Problem::of_value(
            "use NAME=FILE, such as greedy=greedy.py",
            "",
        ));
    };
    check_name((), name)?;
    Ok(ControllerFile {
        name: name.to_owned(),
        file: file.into(),
    })
}

impl ControllerFiles {
    /// Returns whether there are controllers, so that the Python package has to execute the command.
    ///
    /// # Errors
    /// Returns an error if a controller has the name of an allocator of this program.
    pub fn need_python(&self, vocabulary: &Vocabulary) -> Result<bool, Problem> {
        for file in &self.files {
            check_is_unknown(&file.name, vocabulary)?;
        }
        Ok(!self.files.is_empty())
    }

    /// Appends a digest of the files and modules to that of a plan. Without files, the digest of the plan stays the same.
    /// A journal then contains only runs of one version of each controller and of the modules that its file imports.
    ///
    /// # Errors
    /// Returns an error if a file cannot be read.
    pub fn digest(&self, plan: String) -> anyhow::Result<String> {
        let mut digest = plan;
        let files = self
            .files
            .iter()
            .map(|file| (file.name.as_str(), &file.file));
        let modules = self.modules.iter().map(|module| ("", module));
        for (name, file) in files.chain(modules) {
            let text = fs::read(file).with_context(|| file.display().to_string())?;
            let whole = format!("{digest}\n{name}\n{:016x}", xxh3_64(&text));
            digest = format!("{:016x}", xxh3_64(whole.as_bytes()));
        }
        Ok(digest)
    }

    /// Returns the options that repeat these controllers in a command.
    #[must_use]
    pub fn options(&self) -> String {
        let option = |file: &ControllerFile| {
            let value = format!("{}={}", file.name, file.file.display());
            format!(" --controller {}", shell_quoted(Path::new(&value)))
        };
        self.files.iter().map(option).collect()
    }

    /// Returns a scenario of a plan in the form for `alliance run`: its robots with one of these controllers have an
    /// external controller. `None` stands for a scenario without them.
    ///
    /// # Errors
    /// Returns an error for an invalid scenario.
    pub fn external(
        &self,
        scenario: &toml::Table,
        vocabulary: &Vocabulary,
    ) -> anyhow::Result<Option<External>> {
        let mut scenario = Scenario::from_table(scenario, vocabulary)?;
        let stated = |robot: &Robot| scenario.decider_of(robot).to_owned();
        let deciders: Vec<String> = scenario.robots.iter().map(stated).collect();
        let is_ours = |name: &str| self.files.iter().any(|file| file.name == name);
        if !deciders.iter().any(|name| is_ours(name)) {
            return Ok(None);
        }
        // The team's allocator would be unknown to the program.
        scenario.allocator = None;
        for (robot, decider) in scenario.robots.iter_mut().zip(deciders) {
            let ours = is_ours(&decider);
            (robot.controller, robot.allocator) = match ours {
                true => (Some(decider), None),
                false => (None, Some(decider)),
            };
        }
        let commands = self.files.iter().filter(|file| {
            let mut robots = scenario.robots.iter();
            robots.any(|robot| robot.controller.as_ref() == Some(&file.name))
        });
        let commands = commands.map(|ControllerFile { name, file }| {
            let command = format!("{name}=python3 {}", shell_quoted(file));
            format!(" --controller {}", shell_quoted(Path::new(&command)))
        });
        Ok(Some(External {
            options: commands.collect(),
            scenario: scenario.to_toml()?,
        }))
    }

    /// Checks that each name occurs once.
    ///
    /// # Errors
    /// Returns an error that contains a repeated name.
    pub fn check(&self) -> anyhow::Result<()> {
        for (index, file) in self.files.iter().enumerate() {
            if self.files[..index]
                .iter()
                .any(|other| other.name == file.name)
            {
                bail!(
                    "--controller {}: it is given twice; a controller has one file",
                    file.name
                );
            }
        }
        Ok(())
    }
}

/// A scenario with external controllers.
#[derive(Debug)]
pub struct External {
    pub scenario: String,
    /// The options that start its controllers as processes.
    pub options: String,
}

#[cfg(test)]
mod tests {
    use missions::Registry;

    use super::*;

    fn files(texts: &[&str]) -> ControllerFiles {
        let files = texts.iter().map(|text| parse(text).unwrap());
        ControllerFiles {
            files: files.collect(),
            modules: Vec::new(),
        }
    }

    #[test]
    fn a_value_is_a_name_and_a_file() {
        assert_eq!(
            files(&["mine=my rules/mine.py"]).options(),
            " --controller 'mine=my rules/mine.py'"
        );
        for (text, expected) in [
            ("mine.py", "use NAME=FILE"),
            ("mine=", "use NAME=FILE"),
            ("my own=mine.py", "'my own' is not a"),
        ] {
            let problem = parse(text).unwrap_err().to_string();
            assert!(problem.contains(expected), "{text}: {problem}");
        }
        let error = files(&["a=a.py", "a=b.py"]).check().unwrap_err();
        assert!(error.to_string().contains("given twice"), "{error}");
    }

    #[test]
    fn controllers_need_python_and_cannot_have_the_name_of_an_allocator() {
        let vocabulary = Registry::built_in().vocabulary();
        assert_eq!(files(&[]).need_python(&vocabulary), Ok(false));
        assert_eq!(files(&["mine=mine.py"]).need_python(&vocabulary), Ok(true));
        let refused = files(&["mine=mine.py", "nearest=x.py"]).need_python(&vocabulary);
        assert_eq!(
            refused.unwrap_err().to_string(),
            "--controller nearest: 'nearest' is one of the simulator's allocators; give the class another name"
        );
    }

    #[test]
    fn the_digest_depends_on_name_and_content() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("mine.py");
        let digest = |name: &str, text: &str| {
            fs::write(&file, text).unwrap();
            let stated = format!("{name}={}", file.display());
            files(&[&stated]).digest("plan".to_owned()).unwrap()
        };
        let first = digest("mine", "a = 1");
        assert_eq!(first, digest("mine", "a = 1"));
        assert_ne!(first, digest("mine", "a = 2"));
        assert_ne!(first, digest("other", "a = 1"));
        assert_eq!(files(&[]).digest("plan".to_owned()).unwrap(), "plan");

        let module = folder.path().join("module.py");
        let with_module = |text: &str| {
            fs::write(&module, text).unwrap();
            let mut files = files(&[&format!("mine={}", file.display())]);
            files.modules.push(module.clone());
            files.digest("plan".to_owned()).unwrap()
        };
        let first = with_module("b = 1");
        assert_eq!(first, with_module("b = 1"));
        assert_ne!(first, with_module("b = 2"));
    }

    #[test]
    fn an_external_scenario_has_controllers_in_place_of_the_unknown_allocator() {
        let mut vocabulary = Registry::built_in().vocabulary();
        let mut spec = vocabulary.allocators[0].clone();
        spec.name = "mine";
        vocabulary.allocators.push(spec);
        let scenario: toml::Table = toml::from_str(
            "allocator = 'mine'\n[[robots]]\nname = 'blue'\n[[robots]]\nname = 'gold'\nallocator = 'nearest'",
        )
        .unwrap();
        let controllers = files(&["mine=mine.py", "unused=x.py"]);
        let external = controllers
            .external(&scenario, &vocabulary)
            .unwrap()
            .unwrap();
        assert_eq!(external.options, " --controller 'mine=python3 mine.py'");
        let built_in = Registry::built_in().vocabulary();
        let read = Scenario::parse("external.toml", &external.scenario, &built_in).unwrap();
        let deciders: Vec<&str> = read
            .robots
            .iter()
            .map(|robot| read.decider_of(robot))
            .collect();
        assert_eq!(deciders, ["mine", "nearest"]);
        let without: toml::Table = toml::from_str("allocator = 'nearest'").unwrap();
        assert!(
            controllers
                .external(&without, &vocabulary)
                .unwrap()
                .is_none()
        );
    }
}
