//! The editor of scenarios: the drawing of a text, and changes of the text by drawing.
//!
//! - [`kinds`]: the kinds of items that a person places. [`document`]: the text, whose comments and order stay.
//! - `change`: a change of one item. `drawing`: the items and the start of the run for the page.

mod change;
pub mod document;
mod drawing;
pub mod kinds;
#[cfg(test)]
mod tests;

use scenario::Problem;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::choice::{Choice, ScenarioFile};
use crate::engine::OpenError;

pub use change::Change;

/// A request of the editor.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EditRequest {
    /// The scenario with the allocator and the seed of its run.
    pub choice: Choice,
    /// The change of the text; `None` only draws the text.
    #[serde(default)]
    pub change: Option<Change>,
}

/// Answers with the name and the text of the file, and with its drawing or the program's problem: `{"problem": {"text",
/// "line"}}`. A change with a problem changes nothing.
#[must_use]
pub fn edit(request: EditRequest) -> Value {
    let EditRequest { mut choice, change } = request;
    let file = match choice.scenario_file() {
        Ok(file) => file,
        Err(problem) => return json!({"problem": describe(&problem.into())}),
    };
    let changed = change.map_or_else(
        || Ok(file.text.clone()),
        |change| change.apply(&file.text, &choice.scenario()?),
    );
    let drawn = changed.map_err(OpenError::from).and_then(|text| {
        choice.scenario = None;
        choice.file = Some(ScenarioFile {
            text: text.clone(),
            ..file.clone()
        });
        let drawing = drawing::draw(&choice, &text)?;
        Ok((text, drawing))
    });
    match drawn {
        Ok((text, drawing)) => json!({"name": file.name, "text": text, "drawing": drawing}),
        Err(error) => {
            json!({"name": file.name, "text": file.text, "problem": describe(&error)})
        }
    }
}

fn describe(error: &OpenError) -> Value {
    let line = match error {
        OpenError::Choice(problem) => problem.line(),
        OpenError::Start(_) => None,
    };
    json!({"text": error.to_string(), "line": line})
}

/// Creates the refusal of a request that the page never makes.
fn unknown(what: &str) -> Problem {
    Problem::of_value(
        format!("the drawing has no {what}"),
        "draw the text once more",
    )
}
