//! The tables of the log. Each is declared once: its rows as they are read, and its columns with name, type and meaning.
//! The header line, the exports and the table of columns in `docs/GUARANTEES.md` follow from the declarations.

use std::borrow::Cow;
use std::fmt;

use scenario::time::SimTime;
use serde::de::{DeserializeOwned, Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::column::{Cell, CellKind, Column, RowHash};
use super::compact::{CompactForm, FROM, Growth, Prediction, Repetition};
use super::level::LogLevel;
use super::table::Table;

/// A row of one of the CSV tables.
pub trait TableRow: Clone + DeserializeOwned {
    /// The table of these rows.
    const TABLE: Table;
    /// The form of the table in a compact log.
    const FORM: CompactForm<Self> = CompactForm::EveryRow;
}

/// A row of a table whose columns do not depend on the mission.
pub trait DeclaredRow: TableRow + 'static {
    /// The columns, in the order of the file.
    const COLUMNS: &'static [Column<Self>];
    /// The first line of the file.
    const HEADER: &'static str;
}

/// Declares the rows of a table. The comment of a field is the meaning of its column, in one line.
macro_rules! table {
    (
        $(#[doc = $about:literal])+
        $row:ident in $table:ident $(, compact $form:ident)? {
            #[doc = $time:literal]
            t_ms,
            $(
                #[doc = $meaning:literal]
                $column:ident: $type:ty,
            )+
        }
    ) => {
        $(#[doc = $about])+
        #[derive(Clone, Debug, PartialEq, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $row {
            #[doc = $time]
            pub t_ms: SimTime,
            $(
                #[doc = $meaning]
                #[serde(deserialize_with = "Cell::read")]
                pub $column: $type,
            )+
        }

        impl TableRow for $row {
            const TABLE: Table = Table::$table;
            $(const FORM: CompactForm<Self> = $form;)?
        }

        impl DeclaredRow for $row {
            const COLUMNS: &'static [Column<Self>] = &[
                Column {
                    name: "t_ms",
                    about: $time.trim_ascii(),
                    kind: CellKind::Whole64,
                    is_optional: false,
                    value: |row| row.t_ms.value(),
                },
                $(Column {
                    name: stringify!($column),
                    about: $meaning.trim_ascii(),
                    kind: <$type as Cell>::KIND,
                    is_optional: <$type as Cell>::IS_OPTIONAL,
                    value: |row| row.$column.value(),
                },)+
            ];
            const HEADER: &'static str = concat!("t_ms" $(, ",", stringify!($column))+, "\n");
        }
    };
}

table! {
    /// A row of motivations.csv: a behavior set of a robot.
    MotivationRow in Motivations, compact MOTIVATIONS {
        /// The time of the tick. The row contains the end of its step.
        t_ms,
        /// The name of the robot.
        robot: String,
        /// The name of the behavior set.
        behavior_set: String,
        /// The task of the behavior set.
        task: String,
        /// The motivation; the set is activated at the threshold.
        motivation: f64,
        /// The rate of the motivation in this step, motivation/s.
        impatience: f64,
        /// The factor of eq. 2.1: 1 if the sensors call for the task.
        sensory_feedback: bool,
        /// The factor of eq. 2.3: 0 if another set of the robot is active.
        activity_suppression: bool,
        /// The factor of eq. 2.5: 0 for a reset in this step.
        impatience_reset: bool,
        /// The factor of eq. 2.6: 0 if the robot yields or gives up.
        acquiescence: bool,
        /// The state: hibernating, waiting or active.
        state: String,
    }
}

table! {
    /// A row of allocation.csv: a behavior set of a robot whose allocator has no motivations.
    AllocationRow in Allocation, compact ALLOCATION {
        /// The time of the tick. The row contains the end of its step.
        t_ms,
        /// The name of the robot.
        robot: String,
        /// The task of the behavior set.
        task: String,
        /// The name of the behavior set.
        behavior_set: String,
        /// The value that the allocator ranks by, in its own unit. It is not always the bid (CBBA bids the gain in its bundle).
        utility: f64,
        /// The robot that executes the task or owns its bid or contract, according to this robot. Empty for a free task.
        holder: String,
        /// The state: hibernating, waiting or active.
        state: String,
    }
}

