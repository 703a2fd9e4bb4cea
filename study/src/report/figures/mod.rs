//! The figures of a report, as SVG. What they show is computed elsewhere.

pub(crate) mod canvas;
mod gantt;
mod map;
mod motivation;
mod motivation_rows;
mod progress;
mod room;
mod rows;
#[cfg(test)]
mod tests;
mod timeline;

use std::ops::Range;

use alliance_proto::ids::TaskId;
use alliance_proto::mission::columns::{ColumnKind, label};
use alliance_proto::view::Measure;
use plotters::style::RGBColor;

use self::canvas::Sheet;
pub use self::room::Room;
use super::faults::{FaultSpan, fault_spans};
use super::history::History;
use super::metrics::Metrics;

const WHITE: RGBColor = RGBColor(255, 255, 255);

/// Opacity of the bands in which a robot is dead or stopped: darker than those in which it is active, in gray, too.
const ABSENT: f64 = 0.75;

/// A task that is not applicable any more in the last part of a run is drawn once more by itself: from this share of the run on.
const OVER: f64 = 0.9;

/// A figure.
pub struct Figure {
    /// Its file's name, without ending; also what links lead to.
    pub name: String,
    /// What it shows and how to read it.
    pub caption: String,
    /// The drawing.
    pub svg: String,
}

/// Which figures are wanted, and of what.
#[derive(Clone, Debug, Default)]
pub struct Wanted {
    /// How large they are.
    pub sheet: Sheet,
    /// From when, s; without it from the start.
    pub from_s: Option<f64>,
    /// Until when, s; without it to the end.
    pub to_s: Option<f64>,
    /// The end of the axes, s, if that is later than the run's.
    pub end_s: f64,
    /// Names of figures; without any all.
    pub only: Vec<String>,
    /// The room at some moments.
    pub rooms: Vec<Room>,
}

/// Everything that the figures of a run have in common.
pub(super) struct RunFigures<'h> {
    history: &'h History,
    metrics: &'h Metrics,
    faults: Vec<FaultSpan>,
    /// By rank.
    colors: Vec<RGBColor>,
    /// What is shown of the run, s.
    window: Range<f64>,
    sheet: Sheet,
    /// The highest utility of anybody at any time; 1 without any, for an axis needs a length.
    highest_utility: f64,
}

/// Draws a figure, as SVG.
type Draw<'p> = Box<dyn Fn(&RunFigures<'_>) -> anyhow::Result<String> + 'p>;

/// A figure that can be drawn.
struct Planned<'p> {
    name: String,
    caption: String,
    draw: Draw<'p>,
}

/// What was wanted is not there.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct NotThere(String);

/// The figures that are wanted, in the order of the page.
///
/// # Errors
/// [`NotThere`], or when one cannot be drawn.
pub fn figures(
    history: &History,
    metrics: &Metrics,
    wanted: &Wanted,
) -> anyhow::Result<Vec<Figure>> {
    let names = history.robots.iter().map(|robot| robot.name.as_str());
    let utilities = history.robots.iter();
    let utilities = utilities.filter(|robot| robot.measure == Measure::Utility);
    let sets = utilities.flat_map(|robot| &robot.sets);
    let highest = sets.flat_map(|set| set.levels.iter().map(|(_, level)| *level));
    let highest = highest.fold(0.0, f64::max);
    let run = RunFigures {
        history,
        metrics,
        faults: fault_spans(&history.events, history.end),
        colors: crate::palette::colors(names),
        window: window(history, wanted)?,
        sheet: wanted.sheet,
        highest_utility: if highest > 0.0 { highest } else { 1.0 },
    };
    let planned = planned(&run, &wanted.rooms);
    for name in &wanted.only {
        if !planned.iter().any(|figure| figure.name == *name) {
            let known = planned.iter().map(|figure| figure.name.as_str());
            let instead = alliance_proto::scenario::instead(name, known);
            return Err(NotThere(format!("--only: there is no figure '{name}'; {instead}")).into());
        }
    }
    let chosen = planned.into_iter();
    let chosen =
        chosen.filter(|figure| wanted.only.is_empty() || wanted.only.contains(&figure.name));
    let drawn = chosen.map(
        |Planned {
             name,
             caption,
             draw,
         }| {
            let svg = draw(&run)?;
            Ok(Figure { name, caption, svg })
        },
    );
    drawn.collect()
}

/// What is shown of the run, s.
fn window(history: &History, wanted: &Wanted) -> Result<Range<f64>, NotThere> {
    // An axis needs a length, even that of a run that was over at once.
    let own_end = history.end.max(history.step).as_secs_f64();
    let end = own_end.max(wanted.end_s);
    let from = wanted.from_s.unwrap_or(0.0);
    let to = wanted.to_s.unwrap_or(end).min(end);
    if from >= own_end {
        let text = format!("--from {from}: the run was over at {own_end} s");
        return Err(NotThere(text));
    }
    if from >= to {
        let text = format!("--to {to}: must be later than --from, {from} s");
        return Err(NotThere(text));
    }
    Ok(from..to)
}

