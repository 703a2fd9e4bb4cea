//! Motivations or utilities over time, one panel per behavior set: for one robot (thesis Fig. 4.8) or for one task
//! (Fig. 4.9 and 4.11).

use std::ops::Range;

use super::motivation_rows;
use super::timeline::{Timeline, y_title};
use super::{ABSENT, RunFigures, SetOfRobot, task_measures, what};
use crate::figures::canvas::{
    Area, DrawResult, FAINT, INK, Mark, TextLabel, WHITE, X_AXIS_PX, curve, fill, hatch,
    horizontal_line, line, px, rows_for,
};
use crate::figures::legend::Sample;
use crate::figures::simplify::thin;
use crate::report::robot_history::{Reset, SetHistory};
use proto::view::LevelUnit;
use scenario::ids::TaskId;
use scenario::time::SimTime;

const LEFT_PX: f64 = 58.0;
const TITLE_PX: f64 = 25.0;

/// Draws all behavior sets of one robot.
pub fn of_robot(run: &RunFigures<'_>, rank: usize) -> anyhow::Result<String> {
    let robot = &run.history.robots[rank];
    let rows: Vec<SetOfRobot<'_>> = robot.sets.iter().map(|set| (rank, set)).collect();
    let title = format!(
        "{} of all behavior sets of {}",
        what([robot.measure]),
        robot.name
    );
    draw(run, &title, &rows, run.window.clone())
}

/// Draws the behavior sets of all robots for one task in a window of time.
pub fn for_task(run: &RunFigures<'_>, task: TaskId, window: Range<f64>) -> anyhow::Result<String> {
    let rows: Vec<SetOfRobot<'_>> = run.history.behaviors_for(task).collect();
    let name = run.history.catalog.task_name(task);
    let what = what(task_measures(run.history, task));
    let title = format!("{what} of all robots for {name}");
    draw(run, &title, &rows, window)
}

