//! The initial knowledge of a robot: its own body, and the places *relative to the border* (thesis §4.1.1.1). The
//! amount of waste is unknown, and the size of the room is known only if the scenario allows it.

use crate::waste::data::BehaviorKind;
use crate::waste::data::WasteSection;
use std::sync::Arc;

use proto::mission::items::Locations;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;
use scenario::{Catalog, Setup};
use smallvec::SmallVec;

use super::map::Map;
use robot_agent::body::Chassis;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Briefing {
    pub robot: RobotId,
    pub team_size: usize,
    pub catalog: Arc<Catalog>,
    pub map: Arc<Map>,
    /// The robot's own behavior sets, in the order of `Catalog::behaviors_of`.
    pub own_behaviors: SmallVec<[OwnBehavior; 6]>,
    /// The spills for which the robot has behavior sets, in ascending order.
    pub own_spills: Vec<u32>,
    /// The border, if the scenario makes it known beforehand.
    pub border: Option<Locations>,
    pub chassis: Chassis,
    /// The reach of the gripper and the range of the waste sensor, both from the robot's center, m.
    pub reach_m: f32,
    pub sight_m: f32,
    /// The time τ until a silent teammate counts as ceased, the longest of the robot's own sets.
    pub silence: SimTime,
    /// The heartbeat interval 1/ρ, the longest of the robot's own sets.
    pub heartbeat: SimTime,
    pub spill_radius_m: f32,
    pub deposit_radius_m: f32,
    pub report_period: SimTime,
}

/// The data of an own behavior that each step reads. A copy, because the shared catalog costs a cache miss per access.
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
        let config = &scenario.robots[robot.index()];
        let sets = setup
            .alliance
            .robots
            .get(&config.name)
            .map(|robot| &robot.sets);
        let longest = |seconds: fn(&scenario::BehaviorParams) -> f64| {
            let sets = sets.into_iter().flat_map(|sets| sets.values());
            SimTime::from_secs_f64(sets.map(seconds).fold(0.0, f64::max))
        };
        let own_behaviors = setup.catalog.behaviors_of(config).map(|id| {
            let spec = &setup.catalog.sets[id.index()];
            let (task, kind) = (spec.task, BehaviorKind::from_spec(spec));
            OwnBehavior { id, task, kind }
        });
        let own_behaviors: SmallVec<[OwnBehavior; 6]> = own_behaviors.collect();
        let own_spill = |set: &OwnBehavior| match set.kind {
            BehaviorKind::MoveSpill(spill) => Some(spill),
            _ => None,
        };
        let own_spills: Vec<u32> = own_behaviors.iter().filter_map(own_spill).collect();
        let border = Locations {
            min: scenario.room.low(),
            max: scenario.room.high(),
        };
        Self {
            robot,
            team_size: scenario.robots.len(),
            catalog: Arc::clone(&setup.catalog),
            map: Arc::clone(map),
            own_behaviors,
            own_spills,
            border: waste.border_known.then_some(border),
            chassis: Chassis::new(scenario, config),
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
