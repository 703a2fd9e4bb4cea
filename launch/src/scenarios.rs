//! The scenarios that come with the command (`alliance scenarios`).

/// A scenario that can be run by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Builtin {
    /// What it is run by.
    pub name: &'static str,
    /// Its file, comments included.
    pub text: &'static str,
}

impl Builtin {
    /// The file's name, for error messages.
    #[must_use]
    pub fn file_name(&self) -> String {
        format!("{}.toml", self.name)
    }
}

/// All of them, the default mission first.
#[must_use]
pub fn builtins() -> &'static [Builtin] {
    &[
        Builtin {
            name: "waste-cleanup",
            text: include_str!("../scenarios/waste-cleanup.toml"),
        },
        Builtin {
            name: "thesis-no-interruption",
            text: include_str!("../scenarios/thesis-no-interruption.toml"),
        },
        Builtin {
            name: "thesis-trapped-robot",
            text: include_str!("../scenarios/thesis-trapped-robot.toml"),
        },
        Builtin {
            name: "parker-specialised",
            text: include_str!("../scenarios/parker-specialised.toml"),
        },
        Builtin {
            name: "reference",
            text: include_str!("../scenarios/reference.toml"),
        },
    ]
}

/// The one of that name.
#[must_use]
pub fn builtin(name: &str) -> Option<&'static Builtin> {
    builtins().iter().find(|builtin| builtin.name == name)
}

/// The file of the one of that name, comments included.
#[must_use]
pub fn text_of(name: &str) -> Option<&'static str> {
    builtin(name).map(|builtin| builtin.text)
}

#[cfg(test)]
mod tests {
    use alliance_proto::scenario::{Scenario, Setup};
    use missions::Registry;
    use missions::waste::data::default_scenario;

    use super::*;

    #[test]
    fn each_one_can_be_found_and_run() {
        for each in builtins() {
            assert_eq!(builtin(each.name), Some(each));
            assert_eq!(text_of(each.name), Some(each.text));
            let scenario = Scenario::parse(
                &each.file_name(),
                each.text,
                &Registry::built_in().vocabulary(),
            )
            .unwrap();
            assert!(!scenario.description.is_empty(), "{}", each.name);
            Setup::resolve(scenario, 1, None).unwrap();
        }
        assert_eq!(builtin("no-such-scenario"), None);
    }

    #[test]
    fn the_default_mission_differs_from_the_default_in_nothing_but_its_description() {
        let mission = builtin("waste-cleanup").unwrap();
        let scenario = Scenario::parse(
            &mission.file_name(),
            mission.text,
            &Registry::built_in().vocabulary(),
        )
        .unwrap();
        let description = scenario.description.clone();
        let default = default_scenario();
        assert_eq!(
            scenario,
            Scenario {
                description,
                ..default
            }
        );
    }
}
