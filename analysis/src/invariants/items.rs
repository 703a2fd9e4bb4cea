//! Invariant: every item is in one place: on the floor, in one gripper, or at its goal, where it stays.

use scenario::Scenario;
use scenario::fault::Fault;
use scenario::ids::{ItemId, RobotId};
use scenario::mission::expected_properties::ExpectedProperties;

use super::{Item, WorldState, is_delivered};

/// Tolerance for rounding at the border, m.
const ROUNDING_M: f32 = 1e-3;

#[derive(Clone, Debug)]
pub struct Items {
    total: usize,
    /// `true` for each delivered item, by id.
    delivered: Vec<bool>,
    promises: ExpectedProperties,
}

impl Items {
    #[must_use]
    pub fn new(scenario: &Scenario) -> Self {
        let promises = scenario.mission().expected_properties(scenario);
        Self {
            total: promises.items,
            delivered: Vec::new(),
            promises,
        }
    }

    /// Checks the items after a tick. The error describes the violation.
    pub fn check(&mut self, scenario: &Scenario, state: &WorldState) -> Result<(), String> {
        let count = state.items.len();
        let most = self.total + added(scenario, state);
        if !(self.total..=most).contains(&count) {
            return Err(format!(
                "there are {count} items, but {} to {most} are expected",
                self.total
            ));
        }
        self.total = count;
        self.delivered.resize(count, false);
        for (id, (item, delivered)) in state.items.iter().zip(&mut self.delivered).enumerate() {
            check_carrier(scenario, state, id, item)?;
            check_place(scenario, id, item)?;
            let is_delivered = is_delivered(&self.promises, item);
            if *delivered && !is_delivered {
                return Err(format!("item-{id} has left its goal"));
            }
            *delivered = is_delivered;
        }
        for (rank, robot) in state.robots.iter().enumerate() {
            let Some(ItemId(id)) = robot.carrying else {
                continue;
            };
            let item = state.items.get(id as usize);
            if item.and_then(|item| item.carrier) != Some(RobotId(rank as u32)) {
                let name = &scenario.robots[rank].name;
                return Err(format!("{name} carries item-{id}, which is not with it"));
            }
            if !robot.present {
                let name = &scenario.robots[rank].name;
                return Err(format!("{name} carries item-{id} without a body"));
            }
        }
        Ok(())
    }
}

/// Returns the maximum number of items that faults have added in this tick.
fn added(scenario: &Scenario, state: &WorldState) -> usize {
    let now = state
        .faults
        .iter()
        .filter(|fault| fault.applied_ms == Some(state.now));
    now.map(|fault| match &fault.order.fault {
        Fault::Mission(fault) => scenario.mission().items_added(fault),
        _ => 0,
    })
    .sum()
}

fn check_carrier(
    scenario: &Scenario,
    state: &WorldState,
    id: usize,
    item: &Item,
) -> Result<(), String> {
    let Some(carrier) = item.carrier else {
        return Ok(());
    };
    let holds = state.robots[carrier.index()].carrying;
    if holds == Some(ItemId(id as u32)) {
        return Ok(());
    }
    let name = &scenario.robots[carrier.index()].name;
    Err(match holds {
        None => format!("item-{id} is with {name}, which carries nothing"),
        Some(other) => format!("item-{id} is with {name}, which carries {other}"),
    })
}

fn check_place(scenario: &Scenario, id: usize, item: &Item) -> Result<(), String> {
    let at = item.position;
    if scenario.room.to_border_m(at) >= -ROUNDING_M {
        Ok(())
    } else {
        Err(format!("item-{id} lies outside the border, at {at}"))
    }
}
