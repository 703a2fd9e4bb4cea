//! The figures of a report, as SVG. What they show is computed elsewhere.

pub(crate) mod canvas;
mod gantt;
mod map;
mod motivation;
mod progress;
mod timeline;

use std::ops::Range;

use alliance_proto::ids::TaskId;
use alliance_proto::mission::columns::{ColumnKind, label};
use alliance_proto::view::Measure;
use plotters::style::RGBColor;

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

/// Everything that the figures of a run have in common.
pub(super) struct RunFigures<'h> {
    history: &'h History,
    metrics: &'h Metrics,
    faults: Vec<FaultSpan>,
    /// By rank.
    colors: Vec<RGBColor>,
    /// The whole run, s.
    window: Range<f64>,
}

/// All figures, in the order of the page.
///
/// # Errors
/// When one cannot be drawn.
pub fn figures(history: &History, metrics: &Metrics) -> anyhow::Result<Vec<Figure>> {
    let names = history.robots.iter().map(|robot| robot.name.as_str());
    let run = RunFigures {
        history,
        metrics,
        faults: fault_spans(&history.events, history.end),
        colors: crate::palette::colors(names),
        // An axis needs a length, even that of a run that was over at once.
        window: 0.0..history.end.max(history.step).as_secs_f64(),
    };
    let mut figures = Vec::new();
    let mut add = |name: String, caption: String, svg: String| {
        figures.push(Figure { name, caption, svg });
    };
    add(
        "gantt".to_owned(),
        "Who did what. Bars: a behavior set for the task is active; ticks at their upper edge: effects on the world, as far \
         as there is room. Below, in black: the task was applicable to somebody, and nobody was productive on it."
            .to_owned(),
        gantt::draw(&run)?,
    );
    add(
        "map".to_owned(),
        "Ways of all robots.".to_owned(),
        map::together(&run)?,
    );
    if history.robots.len() > 1 {
        add(
            "map-by-robot".to_owned(),
            "The way of each robot by itself.".to_owned(),
            map::apart(&run)?,
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
        add(name, caption, progress::columns(&run, &title, &columns)?);
    }
    for recurring in &metrics.recurring {
        let event = recurring.event;
        let against = recurring
            .period
            .map_or("", |_| ", against the wanted period");
        add(
            format!("every-{event}"),
            format!("From one event '{event}' to the next{against}."),
            progress::recurring(&run, recurring)?,
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
        let svg = motivation::for_task(&run, task, run.window.clone())?;
        add(name.clone(), caption, svg);
        if let Some(window) = applicable(&run, task.index())
            && window.end < run.window.end * OVER
        {
            let caption = format!(
                "The same while {} was applicable, as in the thesis' figure 4.11.",
                spec.name
            );
            let svg = motivation::for_task(&run, task, window)?;
            add(format!("{name}-applicable"), caption, svg);
        }
    }
    for (rank, robot) in history.robots.iter().enumerate() {
        let caption = format!(
            "{} of all behavior sets of {}, as in the thesis' figure 4.8.",
            what([robot.measure]),
            robot.name
        );
        let svg = motivation::of_robot(&run, rank)?;
        add(format!("robot-{}", robot.name), caption, svg);
    }
    Ok(figures)
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

/// From the first to the last moment in which a task was applicable, if ever, and a little more, s.
fn applicable(run: &RunFigures<'_>, task: usize) -> Option<Range<f64>> {
    let spans = &run.metrics.tasks[task].applicable;
    let from = spans.iter().next()?.from.as_secs_f64();
    let to = spans.iter().next_back()?.to.as_secs_f64();
    let margin = (to - from) * 0.03;
    Some((from - margin).max(0.0)..(to + margin).min(run.window.end))
}

/// A task's name as a part of a file's name.
fn plain(name: &str) -> String {
    let words = name.split(|letter: char| !letter.is_ascii_alphanumeric());
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    words.join("-")
}