table! {
    /// A row of allocation_messages.csv: an entry of a message of an allocator. Columns that the kind does not use are
    /// empty.
    AllocationMessageRow in AllocationMessages {
        /// The time of sending.
        t_ms,
        /// The robot that sent the message.
        sender: String,
        /// The incarnation of the sender.
        incarnation: u32,
        /// The running number of the broadcast, as in messages.csv.
        seq: u64,
        /// The kind of the entry.
        kind: String,
        /// The name of the task.
        task: String,
        /// The place of the task's robot, from 0.
        slot: Option<u16>,
        /// The robot of the bid, the winner, or the member of a coalition.
        robot: String,
        /// The bid or utility, in the allocator's own unit.
        bid: Option<f32>,
        /// The time since which the task is due, according to the sender.
        round_ms: Option<SimTime>,
        /// The end of an auction, the time of a bid, or the time of the latest news of a robot.
        time_ms: Option<SimTime>,
        /// The auction as AUCTIONEER/INCARNATION/NUMBER.
        auction: String,
        /// The number of decisions that led to a partition.
        evolution: Option<u64>,
        /// The random number that decides between partitions of equal age.
        stamp: Option<f64>,
        /// Other contents of the entry, as text.
        detail: String,
    }
}

table! {
    /// A row of messages.csv: a broadcast at a receiver.
    MessageRow in Messages, compact MESSAGES {
        /// The time of the delivery, or the time at which it was due.
        t_ms,
        /// The robot that receives the broadcast.
        receiver: String,
        /// The robot that sent the broadcast.
        sender: String,
        /// The incarnation of the sender.
        incarnation: u32,
        /// The running number of the broadcast.
        seq: Option<u64>,
        /// The kind of the broadcast.
        kind: String,
        /// The state of the sender's behavior set.
        state: String,
        /// The time since which the sender has been in that state.
        since_ms: Option<SimTime>,
        /// The behavior set of the sender.
        behavior_set: String,
        /// The task of that behavior set.
        task: String,
        /// The sender's progress, in the unit of its mission.
        progress: Option<u32>,
        /// The time of sending.
        sent_ms: SimTime,
        /// `received`, `delayed`, `damaged` (bit errors), `duplicate` or `pending`; lost are `dropped` and `cut` (faults), `faded`, `blocked` (obstacle), `corrupted` (bit errors) and `lost` (network).
        delivery: String,
    }
}

table! {
    /// A row of sent.csv: the broadcasts that a robot sent in a tick, whether another robot was to receive them or not.
    SentRow in Sent {
        /// The time of the tick.
        t_ms,
        /// The name of the robot.
        robot: String,
        /// The number of broadcasts.
        messages: u32,
        /// The sum of their sizes, bytes.
        bytes: u32,
    }
}

