//! The frame of a picture: clock and progress above the room, team and faults below it.

use maud::{Markup, html};
use proto::control::{AgentState, FaultStatus, Phase};
use proto::view::View;
use scenario::Setup;
use scenario::mission::columns::{ColumnValue, Progress, short_summary};
use scenario::time::SimTime;

use super::geometry::n;
use crate::figures::canvas::{INK, TextLabel};
use crate::figures::palette::{PROGRESS, QUIET_LINE, QUIET_TEXT, TROUBLE, css};

/// The free space at the edges, px.
pub const MARGIN_PX: f64 = 16.0;

/// The height above the room, px.
pub const HEAD_PX: f64 = 70.0;

/// The height below the room, px.
pub const FOOT_PX: f64 = 36.0;

/// The width of the progress bar, px.
const BAR_PX: f64 = 180.0;

fn words(letters: TextLabel, text: &str, (x, y): (f64, f64), anchor: &str) -> Markup {
    html! {
        text x=(n(x)) y=(n(y)) font-size=(n(letters.size_px)) font-weight=[letters.bold.then_some("bold")]
            fill=(css(letters.color)) text-anchor=(anchor) { (text) }
    }
}

/// Writes the simulated time, the run and the mission's progress. `end` is the end of the run.
pub fn head(setup: &Setup, view: &View, end: SimTime, width_px: f64) -> Markup {
    let right = width_px - MARGIN_PX;
    let columns = setup.catalog.mission.vocabulary().columns.iter();
    let row = columns.zip(&view.mission);
    let row: Vec<ColumnValue> = row
        .map(|(column, number)| column.with_number(*number))
        .collect();
    let clock = TextLabel::BOLD.sized(20.0);
    let now = format!("{:.1} s", view.now.as_secs_f64());
    // The columns of figures in a film keep their places.
    let longest = format!("{:.1} s", end.as_secs_f64());
    let summary = TextLabel::BOLD.sized(13.0);
    let room = right - MARGIN_PX - clock.width_px(&longest) - 12.0;
    let state = summary.cut(&short_summary(&row), room);
    let quiet = TextLabel::LEFT.sized(11.0).colored(QUIET_TEXT);
    let scenario = &setup.scenario;
    let run = format!(
        "{}, seed {}, {}",
        scenario.name,
        setup.seed,
        scenario.allocator_list()
    );
    let progress = Progress::from_row(&row).filter(|progress| progress.total() > 0);
    let share = progress.map(|progress| progress.done as f64 / progress.total() as f64);
    let room = right - MARGIN_PX - if share.is_some() { BAR_PX + 12.0 } else { 0.0 };
    let elapsed = (right - MARGIN_PX) * view.now.as_secs_f64() / end.as_secs_f64().max(1e-3);
    html! {
        (words(clock, &now, (MARGIN_PX, 29.0), "start"))
        (words(summary, &state, (right, 27.0), "end"))
        (words(quiet, &quiet.cut(&run, room), (MARGIN_PX, 47.0), "start"))
        @if let Some(share) = share {
            (bar((right - BAR_PX, 38.0), (BAR_PX, 9.0), share, &css(PROGRESS)))
        }
        (bar((MARGIN_PX, 56.0), (right - MARGIN_PX, 3.0), elapsed / (right - MARGIN_PX), &css(QUIET_TEXT)))
    }
}

fn bar((x, y): (f64, f64), (width, height): (f64, f64), share: f64, color: &str) -> Markup {
    let round = n(height / 2.0);
    let filled = width * share.clamp(0.0, 1.0);
    html! {
        rect x=(n(x)) y=(n(y)) width=(n(width)) height=(n(height)) rx=(round) fill=(css(QUIET_LINE)) {}
        @if filled > 0.5 {
            rect x=(n(x)) y=(n(y)) width=(n(filled.max(height))) height=(n(height)) rx=(round) fill=(color) {}
        }
    }
}

/// Writes the state of the team, and the faults in force.
pub fn foot(view: &View, (top, width_px): (f64, f64)) -> Markup {
    let y = top + 22.0;
    let letters = TextLabel::LEFT.sized(12.0);
    let team = team(view);
    let right = width_px - MARGIN_PX;
    let room = right - MARGIN_PX - letters.width_px(&team) - 24.0;
    let in_force = view
        .faults
        .iter()
        .filter(|fault| fault.phase == Phase::InForce);
    let texts: Vec<String> = in_force.map(fault).collect();
    let alarm = TextLabel::BOLD.sized(12.0).colored(TROUBLE);
    html! {
        (words(letters.colored(INK), &team, (MARGIN_PX, y), "start"))
        @if let Some(text) = faults(&texts, |text| alarm.width_px(text) <= room) {
            (words(alarm, &alarm.cut(&text, room), (right, y), "end"))
        }
    }
}

fn fault(status: &FaultStatus) -> String {
    let since = status.applied_ms.map(SimTime::as_secs_f64);
    let since = since.map_or_else(String::new, |since| format!(" since {since:.1} s"));
    // Without the dashes of the command line.
    let fault = status.order.fault.to_string().replace("--", "");
    format!("{fault}{since}")
}

/// Joins the newest texts that fit, and counts the others.
fn faults(texts: &[String], fits: impl Fn(&str) -> bool) -> Option<String> {
    let joined = |left_out: usize| {
        let shown = texts[left_out..].join("; ");
        match left_out {
            0 => shown,
            _ => format!("{shown}; and {left_out} more"),
        }
    };
    let most = texts.len().checked_sub(1)?;
    let fitting = (0..most).map(joined).find(|text| fits(text));
    Some(fitting.unwrap_or_else(|| joined(most)))
}

/// Returns the number of robots in each state, such as `3 robots: 2 at work, 1 idle`.
fn team(view: &View) -> String {
    let count = |is: &dyn Fn(AgentState, bool) -> bool| {
        let robots = view.robots.iter();
        robots
            .filter(|robot| is(robot.state, robot.active.is_some()))
            .count()
    };
    let counts = [
        (
            "at work",
            count(&|state, works| state == AgentState::Present && works),
        ),
        (
            "idle",
            count(&|state, works| state == AgentState::Present && !works),
        ),
        ("joining", count(&|state, _| state == AgentState::Coming)),
        ("silent", count(&|state, _| state == AgentState::Silent)),
        ("dead", count(&|state, _| state == AgentState::Dead)),
        ("absent", count(&|state, _| state == AgentState::Absent)),
    ];
    let counts = counts.iter().filter(|(_, count)| *count > 0);
    let texts: Vec<String> = counts
        .map(|(state, count)| format!("{count} {state}"))
        .collect();
    let robots = match view.robots.len() {
        1 => "1 robot".to_owned(),
        count => format!("{count} robots"),
    };
    format!("{robots}: {}", texts.join(", "))
}
