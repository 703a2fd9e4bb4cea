//! The rows of the tables as they are read: one field per column, named like the column.

use std::fmt;

use scenario::time::SimTime;
use serde::de::{DeserializeOwned, Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::table::Table;

/// A row of one of the CSV tables.
pub trait TableRow: DeserializeOwned {
    /// The table of these rows.
    const TABLE: Table;
}

/// A row of motivations.csv.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // Units as in `telemetry::Motivation`.
pub struct MotivationRow {
    pub t_ms: SimTime,
    pub robot: String,
    pub behavior_set: String,
    pub task: String,
    pub motivation: f64,
    pub impatience: f64,
    #[serde(deserialize_with = "flag")]
    pub sensory_feedback: bool,
    #[serde(deserialize_with = "flag")]
    pub activity_suppression: bool,
    #[serde(deserialize_with = "flag")]
    pub impatience_reset: bool,
    #[serde(deserialize_with = "flag")]
    pub acquiescence: bool,
    pub state: String,
}

impl TableRow for MotivationRow {
    const TABLE: Table = Table::Motivations;
}

/// A row of allocation.csv.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // As in `telemetry::AllocationRow`; `holder` is empty for a free task.
pub struct AllocationRow {
    pub t_ms: SimTime,
    pub robot: String,
    pub task: String,
    pub behavior_set: String,
    pub utility: f64,
    pub holder: String,
    pub state: String,
}

impl TableRow for AllocationRow {
    const TABLE: Table = Table::Allocation;
}

/// A row of allocation_messages.csv: an entry of a message of an allocator. Columns that the kind does not use are empty.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AllocationMessageRow {
    /// The time of sending.
    pub t_ms: SimTime,
    pub sender: String,
    pub incarnation: u32,
    /// The running number of the broadcast, as in messages.csv.
    pub seq: u64,
    pub kind: String,
    pub task: String,
    pub slot: Option<u16>,
    /// The robot of the bid, the winner, or the member of a coalition.
    pub robot: String,
    /// The bid or utility, in the allocator's own unit.
    pub bid: Option<f32>,
    /// The time since which the task is due, according to the sender.
    pub round_ms: Option<SimTime>,
    /// The end of an auction, the time of a bid, or the time of the latest news of a robot.
    pub time_ms: Option<SimTime>,
    /// The auction as AUCTIONEER/INCARNATION/NUMBER.
    pub auction: String,
    /// The number of decisions that led to a partition.
    pub evolution: Option<u64>,
    pub stamp: Option<f64>,
    pub detail: String,
}

impl TableRow for AllocationMessageRow {
    const TABLE: Table = Table::AllocationMessages;
}

/// A row of mission.csv. Its columns depend on the mission.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MissionRow {
    /// The time from which the values are valid.
    pub t_ms: SimTime,
    /// The columns after the time, as pairs of name and value, in their order.
    pub values: Vec<(String, Option<f64>)>,
}

impl MissionRow {
    /// Returns the value of a column. `None` also if there is no such column.
    #[must_use]
    pub fn get(&self, column: &str) -> Option<f64> {
        let mut values = self.values.iter();
        values.find(|(name, _)| name == column)?.1
    }
}

impl TableRow for MissionRow {
    const TABLE: Table = Table::Mission;
}

impl<'de> Deserialize<'de> for MissionRow {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        const TIME: &str = "t_ms";

        struct Columns;

        impl<'de> Visitor<'de> for Columns {
            type Value = MissionRow;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a map from column names to numbers")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<MissionRow, A::Error> {
                let mut time = None;
                let mut values = Vec::new();
                while let Some(name) = map.next_key::<String>()? {
                    if name == TIME {
                        time = Some(map.next_value()?);
                    } else {
                        values.push((name, map.next_value()?));
                    }
                }
                let t_ms = time.ok_or_else(|| A::Error::missing_field(TIME))?;
                Ok(MissionRow { t_ms, values })
            }
        }

        deserializer.deserialize_map(Columns)
    }
}

/// A row of messages.csv.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // As in `telemetry::Reception` and `telemetry::Said`.
pub struct MessageRow {
    pub t_ms: SimTime,
    pub receiver: String,
    pub sender: String,
    pub incarnation: u32,
    pub seq: Option<u64>,
    pub kind: String,
    pub state: String,
    pub since_ms: Option<SimTime>,
    pub behavior_set: String,
    pub task: String,
    pub progress: Option<u32>,
    pub sent_ms: SimTime,
    pub delivery: String,
}

impl TableRow for MessageRow {
    const TABLE: Table = Table::Messages;
}

/// A row of events.csv.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // As in `Event`.
pub struct EventRow {
    pub t_ms: SimTime,
    pub kind: String,
    pub robot: String,
    pub subject: String,
    pub reason: String,
    pub detail: String,
}

impl TableRow for EventRow {
    const TABLE: Table = Table::Events;
}

/// A row of poses.csv.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // As in `BodyRecord`.
pub struct PoseRow {
    pub t_ms: SimTime,
    pub robot: String,
    pub x_m: f32,
    pub y_m: f32,
    pub heading_rad: f32,
    pub speed_m_s: f32,
    #[serde(deserialize_with = "flag")]
    pub carrying: bool,
    pub behavior_set: String,
    pub energy: Option<f32>,
}

impl TableRow for PoseRow {
    const TABLE: Table = Table::Poses;
}

/// A row of targets.csv.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // As in `mission::Target`.
pub struct TargetRow {
    pub t_ms: SimTime,
    pub target: String,
    pub x_m: f32,
    pub y_m: f32,
    pub observers: u32,
}

impl TableRow for TargetRow {
    const TABLE: Table = Table::Targets;
}

/// A row of ticks.csv.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct TickRow {
    pub t_ms: SimTime,
    pub tick: u64,
    pub robot: String,
    pub section: String,
    #[serde(deserialize_with = "hash")]
    pub hash: u64,
}

impl TableRow for TickRow {
    const TABLE: Table = Table::Ticks;
}

fn flag<'de, D: Deserializer<'de>>(deserializer: D) -> Result<bool, D::Error> {
    match u8::deserialize(deserializer)? {
        0 => Ok(false),
        1 => Ok(true),
        other => Err(D::Error::custom(format!("{other} is neither 0 nor 1"))),
    }
}

fn hash<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
    let digits = String::deserialize(deserializer)?;
    parse_hash(&digits)
        .ok_or_else(|| D::Error::custom(format!("'{digits}' is not 16 hexadecimal digits")))
}

/// Parses a hash of ticks.csv.
pub(super) fn parse_hash(digits: &str) -> Option<u64> {
    let hash = u64::from_str_radix(digits, 16).ok()?;
    (digits.len() == 16).then_some(hash)
}
