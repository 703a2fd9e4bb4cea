//! What every robot of a scenario knows beforehand: its own body, and where things are *relative to the border*
//! (thesis §4.1.1.1). Not how much waste there is, nor the room's size, unless the scenario says so.

use crate::waste::data::BehaviorKind;
use crate::waste::data::WasteSection;
use std::sync::Arc;

use alliance_proto::ids::{BehaviorId, RobotId, TaskId};
use alliance_proto::mission::items::Locations;
use alliance_proto::scenario::{Catalog, Setup};
use alliance_proto::time::SimTime;
use glam::Vec2;
use smallvec::SmallVec;

use super::map::Map;
use robot_agent::body::Chassis;

/// What a robot knows beforehand.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Briefing {
    pub robot: RobotId,
    pub team_size: usize,
    pub catalog: Arc<Catalog>,
    pub map: Arc<Map>,
    /// Its behavior sets, in the order of `Catalog::behaviors_of`.
    pub own_behaviors: SmallVec<[OwnBehavior; 6]>,
    /// The spills that it has behavior sets for, in ascending order.
    pub own_spills: Vec<u16>,
    /// The border, where it is known beforehand.
    pub border: Option<Locations>,
    pub chassis: Chassis,
    /// How far from its center the robot reaches and senses waste, m.
    pub reach_m: f32,
    pub sight_m: f32,
    /// τ, the longest of the robot's own sets.
    pub silence: SimTime,
    /// 1/ρ, the longest of the robot's own sets.
    pub heartbeat: SimTime,
    pub spill_radius_m: f32,
    pub deposit_radius_m: f32,
    pub report_period: SimTime,
}

/// What a robot reads of one of its behaviors in every step, copied here because a look into the shared catalog is a cache miss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OwnBehavior {
    pub id: BehaviorId,
    pub task: TaskId,
    pub kind: BehaviorKind,
}

impl Briefing {
    pub fn new(robot: RobotId, setup: &Setup, map: &Arc<Map>) -> Self {
        let scenario = &setup.scenario;
        let waste = WasteSection::of(scenario);
        let own = &scenario.robots[robot.index()];
        let sets = setup.alliance.robots.get(&own.name).map(|own| &own.sets);
        let longest = |seconds: fn(&alliance_proto::scenario::BehaviorParams) -> f64| {
            let sets = sets.into_iter().flat_map(|sets| sets.values());
            SimTime::from_secs_f64(sets.map(seconds).fold(0.0, f64::max))
        };
        let own_behaviors = setup.catalog.behaviors_of(own).map(|id| {
            let spec = &setup.catalog.sets[id.index()];
            let (task, kind) = (spec.task, BehaviorKind::of(spec));
            OwnBehavior { id, task, kind }
        });
        let own_behaviors: SmallVec<[OwnBehavior; 6]> = own_behaviors.collect();
        let own_spill = |set: &OwnBehavior| match set.kind {
            BehaviorKind::MoveSpill(spill) => Some(spill),
            _ => None,
        };
        let own_spills: Vec<u16> = own_behaviors.iter().filter_map(own_spill).collect();
        let border = Locations {
            min: Vec2::ZERO,
            max: Vec2::new(scenario.room.width_m, scenario.room.height_m),
        };
        Self {
            robot,
            team_size: scenario.robots.len(),
            catalog: Arc::clone(&setup.catalog),
            map: Arc::clone(map),
            own_behaviors,
            own_spills,
            border: waste.border_known.then_some(border),
            chassis: Chassis::of(scenario, own),
            reach_m: scenario.body.radius_m + scenario.body.reach_m,
            sight_m: scenario.body.radius_m + scenario.sensors.item_range_m,
            silence: longest(|set| set.ceased_after_s),
            heartbeat: longest(|set| 1.0 / set.broadcast_rate_hz),
            spill_radius_m: waste.spill_radius_m,
            deposit_radius_m: waste.deposit.radius_m,
            report_period: SimTime::from_secs_f64(waste.report_period_s),
        }
    }
}
