//! Reader of predicted rows: recovers the rows of each tick.

use csv::StringRecord;
use scenario::Roster;
use scenario::time::SimTime;
use serde::de::DeserializeOwned;

use super::{CompactError, MotivationRule, Prediction};

/// The rows of a table, tick by tick and robot by robot.
pub(crate) struct PredictedRows<'l, R> {
    form: Prediction<R>,
    rule: MotivationRule,
    written: WrittenRows<'l, R>,
    /// The times of the complete ticks that have not begun.
    times: &'l [SimTime],
    now: SimTime,
    /// The rows of each robot in the current tick.
    robots: Vec<Vec<Kept<R>>>,
    /// The number of robots of the current tick that have begun, and of passed rows of the latest one.
    begun: usize,
    passed: usize,
    lines: u64,
}

/// A row of the current tick.
struct Kept<R> {
    row: R,
    /// The motivation in the previous tick.
    before: f64,
    /// True if the latest step did not change the motivation.
    holds: bool,
}

impl<'l, R: Clone + DeserializeOwned> PredictedRows<'l, R> {
    /// Creates the reader of a table from its bytes.
    pub fn new(
        form: Prediction<R>,
        rule: MotivationRule,
        bytes: &'l [u8],
        roster: &'l Roster,
        times: &'l [SimTime],
    ) -> Self {
        let robots = roster.names().count();
        Self {
            rule,
            written: WrittenRows::new(form.header, bytes, roster),
            form,
            times,
            now: SimTime::ZERO,
            robots: (0..robots).map(|_| Vec::new()).collect(),
            begun: robots,
            passed: 0,
            lines: 0,
        }
    }

    /// Returns the next row.
    pub fn advance(&mut self) -> Result<Option<&R>, CompactError> {
        while self.latest().is_none_or(|rows| rows.len() == self.passed) {
            if !self.begin_robot()? {
                return Ok(None);
            }
        }
        self.passed += 1;
        let rows = self.robots.get(self.begun - 1);
        Ok(rows.map(|rows| &rows[self.passed - 1].row))
    }

    /// Returns the number of rows of the file that were used.
    pub fn lines(&self) -> u64 {
        self.lines
    }

    /// Returns the rows of the robot that began last; `None` before the first tick.
    fn latest(&self) -> Option<&Vec<Kept<R>>> {
        self.robots.get(self.begun.checked_sub(1)?)
    }

    /// Begins the next robot, or the first one of the next tick. Returns `false` after the last tick.
    fn begin_robot(&mut self) -> Result<bool, CompactError> {
        if self.begun == self.robots.len() {
            let Some((now, later)) = self.times.split_first().filter(|_| self.begun > 0) else {
                let left = self.written.peek()?;
                return left.map_or(Ok(false), |row| Err(CompactError::Order(row.line)));
            };
            (self.now, self.times) = (*now, later);
            self.begun = 0;
        }
        let rank = self.begun;
        self.begun += 1;
        self.passed = 0;
        for kept in &mut self.robots[rank] {
            *(self.form.time)(&mut kept.row) = self.now;
            if let Some(growth) = &self.form.growth {
                let (rate, factors) = ((growth.rate)(&kept.row), (growth.factors)(&kept.row));
                let motivation = (growth.motivation)(&mut kept.row);
                kept.before = *motivation;
                *motivation = self.rule.next(kept.before, rate, factors, kept.holds);
                kept.holds = is_same(kept.before, *motivation);
            }
        }
        self.replace_written(rank)?;
        Ok(true)
    }

    /// Replaces the predicted rows of a robot by those that are written for this tick.
    fn replace_written(&mut self, rank: usize) -> Result<(), CompactError> {
        let rows = &mut self.robots[rank];
        let mut is_anew = rows.is_empty();
        let mut place = 0;
        while let Some(next) = self.written.peek()? {
            if next.place > (self.now, rank) {
                break;
            }
            let line = next.line;
            if next.place < (self.now, rank) {
                return Err(CompactError::Order(line));
            }
            let row = self.written.next.take().and_then(|next| next.row);
            self.lines += 1;
            let Some(mut row) = row else {
                rows.clear();
                is_anew = true;
                continue;
            };
            if is_anew {
                let (before, holds) = (0.0, false);
                rows.push(Kept { row, before, holds });
                continue;
            }
            let key = (self.form.key)(&row);
            let mut later = rows[place..].iter();
            let found = later.position(|kept| (self.form.key)(&kept.row) == key);
            place += found.ok_or(CompactError::NoEarlierRow(line))?;
            let kept = &mut rows[place];
            if let Some(growth) = &self.form.growth {
                kept.holds = is_same(kept.before, *(growth.motivation)(&mut row));
            }
            kept.row = row;
            place += 1;
        }
        Ok(())
    }
}

fn is_same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits()
}

/// A row that the log contains.
struct Written<R> {
    line: u64,
    /// The time, and the rank of the robot.
    place: (SimTime, usize),
    /// The row; `None` at the end of all earlier rows of the robot.
    row: Option<R>,
}

/// The rows of a file.
struct WrittenRows<'l, R> {
    file: csv::Reader<&'l [u8]>,
    roster: &'l Roster,
    /// The names of the columns in a full log.
    header: StringRecord,
    record: StringRecord,
    /// The next row, if it was read.
    next: Option<Written<R>>,
}

impl<'l, R: Clone + DeserializeOwned> WrittenRows<'l, R> {
    fn new(header: &str, bytes: &'l [u8], roster: &'l Roster) -> Self {
        Self {
            file: csv::Reader::from_reader(bytes),
            roster,
            header: header.trim_end().split(',').collect(),
            record: StringRecord::new(),
            next: None,
        }
    }

    fn peek(&mut self) -> Result<Option<&Written<R>>, CompactError> {
        if self.next.is_none() {
            self.next = self.read()?;
        }
        Ok(self.next.as_ref())
    }

    fn read(&mut self) -> Result<Option<Written<R>>, CompactError> {
        if !self.file.read_record(&mut self.record)? {
            return Ok(None);
        }
        let record = &self.record;
        let line = record.position().map_or(0, csv::Position::line);
        let field = |column| record.get(column).unwrap_or_default();
        let time = field(0).parse().map_err(|_| CompactError::Time(line))?;
        let name = field(1);
        let robot = self.roster.find(name).ok_or_else(|| {
            let name = name.to_owned();
            CompactError::Robot { line, name }
        })?;
        let ends = record.iter().skip(2).all(str::is_empty);
        Ok(Some(Written {
            line,
            place: (SimTime(time), robot.index()),
            row: match ends {
                true => None,
                false => Some(record.deserialize(Some(&self.header))?),
            },
        }))
    }
}
