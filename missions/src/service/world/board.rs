//! The board: robots read on it what is new of the points that they have tasks for.
//!
//! A robot is told again until it has said up to where it has read: what it was told in a step that did not count is not lost.

use std::collections::BTreeMap;

use arrayvec::ArrayVec;
use serde::{Serialize, Serializer};
use xxhash_rust::xxh3::xxh3_64;

use super::points::Points;
use crate::service::bus::{Fact, SENSED_MOST};
use crate::service::data::TasksAre;

/// Most lines that are looked through for a robot in a step: a long board is read in several.
const LINES: usize = 64;

/// Which points concern a robot.
#[derive(Debug)]
pub(super) enum Reader {
    /// All of them.
    All,
    /// Those points, in order.
    Points(Vec<u16>),
    /// Those of these kinds, in order.
    Kinds(Vec<u16>),
}

impl Reader {
    /// A robot with these tasks, in order.
    pub fn new(tasks: TasksAre, own: Vec<u16>, all: usize) -> Self {
        match tasks {
            _ if own.len() == all => Self::All,
            TasksAre::Points => Self::Points(own),
            TasksAre::Kinds => Self::Kinds(own),
        }
    }

    fn concerns(&self, fact: &Fact) -> bool {
        match self {
            Self::All => true,
            Self::Points(points) => points.binary_search(&fact.point).is_ok(),
            Self::Kinds(kinds) => kinds.binary_search(&fact.kind.into()).is_ok(),
        }
    }
}

/// A line per point: that of its latest change.
#[derive(Clone, Debug, Default)]
pub(super) struct Board {
    /// Points by the number of the line.
    lines: BTreeMap<u32, u16>,
    /// Number of the line of a point.
    line_of: BTreeMap<u16, u32>,
    latest: u32,
    /// Of all lines.
    hash: u64,
}

/// The hash tells the state apart.
impl Serialize for Board {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (self.hash, self.latest).serialize(serializer)
    }
}

fn hash(line: u32, point: u16) -> u64 {
    xxh3_64(&(u64::from(line) << 16 | u64::from(point)).to_le_bytes())
}

/// What is new for a robot.
pub(super) struct News {
    pub facts: ArrayVec<Fact, SENSED_MOST>,
    /// With these, the board is read up to that line.
    pub upto: u32,
}

impl Board {
    /// A point has changed.
    pub fn write(&mut self, point: u16) {
        self.latest += 1;
        if let Some(old) = self.line_of.insert(point, self.latest) {
            self.lines.remove(&old);
            self.hash ^= hash(old, point);
        }
        self.lines.insert(self.latest, point);
        self.hash ^= hash(self.latest, point);
    }

    /// Number of the last line.
    pub fn latest(&self) -> u32 {
        self.latest
    }

    /// What comes after the line up to which the robot has read.
    pub fn news(&self, reader: &Reader, points: &Points, read: u32) -> News {
        let mut facts = ArrayVec::new();
        let mut upto = read;
        if read >= self.latest {
            return News { facts, upto };
        }
        for (line, point) in self.lines.range(read + 1..).take(LINES) {
            let fact = points.fact(*point);
            if reader.concerns(&fact) && facts.try_push(fact).is_err() {
                break;
            }
            upto = *line;
        }
        News { facts, upto }
    }
}
