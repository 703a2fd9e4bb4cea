//! Starts of robots and places of missions that are drawn from the seed, for training on many layouts.
//!
//! The result is a plain scenario: a run that is exported and repeated needs no draws. Places of missions outside this
//! crate keep their values.

use glam::Vec2;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use scenario::rng::{Purpose, stream};
use scenario::{Problem, Room, Scenario, Setup, Start};
use world_server::mission::WorldKind;
use world_server::world::Places;

use crate::Registry;
use crate::push::data::PushSection;
use crate::service::data::ServiceSection;
use crate::waste::data::WasteSection;

/// The number of draws of one place, and of whole scenarios.
const PLACE_DRAWS: usize = 1_000;
const SCENARIO_DRAWS: usize = 200;

/// The gap between drawn robots, m.
const GAP_M: f32 = 0.01;

/// The properties of a scenario that are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Randomised {
    /// The start poses of the robots.
    pub start: bool,
    /// The stated places of the mission: points, deliveries and chargers; spills and deposits; bars.
    pub layout: bool,
}

impl Randomised {
    /// Reads the properties by name: `start` and `layout`.
    ///
    /// # Errors
    /// Names the first unknown property.
    pub fn from_names<'n>(names: impl IntoIterator<Item = &'n str>) -> Result<Self, Problem> {
        let mut all = Self::default();
        for name in names {
            match name {
                "start" => all.start = true,
                "layout" => all.layout = true,
                other => {
                    let what = format!("there is no '{other}'");
                    let remedy = "use 'start' or 'layout'";
                    return Err(Problem::at(["randomise"], what, remedy));
                }
            }
        }
        Ok(all)
    }

    #[must_use]
    pub fn is_empty(self) -> bool {
        self == Self::default()
    }

    /// Returns the scenario with these properties drawn from the seed. All checks of a scenario hold for the result.
    ///
    /// # Errors
    /// If no draw of many passes the checks. The error contains the reason of the last one.
    pub fn draw(
        self,
        scenario: &Scenario,
        seed: u64,
        registry: &Registry,
    ) -> Result<Scenario, Problem> {
        if self.is_empty() {
            return Ok(scenario.clone());
        }
        let mut starts = stream(seed, Purpose::Start);
        let mut layouts = stream(seed, Purpose::Layout);
        let mut why = String::new();
        for _ in 0..SCENARIO_DRAWS {
            match self.draw_once(scenario, &mut starts, &mut layouts, registry) {
                Ok(drawn) => return Ok(drawn),
                Err(reason) => why = reason,
            }
        }
        let what = format!("the last of {SCENARIO_DRAWS} draws of a scenario fails: {why}");
        let remedy = "enlarge the room, or draw less";
        Err(Problem::at(["randomise"], what, remedy))
    }

    /// Returns the setup of a run with that seed, with these properties drawn.
    ///
    /// # Errors
    /// See [`Randomised::draw`].
    pub fn draw_setup(
        self,
        setup: &Setup,
        seed: u64,
        registry: &Registry,
    ) -> Result<Setup, Problem> {
        if self.is_empty() {
            let mut setup = setup.clone();
            setup.seed = seed;
            return Ok(setup);
        }
        let scenario = self.draw(&setup.scenario, seed, registry)?;
        let mut drawn = Setup::resolve(scenario, seed, None)?.setup;
        drawn.profile = setup.profile.clone();
        Ok(drawn)
    }

    fn draw_once(
        self,
        scenario: &Scenario,
        starts: &mut ChaCha8Rng,
        layouts: &mut ChaCha8Rng,
        registry: &Registry,
    ) -> Result<Scenario, String> {
        let mut drawn = scenario.clone();
        let places = Places::of(&drawn);
        let no_room = |what: &str| format!("there is no free place for {what}");
        if self.layout {
            draw_layout(&mut drawn, &places, layouts).map_err(no_room)?;
        }
        let world = registry.worlds().find(&drawn);
        let world = world.map_err(|error| error.to_string())?;
        if self.start {
            draw_starts(&mut drawn, &places, &world, starts).map_err(no_room)?;
        }
        let checked = drawn.checked(&registry.vocabulary());
        let checked = checked.map_err(|problem| problem.to_string())?;
        match world.start_poses(&checked) {
            Ok(_) => Ok(checked),
            Err(error) => Err(error.describe(&checked)),
        }
    }
}

/// Draws a pose for each robot. On failure returns what found no place.
fn draw_starts(
    scenario: &mut Scenario,
    places: &Places,
    world: &WorldKind,
    rng: &mut ChaCha8Rng,
) -> Result<(), &'static str> {
    let bars = (world.bars)(scenario);
    let (room, radius_m) = (scenario.room, scenario.body.radius_m);
    let mut taken: Vec<Vec2> = Vec::new();
    for robot in &mut scenario.robots {
        let apart = |place: Vec2| {
            let bodies = taken.iter();
            places.can_stand(place)
                && bodies
                    .copied()
                    .all(|other| other.distance(place) >= 2.0 * radius_m + GAP_M)
                && bars
                    .iter()
                    .all(|bar| bar.distance_to_point(place) >= radius_m + GAP_M)
        };
        let place = draw_place(&room, radius_m, rng, apart).ok_or("a robot")?;
        taken.push(place);
        robot.start = Some(Start {
            x_m: place.x,
            y_m: place.y,
            heading_deg: rng.random_range(-180.0..180.0_f32).round(),
        });
    }
    Ok(())
}

