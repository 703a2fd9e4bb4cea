//! What is told of push beside its bars: events, run.json, and what there is to see.

use alliance_proto::ids::RobotId;
use alliance_proto::mission::Sensed as Encoded;
use alliance_proto::time::SimTime;
use alliance_proto::view::View;
use world_server::mission::TeamFigures;

use crate::push::bar::End;
use crate::push::bus::Sensed;

/// Of steps to come nothing depends on it.
#[derive(Clone, Debug)]
pub(super) struct Log {
    /// A push that moved an end by so much is a stroke, m.
    least_m: f32,
    /// When the last bar arrived.
    makespan: Option<SimTime>,
    /// By rank.
    robots: Vec<Worker>,
}

#[derive(Clone, Debug, Default)]
struct Worker {
    /// Strokes at the left and at the right ends.
    strokes: [u64; 2],
    /// How often it went from one end to another.
    changes: u64,
    last: Option<(usize, End)>,
    pushed_m: f64,
}

impl Log {
    pub fn new(robots: usize, stroke_m: f32) -> Self {
        Self {
            least_m: stroke_m / 4.0,
            makespan: None,
            robots: vec![Worker::default(); robots],
        }
    }

    /// A robot has pushed an end by so much, and has stopped.
    pub fn pushed(&mut self, robot: RobotId, bar: usize, end: End, moved_m: f32) {
        let worker = &mut self.robots[robot.index()];
        worker.pushed_m += f64::from(moved_m);
        if moved_m < self.least_m {
            return;
        }
        worker.strokes[usize::from(end == End::Right)] += 1;
        let is_other = worker.last.is_some_and(|last| last != (bar, end));
        worker.changes += u64::from(is_other);
        worker.last = Some((bar, end));
    }

    /// A bar has arrived.
    pub fn arrived(&mut self, now: SimTime) {
        self.makespan = Some(now);
    }

    pub fn write_figures(&self, figures: &mut TeamFigures) {
        let mission = &mut figures.mission;
        let workers = || self.robots.iter();
        mission.add("makespan_ms", self.makespan.map(|last| last.0));
        mission.add("strokes", workers().flat_map(|it| it.strokes).sum::<u64>());
        mission.add(
            "changes_of_end",
            workers().map(|it| it.changes).sum::<u64>(),
        );
        for (figures, worker) in figures.robots.iter_mut().zip(&self.robots) {
            figures.add("strokes_left", worker.strokes[0]);
            figures.add("strokes_right", worker.strokes[1]);
            figures.add("changes_of_end", worker.changes);
            figures.add("pushed_m", worker.pushed_m);
        }
    }
}

/// The ends of bars that robots see, in their own frames.
pub(super) fn show_sensed(view: &mut View) {
    for robot in &mut view.robots {
        let Encoded::Open(bytes) = &robot.readings.mission else {
            continue;
        };
        // Whatever it is, it is only shown.
        let sensed: Sensed = bytes.decode().unwrap_or_default();
        robot
            .sensed
            .extend(sensed.bar.flatten().map(|bar| bar.near_end));
    }
}
