//! The files and columns of a run's log, and their reader.
//!
//! - [`Table`]: the files that grow, with their header lines. [`LogLevel`] selects the tables of a run. Each table has
//!   a row type; [`InputLine`] is a line of inputs.jsonl. [`Section`]: the sections of ticks.csv.
//! - [`compact`]: the rows that a compact log does not write, and their recovery.
//! - [`external`]: the answers of robots with external controllers, in foreign.bin.
//! - [`Document`]: the files that are written as a whole; [`RunFile`]: run.json.
//! - `RunLog`: reads a run folder, or a log in `Memory`, up to the last complete tick.

mod column;
pub mod compact;
pub mod external;
mod full_table;
mod input;
mod level;
mod memory;
mod read;
mod read_error;
mod read_rows;
pub mod recorder;
mod rows;
mod run_file;
mod section;
mod table;

pub use column::{CellKind, CellValue, Column, RowHash};
pub use external::ExternalAnswer;
pub use input::{BodyInput, Branch, Input, InputLine, ScanInput};
pub use level::LogLevel;
pub use memory::{Document, MemoryLog};
pub use read::{Damage, RunLog, Seal};
pub use read_error::{ReadError, no_run};
pub use read_rows::Rows;
pub use rows::{
    AllocationMessageRow, AllocationRow, DeclaredRow, EventRow, HitRow, MessageRow, MissionRow,
    MotivationRow, PoseRow, SentRow, TableRow, TargetRow, TickRow,
};
pub use run_file::{BranchOrigin, ControllerFile, Figures, RobotFigures, RunFile, RunOutcome};
pub use section::{RUN_SECTION, Section, WORLD_ROBOT};
pub use table::Table;
