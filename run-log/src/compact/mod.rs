//! The compact form of tables: rows that follow from earlier rows are not written, and the reader recovers them to the
//! bit.
//!
//! - **Predicted rows** (motivations, allocation, poses). From tick to tick a row stays the same, except for the time
//!   and a motivation, which grows by its rate up to the threshold. A row is written in a tick in which any of its bits
//!   differs from that prediction. A row with only the time and the robot ends all earlier rows of the robot. It
//!   precedes the rows of its tick, if there are any.
//! - **Repeated rows** (messages). A row with only the time, the receiver and the sender repeats the other columns of
//!   the latest complete row of that sender.
//!
//! The column of the time of predicted rows is `from_ms` instead of `t_ms`. A program that expects a row for every tick
//! thus fails instead of missing rows.

mod predicted;
mod repeated;
mod rule;

use scenario::time::SimTime;

pub(crate) use predicted::PredictedRows;
pub(crate) use repeated::RepeatedRows;
pub(crate) use rule::MotivationRule;

/// The name of the time in the header line of predicted rows.
pub(crate) const FROM: &str = "from_ms";

/// The form of a table in a compact log.
pub enum CompactForm<R> {
    /// All rows are written.
    EveryRow,
    Predicted(Prediction<R>),
    Repeated(Repetition<R>),
}

/// The columns of a predicted row that the reader needs. The first two columns are the time and the robot.
pub struct Prediction<R> {
    /// The header line of a full log.
    pub(crate) header: &'static str,
    /// The name that distinguishes the rows of a robot in a tick; empty if there is only one.
    pub(crate) key: fn(&R) -> &str,
    pub(crate) time: fn(&mut R) -> &mut SimTime,
    pub(crate) growth: Option<Growth<R>>,
}

/// The columns that determine the next motivation.
pub struct Growth<R> {
    pub(crate) motivation: fn(&mut R) -> &mut f64,
    /// Returns the rate, motivation/s.
    pub(crate) rate: fn(&R) -> f64,
    /// Returns whether all factors are 1.
    pub(crate) factors: fn(&R) -> bool,
}

/// The columns of a repeated row that the reader needs. The first three columns are the time, the receiver and the
/// sender.
pub struct Repetition<R> {
    /// The header line of a full log.
    pub(crate) header: &'static str,
    pub(crate) time: fn(&mut R) -> &mut SimTime,
    pub(crate) receiver: fn(&mut R) -> &mut String,
}

/// An error of a table in compact form.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CompactError {
    #[error("line {0}: the time is not a whole number")]
    Time(u64),
    #[error("line {line}: there is no robot '{name}' in run.json")]
    Robot { line: u64, name: String },
    #[error("line {0}: no earlier row has this robot and behavior set")]
    NoEarlierRow(u64),
    #[error("line {0}: no earlier row has this sender")]
    NoEarlierMessage(u64),
    #[error("line {0}: the row is out of order, or belongs to no complete tick")]
    Order(u64),
    #[error(transparent)]
    Csv(#[from] csv::Error),
}
