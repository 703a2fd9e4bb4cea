//! The matrix of the team's utilities, as one robot stores it: a row per robot, from the robot itself or through
//! others.

use std::ops::BitOrAssign;

use proto::allocation::ble::EligibleTask;
use proto::allocation::dhba::{
    MatrixPart, MatrixRow, PART_WEIGHT_MAX, ROW_ENTRIES_MAX, RowVersion,
};
use scenario::ids::RobotId;
use scenario::time::SimTime;

use crate::broken::is_broken;
use crate::by_rank::ByRank;

/// The least number of teammates near a robot that report each row in a period, if as many are near. More: lost rows and
/// lost robots are found earlier. Fewer: fewer messages.
const REPORTS: usize = 8;

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// The time at which the robot computed the row; `None` while only its existence is known.
    pub made: Option<SimTime>,
    /// The time of the robot's latest message that is known here.
    pub seen: SimTime,
    /// Outside of the row, so that the rows of a large team stay in the processor's cache.
    pub entries: Vec<EligibleTask>,
    /// The largest utility in `entries`; 0 if there are none.
    pub largest: f32,
    /// True if the row must be sent.
    must_send: bool,
    /// True if the robot itself was received since the versions were last requested.
    is_near: bool,
}

impl Row {
    /// Replaces the entries. Returns whether the tasks or their rounds differ.
    fn replace(&mut self, entries: Vec<EligibleTask>) -> bool {
        let is_within = |entry: &EligibleTask, all: &[EligibleTask]| {
            let key = |entry: &EligibleTask| (entry.task, entry.round);
            all.iter().any(|other| key(other) == key(entry))
        };
        let is_same = self.entries.len() == entries.len()
            && entries.iter().all(|new| is_within(new, &self.entries))
            && self.entries.iter().all(|old| is_within(old, &entries));
        let utilities = entries.iter().map(|entry| entry.utility);
        self.largest = utilities.fold(0.0, f32::max);
        self.entries = entries;
        !is_same
    }
}

#[derive(Clone, Debug, Default)]
pub struct Matrix {
    rows: ByRank<Row>,
    /// A number that changes with the tasks and rounds of the rows.
    structure: u64,
    /// A time before which no sign of life of a teammate in `rows` lies.
    oldest: SimTime,
    /// True if a row must be sent.
    has_unsent: bool,
    /// The index of the next row whose version must be sent; `None` if all have been sent.
    next_version: Option<usize>,
    /// The number of parts into which the versions are divided.
    parts: usize,
    /// The number of the part that is sent.
    part: usize,
}

/// The effects of a received version or row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Update {
    /// True if entries have changed.
    pub has_changed: bool,
    /// True if the change concerns the robot's assignment.
    pub is_of_concern: bool,
    /// True if the robot of the row was not known before.
    pub is_newcomer: bool,
}

impl BitOrAssign for Update {
    fn bitor_assign(&mut self, other: Self) {
        self.has_changed |= other.has_changed;
        self.is_of_concern |= other.is_of_concern;
        self.is_newcomer |= other.is_newcomer;
    }
}

impl Matrix {
    /// Returns a number that changes with the tasks and rounds of the rows, but not with the utilities.
    pub fn structure(&self) -> u64 {
        self.structure
    }

    pub fn rows(&self) -> impl Iterator<Item = (RobotId, &Row)> {
        self.rows.iter()
    }

    /// Replaces the row of the robot that owns the matrix, if it differs. Returns whether it does.
    pub fn set_own(&mut self, me: RobotId, entries: &[EligibleTask], now: SimTime) -> bool {
        let row = self.rows.get_or_insert_with(me, Row::default);
        if row.made.is_some() && row.entries.as_slice() == entries {
            return false;
        }
        (row.made, row.seen, row.must_send) = (Some(now), now, true);
        self.structure += u64::from(row.replace(entries.into()));
        self.has_unsent = true;
        true
    }

    /// Returns whether a version changes nothing here, as most of them do.
    #[inline]
    pub fn is_known(&self, version: &RowVersion) -> bool {
        self.rows.place(version.robot).is_ok_and(|place| {
            let row = self.rows.at(place);
            version.made == row.made && version.seen <= row.seen
        })
    }

    /// Receives the version of a teammate's row. An older version than the one here is answered with the row. Returns
    /// whether the teammate was not known before.
    pub fn receive_version(&mut self, version: &RowVersion) -> bool {
        self.note_version(version).1
    }

    /// Receives a version. Returns the index of its row, and whether the teammate was not known before.
    #[inline]
    fn note_version(&mut self, version: &RowVersion) -> (usize, bool) {
        let (place, is_newcomer) = match self.rows.place(version.robot) {
            Ok(place) => (place, false),
            Err(place) => {
                self.rows.insert(place, version.robot, Row::default());
                self.oldest = self.oldest.min(version.seen);
                (place, true)
            }
        };
        let row = self.rows.at_mut(place);
        row.seen = row.seen.max(version.seen);
        if version.made < row.made {
            row.must_send = true;
            self.has_unsent = true;
        }
        (place, is_newcomer)
    }

