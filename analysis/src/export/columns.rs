//! The columns of tables for exports: those that the log declares, and those that a mission declares.

use run_log::{CellKind, CellValue, DeclaredRow, MissionRow};
use scenario::mission::columns::{self, ColumnKind};

/// A function that returns the value in a row; `None` if it is missing.
type Value<R> = Box<dyn for<'r> Fn(&'r R) -> Option<CellValue<'r>>>;

/// A column with its type and the source of its values.
pub struct Column<R> {
    pub name: &'static str,
    pub kind: CellKind,
    /// True if a value may be missing.
    pub is_optional: bool,
    pub value: Value<R>,
}

/// Returns the columns of a table, in the order of the CSV.
pub fn declared<R: DeclaredRow>() -> Vec<Column<R>> {
    let columns = R::COLUMNS.iter().map(|column| Column {
        name: column.name,
        kind: column.kind,
        is_optional: column.is_optional,
        value: Box::new(column.value),
    });
    columns.collect()
}

/// Returns the columns of mission.csv, as the mission declares them.
pub fn of_mission(declared: &'static [columns::Column]) -> Vec<Column<MissionRow>> {
    let time = Column {
        name: "t_ms",
        kind: CellKind::Whole64,
        is_optional: false,
        value: Box::new(|row: &MissionRow| Some(CellValue::Whole(row.t_ms.0))),
    };
    let columns = declared.iter().map(|column| {
        let (name, is_real) = (column.name, column.kind == ColumnKind::Real);
        let is_optional = matches!(column.kind, ColumnKind::Time | ColumnKind::Real);
        Column {
            name,
            kind: if is_real {
                CellKind::Double
            } else {
                CellKind::Whole64
            },
            is_optional,
            value: Box::new(move |row: &MissionRow| match row.get(name) {
                Some(value) if is_real => Some(CellValue::Double(value)),
                Some(value) => Some(CellValue::Whole(value as u64)),
                None => None,
            }),
        }
    });
    [time].into_iter().chain(columns).collect()
}
