//! Properties of any text as the setup of a run.json or as a scenario file. The fuzz target and the test over the
//! corpus in `proto` use them.

use missions::Registry;
use scenario::{Scenario, Setup, SetupFile};

/// Returns the kind of file, as the corpus files begin, or `None` if the text is neither. A valid file can be
/// resolved.
///
/// # Panics
/// Panics if a refusal is not one line or a valid file cannot be resolved.
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

fn one_line(message: &str) {
    assert!(!message.is_empty() && !message.chars().any(char::is_control));
}