fn draw(
    run: &RunFigures<'_>,
    title: &str,
    rows: &[SetOfRobot<'_>],
    window: Range<f64>,
) -> anyhow::Result<String> {
    let has = |wanted| {
        let mut robots = rows.iter().map(|(rank, _)| &run.history.robots[*rank]);
        robots.any(|robot| robot.measure == wanted)
    };
    let (motivations, utilities) = (has(LevelUnit::Motivation), has(LevelUnit::Utility));
    let what = match (motivations, utilities) {
        (_, false) => "motivation m",
        (false, true) => "utility u",
        (true, true) => "motivation m, utility u",
    };
    let legend = legend(motivations || !utilities);
    let timeline = Timeline::new(run, window, LEFT_PX, legend);
    let plot_px = if rows.len() <= 6 { 84.0 } else { 58.0 };
    let head_px = timeline.head_px();
    let panel_px = TITLE_PX + plot_px;
    let bottom_px = head_px + rows.len() as f64 * panel_px;
    let height_px = bottom_px + X_AXIS_PX + 4.0;
    if height_px > run.sheet.max_height_px() {
        return motivation_rows::draw(run, (title, what), rows, timeline.window);
    }
    let plot_at = |place: usize| {
        let top = head_px + place as f64 * panel_px + TITLE_PX;
        top..top + plot_px
    };
    let plots: Vec<Range<f64>> = (0..rows.len()).map(plot_at).collect();
    run.sheet.svg(title, height_px, |area| {
        timeline.draw_head(area, &plots)?;
        for (place, row) in rows.iter().enumerate() {
            let is_last = place + 1 == rows.len();
            let top = head_px + place as f64 * panel_px;
            panel(run, &timeline, area, row, (top, plot_px, is_last))?;
        }
        y_title(area, what, head_px..bottom_px)
    })
}

fn legend(of_motivations: bool) -> Vec<(Sample, &'static str)> {
    let curve = ["utility", "motivation"][usize::from(of_motivations)];
    let reset = Sample::Mark(Mark::Triangle, WHITE);
    let only_of_motivations = [
        (Sample::Dashed(INK, (4.0, 4.0)), "threshold θ"),
        (Sample::Hatch(INK, 4.0), "waiting"),
        (reset, "reset by the teammate of that color"),
    ];
    let mut legend = vec![
        (Sample::Line(INK, 1.75), curve),
        (Sample::Fill(INK, 0.22), "active"),
        (Sample::Fill(FAINT, ABSENT), "dead or stopped"),
        (Sample::Mark(Mark::Diamond, INK), "took over"),
    ];
    if of_motivations {
        legend.extend(only_of_motivations);
    }
    legend
}

/// Draws a panel. The last argument gives its upper edge, px, the height of its plot, px, and `true` if it has the time
/// axis.
fn panel(
    run: &RunFigures<'_>,
    timeline: &Timeline<'_>,
    area: &Area<'_>,
    &(rank, set): &SetOfRobot<'_>,
    (top, plot_px, is_last): (f64, f64, bool),
) -> DrawResult {
    let robot = &run.history.robots[rank];
    let color = run.colors[rank];
    let threshold = run.ceiling(rank);
    let name = TextLabel::BOLD.colored(color);
    let y = top + TITLE_PX - 9.0;
    name.write(area, &robot.name, (LEFT_PX, y))?;
    let after = LEFT_PX + name.width_px(&robot.name) + 8.0;
    TextLabel::LEFT.write(area, &set.name, (after, y))?;

    let plot = top + TITLE_PX..top + TITLE_PX + plot_px;
    let y = (0.0..threshold * 1.12, "", 3);
    let chart = timeline.chart(area, plot, y, is_last)?;
    let height = || 0.0..threshold;
    let absent = run.history.absent(rank);
    for span in absent.iter().filter_map(|span| timeline.cut(span)) {
        fill(&chart, span, 0.0..threshold * 1.12, FAINT, ABSENT)?;
    }
    for span in set.active.iter().filter_map(|span| timeline.cut(span)) {
        fill(&chart, span, height(), color, 0.25)?;
    }
    for span in set.waiting.iter().filter_map(|span| timeline.cut(span)) {
        hatch(area, &chart, span, height(), (color, 4.0))?;
    }
    if robot.measure == LevelUnit::Motivation {
        horizontal_line(&chart, timeline.window.clone(), threshold, line(INK, 0.75))?;
    }
    let window = (&timeline.window, run.sheet.width_px);
    for points in lines(set, run.history.level_step, window, threshold) {
        curve(&chart, points, line(color, 1.75))?;
    }

    let plot = chart.plotting_area();
    let resets = set.resets.iter().filter(|reset| timeline.shows(reset.at));
    let resets: Vec<(f64, &Reset)> = resets
        .map(|reset| (timeline.x_px(reset.at), reset))
        .collect();
    let letters = TextLabel::LEFT.sized(10.0);
    let names = |reset: &Reset| {
        let names = reset.by.iter();
        let names = names.map(|sender| run.history.robots[*sender].name.as_str());
        names.collect::<Vec<_>>().join(", ")
    };
    let places = resets
        .iter()
        .map(|(x, reset)| (*x, 10.0 + letters.width_px(&names(reset))));
    let places = rows_for(&places.collect::<Vec<_>>(), 1);
    for ((_, reset), place) in resets.iter().zip(places) {
        let at = plot.map_coordinate(&(reset.at.as_secs_f64(), threshold * 0.07));
        let by = reset.by.first().map_or(WHITE, |sender| run.colors[*sender]);
        Mark::Triangle.draw(area, at, by)?;
        if place.is_some() {
            let beside = (at.0 + px(7.0), at.1);
            area.draw_text(&names(reset), &letters.style(), beside)?;
        }
    }
    for takeover in run.takeovers_by(timeline, (rank, set)) {
        let at = plot.map_coordinate(&(takeover.at.as_secs_f64(), threshold));
        Mark::Diamond.draw(area, at, INK)?;
    }
    Ok(())
}

/// Returns the curve of a set in a window of time, s: one line for each part without a gap. Falls are vertical steps.
fn lines(
    set: &SetHistory,
    step: SimTime,
    (window, width_px): (&Range<f64>, f64),
    threshold: f64,
) -> Vec<Vec<(f64, f64)>> {
    // Tolerances: half a pixel in time, a quarter in motivation.
    let width = (window.end - window.start) / width_px / 2.0;
    let height = threshold / 300.0;
    set.levels
        .chunk_by(|a, b| b.0.since(a.0) <= step)
        .map(|part| {
            let mut points: Vec<(f64, f64)> = Vec::new();
            for &(at, level) in part {
                let at = at.as_secs_f64();
                if !window.contains(&at) {
                    continue;
                }
                if let Some((_, before)) = points.last().copied()
                    && before > level
                {
                    points.push((at, before));
                }
                points.push((at, level));
            }
            thin(&points, width, height)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use missions::waste::data::default_setup;

    use super::*;
    use crate::figures::canvas::WIDTH_PX;
    use crate::report::tests::run_of;

    /// Compares the drawn curve with the log: every activation at the threshold and every reset, in any window.
    #[test]
    fn every_activation_and_reset_of_a_log_is_drawn() {
        let parts = [(0.0, 1.0), (0.0, 0.37), (0.3, 0.5), (0.9, 0.92)];
        for (seed, (from, to)) in (1..4).flat_map(|seed| parts.map(|part| (seed, part))) {
            let (history, _) = run_of(default_setup(seed));
            let end = history.end.as_secs_f64();
            let window = from * end..to * end;
            let width = (window.end - window.start) / WIDTH_PX / 2.0;
            let threshold = history.setup.alliance.threshold;
            for set in history.robots.iter().flat_map(|robot| &robot.sets) {
                let drawn = lines(set, history.level_step, (&window, WIDTH_PX), threshold).concat();
                let highest = |at: f64| {
                    let near = drawn.iter().filter(|(x, _)| (x - at).abs() <= width);
                    near.map(|(_, level)| *level).fold(f64::MIN, f64::max)
                };
                for pair in set.levels.windows(2) {
                    let [(before_at, before), (at, level)] = [pair[0], pair[1]];
                    let (before_at, at) = (before_at.as_secs_f64(), at.as_secs_f64());
                    // A fall at the edge of the window has no point before it.
                    let is_shown = window.contains(&before_at) && window.contains(&at);
                    if is_shown && (level < before || (level >= threshold && before < threshold)) {
                        let peak = before.max(level);
                        assert!(
                            highest(at) >= peak - threshold / 300.0,
                            "{at} s: {peak}, {}",
                            highest(at)
                        );
                    }
                }
                for pair in drawn.windows(2) {
                    let falls = pair[1].1 < pair[0].1 - threshold / 100.0;
                    assert!(!falls || pair[1].0 - pair[0].0 <= width * 1.001, "{pair:?}");
                }
            }
        }
    }
}
