//! Events that faults wait for.

use proto::telemetry::BehaviorState;
use proto::tick::Report;
use run_log::Input;
use scenario::fault::{EventTrigger, Fault, TriggerEvent};
use scenario::ids::RobotId;
use scenario::time::SimTime;

use super::Simulation;
use crate::faults::schedule::FaultIndex;
use run_log::recorder::{Event, EventKind};

/// An event in the words of a trigger.
struct Occurrence {
    robot: RobotId,
    what: &'static str,
    subject: Option<String>,
}

impl Simulation {
    /// Triggers faults by a robot's decisions in the current tick. Kills take effect before other robots receive the
    /// broadcasts of that tick. Other faults wait for the next tick, as do faults of roles, which need all reports.
    pub(super) fn trigger_by_report(&mut self, report: &Report) {
        if self.schedule.waiting().next().is_none() {
            return;
        }
        let changes = report.changes.iter().map(|change| Occurrence {
            robot: report.robot,
            what: match change.to {
                BehaviorState::Active => TriggerEvent::Activates,
                BehaviorState::Waiting => TriggerEvent::Waits,
                BehaviorState::Hibernating => TriggerEvent::Hibernates,
            }
            .as_str(),
            subject: Some(self.setup.catalog.behavior_name(change.set).to_owned()),
        });
        let terms = self.setup.catalog.mission.vocabulary();
        let noted = report.notes.iter().filter_map(|note| {
            let kind = note.kind.as_str(terms.notes);
            let mut verbs = terms.verbs.iter();
            let (verb, _) = verbs.find(|(_, event)| *event == kind)?;
            Some(Occurrence {
                robot: report.robot,
                what: verb,
                subject: None,
            })
        });
        let occurrences: Vec<Occurrence> = changes.chain(noted).collect();
        for fault in self.waiting_for(&occurrences) {
            let now = self.world.now();
            let ordered = &self.schedule.status(fault).order.fault;
            let kills = matches!(ordered, Fault::Kill(_) | Fault::Terminate(_));
            if kills && ordered.role().is_none() {
                self.schedule.apply(fault, now);
                self.apply(fault);
            } else {
                self.schedule.trigger(fault, self.next_tick_at());
            }
        }
    }

    /// Triggers faults by events of the world, joins and deaths in the ended tick.
    pub(super) fn trigger_by_world(&mut self, events: &[Event], inputs: &[Input]) {
        if self.schedule.waiting().next().is_none() {
            return;
        }
        let terms = self.setup.catalog.mission.vocabulary();
        let in_world = events.iter().filter_map(|event| {
            let EventKind::Mission(kind) = event.kind else {
                return None;
            };
            let mut verbs = terms.verbs.iter();
            let (verb, _) = verbs.find(|(_, event_kind)| *event_kind == kind)?;
            Some(Occurrence {
                robot: event.robot?,
                what: verb,
                subject: Some(event.subject.clone()),
            })
        });
        let from_outside = inputs.iter().filter_map(|input| {
            let (robot, what) = match input {
                Input::Join { robot, .. } => (robot, TriggerEvent::Joins),
                Input::Gone { robot, .. } => (robot, TriggerEvent::Dies),
                _ => return None,
            };
            Some(Occurrence {
                robot: self.robot_named(robot)?,
                what: what.as_str(),
                subject: None,
            })
        });
        let occurrences: Vec<Occurrence> = in_world.chain(from_outside).collect();
        for fault in self.waiting_for(&occurrences) {
            // The clock already shows the next tick.
            self.schedule.trigger(fault, self.world.now());
        }
    }

    fn next_tick_at(&self) -> SimTime {
        self.world.now() + SimTime(self.setup.scenario.step_ms)
    }

    fn waiting_for(&self, occurrences: &[Occurrence]) -> Vec<FaultIndex> {
        let fits = |when: &EventTrigger, occurrence: &Occurrence| {
            when.what.as_str() == occurrence.what
                && when
                    .robot
                    .as_deref()
                    .is_none_or(|robot| robot == self.name(occurrence.robot))
                && (when.subject.is_none() || when.subject == occurrence.subject)
        };
        self.schedule
            .waiting()
            .filter(|(_, when)| occurrences.iter().any(|occurrence| fits(when, occurrence)))
            .map(|(fault, _)| fault)
            .collect()
    }
}
