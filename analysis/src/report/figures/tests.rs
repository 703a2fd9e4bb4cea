//! Figures of teams of any size: their height is limited, and losses and takeovers remain visible.

use missions::Registry;
use run_log::{EventRow, RunFile};
use scenario::fault::{Fault, Order};
use scenario::time::SimTime;
use scenario::{Scenario, Setup};

use super::*;
use crate::figures::canvas::px;
use crate::report::history::History;
use crate::report::tests::run_of;
use crate::{testkit, visit};

/// Returns the member of a mission's family with that many robots. One robot is killed after 1 s.
fn family(mission: &str, robots: usize, size: usize) -> Setup {
    let vocabulary = Registry::built_in().vocabulary();
    let mut missions = vocabulary.missions.iter();
    let mission = missions
        .find(|known| known.scenario_name() == mission)
        .unwrap();
    let mut scenario = mission.family(robots, size).unwrap();
    let kill = Order {
        at_s: Some(1.0),
        ..Order::now(Fault::Kill(scenario.robots[1].name.clone()))
    };
    scenario.faults.timeline.push(kill);
    resolved(scenario)
}

fn resolved(mut scenario: Scenario) -> Setup {
    scenario.limit_s = 4.0;
    testkit::setup(scenario)
}

fn height_px(figure: &Figure) -> f64 {
    let from = figure.svg.find(" height=\"").unwrap() + 9;
    let to = from + figure.svg[from..].find('"').unwrap();
    figure.svg[from..to].parse().unwrap()
}

fn all(history: &History, run: &RunFile) -> Vec<Figure> {
    figures(
        history,
        &Metrics::compute(history, run),
        &FigureSelection::default(),
    )
    .unwrap()
    .figures
}

fn gantt(history: &History, metrics: &Metrics) -> String {
    let wanted = FigureSelection {
        only: vec!["gantt".to_owned()],
        ..FigureSelection::default()
    };
    figures(history, metrics, &wanted).unwrap().figures[0]
        .svg
        .clone()
}

/// Counts the strokes and outlines of a drawing.
fn strokes(svg: &str) -> usize {
    let paths = svg.lines().filter(|line| line.starts_with("<path "));
    let joined: usize = paths.map(|path| path.matches('V').count()).sum();
    svg.matches("<polyline").count() + svg.matches("<line").count() + joined
}

/// Checks that deaths and takeovers are drawn: without them, their strokes are missing.
#[track_caller]
fn marks_are_there(history: &History, metrics: &Metrics) {
    let whole = strokes(&gantt(history, metrics));
    let mut without = metrics.clone();
    let deaths = std::mem::take(&mut without.failures).len();
    assert!(deaths > 0);
    // A cross has two strokes.
    assert_eq!(strokes(&gantt(history, &without)) + 2 * deaths, whole);
    let takeovers = std::mem::take(&mut without.takeovers).len();
    // A diamond has one outline.
    let left = strokes(&gantt(history, &without));
    assert_eq!(left + takeovers + 2 * deaths, whole);
}

#[test]
fn figures_without_room_are_named_and_not_drawn() {
    let (history, run) = run_of(family("waste-cleanup", 3, 2));
    let metrics = Metrics::compute(&history, &run);
    let names = |max_bytes| {
        let wanted = FigureSelection {
            max_bytes,
            ..FigureSelection::default()
        };
        let DrawnFigures { figures, undrawn } = figures(&history, &metrics, &wanted).unwrap();
        let drawn = figures.into_iter().map(|figure| figure.name);
        (drawn.collect::<Vec<_>>(), undrawn)
    };
    let (all, none) = names(None);
    assert_eq!(none, [""; 0]);
    // The mission's curves are small in any team, so they come before the paths.
    let place = |name: &str| all.iter().position(|other| other == name).unwrap();
    assert!(place("mission") < place("every-reported") && place("every-reported") < place("map"));
    let (first, others) = names(Some(0));
    assert_eq!(first, all[..1]);
    assert_eq!(others, all[1..]);
}

