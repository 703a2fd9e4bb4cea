//! The figures of a report as SVG. Other modules compute the data.

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

use crate::figures::{Figure, palette, plain};
use crate::progress::Progress;
use anyhow::bail;
use observation::stints::Loss;
use plotters::style::RGBColor;
use proto::view::LevelUnit;
use scenario::ids::TaskId;
use scenario::mission::columns::{ColumnKind, display_name};

pub use self::room::Room;
use self::timeline::Timeline;
use super::faults::{FaultSpan, fault_spans};
use super::history::History;
use super::metrics::Metrics;
use super::robot_history::SetHistory;
use crate::figures::canvas::{INK, Mark, Sheet, WHITE};
use crate::figures::legend::Sample;
use observation::takeovers::Takeover;

/// Opacity of the bands in which a robot is dead or stopped. They are darker than active bands, also in gray.
const ABSENT: f64 = 0.75;

/// A share of the run. A task that is not applicable after it gets an additional figure of its applicable time.
const OVER: f64 = 0.9;

#[derive(Clone, Debug, Default)]
pub struct FigureSelection {
    pub sheet: Sheet,
    /// Start of the figures, s; `None` for the start of the run.
    pub from_s: Option<f64>,
    /// End of the figures, s; `None` for the end of the run.
    pub to_s: Option<f64>,
    /// End of the axes, s, if later than the end of the run.
    pub end_s: f64,
    /// Names of the wanted figures; empty for all.
    pub only: Vec<String>,
    /// The room at certain times, one figure each.
    pub rooms: Vec<Room>,
    /// The maximum size of all figures but the first, bytes. After the first figure without room, no figure is drawn.
    /// `None` draws all figures.
    pub max_bytes: Option<usize>,
}

/// The figures of a run.
#[derive(Default)]
pub struct DrawnFigures {
    pub figures: Vec<Figure>,
    /// The names of the figures without room.
    pub undrawn: Vec<String>,
}

/// The legend of [`mark_of`].
const LOSSES: [(Sample, &str); 2] = [
    (Sample::Mark(Mark::Cross, INK), "died"),
    (Sample::Mark(Mark::Square, WHITE), "stopped"),
];

/// Returns the mark of a lost robot and its color.
fn mark_of(loss: Loss) -> (Mark, RGBColor) {
    match loss {
        Loss::Died => (Mark::Cross, INK),
        Loss::Stopped => (Mark::Square, WHITE),
    }
}

/// The data that all figures of a run share.
pub(super) struct RunFigures<'h> {
    history: &'h History,
    metrics: &'h Metrics,
    faults: Vec<FaultSpan>,
    /// Robot colors, by rank.
    colors: Vec<RGBColor>,
    /// The shown time, s.
    window: Range<f64>,
    sheet: Sheet,
    /// The highest utility in the run; 1 if there is none, because an axis needs a length.
    highest_utility: f64,
}

/// The rank of a robot, and one of its behavior sets.
type SetOfRobot<'s> = (usize, &'s SetHistory);

impl RunFigures<'_> {
    /// Returns the upper end of a robot's curves: the threshold, or the highest utility in the run.
    fn ceiling(&self, rank: usize) -> f64 {
        match self.history.robots[rank].measure {
            LevelUnit::Motivation => self.history.setup.alliance.threshold,
            LevelUnit::Utility => self.highest_utility,
        }
    }

    /// Returns the shown takeovers that an activation of this set begins.
    fn takeovers_by<'s>(
        &'s self,
        timeline: &'s Timeline<'_>,
        (rank, set): SetOfRobot<'s>,
    ) -> impl Iterator<Item = &'s Takeover> {
        self.metrics.takeovers.iter().filter(move |takeover| {
            let starts = set.active.iter().any(|span| span.from == takeover.at);
            takeover.robot == rank
                && takeover.task == set.task
                && starts
                && timeline.shows(takeover.at)
        })
    }
}

/// A function that draws a figure as SVG.
type Draw<'p> = Box<dyn Fn(&RunFigures<'_>) -> anyhow::Result<String> + 'p>;

struct Planned<'p> {
    name: String,
    caption: String,
    draw: Draw<'p>,
}

/// Draws the wanted figures, in page order.
///
/// # Errors
/// Returns an error for an unavailable figure or time, and drawing errors.
pub fn figures(
    history: &History,
    metrics: &Metrics,
    wanted: &FigureSelection,
) -> anyhow::Result<DrawnFigures> {
    let names = history.robots.iter().map(|robot| robot.name.as_str());
    let others = history.robots.iter();
    let others = others.filter(|robot| robot.measure == LevelUnit::Utility);
    let levels = others.flat_map(|robot| robot.sets.iter().flat_map(|set| &set.levels));
    let highest = levels.map(|(_, level)| *level).fold(0.0, f64::max);
    let run = RunFigures {
        history,
        metrics,
        faults: fault_spans(&history.events, history.end),
        colors: palette::colors(names),
        window: window(history, wanted)?,
        sheet: wanted.sheet,
        highest_utility: if highest > 0.0 { highest } else { 1.0 },
    };
    let planned = planned(&run, &wanted.rooms);
    for name in &wanted.only {
        if !planned.iter().any(|figure| figure.name == *name) {
            let known = planned.iter().map(|figure| figure.name.as_str());
            let instead = scenario::name_remedy(name, known);
            bail!("--only: there is no figure '{name}'; {instead}");
        }
    }
    let mut chosen = planned;
    chosen.retain(|figure| wanted.only.is_empty() || wanted.only.contains(&figure.name));
    let mut progress = Progress::new("drawing the figures", "figures", chosen.len() as u64);
    let mut room = wanted.max_bytes.unwrap_or(usize::MAX);
    let mut drawn = DrawnFigures::default();
    for Planned {
        name,
        caption,
        draw,
    } in chosen
    {
        if !drawn.undrawn.is_empty() {
            drawn.undrawn.push(name);
            continue;
        }
        let svg = draw(&run)?;
        progress.step();
        let is_first = drawn.figures.is_empty();
        if svg.len() > room && !is_first {
            drawn.undrawn.push(name);
            continue;
        }
        room = room.saturating_sub(svg.len());
        drawn.figures.push(Figure {
            about: Vec::new(),
            name,
            caption,
            svg,
            numbers: None,
        });
    }
    Ok(drawn)
}

