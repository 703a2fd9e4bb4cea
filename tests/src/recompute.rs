//! The motivations of a run, calculated once more from its log: the formulas of ALLIANCE.md §2 and §3 as they are printed,
//! over lists of everything that was heard. Nothing here is shared with the robots' own calculation, which keeps a few
//! times instead of the lists.
//!
//! Taken from the log: what was heard (messages.csv), when lives began (events.csv `joined`), the parameters in force
//! (run.json), and of motivations.csv the columns `sensory_feedback` and `state`. Calculated: all the others.

use std::collections::BTreeMap;

use alliance_proto::log::{EventRow, MessageRow, MotivationRow, ReadError, RunLog};
use alliance_proto::scenario::{Alliance, BehaviorParams, HistoryOrigin};

/// What a recalculation came to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Comparison {
    /// Rows of motivations.csv that were compared.
    pub rows: usize,
    /// Where log and calculation differ.
    pub mismatches: Vec<Mismatch>,
}

/// A value that differs.
#[derive(Clone, Debug, PartialEq)]
pub struct Mismatch {
    /// Of which row.
    pub logged: MotivationRow,
    /// What the row should be.
    pub calculated: MotivationRow,
}

/// Calculates every row of a run's motivations.csv.
///
/// # Errors
/// When a table of the log cannot be read.
pub fn recompute(log: &RunLog) -> Result<Comparison, ReadError> {
    Ok(compare(
        &log.run.setup.alliance,
        &log.rows()?,
        &log.rows()?,
        &log.rows()?,
    ))
}

/// The same from the rows of the three tables.
///
/// # Panics
/// If the tables name robots or behavior sets that the parameters do not know.
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
            panic!("run.json knows no robot '{}'", step[0].robot);
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

/// One robot over all of its lives.
struct Robot<'a> {
    alliance: &'a Alliance,
    sets: &'a BTreeMap<String, BehaviorParams>,
    teammates: Vec<&'a str>,
    /// Starts of its lives, ms.
    lives: Vec<i64>,
    /// What it heard, in the order of hearing: by time, sender's rank, incarnation and number.
    heard: Vec<&'a MessageRow>,
    /// How much of both has passed.
    lives_begun: usize,
    heard_so_far: usize,
    /// Of the present incarnation: each set after the step before.
    before: BTreeMap<String, Before>,
    /// Of the present incarnation, by task and sender.
    history: BTreeMap<&'a str, BTreeMap<&'a str, Vec<Word>>>,
}

/// A behavior set after a step.
#[derive(Clone, Copy)]
struct Before {
    motivation: f64,
    /// Since when it has been active, ms.
    active_since: Option<i64>,
}

