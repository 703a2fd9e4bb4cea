//! Observations of learners: numbers from -[`BOUND`] to [`BOUND`] in a fixed number and order, with their names.

use std::f32::consts::FRAC_PI_2;
use std::iter::repeat;
use std::slice;

use glam::Vec2;
use missions::{observe, push};
use proto::mission::SensorReading;
use proto::mission::items::{ItemsReading, MAX_SENSED_ITEMS, Zone};
use proto::readings::{Hit, Readings};
use scenario::{Room, Setup};

use super::external_agent::{ExternalAgent, Mate};

/// The largest number of teammates in an observation: the nearest with a received heartbeat.
const MATES: usize = 8;

/// The number of targets in an observation, nearest first.
const TARGETS: usize = 8;

/// The largest absolute value in an observation. Larger values are clipped; typical values are at most 1.
pub const BOUND: f32 = 2.0;

/// The features of a behavior set.
const SET_FEATURES: [&str; 8] = [
    "applicable",
    "active",
    "cost",
    "age",
    "claims",
    "there",
    "x",
    "y",
];

/// The time or cost, s, that maps to ½. Larger values approach 1.
const HALF_S: f64 = 30.0;

/// The receiver of an observation, number by number.
pub trait Row {
    /// Receives the next number and its name.
    fn put(&mut self, name: impl FnOnce() -> String, number: f32);

    #[inline(always)]
    fn flag(&mut self, name: &'static str, flag: bool) {
        self.put(|| name.to_owned(), f32::from(flag));
    }

    #[inline(always)]
    fn number(&mut self, name: &'static str, number: Option<f32>) {
        self.put(|| name.to_owned(), number.unwrap_or(0.0));
    }

    /// Receives an offset in units of `part_m`; `None` for no object.
    #[inline(always)]
    fn offset(&mut self, name: impl Fn() -> String, offset: Option<Vec2>, part_m: f32) {
        let [x, y] = offset.map_or([0.0; 2], |offset| (offset / part_m).to_array());
        self.put(|| format!("{}.there", name()), f32::from(offset.is_some()));
        self.put(|| format!("{}.x", name()), x);
        self.put(|| format!("{}.y", name()), y);
    }
}

/// The numbers of an observation. Those beyond the end are ignored.
pub struct Numbers<'a>(slice::IterMut<'a, f32>);

impl<'a> Numbers<'a> {
    pub fn new(numbers: &'a mut [f32]) -> Self {
        Self(numbers.iter_mut())
    }
}

impl Row for Numbers<'_> {
    #[inline(always)]
    fn put(&mut self, _: impl FnOnce() -> String, number: f32) {
        if let Some(place) = self.0.next() {
            *place = number.clamp(-BOUND, BOUND);
        }
    }
}

/// The names of the numbers of an observation.
#[derive(Default)]
pub struct Names(pub Vec<String>);

impl Row for Names {
    fn put(&mut self, name: impl FnOnce() -> String, _: f32) {
        self.0.push(name());
    }
}

/// Maps seconds to a number from 0 to 1.
fn squash(seconds: f64) -> f32 {
    (seconds / (seconds + HALF_S)) as f32
}

