//! Hashes of a run: one per tick, robot and section, and one over all of them (DESIGN §5).

use alliance_proto::codec;
use alliance_proto::ids::{RobotId, Tick};
use alliance_proto::log::{Input, Section};
use serde::Serialize;
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

use super::record::{BodyRecord, Event};

/// Length of the longest section's name.
const NAME_MOST: usize = Section::Motivations.as_str().len();

/// Hashes a section.
#[derive(Clone, Default)]
pub(super) struct SectionHash {
    /// Begins with the encoding of the section at hand; kept for its memory.
    room: Vec<u8>,
}

impl SectionHash {
    pub fn of(&mut self, content: &impl Serialize) -> u64 {
        let length = codec::encode_into(content, &mut self.room)
            // Sections are plain data of known length and the destination is memory, so nothing is left to fail.
            .expect("a section can be encoded");
        xxh3_64(&self.room[..length])
    }

    // What each tick has is hashed by functions without parameters of type: they are compiled here, where a step is fast, and not where a
    // recorder gets its sink.

    pub fn inputs(&mut self, inputs: &[Input]) -> u64 {
        self.of(&inputs)
    }

    pub fn events(&mut self, events: &[Event]) -> u64 {
        self.of(&events)
    }

    pub fn state(&mut self, bodies: &[BodyRecord], mission_state: u64) -> u64 {
        self.of(&(bodies, mission_state))
    }
}

/// The streaming hash of a run.
#[derive(Clone, Default)]
pub(super) struct RunHash {
    run: Xxh3,
    /// What the tick at hand adds. It goes over in one go: an update costs more than the few bytes of a section.
    tick: Vec<u8>,
}

impl RunHash {
    /// Begins a tick.
    pub fn tick(&mut self, tick: Tick) {
        self.tick.clear();
        self.tick.extend_from_slice(&tick.to_le_bytes());
    }

    /// Adds the hash of a section of a robot, or of the world.
    #[inline(always)]
    pub fn section(&mut self, robot: Option<RobotId>, section: Section, hash: u64) {
        let rank = robot.map_or(u16::MAX, |robot| robot.0).to_le_bytes();
        let name = section.as_str().as_bytes();
        // In one piece: memory may have to grow for each.
        let mut piece = [0; 2 + NAME_MOST + 8];
        piece[..2].copy_from_slice(&rank);
        piece[2..][..name.len()].copy_from_slice(name);
        piece[2 + name.len()..][..8].copy_from_slice(&hash.to_le_bytes());
        self.tick.extend_from_slice(&piece[..2 + name.len() + 8]);
    }

    /// Ends the tick.
    pub fn end_tick(&mut self) {
        self.run.update(&self.tick);
    }

    /// Hash of the run so far.
    pub fn so_far(&self) -> u64 {
        self.run.digest()
    }
}
