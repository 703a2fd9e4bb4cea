//! Motivations or utilities as rows, for more behavior sets than there is room for curves.

use std::ops::Range;

use plotters::style::RGBColor;
use scenario::time::SimTime;

use super::rows::{LEFT_PX, LEFT_SHARE, Rows, heat, shares, within};
use super::timeline::Timeline;
use super::{ABSENT, LOSSES, RunFigures, SetOfRobot, mark_of};
use crate::figures::canvas::{Chart, DrawResult, FAINT, INK, Mark, X_AXIS_PX, fill};
use crate::figures::legend::Sample;
use crate::figures::palette;

/// Vertical extents as shares of a row: the level above, the active share below.
const LEVEL: Range<f64> = 0.05..0.62;
const ACTIVE: Range<f64> = 0.62..0.95;

/// Draws the figure. The pair names the figure and the measure of its shades.
pub fn draw(
    run: &RunFigures<'_>,
    (title, what): (&str, &str),
    sets: &[SetOfRobot<'_>],
    window: Range<f64>,
) -> anyhow::Result<String> {
    let highest = format!("{what}, highest of a cell; full: θ, or the highest of all");
    let mut legend = vec![
        (Sample::Fill(palette::SHARED_ROW, 0.5), highest.as_str()),
        (Sample::Fill(INK, 1.0), "active, at the lower edge"),
        (Sample::Fill(FAINT, ABSENT), "dead or stopped"),
        (Sample::Mark(Mark::Diamond, INK), "took over"),
    ];
    legend.extend(LOSSES);
    let left_px = LEFT_PX.min(run.sheet.width_px * LEFT_SHARE);
    let timeline = Timeline::new(run, window, left_px, legend);
    let head_px = timeline.head_px();
    let most_px = run.sheet.max_height_px() - head_px - X_AXIS_PX - 4.0;
    let rows = Rows::fit(sets.len(), most_px);
    let bottom_px = head_px + rows.height_px();
    run.sheet.svg(title, bottom_px + X_AXIS_PX + 4.0, |area| {
        timeline.draw_head(area, std::slice::from_ref(&(head_px..bottom_px)))?;
        let y = (rows.height_px()..0.0, "", 0);
        let chart = timeline.chart(area, head_px..bottom_px, y, true)?;
        for row in 0..rows.len() {
            let members = rows.members(row);
            let lane = rows.extent(members.start);
            draw_row(run, &timeline, &chart, lane, &sets[members])?;
        }
        let plot = chart.plotting_area();
        let radius_px = (rows.row_px * 0.5).clamp(2.5, 4.5);
        let losses = run.metrics.failures.iter();
        let losses: Vec<_> = losses.filter(|loss| timeline.shows(loss.at)).collect();
        for (place, (rank, set)) in sets.iter().enumerate() {
            let lane = rows.extent(place);
            let at = |at: f64| plot.map_coordinate(&(at, (lane.start + lane.end) / 2.0));
            for takeover in run.takeovers_by(&timeline, (*rank, set)) {
                let at = at(takeover.at.as_secs_f64());
                Mark::Diamond.draw_sized(area, at, INK, radius_px)?;
            }
            for loss in losses.iter().filter(|loss| loss.robot == *rank) {
                let (mark, color) = mark_of(loss.loss);
                mark.draw_sized(area, at(loss.at.as_secs_f64()), color, radius_px)?;
            }
        }
        let names: Vec<String> = sets
            .iter()
            .map(|(rank, set)| format!("{} {}", run.history.robots[*rank].name, set.name))
            .collect();
        let name = |place: usize| (names[place].as_str(), run.colors[sets[place].0]);
        let lost = |place: usize| losses.iter().any(|loss| loss.robot == sets[place].0);
        rows.write_names(area, &chart, (4.0..left_px - 10.0, 0.0), name, lost)
    })
}

/// Draws a row, in the robot's color if it shows a single robot.
fn draw_row(
    run: &RunFigures<'_>,
    timeline: &Timeline<'_>,
    chart: &Chart<'_>,
    lane: Range<f64>,
    sets: &[SetOfRobot<'_>],
) -> DrawResult {
    let window = &timeline.window;
    let parts = timeline.cells();
    let absent = sets.iter().map(|(rank, _)| run.history.absent(*rank));
    let absent: Vec<_> = absent.collect();
    match &absent[..] {
        [only] => {
            for span in only.iter().filter_map(|span| timeline.cut(span)) {
                fill(chart, span, lane.clone(), FAINT, ABSENT)?;
            }
        }
        several => {
            let values = shares(window, parts, several);
            heat(chart, window, lane.clone(), FAINT, &values)?;
        }
    }
    let color: RGBColor = match sets {
        [(rank, _)] => run.colors[*rank],
        _ => palette::SHARED_ROW,
    };
    let mut highest = vec![0.0_f64; parts];
    for (rank, set) in sets {
        let full = run.ceiling(*rank);
        for (at, level) in &set.levels {
            // A level holds until the next step.
            let cell = |at: SimTime| {
                let share = (at.as_secs_f64() - window.start) / (window.end - window.start);
                (share * parts as f64).clamp(0.0, parts as f64)
            };
            let cells = cell(*at) as usize..cell(*at + run.history.level_step).ceil() as usize;
            for cell in &mut highest[cells] {
                *cell = cell.max(level / full);
            }
        }
    }
    heat(chart, window, within(&lane, &LEVEL), color, &highest)?;
    let active = sets.iter().map(|(_, set)| &set.active);
    let active = shares(window, parts, active);
    heat(chart, window, within(&lane, &ACTIVE), INK, &active)
}
