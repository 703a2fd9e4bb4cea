//! Adds up the figures of run.json.

use std::sync::Arc;

use alliance_proto::ids::RobotId;
use alliance_proto::log::{Figures, Input, RobotFigures};
use alliance_proto::scenario::{Roster, Setup};
use alliance_proto::telemetry::BehaviorState;
use alliance_proto::time::SimTime;

use super::answers::Answer;
use super::record::{EventKind, TickRecord};

/// Adds up the figures of a run.
#[derive(Clone, Debug)]
pub struct Tally {
    figures: Figures,
    /// By rank.
    robots: Vec<RobotFigures>,
    roster: Arc<Roster>,
    step: SimTime,
    report_period: SimTime,
    last_report: SimTime,
    lateness_total_ms: u64,
}

impl Tally {
    pub fn new(setup: &Setup) -> Self {
        let scenario = &setup.scenario;
        Self {
            figures: Figures::default(),
            robots: vec![RobotFigures::default(); scenario.robots.len()],
            roster: Arc::clone(&setup.roster),
            step: SimTime(scenario.step_ms),
            report_period: SimTime::from_secs_f64(scenario.waste.report_period_s),
            last_report: SimTime::ZERO,
            lateness_total_ms: 0,
        }
    }

    pub fn add(&mut self, record: &TickRecord<'_>) {
        self.figures.ticks += 1;
        self.figures.sim_time_ms = record.now + self.step;
        self.figures.items = record.items;
        for input in record.inputs {
            if let Input::Join { robot, .. } = input
                && let Some(robot) = self.roster.robot_named(robot)
            {
                self.robots[robot.index()].lives += 1;
            }
        }
        for (figures, answer) in self.robots.iter_mut().zip(record.answers) {
            if answer.counts {
                count(figures, answer);
            }
        }
        for event in record.events {
            match event.kind {
                EventKind::Delivered => {
                    if let Some(figures) = self.robot(event.robot) {
                        figures.items_delivered += 1;
                    }
                }
                EventKind::Reported => {
                    if let Some(figures) = self.robot(event.robot) {
                        figures.reports_made += 1;
                    }
                    self.add_report(record.now);
                }
                _ => {}
            }
        }
    }

    fn robot(&mut self, robot: Option<RobotId>) -> Option<&mut RobotFigures> {
        self.robots.get_mut(robot?.index())
    }

    fn add_report(&mut self, now: SimTime) {
        let late_ms = now.since(self.last_report + self.report_period).0;
        self.last_report = now;
        self.lateness_total_ms += late_ms;
        let figures = &mut self.figures;
        figures.reports_made += 1;
        figures.report_lateness_max_ms = figures.report_lateness_max_ms.max(Some(late_ms));
        figures.report_lateness_mean_ms =
            Some(self.lateness_total_ms as f64 / f64::from(figures.reports_made));
    }

    /// The figures so far.
    pub fn figures(&self) -> Figures {
        let mut figures = self.figures.clone();
        let robots = self
            .roster
            .names()
            .map(str::to_owned)
            .zip(self.robots.iter().copied());
        figures.robots = robots.collect();
        figures
    }
}

fn count(figures: &mut RobotFigures, answer: &Answer) {
    let (report, deliveries) = (&answer.report, answer.deliveries);
    figures.ticks_counted += 1;
    figures.messages_sent += u64::from(report.broadcasts);
    figures.bytes_sent += u64::from(report.broadcast_bytes);
    figures.messages_heard += u64::from(deliveries.heard + deliveries.delayed);
    figures.messages_delayed += u64::from(deliveries.delayed);
    figures.messages_lost += u64::from(deliveries.lost);
    figures.messages_duplicate += u64::from(deliveries.duplicate);
    let activated = report
        .changes
        .iter()
        .filter(|change| change.to == BehaviorState::Active);
    figures.activations += activated.count() as u32;
}
