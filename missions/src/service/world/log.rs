//! Output of service beside its points: events, figures of run.json and the view.

use std::collections::BTreeSet;

use proto::view::{Mark, MarkRole, View};
use run_log::recorder::Event;
use scenario::ids::RobotId;
use scenario::time::SimTime;
use world_server::mission::{StepEvents, TeamFigures};

use super::crews::DeadlockSearch;
use super::points::{Change, Points};
use crate::service::bus::SensorReading;
use crate::service::data::Charger;

/// The radius of a displayed charger, m.
const CHARGER_SHOWN_M: f32 = 0.4;

/// The record of a run. It does not affect later steps.
#[derive(Clone, Debug)]
pub(super) struct Log {
    step_s: f64,
    last_done: Option<SimTime>,
    /// The time from arrival to completion of each point that is done, ms.
    responses_ms: Vec<u64>,
    /// The open points on which no robot has worked since their arrival.
    not_begun: BTreeSet<u32>,
    /// The time from arrival to the first work on each point, ms.
    waits_ms: Vec<u64>,
    robots: Vec<Worker>,
    pub deadlocks: DeadlockSearch,
}

#[derive(Clone, Debug, Default)]
struct Worker {
    work_steps: u64,
    wasted_steps: u64,
    done: u64,
    way_m: f64,
}

impl Log {
    pub fn new(robots: usize, step_s: f64) -> Self {
        Self {
            step_s,
            last_done: None,
            responses_ms: Vec::new(),
            not_begun: BTreeSet::new(),
            waits_ms: Vec::new(),
            robots: vec![Worker::default(); robots],
            deadlocks: DeadlockSearch::default(),
        }
    }

    /// Records a change of a point, caused by a robot's work or by time. Returns its event.
    pub fn add<'e>(
        &mut self,
        points: &Points,
        point: u32,
        change: Change,
        robot: Option<RobotId>,
        now: SimTime,
        happened: &'e mut StepEvents,
    ) -> &'e mut Event {
        let (work_s, arrived) = points.work_and_arrival(point);
        let response = now.since(arrived);
        let value = points.value_text(point);
        let (kind, detail) = match change {
            Change::Arrived => {
                let terms = points.terms_text(point).map(|terms| format!(", {terms}"));
                let terms = terms.unwrap_or_default();
                ("arrived", format!("{work_s:.3} s of work{terms}"))
            }
            Change::Done => {
                let value = value.map(|value| format!(", {value}")).unwrap_or_default();
                (
                    "done",
                    format!("after {:.3} s{value}", response.as_secs_f64()),
                )
            }
            Change::Expired => {
                let reason = points.lost_predecessor(point);
                let reason = reason.map(|lost| format!("its predecessor p{lost} will not be done"));
                let parts: Vec<String> = reason.into_iter().chain(value).collect();
                ("expired", parts.join(", "))
            }
        };
        let event = happened.push_mission_event(kind, robot);
        event.subject = format!("p{point}");
        event.detail = detail;
        match change {
            Change::Arrived => {
                self.not_begun.insert(point);
            }
            Change::Done => {
                self.responses_ms.push(response.0);
                self.last_done = Some(now);
            }
            Change::Expired => {}
        }
        if let Some(robot) = robot {
            self.robots[robot.index()].done += 1;
        }
        event
    }

    /// Records the wait of a point since its arrival, if a robot works on it for the first time since then.
    pub fn record_wait(&mut self, point: u32, wait: SimTime) {
        if self.not_begun.remove(&point) {
            self.waits_ms.push(wait.0);
        }
    }

    pub fn work_step(&mut self, robot: RobotId) {
        self.robots[robot.index()].work_steps += 1;
    }

    /// Records a step of work on a point that already had enough workers.
    pub fn surplus_step(&mut self, robot: RobotId) {
        self.robots[robot.index()].wasted_steps += 1;
    }

    pub fn moved(&mut self, robot: RobotId, speed_m_s: f32) {
        self.robots[robot.index()].way_m += f64::from(speed_m_s) * self.step_s;
    }

    /// Writes the figures. Only a complete mission has a makespan.
    pub fn write_figures(&self, is_complete: bool, figures: &mut TeamFigures) {
        let mission = &mut figures.mission;
        let mut responses = self.responses_ms.clone();
        responses.sort_unstable();
        let count = responses.len();
        let mean = |times_ms: &[u64]| {
            let total_ms = times_ms.iter().sum::<u64>() as f64;
            (!times_ms.is_empty()).then(|| total_ms / times_ms.len() as f64)
        };
        // The 95th percentile by the nearest-rank method.
        let p95 = count
            .checked_sub(1)
            .map(|_| responses[(count * 95).div_ceil(100) - 1]);
        let makespan = self.last_done.filter(|_| is_complete);
        mission.add("makespan_ms", makespan.map(|last| last.0));
        mission.add("wait.mean_ms", mean(&self.waits_ms));
        mission.add("response.mean_ms", mean(&responses));
        mission.add("response.p95_ms", p95);
        let wasted_steps: u64 = self.robots.iter().map(|robot| robot.wasted_steps).sum();
        mission.add("wasted_robot_s", wasted_steps as f64 * self.step_s);
        for (figures, robot) in figures.robots.iter_mut().zip(&self.robots) {
            figures.add("done", robot.done);
            figures.add("work_s", robot.work_steps as f64 * self.step_s);
            figures.add("surplus_s", robot.wasted_steps as f64 * self.step_s);
            figures.add("way_m", robot.way_m);
        }
    }
}

/// Adds a mark for each charger.
pub(super) fn show_chargers(chargers: &[Charger], view: &mut View) {
    for (number, charger) in chargers.iter().enumerate() {
        let id = format!("charger/{number}");
        view.mark(Mark {
            label: format!("charger c{number}, {} W", charger.rate_w),
            ..Mark::disc(id, charger.place(), CHARGER_SHOWN_M, MarkRole::Zone)
        });
    }
}

/// Adds the points that robots see, in their own frames.
pub(super) fn show_sensed(view: &mut View) {
    for robot in &mut view.robots {
        let sensed = robot.readings.mission.value::<SensorReading>();
        let points = sensed.points.iter().flatten();
        robot.sensed.extend(points.map(|fact| fact.at));
    }
}
