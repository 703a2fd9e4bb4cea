//! The figures of a report, as SVG. What they show is computed elsewhere.

pub(crate) mod canvas;
mod gantt;
mod map;
mod motivation;
mod progress;
mod timeline;

use missions::waste::data::BehaviorKind;
use std::ops::Range;

use plotters::style::RGBColor;

use super::faults::{FaultSpan, fault_spans};
use super::history::History;
use super::metrics::Metrics;

const WHITE: RGBColor = RGBColor(255, 255, 255);

/// Opacity of the bands in which a robot is dead or stopped: darker than those in which it is active, in gray, too.
const ABSENT: f64 = 0.75;

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
    add(
        "items".to_owned(),
        "Where the items were.".to_owned(),
        progress::items(&run)?,
    );
    add(
        "reports".to_owned(),
        "Progress reports against the wanted period.".to_owned(),
        progress::reports(&run)?,
    );
    for task in history.tasks() {
        let spec = &history.catalog.tasks[task.index()];
        let name = format!("task-{}-{}", task.0, plain(&spec.name));
        let caption = format!(
            "Motivation of all robots for {}, as in the thesis' figure 4.9.",
            spec.name
        );
        let svg = motivation::for_task(&run, task, run.window.clone())?;
        add(name.clone(), caption, svg);
        let finds = |kind| {
            matches!(
                kind,
                BehaviorKind::FindLocationsMethodical | BehaviorKind::FindLocationsWander
            )
        };
        let mut sets = history.catalog.sets.iter();
        if sets.any(|set| set.task == task && finds(BehaviorKind::of(set)))
            && let Some(window) = applicable(&run, task.index())
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
            "Motivation of all behavior sets of {}, as in the thesis' figure 4.8.",
            robot.name
        );
        let svg = motivation::of_robot(&run, rank)?;
        add(format!("robot-{}", robot.name), caption, svg);
    }
    Ok(figures)
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