/// A message about a task that was not overtaken by a later one.
struct Word {
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
        let is_heard =
            |it: &&MessageRow| it.receiver == name && (it.fate == "heard" || it.fate == "delayed");
        let mut heard: Vec<&MessageRow> = messages.iter().filter(is_heard).collect();
        heard.sort_by_key(|it| {
            let rank = alliance.robots[&it.sender].rank;
            (it.t_ms, rank, it.incarnation, it.seq)
        });
        Self {
            alliance,
            sets: &alliance.robots[name].sets,
            teammates: alliance
                .robots
                .keys()
                .map(String::as_str)
                .filter(|it| *it != name)
                .collect(),
            lives: events
                .iter()
                .filter(joined)
                .map(|it| ms(it.t_ms.0))
                .collect(),
            heard,
            lives_begun: 0,
            heard_so_far: 0,
            before: BTreeMap::new(),
            history: BTreeMap::new(),
        }
    }

    /// What the rows of one step should be. Of the rows themselves only the columns that name them, `sensory_feedback` and
    /// `state` are used.
    fn step(&mut self, rows: &[MotivationRow]) -> Vec<MotivationRow> {
        let now = ms(rows[0].t_ms.0);
        self.begin_lives(now);
        self.hear(now);
        // (A) The set that was active comes first, (B) the others are suppressed if it still is.
        let was_active = |set: &str| self.active_since(set).is_some();
        let goes_on = rows
            .iter()
            .any(|row| was_active(&row.behavior_set) && row.state == "active");
        let calculated: Vec<MotivationRow> = rows
            .iter()
            .map(|row| {
                let suppressed = goes_on && !was_active(&row.behavior_set);
                self.row(row, suppressed, now)
            })
            .collect();
        for row in &calculated {
            let since = self.active_since(&row.behavior_set).unwrap_or(now);
            let after = Before {
                motivation: row.motivation,
                active_since: (row.state == "active").then_some(since),
            };
            self.before.insert(row.behavior_set.clone(), after);
        }
        calculated
    }

    /// A new incarnation knows nothing.
    fn begin_lives(&mut self, now: i64) {
        while self
            .lives
            .get(self.lives_begun)
            .is_some_and(|&start| start <= now)
        {
            let start = self.lives[self.lives_begun];
            self.lives_begun += 1;
            self.before.clear();
            self.history.clear();
            while self.next_heard(start - 1).is_some() {}
        }
    }

    fn next_heard(&mut self, until: i64) -> Option<&'a MessageRow> {
        let next = *self.heard.get(self.heard_so_far)?;
        if ms(next.t_ms.0) > until {
            return None;
        }
        self.heard_so_far += 1;
        Some(next)
    }

    fn hear(&mut self, now: i64) {
        while let Some(message) = self.next_heard(now) {
            let kind = match (message.kind.as_str(), message.state.as_str()) {
                ("position", _) | (_, "executing") => Kind::Executing,
                (_, "waiting") => Kind::Waiting,
                (_, "released") => Kind::Released,
                // Idle, or a kind that is not about a task.
                _ => continue,
            };
            let stamp = (message.incarnation, message.seq.unwrap_or_default());
            let words = self
                .history
                .entry(&message.task)
                .or_default()
                .entry(&message.sender)
                .or_default();
            if words.iter().all(|word| word.stamp < stamp) {
                words.push(Word {
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

    /// Eq. 2.7 with its factors, for one behavior set.
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
        let spared = active_since.is_some() && !self.alliance.switches.reset_stops_active;
        let impatience_reset = spared || !self.is_reset(params, now);
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

    /// Eq. 2.4, with "= 0" (ALLIANCE.md §2).
    fn impatience(&self, params: &BehaviorParams, now: i64) -> f64 {
        let mut slowest = None;
        for teammate in &self.teammates {
            let slow = params.slow_toward(teammate);
            let phi = span(params.phi_toward(teammate));
            let words = self.words(params, teammate);
            let speaks = self.received_lately(words, now - span(params.ceased_after_s), now);
            let is_new = !self.received_since_origin(words, now - phi, now);
            if speaks && is_new && slowest.is_none_or(|slowest| slow < slowest) {
                slowest = Some(slow);
            }
        }
        slowest.unwrap_or(params.fast_impatience)
    }

    /// Eq. 2.5: whether the factor is 0.
    fn is_reset(&self, params: &BehaviorParams, now: i64) -> bool {
        let before = now - ms(self.alliance.step_ms);
        self.teammates.iter().any(|teammate| {
            let words = self.words(params, teammate);
            let just_now = |word: &Word| before < word.at && word.at <= now && self.counts(word);
            words.iter().any(just_now) && !self.received_since_origin(words, before, now)
        })
    }

    /// Eq. 2.6: whether the factor is 0.
    fn acquiesces(&self, params: &BehaviorParams, active_since: i64, now: i64) -> bool {
        let active_for = now - active_since;
        let from = now - span(params.ceased_after_s);
        let wanted = self.teammates.iter().any(|teammate| {
            let words = after_release(self.words(params, teammate));
            words.iter().any(|word| word.at > from)
        });
        (active_for > span(params.before_yielding_s) && wanted)
            || active_for > span(params.before_giving_up_s)
    }

    /// What was heard from a teammate about the task of a set.
    fn words(&self, params: &BehaviorParams, teammate: &str) -> &[Word] {
        let by_sender = self.history.get(params.task.as_str());
        let words = by_sender.and_then(|words| words.get(teammate));
        words.map_or(&[], Vec::as_slice)
    }

    /// Whether a message counts as comm_received in impatience and reset.
    fn counts(&self, word: &Word) -> bool {
        match word.kind {
            Kind::Executing => true,
            Kind::Waiting => self.alliance.switches.waiting_counts,
            Kind::Released => false,
        }
    }

    /// comm_received(from, now): a release ends what came before it.
    fn received_lately(&self, words: &[Word], from: i64, now: i64) -> bool {
        after_release(words)
            .iter()
            .any(|word| from < word.at && word.at <= now && self.counts(word))
    }

    /// comm_received(0, until), where 0 is the origin: the mission's start, or the last reported progress.
    fn received_since_origin(&self, words: &[Word], until: i64, now: i64) -> bool {
        let origin = match self.alliance.switches.history_origin {
            HistoryOrigin::MissionStart => 0,
            HistoryOrigin::Progress => last_progress(words, now),
        };
        words
            .iter()
            .any(|word| origin <= word.at && word.at <= until && self.counts(word))
    }
}

/// The words after the last release.
fn after_release(words: &[Word]) -> &[Word] {
    let released = words.iter().rposition(|word| word.kind == Kind::Released);
    &words[released.map_or(0, |place| place + 1)..]
}

/// When progress was last reported: a count higher than the one before it in the same incarnation, 0 at its start.
fn last_progress(words: &[Word], now: i64) -> i64 {
    let mut incarnation = 0;
    let mut count = 0;
    let mut last = 0;
    for word in words.iter().filter(|word| word.at <= now) {
        if word.stamp.0 != incarnation {
            (incarnation, count) = (word.stamp.0, 0);
        }
        if word.progress > count {
            last = word.at;
        }
        count = word.progress;
    }
    last
}

fn ms(ms: u64) -> i64 {
    ms as i64
}

/// Seconds in ms.
fn span(seconds: f64) -> i64 {
    (seconds * 1000.0).round() as i64
}
