//! The columns of each table, in the order of the CSV.

use run_log::{
    AllocationMessageRow, AllocationRow, EventRow, MessageRow, MissionRow, MotivationRow, PoseRow,
    TableRow, TargetRow, TickRow,
};
use scenario::mission::columns as declared;

use super::column::Column;
use super::column::Values::{
    Declared, Double, Flag, Integer, Optional, OptionalDouble, OptionalSingle, Single, Text,
};

/// Returns the columns of mission.csv, as the mission declares them.
pub fn of_mission(declared: &'static [declared::Column]) -> Vec<Column<MissionRow>> {
    let time = Column("t_ms", Integer(|row: &MissionRow| row.t_ms.0));
    let columns = declared
        .iter()
        .map(|column| Column(column.name, Declared(column.kind, MissionRow::get)));
    [time].into_iter().chain(columns).collect()
}

pub trait Columns: TableRow + 'static {
    const COLUMNS: &'static [Column<Self>];
}

impl Columns for MotivationRow {
    const COLUMNS: &'static [Column<Self>] = &[
        Column("t_ms", Integer(|row| row.t_ms.0)),
        Column("robot", Text(|row| (&row.robot).into())),
        Column("behavior_set", Text(|row| (&row.behavior_set).into())),
        Column("task", Text(|row| (&row.task).into())),
        Column("motivation", Double(|row| row.motivation)),
        Column("impatience", Double(|row| row.impatience)),
        Column("sensory_feedback", Flag(|row| row.sensory_feedback)),
        Column("activity_suppression", Flag(|row| row.activity_suppression)),
        Column("impatience_reset", Flag(|row| row.impatience_reset)),
        Column("acquiescence", Flag(|row| row.acquiescence)),
        Column("state", Text(|row| (&row.state).into())),
    ];
}

impl Columns for AllocationRow {
    const COLUMNS: &'static [Column<Self>] = &[
        Column("t_ms", Integer(|row| row.t_ms.0)),
        Column("robot", Text(|row| (&row.robot).into())),
        Column("task", Text(|row| (&row.task).into())),
        Column("behavior_set", Text(|row| (&row.behavior_set).into())),
        Column("utility", Double(|row| row.utility)),
        Column("holder", Text(|row| (&row.holder).into())),
        Column("state", Text(|row| (&row.state).into())),
    ];
}

impl Columns for AllocationMessageRow {
    const COLUMNS: &'static [Column<Self>] = &[
        Column("t_ms", Integer(|row| row.t_ms.0)),
        Column("sender", Text(|row| (&row.sender).into())),
        Column("incarnation", Integer(|row| row.incarnation.into())),
        Column("seq", Integer(|row| row.seq)),
        Column("kind", Text(|row| (&row.kind).into())),
        Column("task", Text(|row| (&row.task).into())),
        Column("slot", Optional(|row| row.slot.map(u64::from))),
        Column("robot", Text(|row| (&row.robot).into())),
        Column("bid", OptionalSingle(|row| row.bid)),
        Column("round_ms", Optional(|row| row.round_ms.map(|time| time.0))),
        Column("time_ms", Optional(|row| row.time_ms.map(|time| time.0))),
        Column("auction", Text(|row| (&row.auction).into())),
        Column("evolution", Optional(|row| row.evolution)),
        Column("stamp", OptionalDouble(|row| row.stamp)),
        Column("detail", Text(|row| (&row.detail).into())),
    ];
}

impl Columns for MessageRow {
    const COLUMNS: &'static [Column<Self>] = &[
        Column("t_ms", Integer(|row| row.t_ms.0)),
        Column("receiver", Text(|row| (&row.receiver).into())),
        Column("sender", Text(|row| (&row.sender).into())),
        Column("incarnation", Integer(|row| row.incarnation.into())),
        Column("seq", Optional(|row| row.seq)),
        Column("kind", Text(|row| (&row.kind).into())),
        Column("state", Text(|row| (&row.state).into())),
        Column("since_ms", Optional(|row| row.since_ms.map(|time| time.0))),
        Column("behavior_set", Text(|row| (&row.behavior_set).into())),
        Column("task", Text(|row| (&row.task).into())),
        Column("progress", Optional(|row| row.progress.map(u64::from))),
        Column("sent_ms", Integer(|row| row.sent_ms.0)),
        Column("delivery", Text(|row| (&row.delivery).into())),
    ];
}

impl Columns for EventRow {
    const COLUMNS: &'static [Column<Self>] = &[
        Column("t_ms", Integer(|row| row.t_ms.0)),
        Column("kind", Text(|row| (&row.kind).into())),
        Column("robot", Text(|row| (&row.robot).into())),
        Column("subject", Text(|row| (&row.subject).into())),
        Column("reason", Text(|row| (&row.reason).into())),
        Column("detail", Text(|row| (&row.detail).into())),
    ];
}

impl Columns for PoseRow {
    const COLUMNS: &'static [Column<Self>] = &[
        Column("t_ms", Integer(|row| row.t_ms.0)),
        Column("robot", Text(|row| (&row.robot).into())),
        Column("x_m", Single(|row| row.x_m)),
        Column("y_m", Single(|row| row.y_m)),
        Column("heading_rad", Single(|row| row.heading_rad)),
        Column("speed_m_s", Single(|row| row.speed_m_s)),
        Column("carrying", Flag(|row| row.carrying)),
        Column("behavior_set", Text(|row| (&row.behavior_set).into())),
        Column("energy", OptionalSingle(|row| row.energy)),
    ];
}

impl Columns for TargetRow {
    const COLUMNS: &'static [Column<Self>] = &[
        Column("t_ms", Integer(|row| row.t_ms.0)),
        Column("target", Text(|row| (&row.target).into())),
        Column("x_m", Single(|row| row.x_m)),
        Column("y_m", Single(|row| row.y_m)),
        Column("observers", Integer(|row| row.observers.into())),
    ];
}

impl Columns for TickRow {
    const COLUMNS: &'static [Column<Self>] = &[
        Column("t_ms", Integer(|row| row.t_ms.0)),
        Column("tick", Integer(|row| row.tick)),
        Column("robot", Text(|row| (&row.robot).into())),
        Column("section", Text(|row| (&row.section).into())),
        Column("hash", Text(|row| format!("{:016x}", row.hash).into())),
    ];
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check<R: Columns>() {
        let names: Vec<&str> = R::COLUMNS.iter().map(|column| column.0).collect();
        assert_eq!(names.join(","), R::TABLE.header().unwrap().trim_end());
    }

    #[test]
    fn every_column_under_its_name() {
        check::<MotivationRow>();
        check::<AllocationRow>();
        check::<AllocationMessageRow>();
        check::<MessageRow>();
        check::<EventRow>();
        check::<PoseRow>();
        check::<TargetRow>();
        check::<TickRow>();
    }
}
