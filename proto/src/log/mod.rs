//! The log of a run as it lies on the disk (DESIGN §8): what its files and columns are, and their reader.
//!
//! - [`Table`]: the files that grow, with their header lines, at each [`LogLevel`]; a type for the rows of each, [`InputLine`] for
//!   the lines of inputs.jsonl; [`Section`]: what ticks.csv has hashes of.
//! - [`foreign`]: the answers of robots whose minds are programs of their own, in foreign.bin.
//! - [`Document`]: the files that are written as a whole; [`RunFile`]: run.json.
//! - [`RunLog`] reads a folder, or a log in [`Memory`], as far as it is whole.

pub mod foreign;
mod input;
mod level;
mod memory;
mod read;
mod rows;
mod run_file;
mod section;
mod table;

pub use foreign::ForeignAnswer;
pub use input::{Input, InputLine};
pub use level::LogLevel;
pub use memory::{Document, Memory};
pub use read::{ReadError, RunLog, Seal};
pub use rows::{
    AllocationRow, EventRow, MessageRow, MissionRow, MotivationRow, PoseRow, TableRow, TargetRow,
    TickRow,
};
pub use run_file::{Figures, MindFile, RobotFigures, RunFile, RunOutcome};
pub use section::{RUN_SECTION, Section, WORLD};
pub use table::Table;