/// Writes the observation at level `decide`: the robot, its sets and its teammates. All robots have space for `sets`
/// sets.
pub fn decide(row: &mut impl Row, agent: &ExternalAgent, setup: &Setup, sets: usize) {
    let room = setup.scenario.room;
    let now_s = agent.now.as_secs_f64();
    let position = agent.position.map(|position| shares(&room, position));
    row.flag("position.works", position.is_some());
    row.number("position.x", position.map(|position| position.x));
    row.number("position.y", position.map(|position| position.y));
    row.flag("laden", agent.is_laden);
    row.number("time", Some((now_s / setup.scenario.limit_s) as f32));
    let part_m = room.size().max_element();
    let places = agent.places.iter().chain(repeat(&None));
    for (choice, place) in agent.choices.iter().zip(places) {
        let name = |what: &str| {
            let set = setup.catalog.behavior_name(choice.behavior);
            format!("{set}.{what}")
        };
        let is_active = agent.active == Some(choice.behavior);
        let age_s = agent.now.since(agent.since).as_secs_f64();
        row.put(|| name("applicable"), f32::from(choice.applicable));
        row.put(|| name("active"), f32::from(is_active));
        row.put(|| name("cost"), choice.cost_s.map_or(1.0, squash));
        row.put(|| name("age"), if is_active { squash(age_s) } else { 0.0 });
        let claims = agent.claims_of(choice.task) as f32 / choice.max_robots.max(1) as f32;
        row.put(|| name("claims"), claims);
        let offset = place.zip(agent.position).map(|(place, from)| place - from);
        let set = || setup.catalog.behavior_name(choice.behavior).to_owned();
        row.offset(set, offset, part_m);
    }
    for place in agent.choices.len()..sets {
        for what in SET_FEATURES {
            row.put(|| format!("no-set{place}.{what}"), 0.0);
        }
    }
    teammates(row, agent, setup);
}

/// Writes the nearest teammates with a received heartbeat. Teammates without a position come last.
fn teammates(row: &mut impl Row, agent: &ExternalAgent, setup: &Setup) {
    let part_m = setup.scenario.room.size().max_element();
    let most = setup.scenario.robots.len().saturating_sub(1).min(MATES);
    let mut nearest: [Option<(f32, Mate)>; MATES] = [None; MATES];
    let mut count = 0;
    for mate in agent.mates.iter().flatten() {
        let offset = agent
            .position
            .zip(mate.position)
            .map(|(own, mate)| mate - own);
        let distance_squared = offset.map_or(f32::INFINITY, Vec2::length_squared);
        let nearer = nearest[..count]
            .iter()
            .flatten()
            .filter(|(other, _)| *other <= distance_squared)
            .count();
        if nearer < most {
            count = (count + 1).min(most);
            nearest[nearer..count].rotate_right(1);
            nearest[nearer] = Some((distance_squared, *mate));
        }
    }
    let tasks = setup.catalog.tasks.len() as f32;
    for (place, mate) in nearest.iter().take(most).enumerate() {
        let mate = mate.map(|(_, mate)| mate);
        let offset = mate.and_then(|mate| Some(mate.position? - agent.position?));
        row.put(
            || format!("mate{place}.received"),
            f32::from(mate.is_some()),
        );
        row.offset(|| format!("mate{place}"), offset, part_m);
        let task = mate.and_then(|mate| mate.executing);
        let task = task.map_or(0.0, |task| (task + 1) as f32 / tasks);
        row.put(|| format!("mate{place}.task"), task);
        let age_s = mate.map(|mate| agent.now.since(mate.received).as_secs_f64());
        row.put(|| format!("mate{place}.age"), age_s.map_or(0.0, squash));
    }
}

/// Writes the observation at level `drive`: the sensor readings and the teammates.
pub fn drive(row: &mut impl Row, readings: &Readings, agent: &ExternalAgent, setup: &Setup) {
    let (room, sensors) = (setup.scenario.room, &setup.scenario.sensors);
    let pose = readings.pose;
    let position = pose.map(|pose| shares(&room, pose.position));
    row.flag("position.works", pose.is_some());
    row.number("position.x", position.map(|position| position.x));
    row.number("position.y", position.map(|position| position.y));
    // The simulation's own sine and cosine return the same bits on every machine.
    let ahead = pose.map(|pose| Vec2::from_angle(pose.heading_rad));
    row.number("heading.cos", ahead.map(|direction| direction.x));
    row.number("heading.sin", ahead.map(|direction| direction.y));
    let border_m = sensors.border_range_m;
    for (works, near, reading) in [
        ("front.works", "front.near", readings.front_border),
        ("side.works", "side.near", readings.side_border),
    ] {
        row.flag(works, reading.is_some());
        row.number(
            near,
            reading
                .flatten()
                .map(|distance_m| 1.0 - distance_m / border_m),
        );
    }
    let proximity = readings.proximity.unwrap_or_default();
    row.flag("proximity.works", readings.proximity.is_some());
    for (side, hits) in [
        ("ahead", proximity.ahead),
        ("left", proximity.left),
        ("right", proximity.right),
    ] {
        for (beam, hit) in hits.iter().enumerate() {
            beam_of(row, side, beam, *hit, sensors.avoidance_range_m);
        }
    }
    row.flag("ground.works", readings.ground.is_some());
    row.number(
        "ground.here",
        readings.ground.map(|ground| ground.here - 1.0),
    );
    row.number(
        "ground.ahead",
        readings.ground.map(|ground| ground.ahead - 1.0),
    );
    let capacity_j = setup
        .scenario
        .energy
        .as_ref()
        .map(|energy| energy.capacity_j);
    let energy = readings.energy_j.zip(capacity_j);
    row.flag("energy.works", energy.is_some());
    row.number("energy", energy.map(|(left, most)| left / most));
    row.number(
        "time",
        Some((agent.now.as_secs_f64() / setup.scenario.limit_s) as f32),
    );
    mission(row, &readings.mission, setup);
    teammates(row, agent, setup);
}

