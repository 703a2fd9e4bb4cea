//! The robot controller of the waste clean-up (thesis §4.1): behavior sets and knowledge. Pure.
//!
//! - `briefing`: the initial knowledge, with the `map`. `extremes`: the border as found so far, by `compass` direction.
//! - `memory`: the knowledge about the mission. `teammates`: the last heartbeat of each teammate.
//! - `find`, `spill`, `report`: the behavior sets. `sight` and `views`: what a robot has seen of a spill. `sweep`: the
//!   search.
//! - `costs`: the cost of each behavior, for allocators that compare.
//! - `perceiving` and `acting`: the two halves of a step.
//!
//! # Decisions that the thesis leaves open
//! - Locations are known after each wall was sensed. A search continues until then.
//! - A spill is empty if most of it was seen without waste, and the robot came from or went to the deposit with no
//!   waste in sight. Waste under an obstacle belongs to no task.
//! - A robot may find a spill empty or out of reach twice in a row, with no waste known elsewhere. Then it searches the
//!   whole area that is nearer to this spill than to another, because a fault may have added waste there. So no robot
//!   needs the number of items. Each robot tracks its own search.
//! - A robot that finds no way to most of a spill, or to its waste, sets the spill aside for three minutes. The same
//!   holds for the report site. It sends no message about it, because it may itself be shut in.
//! - Locations prove wrong only at a place where the robot stands and senses something else. Views from outside,
//!   obstacles and walls prove nothing.
//! - An idle robot makes room for a working teammate.
//! - A finder whose update was withdrawn stands back until a teammate searches, at most one minute.
//! - An own observation wins over a message of the same time. A newer message wins over an older observation. Locations
//!   are an exception: their finder, and a robot that confirmed them, keeps them.

mod acting;
mod briefing;
mod compass;
mod costs;
mod extremes;
mod find;
mod map;
mod memory;
mod perceiving;
mod report;
mod sight;
mod spill;
mod sweep;
mod teammates;
mod views;

#[cfg(test)]
mod tests;

use std::sync::Arc;

use glam::Vec2;
use proto::mission::SharedKnowledge;
use proto::team::Broadcast;
use scenario::Setup;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;

use briefing::Briefing;
use extremes::Extremes;
use find::{Methodical, Wander};
use map::{KnownPlaces, Map, Realms};
use memory::Memory;
use report::BlockedWays;
use robot_agent::allocator::Choice;
use robot_agent::body::{Navigator, Status};
use robot_agent::mission::{
    ControllerConstructor, ControllerInput, MissionController, Perception, StepOutput,
};
use sight::FloorView;
use spill::SpillWork;
use teammates::Teammates;

pub(super) use costs::planned_cost_ms;

/// Returns the constructor of a run's controllers, which share the map.
pub(super) fn constructor(setup: &Setup) -> ControllerConstructor {
    let map = Arc::new(Map::of(&setup.scenario));
    ControllerConstructor::new(move |robot, setup| WasteController::new(robot, setup, &map))
}

#[derive(Clone, Debug)]
struct WasteController {
    briefing: Briefing,
    memory: Memory,
    teammates: Teammates,
    extremes: Extremes,
    methodical: Methodical,
    wander: Wander,
    work: Option<SpillWork>,
    ways_to_site: BlockedWays,
    navigator: Navigator,
    status: Status,
    position: Option<Vec2>,
    facing: Facing,
    realms: Realms,
    /// The view of the floor in this step, if the locations are known.
    sight: Option<FloorView>,
    holding: bool,
    load_of: Option<BehaviorId>,
    /// The action of the last step whose effect is not yet visible.
    pending: Option<Pending>,
    /// The tasks with progress that the motivational behaviors have not yet received.
    progressed: Vec<TaskId>,
    /// The progress count of the search for the locations.
    search_progress: u32,
    stands_back_since: Option<SimTime>,
}

/// An action whose effect shows in the next readings.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pending {
    Delivery(TaskId),
    Report(TaskId),
}

impl WasteController {
    /// Creates a new incarnation of a robot, without knowledge beyond its briefing.
    ///
    /// # Panics
    /// If the setup has no such robot.
    fn new(robot: RobotId, setup: &Setup, map: &Arc<Map>) -> Self {
        let briefing = Briefing::new(robot, setup, map);
        Self {
            memory: Memory::new(robot, &briefing.own_spills, briefing.border),
            search_progress: 0,
            briefing,
            teammates: Teammates::default(),
            extremes: Extremes::default(),
            methodical: Methodical::default(),
            wander: Wander::default(),
            work: None,
            ways_to_site: BlockedWays::default(),
            navigator: Navigator::default(),
            status: Status::Going,
            position: None,
            facing: Facing::default(),
            realms: Realms::default(),
            sight: None,
            holding: false,
            load_of: None,
            pending: None,
            progressed: Vec::new(),
            stands_back_since: None,
        }
    }
}

impl MissionController for WasteController {
    fn perceive(
        &mut self,
        input: &ControllerInput<'_>,
        received: &[Arc<Broadcast>],
        perception: &mut Perception,
    ) {
        self.perceive(input.now, input.readings, received, perception);
    }

    fn choices(&self, input: &ControllerInput<'_>, applicable: &[bool], choices: &mut Vec<Choice>) {
        self.write_choices(input.now, input.readings, applicable, choices);
    }

    fn act(
        &mut self,
        input: &ControllerInput<'_>,
        active: Option<BehaviorId>,
        output: &mut StepOutput,
    ) {
        self.act(input.now, active, input.readings, output);
    }

    fn seconds(&self, _: Option<Vec2>, after: &[TaskId], task: TaskId) -> Option<f64> {
        self.cost_after(after, task)
    }

    fn place(&self, _: Option<Vec2>, task: TaskId) -> Option<Vec2> {
        self.place_of(task)
    }

    fn travel_s(&self, from: Option<Vec2>, task: TaskId) -> Option<f64> {
        self.place_of(task)
            .zip(from)
            .map(|(place, from)| self.travel_time_s(from, place))
    }

    fn shared_knowledge(&self, _: &ControllerInput<'_>, knowledge: &mut SharedKnowledge) {
        let known = self.memory.knowledge();
        match knowledge {
            SharedKnowledge::Items(old) => old.clone_from(known),
            SharedKnowledge::Nothing | SharedKnowledge::Open(_) => {
                *knowledge = SharedKnowledge::Items(known.clone())
            }
        }
    }

    fn position(&self, _: &ControllerInput<'_>) -> Option<Vec2> {
        self.position
    }

    fn is_laden(&self) -> bool {
        self.holding
    }
}

/// Returns the places as far as the robot knows them.
fn places<'a>(
    briefing: &'a Briefing,
    memory: &Memory,
    realms: &'a Realms,
) -> Option<KnownPlaces<'a>> {
    let locations = memory.locations()?;
    Some(briefing.map.places(&locations.value, realms))
}

/// The unit vector of a heading, cached because a robot mostly drives straight on.
#[derive(Clone, Copy, Debug)]
struct Facing {
    heading_rad: f32,
    ahead: Vec2,
}

impl Default for Facing {
    fn default() -> Self {
        Self {
            heading_rad: 0.0,
            ahead: Vec2::X,
        }
    }
}

impl Facing {
    fn ahead(&mut self, heading_rad: f32) -> Vec2 {
        if self.heading_rad.to_bits() != heading_rad.to_bits() {
            self.heading_rad = heading_rad;
            self.ahead = Vec2::from_angle(heading_rad);
        }
        self.ahead
    }
}