table! {
    /// A row of hits.csv: the effects of a fault in a tick.
    HitRow in Hits {
        /// The time of the tick.
        t_ms,
        /// The id of the fault.
        fault: String,
        /// The number of effects, such as lost messages or changed readings.
        hits: u64,
    }
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

table! {
    /// A row of events.csv.
    EventRow in Events {
        /// The time of the tick.
        t_ms,
        /// The kind of the event.
        kind: String,
        /// The robot. Empty for an event of the world.
        robot: String,
        /// The behavior set, the fault, or another object of the event.
        subject: String,
        /// The reason of a state change, or the trigger of a fault.
        reason: String,
        /// Further information, as text.
        detail: String,
    }
}

table! {
    /// A row of poses.csv: a body.
    PoseRow in Poses, compact POSES {
        /// The time of the tick. The row contains the start of its step.
        t_ms,
        /// The name of the robot.
        robot: String,
        /// The x coordinate of the center, m.
        x_m: f32,
        /// The y coordinate of the center, m.
        y_m: f32,
        /// The heading, rad counter-clockwise from the x axis.
        heading_rad: f32,
        /// The speed along the heading, m/s.
        speed_m_s: f32,
        /// 1 if the robot carries an item.
        carrying: bool,
        /// The active behavior set. Empty if there is none.
        behavior_set: String,
        /// The remaining energy, J. Empty if energy is unlimited.
        energy: Option<f32>,
    }
}

table! {
    /// A row of targets.csv: a target.
    TargetRow in Targets {
        /// The time of the tick. The row contains the end of its step.
        t_ms,
        /// The name of the target.
        target: String,
        /// The x coordinate, m.
        x_m: f32,
        /// The y coordinate, m.
        y_m: f32,
        /// The number of robots that see the target.
        observers: u32,
    }
}

table! {
    /// A row of ticks.csv: the hash of a section of the run.
    TickRow in Ticks {
        /// The time of the tick.
        t_ms,
        /// The number of the tick.
        tick: u64,
        /// The robot of the section, or the world.
        robot: String,
        /// The section. A file name stands for the rows of that table so far.
        section: String,
        /// The hash of the section.
        hash: RowHash,
    }
}

const MOTIVATIONS: CompactForm<MotivationRow> = CompactForm::Predicted(Prediction {
    header: MotivationRow::HEADER,
    key: |row| &row.behavior_set,
    time: |row| &mut row.t_ms,
    growth: Some(Growth {
        motivation: |row| &mut row.motivation,
        rate: |row| row.impatience,
        factors: |row| {
            row.sensory_feedback
                && row.activity_suppression
                && row.impatience_reset
                && row.acquiescence
        },
    }),
});

const ALLOCATION: CompactForm<AllocationRow> = CompactForm::Predicted(Prediction {
    header: AllocationRow::HEADER,
    key: |row| &row.behavior_set,
    time: |row| &mut row.t_ms,
    growth: None,
});

const POSES: CompactForm<PoseRow> = CompactForm::Predicted(Prediction {
    header: PoseRow::HEADER,
    key: |_| "",
    time: |row| &mut row.t_ms,
    growth: None,
});

const MESSAGES: CompactForm<MessageRow> = CompactForm::Repeated(Repetition {
    header: MessageRow::HEADER,
    time: |row| &mut row.t_ms,
    receiver: |row| &mut row.receiver,
});

impl Table {
    /// Returns the first line with its line end at a log level. [`Table::header`] is that of a full log.
    pub(super) fn header_at(self, level: LogLevel) -> Option<Cow<'static, str>> {
        let header = self.header()?;
        let times = (level == LogLevel::Compact && self.is_predicted())
            .then(|| header.replacen("t_ms", FROM, 1));
        Some(times.map_or(Cow::Borrowed(header), Cow::Owned))
    }

    fn is_predicted(self) -> bool {
        matches!(self, Self::Motivations | Self::Allocation | Self::Poses)
    }

    /// Returns the first line with its line end; empty for JSON lines. `None` for mission.csv, whose columns depend on
    /// the mission.
    #[must_use]
    pub fn header(self) -> Option<&'static str> {
        Some(match self {
            Self::Motivations => MotivationRow::HEADER,
            Self::Allocation => AllocationRow::HEADER,
            Self::AllocationMessages => AllocationMessageRow::HEADER,
            Self::Messages => MessageRow::HEADER,
            Self::Sent => SentRow::HEADER,
            Self::Hits => HitRow::HEADER,
            Self::Events => EventRow::HEADER,
            Self::Poses => PoseRow::HEADER,
            Self::Mission => return None,
            Self::Targets => TargetRow::HEADER,
            Self::Inputs => "",
            Self::External => super::external::HEADER,
            Self::Ticks => TickRow::HEADER,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the rows of a table of columns in Markdown.
    fn lines<R: DeclaredRow>() -> String {
        let file = R::TABLE.file_name();
        let line = |column: &Column<R>| {
            let Column { name, about, .. } = column;
            let optional = if column.is_optional { "optional " } else { "" };
            let kind = column.kind.as_str();
            format!("| `{file}` | `{name}` | {optional}{kind} | {about} |\n")
        };
        R::COLUMNS.iter().map(line).collect()
    }

    /// The table of columns follows from the declarations. `INSTA_UPDATE=always` writes it.
    #[test]
    fn the_guarantees_list_the_columns() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/GUARANTEES.md");
        let page = std::fs::read_to_string(path).unwrap();
        let (begin, rest) = page.split_once("<!-- columns -->\n").unwrap();
        let (_, end) = rest.split_once("<!-- end -->\n").unwrap();
        let tables = [
            lines::<MotivationRow>(),
            lines::<AllocationRow>(),
            lines::<AllocationMessageRow>(),
            lines::<MessageRow>(),
            lines::<SentRow>(),
            lines::<HitRow>(),
            lines::<EventRow>(),
            lines::<PoseRow>(),
            lines::<TargetRow>(),
            lines::<TickRow>(),
        ];
        let expected = format!(
            "{begin}<!-- columns -->\n\n| file | column | type | meaning |\n|---|---|---|---|\n{}\n<!-- end -->\n{end}",
            tables.concat()
        );
        if std::env::var("INSTA_UPDATE").is_ok_and(|update| update == "always") {
            std::fs::write(path, &expected).unwrap();
        } else {
            assert_eq!(
                page, expected,
                "run with INSTA_UPDATE=always and review the difference"
            );
        }
    }
}