fn beam_of(row: &mut impl Row, side: &str, beam: usize, hit: Option<Hit>, range_m: f32) {
    let near = hit.map_or(0.0, |hit| 1.0 - hit.distance_m / range_m);
    row.put(|| format!("{side}{beam}.near"), near);
    let normal = hit.map_or(0.0, |hit| hit.normal_rad / (2.0 * FRAC_PI_2));
    row.put(|| format!("{side}{beam}.normal"), normal);
}

/// Writes the readings of the mission's devices; nothing for an unknown mission.
fn mission(row: &mut impl Row, sensed: &SensorReading, setup: &Setup) {
    let section = setup.catalog.mission.name();
    let range_m = setup.scenario.sensors.item_range_m;
    match (section, sensed) {
        ("waste", sensed) => items(row, sensed.items(), range_m),
        ("observe", sensed) => {
            let sensed = sensed.value::<observe::bus::SensorReading>();
            row.flag("targets.works", sensed.targets.is_some());
            let seen = sensed.targets.as_deref().unwrap_or_default();
            let part_m = setup.scenario.room.size().max_element();
            for place in 0..TARGETS {
                let offset = seen.get(place).map(|target| target.offset);
                row.offset(|| format!("target{place}"), offset, part_m);
            }
        }
        ("push", sensed) => {
            let sensed = sensed.value::<push::bus::SensorReading>();
            let bar = sensed.bar.flatten();
            row.flag("bar.works", sensed.bar.is_some());
            row.offset(
                || "bar".to_owned(),
                bar.map(|bar| bar.near_end),
                setup.scenario.room.size().max_element(),
            );
            row.number("bar.lead", bar.map(|bar| bar.lead_m));
            let is_left = bar.map(|bar| f32::from(bar.end == push::bar::BarEnd::Left));
            row.number("bar.left", is_left);
            row.flag("touch.works", sensed.touch.is_some());
            row.flag("touch", sensed.touch == Some(true));
        }
        _ => {}
    }
}

fn items(row: &mut impl Row, sensed: &ItemsReading, range_m: f32) {
    row.flag("items.works", sensed.items.is_some());
    for place in 0..MAX_SENSED_ITEMS {
        let items = sensed.items.as_ref();
        let offset = items.and_then(|items| items.get(place).copied());
        row.offset(|| format!("item{place}"), offset, range_m);
    }
    row.flag("zone.works", sensed.zone.is_some());
    row.flag("zone.source", sensed.zone == Some(Zone::Source));
    row.flag("zone.target", sensed.zone == Some(Zone::Target));
    row.flag("site.works", sensed.at_site.is_some());
    row.flag("site", sensed.at_site == Some(true));
    row.flag("gripper.works", sensed.holding.is_some());
    row.flag("holding", sensed.holding == Some(true));
}

/// Returns a place in units of half the room's extents: from -1 to 1 in the room.
fn shares(room: &Room, place: Vec2) -> Vec2 {
    2.0 * (place - room.low()) / room.size() - Vec2::ONE
}
