//! A finished run as one HTML file. `launch/page/source/embedded.js` reads the parts of its data, which are JSON:
//!
//! | part | content |
//! |---|---|
//! | `run`, `overview`, `events`, `corners/RANK` | the answers of the server |
//! | `views/N` | the views of a chunk, one per line: the first one, then the changes to the next ones |

use std::io::Write;
use std::path::Path;

use serde::Serialize;
use serde_json::json;

use super::delta::{self, ComparedView};
use super::logged::Logged;
use super::single_file;

/// Writes the finished run in `folder` as an HTML file.
///
/// # Errors
/// [`analysis::export::Differs`] if this program does not reproduce the run exactly. Other errors if the folder contains no run with
/// a complete tick, or the file cannot be written.
pub fn write(folder: &Path, file: &mut dyn Write) -> anyhow::Result<()> {
    let logged = Logged::open(folder)?;
    if let Some(warning) = &logged.warning {
        return Err(analysis::export::Differs(warning.clone()).into());
    }
    single_file::write(file, false, |file| write_data(&logged, file))
}

fn write_data(logged: &Logged, file: &mut dyn Write) -> anyhow::Result<()> {
    let about = logged.about();
    let number = |name: &str| about["log"][name].as_u64().unwrap_or_default();
    let (every, chunk) = (number("every").max(1), number("chunk").max(1));
    let views = number("ticks") / every + 1;
    let chunks = views.div_ceil(chunk);
    let robots = about["scenario"]["robots"].as_array().map_or(0, Vec::len);
    let index = json!({
        "parts": 3 + robots as u64 + chunks,
        "every": every,
        "views": views,
        "chunk": chunk,
    });
    single_file::write_index(file, "embedded-run", &index)?;
    let mut about = about.clone();
    // The path on the author's machine is of no use elsewhere.
    about["folder"] = about["run"].clone();
    about["log"]["is_file"] = true.into();
    write_part(file, "run", &about)?;
    write_part(file, "overview", &logged.overview())?;
    write_part(file, "events", &logged.events())?;
    for rank in 0..robots {
        write_part(file, &format!("corners/{rank}"), &logged.corners(rank))?;
    }
    for number in 0..chunks {
        let views = logged.views(number * chunk * every, chunk, every);
        let mut lines = String::new();
        let mut before: Option<ComparedView<'_>> = None;
        for view in views {
            let next = ComparedView::new(view)?;
            let line = match &before {
                None => delta::to_value(view)?.to_string(),
                Some(before) => format!("\n{}", before.change_to(&next)?),
            };
            lines.push_str(&line);
            before = Some(next);
        }
        single_file::write_part(file, &format!("views/{number}"), lines.as_bytes())?;
    }
    Ok(())
}

fn write_part(file: &mut dyn Write, name: &str, content: &impl Serialize) -> anyhow::Result<()> {
    single_file::write_part(file, name, &serde_json::to_vec(content)?)
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use in_process::Team;
    use missions::waste::data::default_scenario;
    use run_log::LogLevel;
    use run_log::recorder::Folder;
    use scenario::Setup;
    use tempfile::TempDir;

    use super::*;

    /// The page reads the views, curves and events from the file as the server sends them.
    #[test]
    fn the_file_contains_the_answers_of_the_server() {
        let folder = TempDir::new().unwrap();
        let mut scenario = default_scenario();
        scenario.limit_s = 30.0;
        let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
        let sink = Folder::create(folder.path()).unwrap();
        Team::new(setup, LogLevel::Full, sink)
            .unwrap()
            .run()
            .unwrap();
        let file = folder.path().join("run.html");
        let mut html = Vec::new();
        write(folder.path(), &mut html).unwrap();
        std::fs::write(&file, html).unwrap();
        let logged = Logged::open(folder.path()).unwrap();
        let answers = folder.path().join("answers.json");
        let ranks = 0..logged.about()["scenario"]["robots"]
            .as_array()
            .unwrap()
            .len();
        let expected = json!({
            "views": delta::to_value(&logged.views(0, 1000, 1)).unwrap(),
            "overview": delta::to_value(&logged.overview()).unwrap(),
            "corners": ranks.map(|rank| logged.corners(rank)).collect::<Vec<_>>(),
            "events": logged.events(),
            "hash": logged.about()["log"]["hash"],
        });
        std::fs::write(&answers, expected.to_string()).unwrap();
        crate::page::node(
            Command::new("node")
                .env("ALLIANCE_FILE", &file)
                .env("ALLIANCE_ANSWERS", &answers),
            "embedded.test.js",
        );
    }
}
