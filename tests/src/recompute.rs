//! The motivations of a run, calculated from its log by the formulas of ALLIANCE.md §2 and §3 over lists of all
//! received messages.
//!
//! The calculation shares no code with the robots' own, which keeps a few times instead of the lists. Inputs are the
//! received messages (messages.csv), the starts of incarnations (events.csv `joined`), the parameters (run.json), and
//! the columns `sensory_feedback` and `state` of motivations.csv. All other columns are calculated.

use std::collections::BTreeMap;

use run_log::{EventRow, MessageRow, MotivationRow, ReadError, RunLog};
use scenario::{Alliance, BehaviorParams, HistoryOrigin};

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Comparison {
    /// The number of compared rows of motivations.csv.
    pub rows: usize,
    /// The rows in which log and calculation differ.
    pub mismatches: Vec<Mismatch>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Mismatch {
    pub logged: MotivationRow,
    pub calculated: MotivationRow,
}

/// Calculates every row of a run's motivations.csv.
///
/// # Errors
/// Returns an error if a table of the log cannot be read.
pub fn recompute(log: &RunLog) -> Result<Comparison, ReadError> {
    Ok(compare(
        &log.run.setup.alliance,
        &log.rows()?,
        &log.rows()?,
        &log.rows()?,
    ))
}

/// Calculates and compares the rows of the three tables.
///
/// # Panics
/// Panics if the tables contain robots or behavior sets without parameters.
#[must_use]
pub fn compare(
    alliance: &Alliance,
    motivations: &[MotivationRow],
    messages: &[MessageRow],
    events: &[EventRow],
) -> Comparison {
    let mut robots: BTreeMap<&str, Robot<'_>> = alliance
        .robots
        .keys()
        .map(|name| (name.as_str(), Robot::new(name, alliance, messages, events)))
        .collect();
    let mut comparison = Comparison::default();
    for step in motivations.chunk_by(|a, b| (a.t_ms, &a.robot) == (b.t_ms, &b.robot)) {
        let Some(robot) = robots.get_mut(step[0].robot.as_str()) else {
            panic!("run.json has no robot '{}'", step[0].robot);
        };
        for (logged, calculated) in step.iter().zip(robot.step(step)) {
            comparison.rows += 1;
            if *logged != calculated {
                comparison.mismatches.push(Mismatch {
                    logged: logged.clone(),
                    calculated,
                });
            }
        }
    }
    comparison
}

/// A robot over all of its incarnations.
struct Robot<'a> {
    alliance: &'a Alliance,
    sets: &'a BTreeMap<String, BehaviorParams>,
    teammates: Vec<&'a str>,
    /// The start times of its incarnations, in ms.
    joins: Vec<i64>,
    /// The received messages in order of time, sender's rank, incarnation and sequence number.
    received: Vec<&'a MessageRow>,
    /// The numbers of processed starts and messages.
    joins_processed: usize,
    received_processed: usize,
    /// Each set after the previous step of the present incarnation.
    before: BTreeMap<String, Previous>,
    /// The records of the present incarnation, by task and sender.
    history: BTreeMap<&'a str, BTreeMap<&'a str, Vec<Record>>>,
}

#[derive(Clone, Copy)]
struct Previous {
    motivation: f64,
    /// The time of its activation, in ms.
    active_since: Option<i64>,
}

/// A message about a task that was not overtaken by a later one.
struct Record {
    at: i64,
    stamp: (u32, u64),
    kind: Kind,
    progress: u32,
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Executing,
    Waiting,
    Released,
}

impl<'a> Robot<'a> {
    fn new(
        name: &str,
        alliance: &'a Alliance,
        messages: &'a [MessageRow],
        events: &'a [EventRow],
    ) -> Self {
        let joined = |event: &&EventRow| event.kind == "joined" && event.robot == name;
        let is_received = |row: &&MessageRow| {
            let is_delivered = ["received", "delayed", "damaged"].contains(&&*row.delivery);
            row.receiver == name && is_delivered
        };
        let mut received: Vec<&MessageRow> = messages.iter().filter(is_received).collect();
        received.sort_by_key(|row| {
            let rank = alliance.robots[&row.sender].rank;
            (row.t_ms, rank, row.incarnation, row.seq)
        });
        Self {
            alliance,
            sets: &alliance.robots[name].sets,
            teammates: alliance
                .robots
                .keys()
                .map(String::as_str)
                .filter(|teammate| *teammate != name)
                .collect(),
            joins: events
                .iter()
                .filter(joined)
                .map(|event| ms(event.t_ms.0))
                .collect(),
            received,
            joins_processed: 0,
            received_processed: 0,
            before: BTreeMap::new(),
            history: BTreeMap::new(),
        }
    }

