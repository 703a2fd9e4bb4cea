//! The board: it announces changes of points to the robots that have tasks for them.
//!
//! The board repeats its lines until the robot acknowledges them, so a step that does not count loses nothing.

use std::collections::BTreeMap;

use arrayvec::ArrayVec;
use serde::{Serialize, Serializer};
use xxhash_rust::xxh3::xxh3_64;

use super::points::Points;
use crate::service::bus::{MAX_SENSED, PointFact};
use crate::service::data::TaskGranularity;

/// The maximum number of lines that are examined per robot and step. A robot reads a longer board in several steps.
const LINES: usize = 64;

#[derive(Debug)]
pub(super) enum BoardFilter {
    All,
    /// Points with these numbers, in ascending order.
    Points(Vec<u32>),
    /// Points of these kinds, in ascending order.
    Kinds(Vec<u32>),
}

impl BoardFilter {
    /// Creates the filter for a robot that is concerned with these points or kinds.
    pub fn new(tasks: TaskGranularity, mut own: Vec<u32>) -> Self {
        own.sort_unstable();
        own.dedup();
        match tasks {
            TaskGranularity::Points => Self::Points(own),
            TaskGranularity::Kinds => Self::Kinds(own),
        }
    }

    fn concerns(&self, fact: &PointFact) -> bool {
        match self {
            Self::All => true,
            Self::Points(points) => points.binary_search(&fact.point).is_ok(),
            Self::Kinds(kinds) => kinds.binary_search(&fact.kind).is_ok(),
        }
    }
}

/// The board, with one line per point: its latest change.
#[derive(Clone, Debug, Default)]
pub(super) struct Board {
    lines: BTreeMap<u32, u32>,
    line_of: BTreeMap<u32, u32>,
    latest: u32,
    hash: u64,
}

/// Serializes only the hash, which identifies the state.
impl Serialize for Board {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (self.hash, self.latest).serialize(serializer)
    }
}

fn hash(line: u32, point: u32) -> u64 {
    let [lower, upper] = [point & 0xFFFF, point >> 16].map(u64::from);
    xxh3_64(&(upper << 48 | u64::from(line) << 16 | lower).to_le_bytes())
}

pub(super) struct NewFacts {
    pub facts: ArrayVec<PointFact, MAX_SENSED>,
    /// The last line that these facts cover.
    pub upto: u32,
}

impl Board {
    pub fn write(&mut self, point: u32) {
        self.latest += 1;
        if let Some(old) = self.line_of.insert(point, self.latest) {
            self.lines.remove(&old);
            self.hash ^= hash(old, point);
        }
        self.lines.insert(self.latest, point);
        self.hash ^= hash(self.latest, point);
    }

    pub fn latest(&self) -> u32 {
        self.latest
    }

    /// Returns the facts after the last line that the robot has read.
    pub fn new_facts(&self, reader: &BoardFilter, points: &Points, read: u32) -> NewFacts {
        let mut facts = ArrayVec::new();
        let mut upto = read;
        if read >= self.latest {
            return NewFacts { facts, upto };
        }
        for (line, point) in self.lines.range(read + 1..).take(LINES) {
            let fact = points.fact(*point);
            if reader.concerns(&fact) && facts.try_push(fact).is_err() {
                break;
            }
            upto = *line;
        }
        NewFacts { facts, upto }
    }
}
