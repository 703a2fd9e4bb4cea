//! The matrix of the team's utilities, as one robot stores it: a row per robot, from the robot itself or through
//! others.

use std::ops::BitOrAssign;

use proto::allocation::ble::EligibleTask;
use proto::allocation::dhba::{
    MatrixPart, MatrixRow, PART_WEIGHT_MAX, ROW_ENTRIES_MAX, RowVersion,
};
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;
use smallvec::SmallVec;

use crate::by_rank::ByRank;

/// The utilities of a robot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    pub entries: Vec<EligibleTask>,
    /// The tasks of the entries.
    pub tasks: TaskFilter,
    /// True if the row must be sent.
    must_send: bool,
}

/// The version of a row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Version {
    /// The time at which the robot computed the row; `None` while only its existence is known.
    made: Option<SimTime>,
    /// The time of the robot's latest message that is known here.
    seen: SimTime,
}

/// A set of tasks in which different tasks may share a bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TaskFilter(u64);

impl FromIterator<TaskId> for TaskFilter {
    fn from_iter<T: IntoIterator<Item = TaskId>>(tasks: T) -> Self {
        let tasks = tasks.into_iter();
        Self(tasks.fold(0, |bits, task| bits | 1 << (task.index() % 64)))
    }
}

impl TaskFilter {
    /// Returns false only if no task is in both sets.
    pub fn may_meet(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    pub fn add(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

impl Row {
    /// Replaces the entries. The row must be sent.
    fn set_entries(&mut self, entries: &[EligibleTask]) {
        self.must_send = true;
        self.entries.clear();
        self.entries.extend_from_slice(entries);
        self.tasks = entries.iter().map(|entry| entry.task).collect();
    }
}

#[derive(Clone, Debug, Default)]
pub struct Matrix {
    /// The versions of the rows. They are apart from the rows, because a robot receives those of all rows from each
    /// teammate, and a large team's versions should stay in the processor's cache.
    versions: ByRank<Version>,
    /// The rows, in the order of `versions`.
    rows: Vec<Row>,
    /// A time before which no sign of life of a teammate in `versions` lies.
    oldest: SimTime,
    /// True if a row must be sent.
    has_unsent: bool,
    /// The index of the next row whose version must be sent; `None` if all have been sent.
    next_version: Option<usize>,
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
    pub fn rows(&self) -> impl Iterator<Item = (RobotId, &Row)> {
        let robots = self.versions.iter().map(|(robot, _)| robot);
        robots.zip(&self.rows)
    }

    /// Replaces the row of the robot that owns the matrix, if it differs. Returns whether it does.
    pub fn set_own(&mut self, me: RobotId, entries: &[EligibleTask], now: SimTime) -> bool {
        let (place, _) = self.place_or_insert(me);
        let (version, row) = (self.versions.at_mut(place), &mut self.rows[place]);
        if version.made.is_some() && row.entries.as_slice() == entries {
            return false;
        }
        (version.made, version.seen) = (Some(now), now);
        row.set_entries(entries);
        self.has_unsent = true;
        true
    }

    /// Returns the index of a robot's row, and whether the row is new.
    fn place_or_insert(&mut self, robot: RobotId) -> (usize, bool) {
        match self.versions.place(robot) {
            Ok(place) => (place, false),
            Err(place) => {
                self.versions.insert(place, robot, Version::default());
                self.rows.insert(place, Row::default());
                (place, true)
            }
        }
    }

    /// Receives the version of a teammate's row. An older version than the one here is answered with the row.
    pub fn receive_version(&mut self, version: &RowVersion) -> Update {
        self.note_version(version).1
    }

    /// Receives a version, and returns the index of its row.
    fn note_version(&mut self, received: &RowVersion) -> (usize, Update) {
        let (place, is_newcomer) = self.place_or_insert(received.robot);
        if is_newcomer {
            self.oldest = self.oldest.min(received.seen);
        }
        let update = Update {
            is_newcomer,
            ..Update::default()
        };
        let version = self.versions.at_mut(place);
        version.seen = version.seen.max(received.seen);
        if received.made < version.made {
            self.rows[place].must_send = true;
            self.has_unsent = true;
        }
        (place, update)
    }

    /// Receives a teammate's row, and forwards it if it is newer than the one here. `direct` is the time of the message
    /// if the teammate itself sent it. Such a message also corrects a row here that bit errors have damaged. `concerns`
    /// returns whether a change of the first entries to the second ones concerns the robot's assignment.
    pub fn receive_row(
        &mut self,
        received: &RowVersion,
        entries: impl Iterator<Item = EligibleTask>,
        direct: Option<SimTime>,
        concerns: impl FnOnce(&[EligibleTask], &[EligibleTask]) -> bool,
    ) -> Update {
        let (place, mut update) = self.note_version(received);
        let (version, row) = (self.versions.at_mut(place), &mut self.rows[place]);
        // A message from before the row here may contain an earlier row.
        let is_current = direct.is_some() && direct >= version.made && received.made.is_some();
        if received.made > version.made || is_current {
            let entries: SmallVec<[EligibleTask; 6]> = entries.take(ROW_ENTRIES_MAX).collect();
            if received.made != version.made || entries.as_slice() != row.entries.as_slice() {
                update.is_of_concern = concerns(&row.entries, &entries);
                version.made = received.made;
                row.set_entries(&entries);
                self.has_unsent = true;
                update.has_changed = true;
            }
        }
        update
    }

    /// Makes the robot's own row anew if a teammate has another one in its place, from a damaged message. The row of the
    /// later time replaces the damaged ones everywhere.
    pub fn correct_own(&mut self, me: RobotId, received: &MatrixRow, now: SimTime) {
        let Ok(place) = self.versions.place(me) else {
            return;
        };
        let (own, row) = (self.versions.at_mut(place), &mut self.rows[place]);
        let made = received.version.made;
        let differs = received.entries != row.entries;
        if made <= Some(now) && (made > own.made || (made == own.made && differs)) {
            (own.made, row.must_send) = (Some(now), true);
            self.has_unsent = true;
        }
    }

    /// Records a direct sign of life of a robot.
    pub fn note_seen(&mut self, robot: RobotId, sent: SimTime) {
        if let Ok(place) = self.versions.place(robot) {
            let seen = &mut self.versions.at_mut(place).seen;
            *seen = sent.max(*seen);
        }
    }

    /// Removes the teammates' rows without a sign of life for `tau`. Returns whether there were any.
    pub fn remove_silent(&mut self, me: RobotId, now: SimTime, tau: SimTime) -> bool {
        if now.since(self.oldest) < tau {
            return false;
        }
        let mut has_removed = false;
        self.oldest = now;
        for place in self.versions.places().rev() {
            let (robot, version) = self.versions.entry_mut(place);
            if robot == me {
                continue;
            }
            if now.since(version.seen) >= tau {
                self.versions.remove(place);
                self.rows.remove(place);
                has_removed = true;
            } else {
                self.oldest = self.oldest.min(version.seen);
            }
        }
        self.has_unsent = self.rows.iter().any(|row| row.must_send);
        has_removed
    }

    /// Requests that the robot's own row and the versions of all rows are sent.
    pub fn repeat(&mut self, me: RobotId) {
        if let Ok(place) = self.versions.place(me) {
            self.rows[place].must_send = true;
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
        if let Ok(place) = self.versions.place(me) {
            self.versions.at_mut(place).seen = now;
        }
        let mut part = MatrixPart::default();
        let mut weight = 0;
        if std::mem::take(&mut self.has_unsent) {
            for ((robot, version), row) in self.versions.iter().zip(&mut self.rows) {
                if row.must_send && weight + 2 + row.entries.len() > PART_WEIGHT_MAX {
                    self.has_unsent = true;
                } else if row.must_send {
                    weight += 2 + row.entries.len();
                    row.must_send = false;
                    part.rows.push(MatrixRow {
                        version: version.of(robot),
                        entries: row.entries.clone(),
                    });
                }
            }
        }
        if let Some(from) = self.next_version {
            let room = PART_WEIGHT_MAX.saturating_sub(weight) / 2;
            let others = self.versions.iter().skip(from).take(room);
            part.versions = others.map(|(robot, version)| version.of(robot)).collect();
            let next = from + room;
            self.next_version = Some(next).filter(|&next| next < self.rows.len());
        }
        part
    }
}

impl Version {
    fn of(self, robot: RobotId) -> RowVersion {
        RowVersion {
            robot,
            made: self.made,
            seen: self.seen,
        }
    }
}