    /// Returns the calculated rows of one step. The logged rows give only the names, `sensory_feedback` and `state`.
    fn step(&mut self, rows: &[MotivationRow]) -> Vec<MotivationRow> {
        let now = ms(rows[0].t_ms.0);
        self.begin_incarnations(now);
        self.receive(now);
        // The active set comes first. If it stays active, it suppresses the other sets.
        let was_active = |set: &str| self.active_since(set).is_some();
        let stays_active = rows
            .iter()
            .any(|row| was_active(&row.behavior_set) && row.state == "active");
        let calculated: Vec<MotivationRow> = rows
            .iter()
            .map(|row| {
                let suppressed = stays_active && !was_active(&row.behavior_set);
                self.row(row, suppressed, now)
            })
            .collect();
        for row in &calculated {
            let since = self.active_since(&row.behavior_set).unwrap_or(now);
            let after = Previous {
                motivation: row.motivation,
                active_since: (row.state == "active").then_some(since),
            };
            self.before.insert(row.behavior_set.clone(), after);
        }
        calculated
    }

    /// Clears all state at the start of an incarnation.
    fn begin_incarnations(&mut self, now: i64) {
        while self
            .joins
            .get(self.joins_processed)
            .is_some_and(|&start| start <= now)
        {
            let start = self.joins[self.joins_processed];
            self.joins_processed += 1;
            self.before.clear();
            self.history.clear();
            while self.next_received(start - 1).is_some() {}
        }
    }

