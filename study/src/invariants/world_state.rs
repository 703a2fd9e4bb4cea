//! A run as it is after a tick.

use alliance_proto::control::FaultStatus;
use alliance_proto::ids::{ItemId, RobotId, Tick};
use alliance_proto::mission::promises::Promises;
use alliance_proto::readings::Pose;
use alliance_proto::telemetry::Motivation;
use alliance_proto::time::SimTime;
use alliance_proto::view::View;
use glam::Vec2;
use world_server::barrier::Presence;
use world_server::simulation::Simulation;
use world_server::world::{Component, ComponentId, Shape};

/// What there is to look at.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldState {
    /// The tick that has ended.
    pub tick: Tick,
    /// Its simulated time.
    pub now: SimTime,
    /// By rank.
    pub robots: Vec<RobotState>,
    /// By id.
    pub items: Vec<Item>,
    /// All rectangles on the floor.
    pub rectangles: Vec<Rectangle>,
    /// All faults of the run so far.
    pub faults: Vec<FaultStatus>,
}

/// A robot.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotState {
    /// Whether it has a body in the world.
    pub present: bool,
    /// Whether its agent takes part.
    pub takes_part: bool,
    /// Where its body is.
    pub pose: Pose,
    /// How fast it moved, m/s.
    pub speed_m_s: f32,
    /// Energy left, J; `None` where energy is not simulated.
    pub energy_j: Option<f32>,
    /// What its gripper holds.
    pub carrying: Option<ItemId>,
    /// As last reported.
    pub motivations: Vec<Motivation>,
}

/// An item.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Item {
    /// Where it lies; while it is carried, where it was picked up, m.
    pub position: Vec2,
    /// Who carries it.
    pub carrier: Option<RobotId>,
}

/// A rectangle on the floor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    /// What tells it from others; never given twice.
    pub id: ComponentId,
    /// Lower left corner, m.
    pub min: Vec2,
    /// Upper right corner, m.
    pub max: Vec2,
    /// Whether nothing can enter it.
    pub solid: bool,
}

impl WorldState {
    /// What the last tick has left.
    #[must_use]
    pub fn of(simulation: &Simulation) -> Self {
        let (world, barrier) = (simulation.world(), simulation.barrier());
        let tick = simulation.tick().saturating_sub(1);
        let mut seen = View::default();
        world.mission().show(world, &mut seen);
        let robots = barrier.robots().map(|robot| RobotState {
            present: world.is_present(robot),
            takes_part: barrier.presence(robot) == Presence::Present,
            pose: world.pose(robot),
            speed_m_s: world.speed_m_s(robot),
            energy_j: world.energy_j(robot),
            carrying: world.mission().load(robot),
            motivations: simulation.motivations(robot).to_vec(),
        });
        let items = seen.items.iter().map(|item| Item {
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

/// Whether the item lies where it is to be brought.
#[must_use]
pub fn is_delivered(promises: &Promises, item: &Item) -> bool {
    let mut goals = promises.goals.iter();
    item.carrier.is_none() && goals.any(|goal| goal.contains(item.position))
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
