//! Events that faults wait for.

use alliance_proto::fault::{Fault, Happening, When};
use alliance_proto::ids::RobotId;
use alliance_proto::log::Input;
use alliance_proto::telemetry::BehaviorState;
use alliance_proto::tick::Report;
use alliance_proto::time::SimTime;

use super::Simulation;
use crate::faults::schedule::FaultIndex;
use crate::recorder::{Event, EventKind};

/// Something that has happened, as a trigger names it.
struct Happened {
    robot: RobotId,
    /// The verb.
    what: &'static str,
    subject: Option<String>,
}

impl Simulation {
    /// What a robot has decided in the current tick. A kill that waited for it comes before the team hears of it (DESIGN §4),
    /// everything else at the beginning of the next tick, and so does what befalls a role: who has it all reports tell.
    pub(super) fn trigger_by_report(&mut self, report: &Report) {
        if self.schedule.waiting().next().is_none() {
            return;
        }
        let changes = report.changes.iter().map(|change| Happened {
            robot: report.robot,
            what: match change.to {
                BehaviorState::Active => Happening::Activates,
                BehaviorState::Waiting => Happening::Waits,
                BehaviorState::Hibernating => Happening::Hibernates,
            }
            .as_str(),
            subject: Some(self.setup.catalog.behavior_name(change.set).to_owned()),
        });
        let terms = self.setup.catalog.mission.terms();
        let noted = report.notes.iter().filter_map(|note| {
            let kind = note.kind.as_str(terms.notes);
            let mut verbs = terms.verbs.iter();
            let (verb, _) = verbs.find(|(_, stands_for)| *stands_for == kind)?;
            Some(Happened {
                robot: report.robot,
                what: verb,
                subject: None,
            })
        });
        let happened: Vec<Happened> = changes.chain(noted).collect();
        for fault in self.waiting_for(&happened) {
            let now = self.world.now();
            let asked = &self.schedule.status(fault).order.fault;
            let kills = matches!(asked, Fault::Kill(_) | Fault::Terminate(_));
            if kills && asked.role().is_none() {
                self.schedule.apply(fault, now);
                self.apply(fault);
            } else {
                self.schedule.trigger(fault, self.next_tick_at());
            }
        }
    }

    /// What the world did in the tick that ends, and who came and went in it.
    pub(super) fn trigger_by_world(&mut self, events: &[Event], inputs: &[Input]) {
        if self.schedule.waiting().next().is_none() {
            return;
        }
        let terms = self.setup.catalog.mission.terms();
        let in_world = events.iter().filter_map(|event| {
            let EventKind::Mission(kind) = event.kind else {
                return None;
            };
            let mut verbs = terms.verbs.iter();
            let (verb, _) = verbs.find(|(_, stands_for)| *stands_for == kind)?;
            Some(Happened {
                robot: event.robot?,
                what: verb,
                subject: Some(event.subject.clone()),
            })
        });
        let from_outside = inputs.iter().filter_map(|input| {
            let (robot, what) = match input {
                Input::Join { robot, .. } => (robot, Happening::Joins),
                Input::Gone { robot, .. } => (robot, Happening::Dies),
                _ => return None,
            };
            Some(Happened {
                robot: self.robot_named(robot)?,
                what: what.as_str(),
                subject: None,
            })
        });
        let happened: Vec<Happened> = in_world.chain(from_outside).collect();
        for fault in self.waiting_for(&happened) {
            // The clock shows the next tick already.
            self.schedule.trigger(fault, self.world.now());
        }
    }

    fn next_tick_at(&self) -> SimTime {
        self.world.now() + SimTime(self.setup.scenario.step_ms)
    }

    fn waiting_for(&self, happened: &[Happened]) -> Vec<FaultIndex> {
        let fits = |when: &When, happened: &Happened| {
            when.what.as_str() == happened.what
                && when
                    .robot
                    .as_deref()
                    .is_none_or(|robot| robot == self.name(happened.robot))
                && (when.subject.is_none() || when.subject == happened.subject)
        };
        self.schedule
            .waiting()
            .filter(|(_, when)| happened.iter().any(|happened| fits(when, happened)))
            .map(|(fault, _)| fault)
            .collect()
    }
}
