//! The figures of run.json.

use std::collections::BTreeMap;
use std::iter;
use std::sync::Arc;

use crate::{Figures, Input, RobotFigures};
use prefetch::prefetch;
use proto::control::FaultStatus;
use proto::telemetry::BehaviorState;
use scenario::mission::columns::ColumnKind;
use scenario::mission::{MissionFigures, TeamFigures};
use scenario::time::SimTime;
use scenario::{Roster, Setup};

use super::answers::Answer;
use super::record::{EventKind, TickRecord};

/// The part of a run's result that is not in its tables.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ending {
    /// `true` if a stall or a message loss outside the scenario changed the run.
    pub unscripted: bool,
    /// The faults in the order in which they were armed, each with its number of hits.
    pub faults: Vec<FaultStatus>,
    pub figures: TeamFigures,
    /// The builds of agents that differ from the world's, by robot.
    pub agent_builds: BTreeMap<String, String>,
}

#[derive(Clone, Debug)]
pub struct Tally {
    figures: Figures,
    robots: Vec<RobotFigures>,
    roster: Arc<Roster>,
    step: SimTime,
    /// Counts of completed work per robot, one entry for each counting column of mission.csv.
    done: Vec<Done>,
}

/// The counts of a column of mission.csv, by robot.
#[derive(Clone, Debug)]
struct Done {
    column: &'static str,
    event: &'static str,
    by: Vec<u64>,
}

impl Tally {
    pub fn new(setup: &Setup) -> Self {
        let scenario = &setup.scenario;
        let columns = setup.catalog.mission.vocabulary().columns.iter();
        let done = columns.filter(|column| column.kind == ColumnKind::Done);
        let done = done.filter_map(|column| {
            Some(Done {
                column: column.name,
                event: column.event?,
                by: vec![0; scenario.robots.len()],
            })
        });
        Self {
            done: done.collect(),
            figures: Figures::default(),
            robots: vec![RobotFigures::default(); scenario.robots.len()],
            roster: Arc::clone(&setup.roster),
            step: SimTime(scenario.step_ms),
        }
    }

    #[inline]
    pub fn prefetch(&self) {
        prefetch(&*self.robots);
    }

    pub fn add(&mut self, record: &TickRecord<'_>) {
        self.figures.ticks += 1;
        self.figures.sim_time_ms = record.now + self.step;
        for input in record.inputs {
            if let Input::Join { robot, .. } = input
                && let Some(robot) = self.roster.find(robot)
            {
                self.robots[robot.index()].incarnations += 1;
            }
        }
        for event in record.events {
            if let (EventKind::Mission(kind), Some(robot)) = (event.kind, event.robot) {
                for done in self.done.iter_mut().filter(|done| done.event == kind) {
                    done.by[robot.index()] += 1;
                }
            }
        }
        for (figures, answer) in self.robots.iter_mut().zip(record.answers) {
            if answer.counts {
                count(figures, answer);
            }
        }
    }

    /// Returns the figures so far together with those of the mission.
    pub fn figures(&self, mission_figures: TeamFigures) -> Figures {
        let TeamFigures {
            mission,
            mut robots,
        } = mission_figures;
        if robots.iter().all(MissionFigures::is_empty) {
            for done in &self.done {
                for (figures, count) in robots.iter_mut().zip(&done.by) {
                    figures.add(done.column, *count);
                }
            }
        }
        let by_robot = robots
            .into_iter()
            .chain(iter::repeat_with(MissionFigures::default));
        let robots = self.roster.names().zip(&self.robots).zip(by_robot);
        let robots = robots.map(|((name, robot), mission)| {
            let figures = RobotFigures {
                mission,
                ..robot.clone()
            };
            (name.to_owned(), figures)
        });
        Figures {
            mission,
            robots: robots.collect(),
            ..self.figures.clone()
        }
    }
}

fn count(figures: &mut RobotFigures, answer: &Answer) {
    let (report, deliveries) = (&answer.report, answer.deliveries);
    figures.ticks_counted += 1;
    figures.messages_sent += u64::from(report.broadcasts);
    figures.bytes_sent += u64::from(report.broadcast_bytes);
    figures.messages_received +=
        u64::from(deliveries.received + deliveries.delayed + deliveries.damaged);
    figures.messages_delayed += u64::from(deliveries.delayed);
    figures.messages_lost += u64::from(deliveries.lost);
    figures.messages_duplicate += u64::from(deliveries.duplicate);
    let activated = report
        .changes
        .iter()
        .filter(|change| change.to == BehaviorState::Active);
    figures.activations += activated.count() as u32;
}
