//! Observations of learners: numbers from -[`BOUND`] to [`BOUND`] in a fixed number and order, with their names.

use std::f32::consts::FRAC_PI_2;
use std::iter::repeat;

use arrayvec::ArrayVec;
use glam::Vec2;
use missions::{observe, push};
use proto::mission::SensorReading;
use proto::mission::items::{ItemsReading, MAX_SENSED_ITEMS, Zone};
use proto::readings::{Hit, Readings};
use scenario::{Energy, Room, Setup};

use super::external_agent::{ExternalAgent, Mate};

/// The largest number of teammates in an observation: the nearest with a received heartbeat.
const MATES: usize = 8;

/// The number of targets in an observation, nearest first.
const TARGETS: usize = 8;

/// The largest absolute value in an observation. Larger values are clipped; typical values are at most 1.
pub const BOUND: f32 = 2.0;

/// The features of a behavior set, without its offset.
const SET_FEATURES: [&str; 5] = ["applicable", "active", "cost", "age", "claims"];

/// The time or cost, s, that maps to ½. Larger values approach 1.
const HALF_S: f64 = 30.0;

/// The receiver of an observation, some numbers at a time.
pub trait Row {
    /// Receives the next numbers and their names.
    fn put<const N: usize>(&mut self, names: impl FnOnce() -> [String; N], numbers: [f32; N]);

    /// Receives numbers like [`Row::put`] whose absolute value is at most [`BOUND`].
    fn put_bounded<const N: usize>(
        &mut self,
        names: impl FnOnce() -> [String; N],
        numbers: [f32; N],
    );

    #[inline(always)]
    fn flag(&mut self, name: &'static str, flag: bool) {
        self.put_bounded(|| [name.to_owned()], [f32::from(flag)]);
    }

    /// Receives numbers of a device; zeros for `None`.
    #[inline(always)]
    fn numbers<const N: usize>(&mut self, names: [&'static str; N], numbers: Option<[f32; N]>) {
        self.put(|| names.map(str::to_owned), numbers.unwrap_or([0.0; N]));
    }

    /// Receives whether an object is there, and its offset in units of `part_m`; `None` for no object.
    #[inline(always)]
    fn offset(&mut self, name: impl Fn() -> String, offset: Option<Vec2>, part_m: f32) {
        let names = || names_of(&name(), ["there", "x", "y"]);
        match offset {
            Some(offset) => self.put(names, [1.0, offset.x / part_m, offset.y / part_m]),
            None => self.put_bounded(names, [0.0; 3]),
        }
    }
}

/// The numbers of an observation. Those beyond the end are ignored.
pub struct Numbers<'a>(pub &'a mut [f32]);

impl Row for Numbers<'_> {
    #[inline(always)]
    fn put<const N: usize>(&mut self, names: impl FnOnce() -> [String; N], numbers: [f32; N]) {
        self.put_bounded(names, numbers.map(|number| number.clamp(-BOUND, BOUND)));
    }

    #[inline(always)]
    fn put_bounded<const N: usize>(&mut self, _: impl FnOnce() -> [String; N], numbers: [f32; N]) {
        if let Some(next) = self.0.split_off_mut(..N) {
            next.copy_from_slice(&numbers);
        }
    }
}

/// The names of the numbers of an observation.
#[derive(Default)]
pub struct Names(pub Vec<String>);

impl Row for Names {
    fn put<const N: usize>(&mut self, names: impl FnOnce() -> [String; N], _: [f32; N]) {
        self.0.extend(names());
    }

    fn put_bounded<const N: usize>(
        &mut self,
        names: impl FnOnce() -> [String; N],
        numbers: [f32; N],
    ) {
        self.put(names, numbers);
    }
}

/// Returns the names of numbers that describe one object.
fn names_of<const N: usize>(object: &str, what: [&str; N]) -> [String; N] {
    what.map(|what| format!("{object}.{what}"))
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
    row.numbers(["position.x", "position.y"], position);
    row.flag("laden", agent.is_laden);
    let time = (now_s / setup.scenario.limit_s) as f32;
    row.numbers(["time"], Some([time]));
    let part_m = room.size().max_element();
    let places = agent.places.iter().chain(repeat(&None));
    for (choice, place) in agent.choices.iter().zip(places) {
        let set = || setup.catalog.behavior_name(choice.behavior).to_owned();
        let is_active = agent.active == Some(choice.behavior);
        let age_s = agent.now.since(agent.since).as_secs_f64();
        let numbers = [
            f32::from(choice.applicable),
            f32::from(is_active),
            choice.cost_s.map_or(1.0, squash),
            if is_active { squash(age_s) } else { 0.0 },
            agent.claims_of(choice.task) as f32 / choice.max_robots.max(1) as f32,
        ];
        row.put(|| names_of(&set(), SET_FEATURES), numbers);
        let offset = place.zip(agent.position).map(|(place, from)| place - from);
        row.offset(set, offset, part_m);
    }
    for place in agent.choices.len()..sets {
        let set = || format!("no-set{place}");
        row.put(|| names_of(&set(), SET_FEATURES), [0.0; SET_FEATURES.len()]);
        row.offset(set, None, part_m);
    }
    teammates(row, agent, setup);
}