/// Draws the places of the mission. On failure returns what found no place.
fn draw_layout(
    scenario: &mut Scenario,
    places: &Places,
    rng: &mut ChaCha8Rng,
) -> Result<(), &'static str> {
    let (room, radius_m) = (scenario.room, scenario.body.radius_m);
    if let Some(section) = scenario.mission.values_mut::<ServiceSection>() {
        draw_service(section, &room, radius_m, places, rng)
    } else if let Some(section) = scenario.mission.values_mut::<WasteSection>() {
        draw_waste(section, &room, rng)
    } else if let Some(section) = scenario.mission.values_mut::<PushSection>() {
        draw_push(section, &room, radius_m, rng);
        Ok(())
    } else {
        // The targets of the mission observe already depend on the seed.
        Ok(())
    }
}

/// Draws points, deliveries and chargers where a robot can stand. Things at the same place stay together.
fn draw_service(
    section: &mut ServiceSection,
    room: &Room,
    radius_m: f32,
    places: &Places,
    rng: &mut ChaCha8Rng,
) -> Result<(), &'static str> {
    let mut drawn: Vec<(Vec2, Vec2)> = Vec::new();
    let mut moved = |old: Vec2, what: &'static str| -> Result<Vec2, &'static str> {
        if let Some((_, new)) = drawn.iter().find(|(other, _)| *other == old) {
            return Ok(*new);
        }
        let is_free = |place: Vec2| {
            let mut others = drawn.iter();
            places.can_stand(place)
                && others.all(|(_, other)| other.distance(place) >= 2.0 * radius_m)
        };
        let new = draw_place(room, radius_m, rng, is_free).ok_or(what)?;
        drawn.push((old, new));
        Ok(new)
    };
    for point in &mut section.points {
        let place = moved(Vec2::new(point.x_m, point.y_m), "a point")?;
        (point.x_m, point.y_m) = (place.x, place.y);
        if let Some(delivery) = &mut point.deliver_to {
            *delivery = moved(Vec2::from(*delivery), "a delivery")?.to_array();
        }
    }
    for charger in &mut section.chargers {
        let place = moved(charger.place(), "a charger")?;
        (charger.x_m, charger.y_m) = (place.x, place.y);
    }
    Ok(())
}

/// Draws spills and deposits as discs inside the room that do not overlap.
fn draw_waste(
    section: &mut WasteSection,
    room: &Room,
    rng: &mut ChaCha8Rng,
) -> Result<(), &'static str> {
    let mut discs: Vec<(Vec2, f32)> = Vec::new();
    let mut fractions = |radius_m: f32, what: &'static str| -> Result<Vec2, &'static str> {
        let is_free = |place: Vec2| {
            let mut others = discs.iter();
            others.all(|(other, other_m)| other.distance(place) >= radius_m + other_m)
        };
        let place = draw_place(room, radius_m, rng, is_free).ok_or(what)?;
        discs.push((place, radius_m));
        Ok(((place - room.low()) / room.size()).clamp(Vec2::ZERO, Vec2::ONE))
    };
    let (deposit_m, spill_m) = (section.deposit.radius_m, section.spill_radius_m);
    let first = fractions(deposit_m, "a deposit")?;
    (section.deposit.x_fraction, section.deposit.y_fraction) = first.into();
    for deposit in &mut section.further_deposits {
        (deposit.x_fraction, deposit.y_fraction) = fractions(deposit_m, "a deposit")?.into();
    }
    for spill in &mut section.spills {
        (spill.x_fraction, spill.y_fraction) = fractions(spill_m, "a spill")?.into();
    }
    Ok(())
}

/// Draws the bars, which keep their ways to the goals. The check of the scenario finds bars that overlap.
fn draw_push(section: &mut PushSection, room: &Room, radius_m: f32, rng: &mut ChaCha8Rng) {
    let (low, high) = (room.low(), room.high());
    let half_m = section.length_m / 2.0 + section.half_width_m;
    let first_m = low.x + section.half_width_m + 2.0 * radius_m + GAP_M;
    for bar in &mut section.bars {
        let way_m = bar.goal_x_m - bar.x_m;
        let last_m = high.x - section.half_width_m - section.skew_m - way_m - GAP_M;
        if first_m < last_m {
            bar.x_m = rng.random_range(first_m..last_m);
            bar.goal_x_m = bar.x_m + way_m;
        }
        let (bottom_m, top_m) = (low.y + half_m + GAP_M, high.y - half_m - GAP_M);
        if bottom_m < top_m {
            bar.y_m = rng.random_range(bottom_m..top_m);
        }
    }
}

/// Draws a place at least `inset_m` from the border, uniformly among those for which `will_do` holds. Returns `None` after
/// [`PLACE_DRAWS`] unsuitable ones.
fn draw_place(
    room: &Room,
    inset_m: f32,
    rng: &mut ChaCha8Rng,
    will_do: impl Fn(Vec2) -> bool,
) -> Option<Vec2> {
    let inset = Vec2::splat(inset_m).min(room.size() / 2.0);
    let (low, size) = (room.low() + inset, room.size() - 2.0 * inset);
    let mut draws = (0..PLACE_DRAWS).map(|_| low + size * Vec2::new(rng.random(), rng.random()));
    draws.find(|place| will_do(*place))
}
