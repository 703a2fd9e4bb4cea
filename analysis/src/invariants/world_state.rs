//! The state of a run after a tick.

use glam::Vec2;
use proto::control::FaultStatus;
use proto::readings::Pose;
use proto::telemetry::Motivation;
use proto::view::View;
use scenario::ids::{ItemId, RobotId, Tick};
use scenario::mission::expected_properties::ExpectedProperties;
use scenario::time::SimTime;
use world_server::barrier::Presence;
use world_server::simulation::Simulation;
use world_server::world::{Component, ComponentId, Shape};

/// The state that the invariants check.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldState {
    /// The tick that has ended.
    pub tick: Tick,
    pub now: SimTime,
    pub robots: Vec<RobotState>,
    pub items: Vec<Item>,
    pub rectangles: Vec<Rectangle>,
    pub faults: Vec<FaultStatus>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct RobotState {
    /// `true` if the robot has a body in the world.
    pub present: bool,
    /// `true` if the robot's agent takes part.
    pub takes_part: bool,
    pub pose: Pose,
    pub speed_m_s: f32,
    /// Energy left, J; `None` if energy is not simulated.
    pub energy_j: Option<f32>,
    pub carrying: Option<ItemId>,
    /// The motivations as last reported.
    pub motivations: Vec<Motivation>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Item {
    /// The position, m; for a carried item, the position where it was picked up.
    pub position: Vec2,
    pub carrier: Option<RobotId>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    /// A unique id, never reused.
    pub id: ComponentId,
    /// Lower left corner, m.
    pub min: Vec2,
    /// Upper right corner, m.
    pub max: Vec2,
    /// `true` if bodies cannot enter.
    pub solid: bool,
}

impl WorldState {
    /// Reads the state after the last tick.
    #[must_use]
    pub fn from_simulation(simulation: &Simulation) -> Self {
        let (world, barrier) = (simulation.world(), simulation.barrier());
        let tick = simulation.tick().saturating_sub(1);
        let mut view = View::default();
        world.mission().add_to_view(world, &mut view);
        let robots = barrier.robots().map(|robot| RobotState {
            present: world.is_present(robot),
            takes_part: barrier.presence(robot) == Presence::Present,
            pose: world.pose(robot),
            speed_m_s: world.speed_m_s(robot),
            energy_j: world.energy_j(robot),
            carrying: world.mission().load(robot),
            motivations: simulation.motivations(robot).to_vec(),
        });
        let items = view.items.iter().map(|item| Item {
            position: item.position,
            carrier: item.carrier,
        });
        Self {
            tick,
            now: SimTime(tick * simulation.setup().scenario.step_ms),
            robots: robots.collect(),
            items: items.collect(),
            rectangles: world.obstacles().iter().filter_map(rectangle).collect(),
            faults: simulation.faults(),
        }
    }
}

/// Returns whether an item lies at one of its goals.
#[must_use]
pub fn is_delivered(promises: &ExpectedProperties, item: &Item) -> bool {
    item.carrier.is_none() && promises.goals.contain(item.position)
}

fn rectangle(component: &Component) -> Option<Rectangle> {
    let Shape::Rectangle { half_size_m } = component.shape else {
        return None;
    };
    let center = component.pose.position;
    Some(Rectangle {
        id: component.id,
        min: center - half_size_m,
        max: center + half_size_m,
        solid: component.penetrability.is_solid(),
    })
}
