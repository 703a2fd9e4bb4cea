//! What a robot knows of the targets that are near, and of teammates that are: bounded, whatever there is.

use alliance_proto::ids::RobotId;
use alliance_proto::time::SimTime;
use arrayvec::ArrayVec;
use glam::Vec2;

use crate::observe::bus::{SENSED_MOST, Sighting};

/// Most targets that it keeps in mind.
const MOST_TARGETS: usize = 2 * SENSED_MOST;
/// Most teammates.
const MOST_TEAMMATES: usize = 12;
/// What was not sensed for longer is forgotten.
const REMEMBERED: SimTime = SimTime(10_000);
/// What teammates said counts for so long: they repeat it each second.
const SAID: SimTime = SimTime(2_500);
/// How far apart the sightings are from which a speed is worked out.
const APART: SimTime = SimTime(500);
/// A target that is nearer than the end of sight by so much is seen for certain, m.
const CERTAIN_M: f32 = 0.3;

/// A target that may be near.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Track {
    /// The newest sighting, one's own or a teammate's.
    last: Sighting,
    /// An older one.
    base: Sighting,
    /// m/s.
    velocity: Vec2,
    /// Whether the robot senses it now.
    pub in_sight: bool,
    /// When a teammate sensed it last, as far as it has said.
    shared: Option<SimTime>,
}

/// What a robot knows.
#[derive(Clone, Debug, Default)]
pub(super) struct Memory {
    /// By number.
    tracks: ArrayVec<Track, MOST_TARGETS>,
    /// Where teammates were and when they said so, by rank.
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

    /// Where it is now, if it moves straight on.
    pub fn at(&self, now: SimTime) -> Vec2 {
        let past_s = now.since(self.last.when).as_secs_f64() as f32;
        self.last.at + self.velocity * past_s
    }

    /// Whether a teammate sees it, too.
    pub fn is_shared(&self, now: SimTime) -> bool {
        self.shared.is_some_and(|shared| now.since(shared) <= SAID)
    }

    fn update(&mut self, sighting: Sighting, fastest_m_s: f32) {
        if sighting.when <= self.last.when {
            return;
        }
        self.last = sighting;
        let apart = sighting.when.since(self.base.when);
        if apart >= APART {
            let way = sighting.at - self.base.at;
            let velocity = way / apart.as_secs_f64() as f32;
            self.velocity = velocity.clamp_length_max(fastest_m_s);
            self.base = sighting;
        }
    }
}

impl Memory {
    /// All targets that it keeps in mind.
    pub fn tracks(&self) -> impl Iterator<Item = &Track> {
        self.tracks.iter()
    }

    /// Whether there is one.
    pub fn has_tracks(&self) -> bool {
        !self.tracks.is_empty()
    }

    /// Where teammates that are near were last.
    pub fn teammates(&self) -> impl Iterator<Item = Vec2> {
        self.teammates.iter().map(|(_, at, _)| *at)
    }

    /// Its own sightings.
    pub fn in_sight(&self) -> impl Iterator<Item = Sighting> {
        let in_sight = self.tracks.iter().filter(|track| track.in_sight);
        in_sight.map(|track| track.last)
    }

    /// Before what it senses in a step.
    pub fn look_away(&mut self) {
        self.tracks
            .iter_mut()
            .for_each(|track| track.in_sight = false);
    }

    /// It senses a target: whether that is new to it.
    pub fn see(&mut self, sighting: Sighting, fastest_m_s: f32) -> bool {
        let is_new = self.place(sighting.target).is_err();
        if is_new && self.tracks.is_full() {
            // What is seen comes before what is remembered; of those in sight there are fewer.
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

    /// A teammate says that it senses a target.
    pub fn hear(&mut self, sighting: Sighting, fastest_m_s: f32) {
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

    /// A teammate says where it is.
    pub fn hear_of_teammate(&mut self, robot: RobotId, at: Vec2, now: SimTime) {
        let place = self.teammates.binary_search_by_key(&robot, |it| it.0);
        match place {
            Ok(index) => self.teammates[index] = (robot, at, now),
            Err(index) if !self.teammates.is_full() => {
                self.teammates.insert(index, (robot, at, now));
            }
            Err(_) => {}
        }
    }

    /// Forgets what is too old or too far from there, m, and targets that would be sensed if they were where they are believed to be.
    pub fn forget(&mut self, position: Vec2, reach: Reach, now: SimTime) {
        let certain_m = reach.sight_m - CERTAIN_M;
        self.tracks.retain(|track| {
            let distance_m = track.at(now).distance(position);
            let is_missed = !track.in_sight && distance_m < certain_m;
            let is_old = now.since(track.last.when) > REMEMBERED;
            track.in_sight || !(is_missed || is_old || distance_m > reach.targets_m)
        });
        self.teammates.retain(|(_, at, said)| {
            now.since(*said) <= SAID && at.distance(position) <= reach.robots_m
        });
    }

    fn place(&self, target: u16) -> Result<usize, usize> {
        self.tracks
            .binary_search_by_key(&target, |track| track.last.target)
    }
}

/// What is near, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reach {
    /// Up to there every target is sensed; below 0 without a device that works.
    pub sight_m: f32,
    /// Targets.
    pub targets_m: f32,
    /// Teammates.
    pub robots_m: f32,
}