fn window(history: &History, wanted: &FigureSelection) -> anyhow::Result<Range<f64>> {
    // An axis needs a length, even for an empty run.
    let run_end = history.end.max(history.step).as_secs_f64();
    let end = run_end.max(wanted.end_s);
    let from = wanted.from_s.unwrap_or(0.0);
    let to = wanted.to_s.unwrap_or(end).min(end);
    if from >= run_end {
        bail!("--from {from}: the run ended at {run_end} s");
    }
    if from >= to {
        bail!("--to {to}: must be later than --from, {from} s");
    }
    Ok(from..to)
}

fn planned<'p>(run: &'p RunFigures<'_>, rooms: &'p [Room]) -> Vec<Planned<'p>> {
    let history = run.history;
    let mut figures: Vec<Planned<'p>> = Vec::new();
    let mut add = |name: &str, caption: &str, draw: Draw<'p>| {
        figures.push(Planned {
            name: name.to_owned(),
            caption: caption.to_owned(),
            draw,
        });
    };
    let activity = "Activity of the robots. Bars: a behavior set for the task is active; ticks at their upper edge: effects \
         on the world, where there is room.";
    let orphans =
        " Rows under \"orphan\": the task was applicable, and no robot was productive on it.";
    let caption = match history.is_summary {
        true => activity.to_owned(),
        false => activity.to_owned() + orphans,
    };
    add("gantt", &caption, Box::new(gantt::draw));
    for room in rooms {
        let caption = format!(
            "The room at {} s, and the paths of the {} s before. A place is the paler, the less of its work is left.",
            room.at_s(),
            room::TRAIL_S
        );
        add(
            &room.name(),
            &caption,
            Box::new(move |run| room::draw(run, room)),
        );
    }
    for columns in progress::axes(history.columns()) {
        let (name, title) = match columns.as_slice() {
            [column] if column.kind == ColumnKind::Real => (
                format!("mission-{}", plain(column.name)),
                display_name(column.name),
            ),
            _ => ("mission".to_owned(), "counts".to_owned()),
        };
        let caption = format!("The mission over time: {title}.");
        add(
            &name,
            &caption,
            Box::new(move |run| progress::columns(run, &title, &columns)),
        );
    }
    for recurring in &run.metrics.recurring {
        let event = recurring.event;
        let against = recurring.period.map_or("", |_| ", with the wanted period");
        add(
            &format!("every-{event}"),
            &format!("Time between '{event}' events{against}."),
            Box::new(move |run| progress::recurring(run, recurring)),
        );
    }
    if history.is_summary {
        return figures;
    }
    // The figures above stay small in a large team. Paths do not, and no figure is drawn after one without room.
    add("map", "Paths of all robots.", Box::new(map::together));
    if history.robots.len() > 1 {
        let caption = "The path of each robot on its own map; several robots share a map if there are too many.";
        add("map-by-robot", caption, Box::new(map::apart));
    }
    for task in history.tasks() {
        let spec = &history.catalog.tasks[task.index()];
        let name = format!("task-{}-{}", task.0, plain(&spec.name));
        let caption = format!(
            "{} of all robots for {}.",
            what(task_measures(history, task)),
            spec.name
        );
        let draw = move |run: &RunFigures<'_>| motivation::for_task(run, task, run.window.clone());
        add(&name, &caption, Box::new(draw));
        if let Some(window) = applicable(run, task.index())
            && window.end < run.window.end * OVER
        {
            let caption = format!(
                "The same figure for the time in which {} was applicable.",
                spec.name
            );
            add(
                &format!("{name}-applicable"),
                &caption,
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
        let name = format!("robot-{}", robot.name);
        add(
            &name,
            &caption,
            Box::new(move |run| motivation::of_robot(run, rank)),
        );
    }
    figures
}

fn what(measures: impl IntoIterator<Item = LevelUnit>) -> &'static str {
    let mut measures = measures.into_iter();
    let has = measures.next().unwrap_or(LevelUnit::Motivation);
    match has {
        _ if measures.any(|measure| measure != has) => "Motivation, or utility,",
        LevelUnit::Motivation => "Motivation",
        LevelUnit::Utility => "Utility",
    }
}

/// Returns the measures of the robots that can perform a task.
fn task_measures(history: &History, task: TaskId) -> impl Iterator<Item = LevelUnit> {
    let sets = history.behaviors_for(task);
    sets.map(|(rank, _)| history.robots[rank].measure)
}

/// Returns the time from the first to the last applicable moment of a task, s, with a margin and within the window.
fn applicable(run: &RunFigures<'_>, task: usize) -> Option<Range<f64>> {
    let spans = &run.metrics.tasks[task].applicable;
    let from = spans.iter().next()?.from.as_secs_f64();
    let to = spans.iter().next_back()?.to.as_secs_f64();
    let margin = (to - from) * 0.03;
    let (from, to) = (from - margin, to + margin);
    let shown = from.max(run.window.start)..to.min(run.window.end);
    (shown.start < shown.end).then_some(shown)
}