/// All figures that there are of a run.
fn planned<'p>(run: &'p RunFigures<'_>, rooms: &'p [Room]) -> Vec<Planned<'p>> {
    let history = run.history;
    let mut figures: Vec<Planned<'p>> = Vec::new();
    let mut add = |name: String, caption: String, draw: Draw<'p>| {
        figures.push(Planned {
            name,
            caption,
            draw,
        });
    };
    add(
        "gantt".to_owned(),
        "Who did what. Bars: a behavior set for the task is active; ticks at their upper edge: effects on the world, as far \
         as there is room. Below, in black: the task was applicable to somebody, and nobody was productive on it."
            .to_owned(),
        Box::new(gantt::draw),
    );
    for room in rooms {
        add(
            room.name(),
            format!(
                "The room at {} s, and the ways of the {} s before.",
                room.at_s(),
                room::TRAIL_S
            ),
            Box::new(move |run| room::draw(run, room)),
        );
    }
    add(
        "map".to_owned(),
        "Ways of all robots.".to_owned(),
        Box::new(map::together),
    );
    if history.robots.len() > 1 {
        add(
            "map-by-robot".to_owned(),
            "The way of each robot by itself; of robots together, where they are too many."
                .to_owned(),
            Box::new(map::apart),
        );
    }
    for columns in progress::axes(history.columns()) {
        let (name, title) = match columns.as_slice() {
            [column] if column.kind == ColumnKind::Real => (
                format!("mission-{}", plain(column.name)),
                label(column.name),
            ),
            _ => ("mission".to_owned(), "counts".to_owned()),
        };
        let caption = format!("The mission over time: {title}.");
        add(
            name,
            caption,
            Box::new(move |run| progress::columns(run, &title, &columns)),
        );
    }
    for recurring in &run.metrics.recurring {
        let event = recurring.event;
        let against = recurring
            .period
            .map_or("", |_| ", against the wanted period");
        add(
            format!("every-{event}"),
            format!("From one event '{event}' to the next{against}."),
            Box::new(move |run| progress::recurring(run, recurring)),
        );
    }
    for task in history.tasks() {
        let spec = &history.catalog.tasks[task.index()];
        let name = format!("task-{}-{}", task.0, plain(&spec.name));
        let caption = format!(
            "{} of all robots for {}, as in the thesis' figure 4.9.",
            what(task_measures(history, task)),
            spec.name
        );
        add(
            name.clone(),
            caption,
            Box::new(move |run| motivation::for_task(run, task, run.window.clone())),
        );
        if let Some(window) = applicable(run, task.index())
            && window.end < run.window.end * OVER
        {
            let caption = format!(
                "The same while {} was applicable, as in the thesis' figure 4.11.",
                spec.name
            );
            add(
                format!("{name}-applicable"),
                caption,
                Box::new(move |run| motivation::for_task(run, task, window.clone())),
            );
        }
    }
    for (rank, robot) in history.robots.iter().enumerate() {
        let caption = format!(
            "{} of all behavior sets of {}, as in the thesis' figure 4.8.",
            what([robot.measure]),
            robot.name
        );
        add(
            format!("robot-{}", robot.name),
            caption,
            Box::new(move |run| motivation::of_robot(run, rank)),
        );
    }
    figures
}

/// What is drawn as curves, as a word.
fn what(measures: impl IntoIterator<Item = Measure>) -> &'static str {
    let mut measures = measures.into_iter();
    let has = measures.next().unwrap_or(Measure::Motivation);
    match has {
        _ if measures.any(|measure| measure != has) => "Motivation, or utility,",
        Measure::Motivation => "Motivation",
        Measure::Utility => "Utility",
    }
}

/// What those robots have that can perform a task.
fn task_measures(history: &History, task: TaskId) -> impl Iterator<Item = Measure> {
    let sets = history.behaviors_for(task);
    sets.map(|(rank, _)| history.robots[rank].measure)
}

/// From the first to the last moment in which a task was applicable, if ever, and a little more, as far as it is shown, s.
fn applicable(run: &RunFigures<'_>, task: usize) -> Option<Range<f64>> {
    let spans = &run.metrics.tasks[task].applicable;
    let from = spans.iter().next()?.from.as_secs_f64();
    let to = spans.iter().next_back()?.to.as_secs_f64();
    let margin = (to - from) * 0.03;
    let (from, to) = (from - margin, to + margin);
    let shown = from.max(run.window.start)..to.min(run.window.end);
    (shown.start < shown.end).then_some(shown)
}

/// A task's name as a part of a file's name.
fn plain(name: &str) -> String {
    let words = name.split(|letter: char| !letter.is_ascii_alphanumeric());
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    words.join("-")
}
