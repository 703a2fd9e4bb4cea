//! What every robot of a scenario knows beforehand: its own body, and where things are *relative to the border*
//! (thesis §4.1.1.1). Not the room's size, nor how much waste there is.

use alliance_proto::ids::RobotId;
use alliance_proto::scenario::{Catalog, Setup};
use alliance_proto::team::Locations;
use alliance_proto::time::SimTime;
use glam::Vec2;

use crate::body::Chassis;

/// What a robot knows beforehand.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Briefing {
    pub robot: RobotId,
    pub team_size: usize,
    pub catalog: Catalog,
    pub chassis: Chassis,
    /// How far from its center the robot reaches and senses waste, m.
    pub reach_m: f32,
    pub sight_m: f32,
    /// τ, the longest of the robot's own sets.
    pub silence: SimTime,
    /// 1/ρ, the longest of the robot's own sets.
    pub heartbeat: SimTime,
    /// Centers as fractions of the border.
    spills: Vec<Vec2>,
    pub spill_radius_m: f32,
    deposit: Vec2,
    pub deposit_radius_m: f32,
    site_size: Vec2,
    pub report_period: SimTime,
}

/// Where things are, once the border is known, m.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Places {
    /// Centers of the spills, in the scenario's order.
    pub spills: Vec<Vec2>,
    /// Center of the deposit.
    pub deposit: Vec2,
    /// Corners of the report site.
    pub site_min: Vec2,
    pub site_max: Vec2,
}

impl Briefing {
    pub fn new(robot: RobotId, setup: &Setup) -> Self {
        let scenario = &setup.scenario;
        let waste = &scenario.waste;
        let own = &scenario.robots[robot.index()];
        let sets = setup.alliance.robots.get(&own.name).map(|own| &own.sets);
        let longest = |seconds: fn(&alliance_proto::scenario::SetParams) -> f64| {
            let sets = sets.into_iter().flat_map(|sets| sets.values());
            SimTime::from_secs_f64(sets.map(seconds).fold(0.0, f64::max))
        };
        Self {
            robot,
            team_size: scenario.robots.len(),
            catalog: Catalog::of(scenario),
            chassis: Chassis::of(scenario),
            reach_m: scenario.body.radius_m + scenario.body.reach_m,
            sight_m: scenario.body.radius_m + scenario.sensors.waste_range_m,
            silence: longest(|set| set.ceased_after_s),
            heartbeat: longest(|set| 1.0 / set.broadcast_rate_hz),
            spills: waste
                .spills
                .iter()
                .map(|spill| Vec2::new(spill.x_fraction, spill.y_fraction))
                .collect(),
            spill_radius_m: waste.spill_radius_m,
            deposit: Vec2::new(waste.deposit.x_fraction, waste.deposit.y_fraction),
            deposit_radius_m: waste.deposit.radius_m,
            site_size: Vec2::new(waste.report_site.width_m, waste.report_site.height_m),
            report_period: SimTime::from_secs_f64(waste.report_period_s),
        }
    }

    /// The number of spills.
    pub fn spill_count(&self) -> usize {
        self.spills.len()
    }

    /// Where things are in a border of these extremes.
    pub fn places(&self, border: &Locations) -> Places {
        let size = border.max - border.min;
        let place = |fraction: Vec2| border.min + fraction * size;
        let left = place(Vec2::new(0.0, 0.5));
        let half = Vec2::new(0.0, self.site_size.y / 2.0);
        Places {
            spills: self
                .spills
                .iter()
                .map(|&fraction| place(fraction))
                .collect(),
            deposit: place(self.deposit),
            site_min: (left - half).max(border.min),
            site_max: (left + half + Vec2::new(self.site_size.x, 0.0)).min(border.max),
        }
    }
}
