//! Checks of `[waste]`.

use glam::Vec2;
use scenario::limits::{FRACTION, LENGTH, TIME, TIME_OR_ZERO, WIDEST_M, check_names, closed};
use scenario::{KeyPath, Obstacle, Problem, Scenario};
use world_server::world::Places;

use super::{Spot, WasteSection, report_site};

/// The maximum number of spills of a scenario, and of deposits.
pub const MAX_SPILLS: usize = scenario::MAX_TASKS;
pub(super) const MAX_ITEMS: u32 = 1000;
/// The maximum number of items of all spills, and of all items that a repeated fault adds.
pub(crate) const MAX_ITEMS_TOTAL: u32 = 10_000_000;

pub(super) fn check(scenario: &Scenario) -> Result<(), Problem> {
    // The robots' maps of the floor have no room for more.
    scenario.room.check(WIDEST_M)?;
    let waste = WasteSection::of(scenario);
    let at = KeyPath::new(["waste"]);
    let spills = at.key("spills");
    check_names(
        &spills,
        waste.spills.iter().map(|spill| spill.name.as_str()),
        MAX_SPILLS,
    )?;
    for (index, spill) in waste.spills.iter().enumerate() {
        let at = spills.index(index);
        closed(0.0, f64::from(MAX_ITEMS), "").check(at.key("items"), spill.items)?;
        fractions(&at, spill.x_fraction, spill.y_fraction)?;
    }
    let items: u32 = waste.spills.iter().map(|spill| spill.items).sum();
    if items > MAX_ITEMS_TOTAL {
        let what = format!("{items} items in all");
        let remedy = format!("give at most {MAX_ITEMS_TOTAL}");
        return Err(Problem::at(spills, what, remedy));
    }
    LENGTH.check(at.key("spill_radius_m"), waste.spill_radius_m)?;
    LENGTH.check(at.key("item_radius_m"), waste.item_radius_m)?;
    if waste.item_radius_m > waste.spill_radius_m {
        let what = format!(
            "an item of radius {} m is larger than a spill",
            waste.item_radius_m
        );
        let remedy = format!(
            "it must be at most spill_radius_m, {} m",
            waste.spill_radius_m
        );
        return Err(Problem::at(at.key("item_radius_m"), what, remedy));
    }
    let deposit = at.key("deposit");
    LENGTH.check(deposit.key("radius_m"), waste.deposit.radius_m)?;
    fractions(&deposit, waste.deposit.x_fraction, waste.deposit.y_fraction)?;
    let further = at.key("further_deposits");
    if waste.further_deposits.len() >= MAX_SPILLS {
        let what = format!("{} entries", waste.further_deposits.len());
        let remedy = format!("give at most {}", MAX_SPILLS - 1);
        return Err(Problem::at(further, what, remedy));
    }
    for (index, spot) in waste.further_deposits.iter().enumerate() {
        fractions(&further.index(index), spot.x_fraction, spot.y_fraction)?;
    }
    let site = at.key("report_site");
    LENGTH.check(site.key("width_m"), waste.report_site.width_m)?;
    LENGTH.check(site.key("height_m"), waste.report_site.height_m)?;
    TIME_OR_ZERO.check(site.key("color_s"), waste.report_site.color_s)?;
    TIME.check(at.key("report_period_s"), waste.report_period_s)?;
    lasting(waste, at.key("duration_s"))
}

/// Checks a place as fractions of the room.
fn fractions(at: &KeyPath, x_fraction: f32, y_fraction: f32) -> Result<(), Problem> {
    FRACTION.check(at.key("x_fraction"), x_fraction)?;
    FRACTION.check(at.key("y_fraction"), y_fraction)
}

/// Checks that obstacles leave room in each spill and deposit for an item that a robot can grip, and in the report
/// site for a robot.
pub(super) fn check_places(scenario: &Scenario) -> Result<(), Problem> {
    if !scenario.obstacles.iter().any(Obstacle::is_solid) {
        return Ok(());
    }
    let waste = WasteSection::of(scenario);
    let places = Places::of(scenario);
    let full = |at: KeyPath, what: String| Err(Problem::at(at, what, "move it or the obstacles"));
    let takes_an_item = |spot: Spot, radius_m: f32| {
        let center = spot.in_room(&scenario.room);
        let fits = |place: Vec2| {
            place.distance(center) <= radius_m && places.can_be_gripped(place, waste.item_radius_m)
        };
        places
            .any([center - radius_m, center + radius_m], fits)
            .is_some()
    };
    let at = KeyPath::new(["waste"]);
    for (index, spill) in waste.spills.iter().enumerate() {
        if !takes_an_item(spill.spot(), waste.spill_radius_m) {
            let at = at.key("spills").index(index);
            let what = format!(
                "obstacles leave no room in spill '{}' for an item",
                spill.name
            );
            return full(at, what);
        }
    }
    for (index, spot) in waste.deposits().enumerate() {
        if !takes_an_item(spot, waste.deposit.radius_m) {
            let at = match index {
                0 => at.key("deposit"),
                _ => at.key("further_deposits").index(index - 1),
            };
            return full(
                at,
                "obstacles leave no room in the deposit for an item".to_owned(),
            );
        }
    }
    match places.any(report_site(scenario), |place| places.can_stand(place)) {
        Some(_) => Ok(()),
        None => {
            let what = "obstacles leave no room in the report site for a robot";
            full(at.key("report_site"), what.to_owned())
        }
    }
}

/// Checks `duration_s`, which only foraging allows.
fn lasting(waste: &WasteSection, at: KeyPath) -> Result<(), Problem> {
    let Some(duration_s) = waste.duration_s else {
        return Ok(());
    };
    TIME.check(&at, duration_s)?;
    if !waste.respawn {
        let what = "the clean-up ends when all items are delivered";
        let remedy = "leave it out, or write respawn = true";
        return Err(Problem::at(at, what, remedy));
    }
    Ok(())
}