/// Writes the nearest teammates with a received heartbeat. Teammates without a position come last.
fn teammates(row: &mut impl Row, agent: &ExternalAgent, setup: &Setup) {
    let part_m = setup.scenario.room.size().max_element();
    let most = setup.scenario.robots.len().saturating_sub(1).min(MATES);
    let mut nearest: ArrayVec<(f32, &Mate), MATES> = ArrayVec::new();
    for mate in agent.mates.iter().flatten() {
        let offset = agent
            .position
            .zip(mate.position)
            .map(|(own, mate)| mate - own);
        let distance_squared = offset.map_or(f32::INFINITY, Vec2::length_squared);
        let is_nearer = |(other, _): &&(f32, &Mate)| *other <= distance_squared;
        let nearer = nearest.iter().filter(is_nearer).count();
        if nearer < most {
            nearest.truncate(most - 1);
            nearest.insert(nearer, (distance_squared, mate));
        }
    }
    let tasks = setup.catalog.tasks.len() as f32;
    for place in 0..most {
        let mate = nearest.get(place).map(|(_, mate)| *mate);
        let name = || format!("mate{place}");
        let received = f32::from(mate.is_some());
        row.put_bounded(|| names_of(&name(), ["received"]), [received]);
        let offset = mate.and_then(|mate| Some(mate.position? - agent.position?));
        row.offset(name, offset, part_m);
        let task = mate.and_then(|mate| mate.executing);
        let age_s = mate.map(|mate| agent.now.since(mate.received).as_secs_f64());
        let numbers = [
            task.map_or(0.0, |task| (task + 1) as f32 / tasks),
            age_s.map_or(0.0, squash),
        ];
        row.put(|| names_of(&name(), ["task", "age"]), numbers);
    }
}

/// Writes the observation at level `drive`: the sensor readings and the teammates.
pub fn drive(row: &mut impl Row, readings: &Readings, agent: &ExternalAgent, setup: &Setup) {
    let (room, sensors) = (setup.scenario.room, &setup.scenario.sensors);
    let pose = readings.pose;
    let position = pose.map(|pose| shares(&room, pose.position));
    row.flag("position.works", pose.is_some());
    row.numbers(["position.x", "position.y"], position);
    // The simulation's own sine and cosine return the same bits on every machine.
    let ahead = pose.map(|pose| Vec2::from_angle(pose.heading_rad).to_array());
    row.numbers(["heading.cos", "heading.sin"], ahead);
    let near = |distance_m: f32| [1.0 - distance_m / sensors.border_range_m];
    row.flag("front.works", readings.front_border.is_some());
    row.numbers(["front.near"], readings.front_border.flatten().map(near));
    row.flag("side.works", readings.side_border.is_some());
    row.numbers(["side.near"], readings.side_border.flatten().map(near));
    row.flag("proximity.works", readings.proximity.is_some());
    let proximity = readings.proximity.unwrap_or_default();
    beams(row, "ahead", &proximity.ahead, sensors.avoidance_range_m);
    beams(row, "left", &proximity.left, sensors.avoidance_range_m);
    beams(row, "right", &proximity.right, sensors.avoidance_range_m);
    row.flag("ground.works", readings.ground.is_some());
    let ground = readings.ground;
    let ground = ground.map(|ground| [ground.here - 1.0, ground.ahead - 1.0]);
    row.numbers(["ground.here", "ground.ahead"], ground);
    let share = |energy: &Energy| Some([readings.energy_j? / energy.capacity_j]);
    let energy = setup.scenario.energy.as_ref().and_then(share);
    row.flag("energy.works", energy.is_some());
    row.numbers(["energy"], energy);
    let time = (agent.now.as_secs_f64() / setup.scenario.limit_s) as f32;
    row.numbers(["time"], Some([time]));
    mission(row, &readings.mission, setup);
    teammates(row, agent, setup);
}

/// Writes the hits of the beams on one side.
#[inline(always)]
fn beams(row: &mut impl Row, side: &str, hits: &[Option<Hit>], range_m: f32) {
    for (beam, hit) in hits.iter().enumerate() {
        let names = || names_of(&format!("{side}{beam}"), ["near", "normal"]);
        match hit {
            Some(hit) => {
                let near = 1.0 - hit.distance_m / range_m;
                row.put(names, [near, hit.normal_rad / (2.0 * FRAC_PI_2)]);
            }
            None => row.put_bounded(names, [0.0; 2]),
        }
    }
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
            row.numbers(["bar.lead"], bar.map(|bar| [bar.lead_m]));
            let is_left = bar.is_some_and(|bar| bar.end == push::bar::BarEnd::Left);
            row.flag("bar.left", is_left);
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
fn shares(room: &Room, place: Vec2) -> [f32; 2] {
    (2.0 * (place - room.low()) / room.size() - Vec2::ONE).to_array()
}