#[test]
fn figures_of_any_team_fit_on_a_screen() {
    for (mission, robots, size) in [
        ("waste-cleanup", 3, 2),
        ("waste-cleanup", 30, 20),
        ("waste-cleanup", 300, 200),
        ("service", 30, 100),
        ("service", 300, 60),
    ] {
        let (history, run) = run_of(family(mission, robots, size));
        let figures = all(&history, &run);
        assert!(figures.len() > robots, "{mission} with {robots}");
        for figure in &figures {
            let height = height_px(figure);
            assert!(
                height < 2_000.0,
                "{mission} with {robots}: {} is {height} px high",
                figure.name
            );
        }
        let gantt = &figures[0];
        assert_eq!(gantt.name, "gantt");
        let kill = format!("kill {}", history.robots[1].name);
        assert!(gantt.svg.contains(&kill), "{mission} with {robots}");
        if robots > 3 {
            marks_are_there(&history, &Metrics::compute(&history, &run));
        }
    }
}

/// Gold and blue take the upper spill's task in the same tick. Gold keeps it for one tick.
#[test]
fn an_activation_of_one_tick_is_visible() {
    let mut scenario = testkit::shipped("waste-cleanup");
    scenario.limit_s = 70.0;
    let (history, run) = run_of(testkit::setup(scenario));
    let figures = all(&history, &run);
    for name in ["gantt", "robot-gold"] {
        let figure = figures.iter().find(|figure| figure.name == name).unwrap();
        let widths = figure.svg.split("<rect ").skip(1).map(|rect| {
            let from = rect.find("width=\"").unwrap() + 7;
            let width = rect[from..].split('"').next().unwrap();
            width.parse::<i32>().unwrap()
        });
        let least = widths.min().unwrap();
        // Ends are rounded to units.
        assert!(
            (px(1.0) - 1..=px(1.0) + 1).contains(&least),
            "{name}: {least}"
        );
    }
}

/// Draws robots that share rows: the active share of each row, and deaths.
#[test]
fn more_robots_than_rows_are_drawn_together() {
    let vocabulary = Registry::built_in().vocabulary();
    let scenario = vocabulary.missions[0].family(1_400, 900).unwrap();
    let mut history = History::new(resolved(scenario), SimTime(4_000));
    let span = |from, to| {
        crate::report::spans::Spans::from_iter([observation::stints::Span {
            from: SimTime(from),
            to: SimTime(to),
        }])
    };
    for (rank, robot) in history.robots.iter_mut().enumerate() {
        robot.present = span(0, if rank == 700 { 2_000 } else { 4_000 });
        robot.sets[0].active = span(1_000, if rank % 2 == 0 { 3_000 } else { 1_000 });
    }
    history.events.push(EventRow {
        t_ms: SimTime(2_000),
        kind: "gone".to_owned(),
        robot: history.robots[700].name.clone(),
        subject: String::new(),
        reason: String::new(),
        detail: String::new(),
    });
    let run = RunFile {
        setup: history.setup.clone(),
        ..visit::run_file()
    };
    let metrics = Metrics::compute(&history, &run);
    assert_eq!(metrics.failures.len(), 1);
    marks_are_there(&history, &metrics);
    let gantt = gantt(&history, &metrics);
    // About half of each row is active from 1 to 3 s.
    let cells = |opacity: &str, color: &str| {
        let cell = format!("opacity=\"{opacity}\" fill=\"{color}\"");
        gantt.matches(&cell).count()
    };
    assert!(cells("0.5", "#566B86") + cells("0.6", "#566B86") > 90);
    assert_eq!(cells("0.1", "#222222"), 1);
    assert!(gantt.contains("some of the robots active"));
    assert!(gantt.contains(" … "));
    for name in ["task-0-find-locations", "map-by-robot"] {
        let wanted = FigureSelection {
            only: vec![name.to_owned()],
            ..FigureSelection::default()
        };
        let drawn = figures(&history, &metrics, &wanted).unwrap().figures;
        assert!(height_px(&drawn[0]) < 2_000.0, "{name}");
    }
}
