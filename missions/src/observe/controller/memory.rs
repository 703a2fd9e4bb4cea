//! A robot's memory of near targets and near teammates, bounded in size.

use arrayvec::ArrayVec;
use glam::Vec2;
use prefetch::{Layer, prefetch, prefetch_start};
use scenario::ids::RobotId;
use scenario::time::SimTime;

use crate::observe::bus::{MAX_SENSED_TARGETS, Sighting};

const MOST_TARGETS: usize = 2 * MAX_SENSED_TARGETS;
const MOST_TEAMMATES: usize = 12;
/// The time after which an old sighting is removed.
const TRACK_LIFETIME: SimTime = SimTime(10_000);
/// The time for which a teammate's message counts. Heartbeats repeat it each second.
const MESSAGE_LIFETIME: SimTime = SimTime(2_500);
/// The time between the two sightings that give a velocity.
const VELOCITY_INTERVAL: SimTime = SimTime(500);
/// The margin within the sensing range in which a target is certainly seen, m.
const CERTAIN_M: f32 = 0.3;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Track {
    last: Sighting,
    /// An older sighting, for the velocity.
    base: Sighting,
    velocity: Vec2,
    pub in_sight: bool,
    /// The time of the last sighting in a teammate's message.
    shared: Option<SimTime>,
}

#[derive(Clone, Debug, Default)]
pub(super) struct Memory {
    tracks: ArrayVec<Track, MOST_TARGETS>,
    /// The positions of teammates and the times of their messages, sorted by rank.
    teammates: ArrayVec<(RobotId, Vec2, SimTime), MOST_TEAMMATES>,
}

impl Track {
    fn new(sighting: Sighting) -> Self {
        Self {
            last: sighting,
            base: sighting,
            velocity: Vec2::ZERO,
            in_sight: false,
            shared: None,
        }
    }

    /// Returns the predicted position, for motion in a straight line.
    pub fn at(&self, now: SimTime) -> Vec2 {
        let past_s = now.since(self.last.when).as_secs_f64() as f32;
        self.last.at + self.velocity * past_s
    }

    /// Returns whether a teammate reports to see the target, too.
    pub fn is_shared(&self, now: SimTime) -> bool {
        self.shared
            .is_some_and(|shared| now.since(shared) <= MESSAGE_LIFETIME)
    }

    fn update(&mut self, sighting: Sighting, fastest_m_s: f32) {
        if sighting.when <= self.last.when {
            return;
        }
        self.last = sighting;
        let apart = sighting.when.since(self.base.when);
        if apart >= VELOCITY_INTERVAL {
            let way = sighting.at - self.base.at;
            let velocity = way / apart.as_secs_f64() as f32;
            self.velocity = velocity.clamp_length_max(fastest_m_s);
            self.base = sighting;
        }
    }
}

impl Memory {
    /// Requests the memory of the used entries, see [`prefetch`](mod@prefetch).
    pub fn prefetch(&self, layer: Layer) {
        if layer == Layer::Elements {
            // The number of entries comes first.
            prefetch_start(&self.tracks);
            prefetch_start(&self.teammates);
        } else {
            prefetch(self.tracks.as_slice());
            prefetch(self.teammates.as_slice());
        }
    }

    pub fn tracks(&self) -> impl Iterator<Item = &Track> {
        self.tracks.iter()
    }

    pub fn has_tracks(&self) -> bool {
        !self.tracks.is_empty()
    }

    pub fn teammates(&self) -> impl Iterator<Item = Vec2> {
        self.teammates.iter().map(|(_, at, _)| *at)
    }

    pub fn in_sight(&self) -> impl Iterator<Item = Sighting> {
        let in_sight = self.tracks.iter().filter(|track| track.in_sight);
        in_sight.map(|track| track.last)
    }

    pub fn clear_in_sight(&mut self) {
        self.tracks
            .iter_mut()
            .for_each(|track| track.in_sight = false);
    }

    /// Stores a sensed target. Returns whether it is new.
    pub fn add_reading(&mut self, sighting: Sighting, fastest_m_s: f32) -> bool {
        let is_new = self.place(sighting.target).is_err();
        if is_new && self.tracks.is_full() {
            // A sensed target replaces one out of sight. Targets in sight never fill the memory.
            let other = self.tracks.iter().position(|track| !track.in_sight);
            self.tracks.remove(other.unwrap_or_default());
        }
        let index = match self.place(sighting.target) {
            Ok(index) => index,
            Err(index) => {
                self.tracks.insert(index, Track::new(sighting));
                index
            }
        };
        let track = &mut self.tracks[index];
        track.update(sighting, fastest_m_s);
        track.in_sight = true;
        is_new
    }

    pub fn add_message(&mut self, sighting: Sighting, fastest_m_s: f32) {
        match self.place(sighting.target) {
            Ok(index) => {
                let track = &mut self.tracks[index];
                track.update(sighting, fastest_m_s);
                track.shared = track.shared.max(Some(sighting.when));
            }
            Err(index) if !self.tracks.is_full() => {
                let mut track = Track::new(sighting);
                track.shared = Some(sighting.when);
                self.tracks.insert(index, track);
            }
            Err(_) => {}
        }
    }

    pub fn add_teammate(&mut self, robot: RobotId, at: Vec2, now: SimTime) {
        let place = self.teammates.binary_search_by_key(&robot, |known| known.0);
        match place {
            Ok(index) => self.teammates[index] = (robot, at, now),
            Err(index) if !self.teammates.is_full() => {
                self.teammates.insert(index, (robot, at, now));
            }
            Err(_) => {}
        }
    }

    /// Removes old and distant entries, and each target that should be in sight at its predicted position but is not.
    pub fn remove_stale(&mut self, position: Vec2, reach: Ranges, now: SimTime) {
        let certain_m = reach.sight_m - CERTAIN_M;
        self.tracks.retain(|track| {
            let distance_m = track.at(now).distance(position);
            let is_missed = !track.in_sight && distance_m < certain_m;
            let is_old = now.since(track.last.when) > TRACK_LIFETIME;
            track.in_sight || !(is_missed || is_old || distance_m > reach.targets_m)
        });
        self.teammates.retain(|(_, at, received)| {
            now.since(*received) <= MESSAGE_LIFETIME && at.distance(position) <= reach.robots_m
        });
    }

    fn place(&self, target: u32) -> Result<usize, usize> {
        self.tracks
            .binary_search_by_key(&target, |track| track.last.target)
    }
}

/// The distances that count as near, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ranges {
    /// The distance up to which every target is sensed; below 0 without a working device.
    pub sight_m: f32,
    pub targets_m: f32,
    pub robots_m: f32,
}
