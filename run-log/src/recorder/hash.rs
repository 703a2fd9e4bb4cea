//! The hashes of a run: one per tick, robot and section, and one over all of them.

use crate::{Input, Section};
use prefetch::prefetch;
use scenario::ids::{RobotId, Tick};
use xxhash_rust::xxh3::Xxh3;

use super::record::{BodyRecord, Event};
use super::section_hash::SectionHash;

const NAME_MOST: usize = Section::Motivations.as_str().len();

impl SectionHash {
    // Sections of every tick are hashed by functions without type parameters. These are compiled in this optimized crate, and
    // not in the crate that chooses a sink.

    pub(super) fn inputs(&mut self, inputs: &[Input]) -> u64 {
        self.of(&inputs)
    }

    pub(super) fn events(&mut self, events: &[Event]) -> u64 {
        self.of(&events)
    }

    pub(super) fn state(&mut self, bodies: &[BodyRecord], mission_state: u64) -> u64 {
        self.of(&(bodies, mission_state))
    }
}

#[derive(Clone, Default)]
pub(super) struct RunHash {
    run: Xxh3,
    /// The bytes of the current tick. One update per tick is faster than one per section.
    tick: Vec<u8>,
}

impl RunHash {
    #[inline]
    pub fn prefetch(&self) {
        prefetch(&*self.tick);
    }

    pub fn tick(&mut self, tick: Tick) {
        self.tick.clear();
        self.tick.extend_from_slice(&tick.to_le_bytes());
    }

    /// Adds the hash of a section of a robot, or of the world if `robot` is `None`.
    #[inline(always)]
    pub fn section(&mut self, robot: Option<RobotId>, section: Section, hash: u64) {
        // Two bytes of the rank suffice: robots follow in order of rank, and larger teams wrap round.
        let rank = robot.map_or(u16::MAX, |robot| robot.0 as u16).to_le_bytes();
        let name = section.as_str().as_bytes();
        // Added in one piece, because each addition may have to grow the buffer.
        let mut piece = [0; 2 + NAME_MOST + 8];
        piece[..2].copy_from_slice(&rank);
        piece[2..][..name.len()].copy_from_slice(name);
        piece[2 + name.len()..][..8].copy_from_slice(&hash.to_le_bytes());
        self.tick.extend_from_slice(&piece[..2 + name.len() + 8]);
    }

    pub fn end_tick(&mut self) {
        self.run.update(&self.tick);
    }

    pub fn so_far(&self) -> u64 {
        self.run.digest()
    }
}
