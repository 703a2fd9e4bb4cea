//! The waste clean-up (thesis §4.1, DESIGN §7): behavior sets and knowledge. Pure.
//!
//! A tour:
//! - `briefing`: what a robot knows beforehand, with the `map`. `extremes`: what it learns about the border, by `compass`. `memory`: what it knows about the
//!   mission, from own sight and from hearsay. `teammates`: what it last heard of each of the others.
//! - `find`, `spill`, `report`: the behavior sets; `sight` and `views` are what the work on a spill sees, `sweep` is how it searches.
//! - `costs`: what each behavior would cost, for allocators that compare.
//! - `perceiving` and `acting`: the two halves of a step, which use them all.
//!
//! Decided here:
//! - Locations are known once each wall was sensed; a search that has not sensed all of them goes on.
//! - A spill is empty when most of it was seen without anything on it, and the robot came from the deposit or went there with
//!   nothing in sight. What lies under an obstacle is nobody's.
//! - Whoever finds a spill empty or out of reach that was so before, and knows of nothing that is left at the others, looks over all
//!   of the room that is nearer to this spill than to another: somebody may have strewn waste there. So nobody has to know how much
//!   there is. Each robot keeps for itself how far it has got.
//! - A spill to most of which, or to whose waste, a robot finds no way it leaves alone for three minutes, so that the next one has
//!   its turn, and tells nobody: it may be shut in itself. So with the report site, when every way to it is closed.
//! - Locations prove wrong only where the robot stands and senses something else. What it sees from outside, and an obstacle or
//!   wall in the way, prove nothing against them.
//! - An idle robot makes room for a teammate at work.
//! - A finder whose update was withdrawn stands back until a teammate searches, but no longer than a minute.
//! - Own sight beats hearsay of the same time; older sight gives way to newer hearsay, for the world changes. Only the
//!   locations do not: who found them, or sensed a spill where they say, keeps them against newer ones.

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

use crate::waste::data::WASTE;
use alliance_proto::ids::{BehaviorId, RobotId, TaskId};
use alliance_proto::mission::Lore;
use alliance_proto::scenario::Setup;
use alliance_proto::team::Broadcast;
use alliance_proto::time::SimTime;
use glam::Vec2;

use briefing::Briefing;
use extremes::Extremes;
use find::{Methodical, Wander};
use map::{Map, Places, Realms};
use memory::Memory;
use report::Ways;
use robot_agent::allocator::Choice;
use robot_agent::body::{Navigator, Status};
use robot_agent::mission::{Action, AgentMission, MissionMind, Moment, Perception, SharedMission};
use sight::Sight;
use spill::SpillWork;
use teammates::Teammates;

/// The clean-up's robot side.
pub const MIND: MissionMind = MissionMind {
    data: WASTE,
    shared: |setup| Arc::new(Team(Arc::new(Map::of(&setup.scenario)))),
};

/// What all robots of a run know beforehand.
#[derive(Debug)]
struct Team(Arc<Map>);

impl SharedMission for Team {
    fn mind(&self, robot: RobotId, setup: &Setup) -> Box<dyn AgentMission> {
        Box::new(WasteMission::new(robot, setup, &self.0))
    }

    fn planned_cost_ms(&self, setup: &Setup) -> Vec<Vec<Option<i64>>> {
        costs::planned_cost_ms(&setup.scenario, &setup.catalog)
    }
}

/// One robot's mind for the waste clean-up.
#[derive(Clone, Debug)]
struct WasteMission {
    briefing: Briefing,
    memory: Memory,
    teammates: Teammates,
    extremes: Extremes,
    methodical: Methodical,
    wander: Wander,
    work: Option<SpillWork>,
    ways_to_site: Ways,
    navigator: Navigator,
    status: Status,
    position: Option<Vec2>,
    facing: Facing,
    realms: Realms,
    /// The floor as the step sees it, where its places are known.
    sight: Option<Sight>,
    holding: bool,
    /// The set that picked up what the robot holds.
    load_of: Option<BehaviorId>,
    /// What it did in the last step and has not yet seen the effect of.
    pending: Option<Pending>,
    /// Effects on the world, seen but not yet reported to the motivational behaviors.
    progressed: Vec<TaskId>,
    /// Progress count on finding the locations.
    search_progress: u32,
    stands_back_since: Option<SimTime>,
}

/// An act whose effect shows in the next readings.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pending {
    Delivery(TaskId),
    Report(TaskId),
}

impl WasteMission {
    /// A new incarnation of that robot: it knows nothing but its briefing.
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
            ways_to_site: Ways::default(),
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

impl AgentMission for WasteMission {
    fn perceive(
        &mut self,
        moment: &Moment<'_>,
        heard: &[Arc<Broadcast>],
        perception: &mut Perception,
    ) {
        self.take_in(moment.now, moment.readings, heard, perception);
    }

    fn choices(&self, moment: &Moment<'_>, applicable: &[bool], choices: &mut Vec<Choice>) {
        self.offer(moment.now, moment.readings, applicable, choices);
    }

    fn act(&mut self, moment: &Moment<'_>, active: Option<BehaviorId>, action: &mut Action) {
        self.carry_out(moment.now, active, moment.readings, action);
    }

    fn lore(&self, lore: &mut Lore) {
        let known = self.memory.knowledge();
        match lore {
            Lore::Items(old) => old.clone_from(known),
            Lore::Nothing | Lore::Open(_) => *lore = Lore::Items(known.clone()),
        }
    }

    fn position(&self) -> Option<Vec2> {
        self.position
    }

    fn is_laden(&self) -> bool {
        self.holding
    }

    fn checkpoint(&self) -> Box<dyn AgentMission> {
        Box::new(self.clone())
    }
}

/// Where things are, as far as a robot knows.
fn places<'a>(briefing: &'a Briefing, memory: &Memory, realms: &'a Realms) -> Option<Places<'a>> {
    let locations = memory.locations()?;
    Some(briefing.map.places(&locations.value, realms))
}

/// Unit vector of a heading, kept for the next step: a robot mostly goes straight on.
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
            self.ahead = Vec2::new(libm::cosf(heading_rad), libm::sinf(heading_rad));
        }
        self.ahead
    }
}
