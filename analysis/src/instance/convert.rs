//! The conversion of the text of an instance file into a checked scenario.

use scenario::{KeyPath, Problem, Scenario, Vocabulary};

use super::check::check;
use super::formats::Format;
use super::frame::Frame;
use super::map::OccupancyMap;
use super::source::{Loaded, Source};
use super::team::add_robots;
use super::write::{Written, scenario};

/// The options of a conversion.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The format; by default name and content suggest one.
    pub format: Option<Format>,
    /// The number of robots of a file without robots.
    pub robots: Option<usize>,
    /// Metres per unit of the file; by default a power of ten.
    pub scale: Option<f64>,
    /// The walls, in the frame of the places.
    pub map: Option<OccupancyMap>,
}

/// An instance file and its scenario.
#[derive(Clone, Debug)]
pub struct Converted {
    pub loaded: Loaded,
    pub written: Written,
    /// The scenario that the text states.
    pub scenario: Scenario,
}

/// Converts a file into a scenario.
///
/// # Errors
/// Returns the first mistake with its line, from the syntax of the file to the rules of scenarios.
pub fn convert(
    source: Source<'_>,
    options: &Options,
    vocabulary: &Vocabulary,
) -> Result<Converted, Problem> {
    let format = options.format.map_or_else(|| Format::guess(source), Ok)?;
    let mut loaded = format.read(source)?;
    if loaded.instance.name.is_empty() {
        source.stem().clone_into(&mut loaded.instance.name);
    }
    add_robots(&mut loaded, options.robots, source)?;
    check(&loaded, source)?;
    if let Some(map) = &options.map {
        let note = map.put_under(&mut loaded.instance);
        loaded.notes.push(note);
    }
    let frame = Frame::new(&loaded, options.scale, source)?;
    let refused = |problem: Problem| {
        let point = problem.index_in(&KeyPath::new(["service", "points"]));
        match point.and_then(|index| Some((index, loaded.instance.tasks.get(index)?))) {
            Some((index, task)) => {
                let what = format!("task '{}': {}", task.id, problem.without_place());
                source.error(loaded.task_line(index), what, "")
            }
            None => Problem::with_source(source.name, problem.to_string(), ""),
        }
    };
    let title = format!("Imported from {}.", source.name);
    let written = scenario(&loaded, &frame, &title).map_err(refused)?;
    // Rules that depend on the mission alone, such as places inside obstacles.
    let parsed = Scenario::parse("scenario", &written.text, vocabulary).map_err(refused)?;
    Ok(Converted {
        scenario: parsed,
        written,
        loaded,
    })
}
