//! The rows of a compact log that are not the predicted ones. [`crate::compact`] describes the form.

use proto::telemetry::{AllocationRow, BehaviorState};
use scenario::ids::{BehaviorId, RobotId, TaskId};

use super::answers::MotivationBits;
use super::repeated::BodyBits;
use crate::compact::MotivationRule;

/// The state of the writer: the rows of each robot in the latest tick.
#[derive(Clone)]
pub(super) struct ChangedRows {
    pub rule: MotivationRule,
    pub motivations: Vec<LatestRows<MotivationBits>>,
    pub allocation: Vec<LatestRows<AllocationBits>>,
    pub poses: Vec<LatestRows<BodyBits>>,
}

impl ChangedRows {
    pub fn new(rule: MotivationRule, robots: usize) -> Self {
        Self {
            rule,
            motivations: vec![LatestRows::default(); robots],
            allocation: vec![LatestRows::default(); robots],
            poses: vec![LatestRows::default(); robots],
        }
    }

    /// Returns whether a robot has rows of allocation.csv.
    pub fn has_allocation(&self) -> bool {
        self.allocation.iter().any(|robot| !robot.rows.is_empty())
    }
}

/// The rows of a robot in the latest tick.
#[derive(Clone, Debug)]
pub(super) struct LatestRows<B> {
    /// The values of each row, and whether the latest step left its motivation as it was.
    rows: Vec<(B, bool)>,
    /// False if several rows have the same key. Such rows are always written.
    are_distinct: bool,
}

/// The bits of all values of a row except time and robot.
pub(super) trait RowBits: Copy + PartialEq {
    /// Returns the behavior set, which distinguishes the rows of a robot.
    fn key(&self) -> Option<BehaviorId>;

    /// Returns the values in the next tick if the row follows its prediction.
    fn next(&self, _rule: &MotivationRule, _holds: bool) -> Self {
        *self
    }

    /// Returns whether the motivation is the same as in the row before.
    fn holds(&self, _before: &Self) -> bool {
        true
    }
}

/// A change of the rows of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RowChange {
    /// All earlier rows end.
    End,
    /// The row with this index is written.
    Row(usize),
}

impl<B: RowBits> LatestRows<B> {
    /// Replaces the rows by those of the next tick. Calls `write` for each change, in the order of the file.
    pub fn update(
        &mut self,
        rule: &MotivationRule,
        rows: impl ExactSizeIterator<Item = B> + Clone,
        mut write: impl FnMut(RowChange),
    ) {
        let same_keys = rows.len() == self.rows.len() && {
            let mut pairs = self.rows.iter().zip(rows.clone());
            pairs.all(|((before, _), row)| before.key() == row.key())
        };
        if same_keys && self.are_distinct {
            for (index, ((latest, holds), row)) in self.rows.iter_mut().zip(rows).enumerate() {
                if latest.next(rule, *holds) != row {
                    write(RowChange::Row(index));
                }
                *holds = row.holds(latest);
                *latest = row;
            }
            return;
        }
        if !self.rows.is_empty() {
            write(RowChange::End);
        }
        (0..rows.len()).for_each(|index| write(RowChange::Row(index)));
        self.rows.clear();
        self.rows.extend(rows.map(|row| (row, false)));
        let mut keys = self.rows.iter().map(|(row, _)| row.key()).enumerate();
        self.are_distinct = keys.all(|(index, key)| {
            let before = self.rows[..index].iter();
            before.map(|(row, _)| row.key()).all(|other| other != key)
        });
    }
}

impl<B> Default for LatestRows<B> {
    fn default() -> Self {
        Self {
            rows: Vec::new(),
            are_distinct: true,
        }
    }
}

impl RowBits for MotivationBits {
    fn key(&self) -> Option<BehaviorId> {
        Some(self.0)
    }

    fn next(&self, rule: &MotivationRule, holds: bool) -> Self {
        let (set, [motivation, impatience], factors, state) = *self;
        let [level, rate] = [motivation, impatience].map(f64::from_bits);
        let all = factors.iter().all(|factor| *factor);
        let motivation = rule.next(level, rate, all, holds).to_bits();
        (set, [motivation, impatience], factors, state)
    }

    fn holds(&self, before: &Self) -> bool {
        self.1[0] == before.1[0]
    }
}

/// The values of a row of allocation.csv.
pub(super) type AllocationBits = (TaskId, BehaviorId, u64, Option<RobotId>, BehaviorState);

pub(super) fn allocation_bits(row: &AllocationRow) -> AllocationBits {
    let AllocationRow {
        task,
        behavior,
        utility,
        holder,
        state,
    } = *row;
    (task, behavior, utility.to_bits(), holder, state)
}

impl RowBits for AllocationBits {
    fn key(&self) -> Option<BehaviorId> {
        Some(self.1)
    }
}

impl RowBits for BodyBits {
    fn key(&self) -> Option<BehaviorId> {
        None
    }
}