    /// Receives a teammate's row, and forwards it if it is newer than the one here. `direct` is the time of the message
    /// if the teammate itself sent it. Such a message also corrects a row here that bit errors have damaged. `concerns`
    /// returns whether a change of the first entries to the second ones concerns the robot's assignment.
    pub fn receive_row(
        &mut self,
        version: &RowVersion,
        entries: impl Iterator<Item = EligibleTask> + Clone,
        direct: Option<SimTime>,
        concerns: impl FnOnce(&[EligibleTask], &[EligibleTask]) -> bool,
    ) -> Update {
        let (place, is_newcomer) = self.note_version(version);
        let mut update = Update {
            is_newcomer,
            ..Update::default()
        };
        let row = self.rows.at_mut(place);
        // A message from before the row here may contain an earlier row.
        let is_current = direct.is_some() && direct >= row.made && version.made.is_some();
        if version.made > row.made || is_current {
            let entries = entries.take(ROW_ENTRIES_MAX);
            if version.made != row.made || !entries.clone().eq(row.entries.iter().copied()) {
                let entries: Vec<EligibleTask> = entries.collect();
                update.is_of_concern = concerns(&row.entries, &entries);
                (row.made, row.must_send) = (version.made, true);
                self.structure += u64::from(row.replace(entries));
                self.has_unsent = true;
                update.has_changed = true;
            }
        }
        update
    }

    /// Makes the robot's own row anew if a teammate has another one in its place, from a damaged message. The row of the
    /// later time replaces the damaged ones everywhere.
    pub fn correct_own(&mut self, me: RobotId, received: &MatrixRow, now: SimTime) {
        let Ok(at) = self.rows.place(me) else { return };
        let row = self.rows.at_mut(at);
        let made = received.version.made;
        let differs = received.entries.as_slice() != row.entries.as_slice();
        if made <= Some(now) && (made > row.made || (made == row.made && differs)) {
            (row.made, row.must_send) = (Some(now), true);
            self.has_unsent = true;
        }
    }

    /// Records a direct sign of life of a robot.
    pub fn note_seen(&mut self, robot: RobotId, sent: SimTime) {
        if let Ok(at) = self.rows.place(robot) {
            let row = self.rows.at_mut(at);
            row.seen = sent.max(row.seen);
            row.is_near = true;
        }
    }

    /// Removes the teammates' rows without a sign of life for `tau`. Returns whether there were any.
    pub fn remove_silent(&mut self, me: RobotId, now: SimTime, tau: SimTime) -> bool {
        if now.since(self.oldest) < tau || is_broken("dhba-rows-never-age") {
            return false;
        }
        let mut has_removed = false;
        self.oldest = now;
        for place in self.rows.places().rev() {
            let (robot, row) = self.rows.entry_mut(place);
            if robot == me {
                continue;
            }
            if now.since(row.seen) >= tau {
                self.rows.remove(place);
                has_removed = true;
            } else {
                self.oldest = self.oldest.min(row.seen);
            }
        }
        self.has_unsent = self.rows.iter().any(|(_, row)| row.must_send);
        self.structure += u64::from(has_removed);
        has_removed
    }

    /// Requests that the robot's own row and the versions of all rows are sent, or a part of the versions if many
    /// teammates are near, because these report the others. `period` is the number of the period since the start.
    pub fn repeat(&mut self, me: RobotId, period: u64) {
        let mut near = 0;
        for row in self.rows.values_mut() {
            near += usize::from(std::mem::take(&mut row.is_near));
        }
        self.parts = (near / REPORTS).max(1);
        // Teammates begin with different parts.
        self.part = me.index() + (period % self.parts as u64) as usize;
        if let Ok(at) = self.rows.place(me) {
            self.rows.at_mut(at).must_send = true;
            self.has_unsent = true;
        }
        self.next_version = Some(0);
    }

    /// Returns whether a row or a version must be sent.
    pub fn must_send(&self) -> bool {
        self.next_version.is_some() || self.has_unsent
    }

    /// Returns the next message: rows that must be sent, and versions as far as they fit.
    pub fn next_part(&mut self, me: RobotId, now: SimTime) -> MatrixPart {
        if let Ok(at) = self.rows.place(me) {
            self.rows.at_mut(at).seen = now;
        }
        let mut part = MatrixPart::default();
        let mut weight = 0;
        let has_unsent = std::mem::take(&mut self.has_unsent);
        for place in self.rows.places().filter(|_| has_unsent) {
            let (robot, row) = self.rows.entry_mut(place);
            if row.must_send && weight + 2 + row.entries.len() > PART_WEIGHT_MAX {
                self.has_unsent = true;
            } else if row.must_send {
                weight += 2 + row.entries.len();
                row.must_send = false;
                part.rows.push(MatrixRow {
                    version: version(robot, row),
                    entries: row.entries.clone(),
                });
            }
        }
        if let Some(from) = self.next_version {
            let room = PART_WEIGHT_MAX.saturating_sub(weight) / 2;
            let (first, parts) = (self.part, self.parts);
            let is_due = |robot: RobotId| (robot.index() + first).is_multiple_of(parts);
            let rows = self.rows.iter().enumerate().skip(from);
            let mut due = rows.filter(|(_, (robot, _))| is_due(*robot));
            let versions = due.by_ref().take(room);
            part.versions = versions
                .map(|(_, (robot, row))| version(robot, row))
                .collect();
            self.next_version = due.next().map(|(place, _)| place);
        }
        part
    }
}

fn version(robot: RobotId, row: &Row) -> RowVersion {
    RowVersion {
        robot,
        made: row.made,
        seen: row.seen,
    }
}
