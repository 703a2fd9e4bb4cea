//! The matrix of the team's utilities, as one robot stores it: a row per robot, from the robot itself or through
//! others.

use std::ops::BitOrAssign;

use proto::allocation::ble::EligibleTask;
use proto::allocation::dhba::{MatrixPart, MatrixRow, PartSizes, ROW_ENTRIES_MAX, RowVersion};
use scenario::ids::RobotId;
use scenario::time::SimTime;

use crate::broken::is_broken;
use crate::by_rank::ByRank;

/// The least number of teammates near a robot that report each row in a period, if as many are near. More: lost rows and
/// lost robots are found earlier. Fewer: fewer messages.
const REPORTS: usize = 8;

/// The version and the state of a robot's row.
#[derive(Clone, Debug, Default)]
struct Row {
    /// The time at which the robot computed the row; `None` while only its existence is known.
    made: Option<SimTime>,
    /// The time of the robot's latest message that is known here.
    seen: SimTime,
    /// The largest utility in the row; 0 if it is empty.
    largest: f32,
    /// True if the row must be sent.
    must_send: bool,
    /// True if the robot itself was received since the versions were last requested.
    is_near: bool,
}

#[derive(Clone, Debug, Default)]
pub struct Matrix {
    rows: ByRank<Row>,
    /// The entries of each row, apart from `rows`, so that the data read for each received version stay in the
    /// processor's nearest cache.
    entries: Vec<Vec<EligibleTask>>,
    /// Memory for the entries of the next row.
    next: Vec<EligibleTask>,
    /// A number that changes with the places, tasks and rounds of the rows.
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
    /// Returns a number that changes with the places, tasks and rounds of the rows, but not with the utilities.
    pub fn structure(&self) -> u64 {
        self.structure
    }

    /// Returns the robots of the rows and their entries, in the order of the places.
    pub fn rows(&self) -> impl Iterator<Item = (RobotId, &[EligibleTask])> {
        let robots = self.rows.iter().map(|(robot, _)| robot);
        robots.zip(self.entries.iter().map(Vec::as_slice))
    }

    /// Returns the robot of the row at a place, and its entries.
    pub fn row(&self, place: usize) -> (RobotId, &[EligibleTask]) {
        (self.rows.rank_at(place), &self.entries[place])
    }

    /// Returns the largest utility of all entries; 0 if there are none.
    pub fn largest(&self) -> f32 {
        let rows = self.rows.iter();
        rows.fold(0.0, |largest, (_, row)| row.largest.max(largest))
    }

    /// Returns the time at which a robot computed its row.
    #[cfg(test)]
    pub fn made(&self, robot: RobotId) -> Option<SimTime> {
        let place = self.rows.place(robot).ok()?;
        self.rows.at(place).made
    }

    /// Returns the place of a robot's row, and whether it is new.
    #[inline]
    fn place_or_insert(&mut self, robot: RobotId) -> (usize, bool) {
        match self.rows.place(robot) {
            Ok(place) => (place, false),
            Err(place) => {
                self.insert(place, robot);
                (place, true)
            }
        }
    }

    /// Inserts a row without entries.
    #[cold]
    fn insert(&mut self, place: usize, robot: RobotId) {
        self.rows.insert(place, robot, Row::default());
        self.entries.insert(place, Vec::new());
        self.structure += 1;
    }

    /// Replaces the entries of a row by `next`. `made` is the time at which the robot computed them.
    fn replace(&mut self, place: usize, made: Option<SimTime>) {
        let (old, new) = (&mut self.entries[place], &mut self.next);
        let is_within = |entry: &EligibleTask, all: &[EligibleTask]| {
            let key = |entry: &EligibleTask| (entry.task, entry.round);
            all.iter().any(|other| key(other) == key(entry))
        };
        let is_same = old.len() == new.len()
            && new.iter().all(|entry| is_within(entry, old))
            && old.iter().all(|entry| is_within(entry, new));
        std::mem::swap(old, new);
        let row = self.rows.at_mut(place);
        let utilities = self.entries[place].iter().map(|entry| entry.utility);
        row.largest = utilities.fold(0.0, f32::max);
        (row.made, row.must_send) = (made, true);
        self.structure += u64::from(!is_same);
        self.has_unsent = true;
    }

    /// Replaces the row of the robot that owns the matrix, if it differs. Returns whether it does.
    pub fn set_own(&mut self, me: RobotId, entries: &[EligibleTask], now: SimTime) -> bool {
        let (place, _) = self.place_or_insert(me);
        let row = self.rows.at_mut(place);
        if row.made.is_some() && self.entries[place] == entries {
            return false;
        }
        row.seen = now;
        self.next.clear();
        self.next.extend_from_slice(entries);
        self.replace(place, Some(now));
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
        let (place, is_newcomer) = self.place_or_insert(version.robot);
        if is_newcomer {
            self.oldest = self.oldest.min(version.seen);
        }
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
        let (row, old) = (self.rows.at(place), &self.entries[place]);
        // A message from before the row here may contain an earlier row.
        let is_current = direct.is_some() && direct >= row.made && version.made.is_some();
        if version.made > row.made || is_current {
            let entries = entries.take(ROW_ENTRIES_MAX);
            if version.made != row.made || !entries.clone().eq(old.iter().copied()) {
                self.next.clear();
                self.next.extend(entries);
                update.is_of_concern = concerns(old, &self.next);
                self.replace(place, version.made);
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
        let differs = received.entries != self.entries[at];
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
                self.entries.remove(place);
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
        let sizes = PartSizes::at(now);
        let mut room = PartSizes::MAX;
        let has_unsent = std::mem::take(&mut self.has_unsent);
        for place in self.rows.places().filter(|_| has_unsent) {
            let (robot, row) = self.rows.entry_mut(place);
            if !row.must_send {
                continue;
            }
            let entries = &self.entries[place];
            let size = sizes.row + sizes.entry * entries.len();
            if size > room {
                self.has_unsent = true;
                continue;
            }
            room -= size;
            row.must_send = false;
            part.rows.push(MatrixRow {
                version: version(robot, row),
                entries: entries.clone(),
            });
        }
        if let Some(from) = self.next_version {
            let room = room / sizes.version;
            let (first, parts) = (self.part, self.parts);
            let is_due = |robot: RobotId| (robot.index() + first).is_multiple_of(parts);
            let rows = self.rows.iter().enumerate().skip(from);
            let mut due = rows.filter(|(_, (robot, _))| is_due(*robot));
            let versions = due.by_ref().take(room);
            part.versions.reserve(room.min(self.entries.len()));
            part.versions
                .extend(versions.map(|(_, (robot, row))| version(robot, row)));
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
