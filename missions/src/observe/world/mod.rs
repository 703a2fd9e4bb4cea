//! The world's part of observe. Targets move by themselves and are not solid. A robot observes the targets in its
//! range.
//!
//! - `targets`: their motion. `watch`: their observation.

mod targets;
#[cfg(test)]
mod tests;
mod watch;

use std::sync::Arc;

use glam::Vec2;
use prefetch::{Layer, prefetch};
use proto::mission::{Action, SensorReading as AnyReading};
use proto::tick::Outcome;
use proto::view::{Mark, MarkOutline, MarkRole, View, Work};
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;
use scenario::{Scenario, Setup};
use serde::Serialize;
use world_server::mission::{
    FigureValue, MissionWorld, StepEvents, Target, TeamFigures, Validity, hash_state,
};
use world_server::world::Floor;

use super::bus::{ObserveAction as Look, SensedTarget, SensorReading};
use super::data::{Area, ObserveSection, Policy, TaskKind};
use targets::Targets;
use watch::Observation;

/// The displayed radius of a target, m, and its least share of the room's size.
const SHOWN_M: f32 = 0.15;
const SHOWN: f32 = 0.006;

#[derive(Clone, Debug, Serialize)]
pub struct Observe {
    #[serde(skip)]
    constants: Arc<Constants>,
    targets: Targets,
    watch: Observation,
}

#[derive(Debug)]
struct Constants {
    section: ObserveSection,
    area: Area,
    step: SimTime,
    duration: SimTime,
}

impl MissionWorld for Observe {
    fn new(setup: &Setup, floor: &Floor) -> Self {
        let scenario = &setup.scenario;
        let section = ObserveSection::from_scenario(scenario).clone();
        let targets = Targets::new(setup);
        Self {
            watch: Observation::new(floor.robot_count(), targets.len()),
            targets,
            constants: Arc::new(Constants {
                area: Area::from_scenario(scenario),
                step: SimTime(scenario.step_ms),
                duration: SimTime::from_secs_f64(section.duration_s),
                section,
            }),
        }
    }

    fn starts(scenario: &Scenario) -> Vec<Vec2> {
        let area = Area::from_scenario(scenario).inset(1.1 * scenario.body.radius_m);
        let count = scenario.robots.len();
        // The places of larger teams are alternatives, if obstacles or bodies are in the way.
        [1, 2, 4]
            .into_iter()
            .flat_map(|times| area.spread(times * count))
            .collect()
    }

    fn begin(&mut self, floor: &mut Floor, _: &mut StepEvents) {
        self.targets.step(floor.now());
    }

    fn act(&mut self, robot: RobotId, action: &Action, _: &mut Floor, _: &mut StepEvents) {
        if let Some(Look) = action.value() {
            self.watch.look(robot);
        }
    }

    fn settle(&mut self, floor: &mut Floor, happened: &mut StepEvents) {
        self.watch.settle(&self.targets, floor, happened);
    }

    fn sense(&self, robot: RobotId, floor: &Floor, sensed: &mut AnyReading) -> Validity {
        let (position, ahead) = (floor.pose(robot).position, floor.ahead(robot));
        let sensed = &mut sensed.value_mut::<SensorReading>().targets;
        // Written in place: lists of fixed capacity are expensive to move.
        let sensed = sensed.get_or_insert_default();
        sensed.clear();
        sensed.extend(self.targets.nearest(position).iter().map(|(_, number)| {
            let offset = self.targets.at(*number) - position;
            SensedTarget {
                target: *number as u32,
                offset: Vec2::new(ahead.dot(offset), ahead.perp_dot(offset)),
            }
        }));
        Validity::ThisTick
    }

    fn copy_device(&self, device: &str, from: &AnyReading, to: &mut AnyReading) {
        if device == "targets" {
            *to.value_mut::<SensorReading>() = from.value::<SensorReading>().into_owned();
        }
    }

    fn add_error(&self, device: &str, sensed: &mut AnyReading, error_m: &mut dyn FnMut() -> f32) {
        if device != "targets" {
            return;
        }
        if let Some(targets) = &mut sensed.value_mut::<SensorReading>().targets {
            for seen in targets.iter_mut() {
                seen.offset += Vec2::new(error_m(), error_m());
            }
            targets.sort_by(|a, b| {
                let of = |seen: &SensedTarget| seen.offset.length_squared();
                of(a).total_cmp(&of(b))
            });
        }
    }

    fn end(&self, now: SimTime) -> Option<Outcome> {
        (now >= self.constants.duration).then_some(Outcome::Complete)
    }

    /// Robots that follow targets have one task at a time: search far from targets, observe near them.
    fn has_work(&self, task: TaskId, robot: RobotId, floor: &Floor) -> bool {
        let section = &self.constants.section;
        if matches!(section.policy, Policy::Fixed | Policy::Random) {
            return true;
        }
        let place = floor.pose(robot).position;
        let is_near = self.targets.any_within(place, section.predict_m);
        is_near == (section.policy.duties()[task.index()] == TaskKind::Observe)
    }

    fn row(&self, row: &mut Vec<FigureValue>) {
        self.watch.write_row(row);
    }

    fn targets(&self, targets: &mut Vec<Target>) {
        let observers = self.watch.observers().iter();
        targets.extend(observers.enumerate().map(|(number, &observers)| Target {
            at: self.targets.at(number),
            observers,
        }));
    }

    fn state_hash(&self) -> u64 {
        hash_state(self)
    }

    fn figures(&self, figures: &mut TeamFigures) {
        self.watch.write_figures(self.constants.step, figures);
    }

    fn prefetch(&self, layer: Layer) {
        if layer == Layer::Elements {
            prefetch(&*self.constants);
            self.targets.prefetch();
            self.watch.prefetch();
        }
    }

    /// Shows the region, the targets, and each robot's range with lines to its targets.
    fn add_to_view(&self, floor: &Floor, view: &mut View) {
        let shown_m = SHOWN_M.max(SHOWN * floor.room().size().max_element());
        if let Area::Disc { center, radius_m } = self.constants.area {
            view.mark(Mark::disc(
                "region".to_owned(),
                center,
                radius_m,
                MarkRole::Range,
            ));
        }
        for number in 0..self.targets.len() {
            let id = format!("t{number}");
            view.mark(Mark {
                work: Work::left_or_done(!self.watch.is_seen(number)),
                ..Mark::disc(id, self.targets.at(number), shown_m, MarkRole::Target)
            });
        }
        for robot in &mut view.robots {
            let sensed = robot.readings.mission.value::<SensorReading>();
            let targets = sensed.targets.iter().flatten();
            robot.sensed.extend(targets.map(|seen| seen.offset));
        }
        for robot in self.watch.looked() {
            let place = floor.pose(robot).position;
            let id = format!("range {robot}");
            let range_m = self.constants.section.range_m;
            view.mark(Mark::disc(id, place, range_m, MarkRole::Range));
            for (number, _) in self.targets.in_range(place) {
                view.mark(Mark {
                    id: format!("{robot} t{number}"),
                    outline: MarkOutline::Line {
                        from: place,
                        to: self.targets.at(number),
                    },
                    role: MarkRole::Link,
                    work: None,
                    label: String::new(),
                });
            }
        }
    }

    fn check_invariants(&self, _: &Floor) -> Result<(), String> {
        self.targets.holds()?;
        self.watch.holds()
    }
}
