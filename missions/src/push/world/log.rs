//! Statistics of push for run.json, and the display of readings.

use proto::view::View;
use scenario::ids::RobotId;
use scenario::time::SimTime;
use world_server::mission::TeamFigures;

use crate::push::bar::BarEnd;
use crate::push::bus::SensorReading;

#[derive(Clone, Debug)]
pub(super) struct Statistics {
    /// The least motion that counts as a stroke, m.
    least_m: f32,
    last_arrival: Option<SimTime>,
    robots: Vec<RobotStatistics>,
}

#[derive(Clone, Debug, Default)]
struct RobotStatistics {
    strokes: [u64; 2],
    changes: u64,
    last: Option<(usize, BarEnd)>,
    pushed_m: f64,
}

impl Statistics {
    pub fn new(robots: usize, stroke_m: f32) -> Self {
        Self {
            least_m: stroke_m / 4.0,
            last_arrival: None,
            robots: vec![RobotStatistics::default(); robots],
        }
    }

    pub fn pushed(&mut self, robot: RobotId, bar: usize, end: BarEnd, moved_m: f32) {
        let worker = &mut self.robots[robot.index()];
        worker.pushed_m += f64::from(moved_m);
        if moved_m < self.least_m {
            return;
        }
        worker.strokes[usize::from(end == BarEnd::Right)] += 1;
        let is_other = worker.last.is_some_and(|last| last != (bar, end));
        worker.changes += u64::from(is_other);
        worker.last = Some((bar, end));
    }

    pub fn arrived(&mut self, now: SimTime) {
        self.last_arrival = Some(now);
    }

    /// Writes the figures. Only a complete mission has a makespan.
    pub fn write_figures(&self, is_complete: bool, figures: &mut TeamFigures) {
        let mission = &mut figures.mission;
        let workers = || self.robots.iter();
        let makespan = self.last_arrival.filter(|_| is_complete);
        mission.add("makespan_ms", makespan.map(|last| last.0));
        mission.add(
            "strokes",
            workers().flat_map(|worker| worker.strokes).sum::<u64>(),
        );
        mission.add(
            "changes_of_end",
            workers().map(|worker| worker.changes).sum::<u64>(),
        );
        for (figures, worker) in figures.robots.iter_mut().zip(&self.robots) {
            figures.add("strokes_left", worker.strokes[0]);
            figures.add("strokes_right", worker.strokes[1]);
            figures.add("changes_of_end", worker.changes);
            figures.add("pushed_m", worker.pushed_m);
        }
    }
}

/// Adds the bar ends that robots see, in their own frames.
pub(super) fn show_sensed(view: &mut View) {
    for robot in &mut view.robots {
        let sensed = robot.readings.mission.value::<SensorReading>();
        robot
            .sensed
            .extend(sensed.bar.flatten().map(|bar| bar.near_end));
    }
}
