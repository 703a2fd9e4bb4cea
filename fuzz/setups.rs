//! What holds for any text as the setup of a run.json, or as a scenario file; part of the fuzz target and of proto's test over
//! the corpus.

use alliance_proto::scenario::{Scenario, Setup, SetupFile};
use missions::Registry;

/// What the text is of, as the corpus's files begin; `None` if it is neither. What is refused is refused in one line, and what is
/// not can be resolved.
///
/// # Panics
/// When that is not so.
#[must_use]
pub fn kind_of(text: &[u8]) -> Option<&'static str> {
    let vocabulary = Registry::built_in().vocabulary();
    if let Ok(setup) = serde_json::from_slice::<SetupFile>(text) {
        let checked = setup
            .read(&vocabulary)
            .and_then(|setup| setup.check().map(|()| setup));
        return match checked {
            Ok(setup) => {
                assert!(Setup::resolve(setup.scenario, setup.seed, None).is_ok());
                Some("setup")
            }
            Err(error) => {
                one_line(&error.to_string());
                None
            }
        };
    }
    let text = str::from_utf8(text).ok()?;
    match Scenario::parse("a.toml", text, &vocabulary) {
        Ok(scenario) => {
            assert!(Setup::resolve(scenario, 1, None).is_ok());
            Some("scenario")
        }
        Err(error) => {
            one_line(&error.to_string());
            None
        }
    }
}

fn one_line(said: &str) {
    assert!(!said.is_empty() && !said.chars().any(char::is_control));
}