    fn next_received(&mut self, until: i64) -> Option<&'a MessageRow> {
        let next = *self.received.get(self.received_processed)?;
        if ms(next.t_ms.0) > until {
            return None;
        }
        self.received_processed += 1;
        Some(next)
    }

    fn receive(&mut self, now: i64) {
        while let Some(message) = self.next_received(now) {
            let kind = match (message.kind.as_str(), message.state.as_str()) {
                ("position", _) | (_, "executing") => Kind::Executing,
                (_, "waiting") => Kind::Waiting,
                (_, "released") => Kind::Released,
                // An idle heartbeat, or a message that is not about a task.
                _ => continue,
            };
            let stamp = (message.incarnation, message.seq.unwrap_or_default());
            let records = self
                .history
                .entry(&message.task)
                .or_default()
                .entry(&message.sender)
                .or_default();
            if records.iter().all(|record| record.stamp < stamp) {
                records.push(Record {
                    at: ms(message.t_ms.0),
                    stamp,
                    kind,
                    progress: message.progress.unwrap_or_default(),
                });
            }
        }
    }

    fn active_since(&self, set: &str) -> Option<i64> {
        self.before.get(set)?.active_since
    }

    /// Calculates Eq. 2.7 with its factors for one behavior set.
    fn row(&self, logged: &MotivationRow, suppressed: bool, now: i64) -> MotivationRow {
        let params = &self.sets[&logged.behavior_set];
        let before = self.before.get(&logged.behavior_set);
        let active_since = self.active_since(&logged.behavior_set);
        let step_s = if before.is_some() {
            self.alliance.step_ms as f64 / 1000.0
        } else {
            0.0
        };
        let impatience = self.impatience(params, now);
        let sensory_feedback = logged.sensory_feedback;
        let activity_suppression = !suppressed;
        let is_exempt = active_since.is_some() && !self.alliance.switches.reset_stops_active;
        let impatience_reset = is_exempt || !self.is_reset(params, now);
        let acquiescence = active_since.is_none_or(|since| !self.acquiesces(params, since, now));
        let factors = [
            sensory_feedback,
            activity_suppression,
            impatience_reset,
            acquiescence,
        ];
        let product: f64 = factors
            .iter()
            .map(|&factor| f64::from(u8::from(factor)))
            .product();
        let level = before.map_or(0.0, |before| before.motivation);
        let motivation = f64::min(
            self.alliance.threshold,
            (level + impatience * step_s) * product,
        );
        MotivationRow {
            motivation,
            impatience,
            activity_suppression,
            impatience_reset,
            acquiescence,
            ..logged.clone()
        }
    }

    /// Calculates Eq. 2.4, with "= 0" (ALLIANCE.md §2).
    fn impatience(&self, params: &BehaviorParams, now: i64) -> f64 {
        let mut slowest = None;
        for teammate in &self.teammates {
            let slow = params.slow_impatience_toward(teammate);
            let phi = span(params.willing_to_affect_toward_s(teammate));
            let records = self.records(params, teammate);
            let is_recent = self.received_lately(records, now - span(params.ceased_after_s), now);
            let is_new = !self.received_since_origin(records, now - phi, now);
            if is_recent && is_new && slowest.is_none_or(|slowest| slow < slowest) {
                slowest = Some(slow);
            }
        }
        slowest.unwrap_or(params.fast_impatience)
    }

    /// Returns whether the factor of Eq. 2.5 is 0.
    fn is_reset(&self, params: &BehaviorParams, now: i64) -> bool {
        let before = now - ms(self.alliance.step_ms);
        self.teammates.iter().any(|teammate| {
            let records = self.records(params, teammate);
            let just_now =
                |record: &Record| before < record.at && record.at <= now && self.counts(record);
            records.iter().any(just_now) && !self.received_since_origin(records, before, now)
        })
    }

    /// Returns whether the factor of Eq. 2.6 is 0.
    fn acquiesces(&self, params: &BehaviorParams, active_since: i64, now: i64) -> bool {
        let active_for = now - active_since;
        let from = now - span(params.ceased_after_s);
        let is_requested = self.teammates.iter().any(|teammate| {
            let records = after_release(self.records(params, teammate));
            records.iter().any(|record| record.at > from)
        });
        (active_for > span(params.before_yielding_s) && is_requested)
            || active_for > span(params.before_giving_up_s)
    }

    /// Returns the records of a teammate about the task of a set.
    fn records(&self, params: &BehaviorParams, teammate: &str) -> &[Record] {
        let by_sender = self.history.get(params.task.as_str());
        let records = by_sender.and_then(|records| records.get(teammate));
        records.map_or(&[], Vec::as_slice)
    }

    /// Returns whether a message counts as comm_received in impatience and reset.
    fn counts(&self, record: &Record) -> bool {
        match record.kind {
            Kind::Executing => true,
            Kind::Waiting => self.alliance.switches.waiting_counts,
            Kind::Released => false,
        }
    }

    /// Returns comm_received(from, now). A release ends earlier messages.
    fn received_lately(&self, records: &[Record], from: i64, now: i64) -> bool {
        after_release(records)
            .iter()
            .any(|record| from < record.at && record.at <= now && self.counts(record))
    }

    /// Returns comm_received(0, until), where 0 is the mission's start or the last reported progress.
    fn received_since_origin(&self, records: &[Record], until: i64, now: i64) -> bool {
        let origin = match self.alliance.switches.history_origin {
            HistoryOrigin::MissionStart => 0,
            HistoryOrigin::Progress => last_progress(records, now),
        };
        records
            .iter()
            .any(|record| origin <= record.at && record.at <= until && self.counts(record))
    }
}

fn after_release(records: &[Record]) -> &[Record] {
    let released = records
        .iter()
        .rposition(|record| record.kind == Kind::Released);
    &records[released.map_or(0, |place| place + 1)..]
}

/// Returns the time of the last progress: a higher count than before in the same incarnation, which starts with 0.
fn last_progress(records: &[Record], now: i64) -> i64 {
    let mut incarnation = 0;
    let mut count = 0;
    let mut last = 0;
    for record in records.iter().filter(|record| record.at <= now) {
        if record.stamp.0 != incarnation {
            (incarnation, count) = (record.stamp.0, 0);
        }
        if record.progress > count {
            last = record.at;
        }
        count = record.progress;
    }
    last
}

fn ms(ms: u64) -> i64 {
    ms as i64
}

/// Converts seconds to ms.
fn span(seconds: f64) -> i64 {
    (seconds * 1000.0).round() as i64
}
