//! Begin and end of faults: triggers, durations, phases and hits. The schedule does not depend on the effects of faults.

use proto::control::{FaultStatus, Phase};
use scenario::Problem;
use scenario::fault::{EventTrigger, Fault, Order, Role};
use scenario::time::SimTime;

/// The index of a fault of the run, in the order of arming.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct FaultIndex(pub usize);

/// A transition of a fault at the beginning of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transition {
    Apply(FaultIndex),
    Heal(FaultIndex),
}

#[derive(Clone, Debug, Default)]
pub struct Schedule {
    entries: Vec<Entry>,
    /// The statuses at the end of the last tick, if one has changed since by more than its hits.
    ended: Option<Vec<FaultStatus>>,
    /// The statuses before the first command of the current tick, if there is one.
    before_commands: Option<Vec<FaultStatus>>,
}

#[derive(Clone, Debug)]
struct Entry {
    status: FaultStatus,
    /// The original order if its target is a role. The status contains the selected robot.
    role_order: Option<Fault>,
    /// The time at which the fault takes effect next.
    due: Option<SimTime>,
    until: Option<SimTime>,
    /// The number of hits before the fault was applied last.
    earlier_hits: u64,
    /// The number of hits at the end of the last tick.
    ended_hits: u64,
}

impl Entry {
    /// Returns the status with the hits at the end of the last tick.
    fn ended(&self) -> FaultStatus {
        FaultStatus {
            hits: self.ended_hits,
            ..self.status.clone()
        }
    }

    /// Checks whether the fault has a target robot, and writes the holder of its role to the status.
    fn resolve_target<'n>(&mut self, with_role: impl Fn(Role<'_>) -> Option<&'n str>) -> bool {
        let Some(ordered) = &self.role_order else {
            return true;
        };
        let target = ordered.role().and_then(with_role);
        if let Some(robot) = target {
            self.status.order.fault = ordered.with_target(robot);
        }
        target.is_some()
    }
}

impl Schedule {
    /// Arms a fault from `now` on, with its own id or as `f1`, `f2`, ….
    ///
    /// # Errors
    /// If another fault has the id.
    pub fn arm(&mut self, mut order: Order, now: SimTime) -> Result<FaultIndex, Problem> {
        let id = self.choose_id(order.id.take(), &[])?;
        self.keep_ended();
        order.id = Some(id.clone());
        let due = match (&order.when, order.at()) {
            (Some(_), _) => None,
            (None, at) => Some(at.unwrap_or(now).max(now)),
        };
        self.entries.push(Entry {
            due,
            until: None,
            earlier_hits: 0,
            ended_hits: 0,
            role_order: order.fault.role().is_some().then(|| order.fault.clone()),
            status: FaultStatus {
                id,
                order,
                phase: Phase::Armed,
                applied_ms: None,
                healed_ms: None,
                hits: 0,
                failed: None,
            },
        });
        Ok(FaultIndex(self.entries.len() - 1))
    }

    /// Returns the id of a fault to be armed: the requested id or a new one.
    ///
    /// # Errors
    /// If another fault has the id, or it is reserved.
    pub fn choose_id(
        &self,
        requested: Option<String>,
        reserved: &[&str],
    ) -> Result<String, Problem> {
        let is_taken = |id: &str| self.find(id).is_some() || reserved.contains(&id);
        match requested {
            Some(id) if is_taken(&id) => {
                let what = format!("'{id}' is already the id of another fault of this run");
                Err(Problem::at(["id"], what, "choose another id, or omit it"))
            }
            Some(id) => Ok(id),
            None => {
                let mut number = self.entries.len() + reserved.len() + 1;
                while is_taken(&format!("f{number}")) {
                    number += 1;
                }
                Ok(format!("f{number}"))
            }
        }
    }

    #[must_use]
    pub fn find(&self, id: &str) -> Option<FaultIndex> {
        let place = self.entries.iter().position(|entry| entry.status.id == id);
        place.map(FaultIndex)
    }

    #[must_use]
    pub fn status(&self, fault: FaultIndex) -> &FaultStatus {
        &self.entries[fault.0].status
    }

    /// Returns the statuses of all faults, in the order of arming.
    pub fn statuses(&self) -> impl Iterator<Item = &FaultStatus> {
        self.entries.iter().map(|entry| &entry.status)
    }

    /// Returns the statuses of all faults at the end of the last tick, where the log of an interrupted run ends.
    #[must_use]
    pub fn ended(&self) -> Vec<FaultStatus> {
        let kept = self.ended.clone();
        kept.unwrap_or_else(|| self.entries.iter().map(Entry::ended).collect())
    }

    /// Ends a tick with the present statuses.
    pub fn end_tick(&mut self) {
        self.ended = None;
        self.before_commands = None;
        for entry in &mut self.entries {
            entry.ended_hits = entry.status.hits;
        }
    }

    /// Keeps the present statuses before the first command of a tick.
    pub fn begin_command(&mut self) {
        if self.before_commands.is_none() {
            self.before_commands = Some(self.statuses().cloned().collect());
        }
    }

    /// Ends a tick without robots. Its commands are in no log, so that the statuses are those before them.
    pub fn end_idle_tick(&mut self) {
        let kept = self.before_commands.take();
        self.end_tick();
        self.ended = kept;
    }

    /// Keeps the statuses at the end of the last tick before one changes.
    fn keep_ended(&mut self) {
        if self.ended.is_none() {
            self.ended = Some(self.ended());
        }
    }

    /// Returns the simulated time at which a fault takes effect; `None` if it waits for an event.
    #[must_use]
    pub fn due(&self, fault: FaultIndex) -> Option<SimTime> {
        self.entries[fault.0].due
    }

    /// Returns the faults in force by index.
    pub fn in_force(&self) -> impl Iterator<Item = (FaultIndex, &Fault)> {
        self.entries
            .iter()
            .enumerate()
            .filter(|(_, entry)| entry.status.phase == Phase::InForce)
            .map(|(index, entry)| (FaultIndex(index), &entry.status.order.fault))
    }

    /// Performs and returns the next transition due at `now`: first healing, then taking effect, each in the order of arming. Call
    /// it until it returns `None`. A fault of a role waits for a robot in that role, which `with_role` returns.
    pub fn next<'n>(
        &mut self,
        now: SimTime,
        with_role: impl Fn(Role<'_>) -> Option<&'n str>,
    ) -> Option<Transition> {
        let is_due = |time: Option<SimTime>| time.is_some_and(|time| time <= now);
        if let Some(index) = self.entries.iter().position(|entry| is_due(entry.until)) {
            self.heal(FaultIndex(index), now);
            return Some(Transition::Heal(FaultIndex(index)));
        }
        if !self.entries.iter().any(|entry| is_due(entry.due)) {
            return None;
        }
        // A role changes the order of a status.
        self.keep_ended();
        let index = self
            .entries
            .iter_mut()
            .position(|entry| is_due(entry.due) && entry.resolve_target(&with_role))?;
        self.apply(FaultIndex(index), now);
        Some(Transition::Apply(FaultIndex(index)))
    }

    pub fn apply(&mut self, fault: FaultIndex, now: SimTime) {
        self.keep_ended();
        let entry = &mut self.entries[fault.0];
        let order = &entry.status.order;
        entry.due = order
            .every_s
            .map(|every_s| now + SimTime::from_secs_f64(every_s).max(SimTime(1)));
        entry.until = order.duration().map(|duration| now + duration);
        entry.earlier_hits = entry.status.hits;
        entry.status.phase = match (order.fault.is_instantaneous(), entry.due) {
            (false, _) => Phase::InForce,
            (true, Some(_)) => Phase::Armed,
            (true, None) => Phase::Over,
        };
        entry.status.applied_ms = Some(now);
        entry.status.failed = None;
    }

    /// Records the reason why the effect of a fault was impossible.
    pub fn fail(&mut self, fault: FaultIndex, why: &str) {
        self.keep_ended();
        self.entries[fault.0].status.failed = Some(why.to_owned());
    }

    fn heal(&mut self, fault: FaultIndex, now: SimTime) {
        self.keep_ended();
        let entry = &mut self.entries[fault.0];
        entry.until = None;
        entry.status.healed_ms = Some(now);
        entry.status.phase = if entry.due.is_some() {
            Phase::Armed
        } else {
            Phase::Over
        };
    }

    /// Checks whether a fault in force neither heals by itself nor repeats.
    #[must_use]
    pub fn is_permanent(&self, fault: FaultIndex) -> bool {
        let entry = &self.entries[fault.0];
        entry.until.is_none() && entry.due.is_none()
    }

    /// Heals or disarms a fault permanently. Returns whether it was in force; `None` if it had already ended.
    pub fn clear(&mut self, fault: FaultIndex, now: SimTime) -> Option<bool> {
        self.keep_ended();
        let entry = &mut self.entries[fault.0];
        let phase = entry.status.phase;
        if phase == Phase::Over {
            return None;
        }
        entry.due = None;
        entry.until = None;
        entry.status.phase = Phase::Over;
        if phase == Phase::InForce {
            entry.status.healed_ms = Some(now);
        }
        Some(phase == Phase::InForce)
    }

    /// Removes a fault from the future: one that has not begun does not begin, and one in force ends at its own time and does
    /// not repeat. Returns whether the fault had not begun.
    pub fn disarm(&mut self, fault: FaultIndex) -> bool {
        self.keep_ended();
        let entry = &mut self.entries[fault.0];
        let is_armed = entry.status.phase == Phase::Armed;
        entry.due = None;
        if is_armed {
            entry.status.phase = Phase::Over;
        }
        is_armed
    }

    /// Returns all faults, in the order of arming.
    pub fn all(&self) -> impl Iterator<Item = FaultIndex> + use<> {
        (0..self.entries.len()).map(FaultIndex)
    }

    /// Checks whether time alone brings a robot back. Then the clock continues without robots.
    #[must_use]
    pub fn will_return_robots(&self) -> bool {
        self.entries.iter().any(|entry| {
            let heals = entry.until.is_some()
                && matches!(
                    entry.status.order.fault,
                    Fault::Kill(_)
                        | Fault::Terminate(_)
                        | Fault::Pause(_)
                        | Fault::Remove(_)
                        | Fault::Power(_)
                );
            let begins = entry.due.is_some()
                && matches!(
                    entry.status.order.fault,
                    Fault::Restart(_) | Fault::Continue(_) | Fault::Add(_)
                );
            heals || begins
        })
    }

    /// Returns the faults that wait for an event.
    pub fn waiting(&self) -> impl Iterator<Item = (FaultIndex, &EventTrigger)> {
        self.entries
            .iter()
            .enumerate()
            .filter_map(|(index, entry)| {
                let waits = entry.status.phase == Phase::Armed && entry.due.is_none();
                let when = entry.status.order.when.as_ref().filter(|_| waits)?;
                Some((FaultIndex(index), when))
            })
    }

    /// Schedules a fault after the event that it waited for.
    pub fn trigger(&mut self, fault: FaultIndex, at: SimTime) {
        self.entries[fault.0].due = Some(at);
    }

    /// Adds a hit to a fault and returns whether it is the first since the fault was applied.
    pub fn hit(&mut self, fault: FaultIndex) -> bool {
        let entry = &mut self.entries[fault.0];
        let is_first = entry.status.hits == entry.earlier_hits;
        entry.status.hits += 1;
        is_first
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use Transition::{Apply, Heal};

    fn order(json: &str) -> Order {
        serde_json::from_str(json).unwrap()
    }

    fn turns(schedule: &mut Schedule, now: u64) -> Vec<Transition> {
        std::iter::from_fn(|| schedule.next(SimTime(now), |_| None)).collect()
    }

    const A: FaultIndex = FaultIndex(0);
    const B: FaultIndex = FaultIndex(1);

    #[test]
    fn a_fault_is_applied_at_its_time_and_healed_after_its_duration() {
        let mut schedule = Schedule::default();
        let order = order(r#"{"fault":{"mute":"blue"},"at_s":0.1,"for_s":0.2}"#);
        schedule.arm(order, SimTime(0)).unwrap();
        assert_eq!(schedule.due(A), Some(SimTime(100)));
        assert!(turns(&mut schedule, 50).is_empty());
        assert_eq!(schedule.in_force().count(), 0);
        assert_eq!(turns(&mut schedule, 100), [Apply(A)]);
        assert_eq!(schedule.in_force().count(), 1);
        assert!(turns(&mut schedule, 250).is_empty());
        assert_eq!(turns(&mut schedule, 300), [Heal(A)]);
        let status = schedule.status(A);
        assert_eq!(status.phase, Phase::Over);
        assert_eq!(status.applied_ms, Some(SimTime(100)));
        assert_eq!(status.healed_ms, Some(SimTime(300)));
        assert!(turns(&mut schedule, 1_000_000).is_empty());
    }

    #[test]
    fn past_and_missing_times_mean_now() {
        let mut schedule = Schedule::default();
        let late = order(r#"{"fault":{"mute":"blue"},"at_s":1}"#);
        schedule.arm(late, SimTime(5000)).unwrap();
        schedule
            .arm(order(r#"{"fault":{"deaf":"blue"}}"#), SimTime(5000))
            .unwrap();
        assert_eq!(turns(&mut schedule, 5000), [Apply(A), Apply(B)]);
    }

    #[test]
    fn healing_precedes_new_faults() {
        let mut schedule = Schedule::default();
        let begins = order(r#"{"fault":{"mute":"blue"},"at_s":1}"#);
        let heals = order(r#"{"fault":{"deaf":"blue"},"for_s":1}"#);
        schedule.arm(begins, SimTime(0)).unwrap();
        schedule.arm(heals, SimTime(0)).unwrap();
        assert_eq!(turns(&mut schedule, 0), [Apply(B)]);
        assert_eq!(turns(&mut schedule, 1000), [Heal(B), Apply(A)]);
    }

    #[test]
    fn a_periodic_fault_repeats_and_reports_a_first_hit_each_time() {
        let mut schedule = Schedule::default();
        let again = order(r#"{"fault":{"mute":"blue"},"at_s":1,"every_s":2,"for_s":0.5}"#);
        schedule.arm(again, SimTime(0)).unwrap();
        for round in 0..3 {
            assert_eq!(turns(&mut schedule, 1000 + round * 2000), [Apply(A)]);
            assert!(schedule.hit(A));
            assert!(!schedule.hit(A));
            assert_eq!(turns(&mut schedule, 1500 + round * 2000), [Heal(A)]);
            assert_eq!(schedule.status(A).phase, Phase::Armed);
        }
        assert_eq!(schedule.status(A).hits, 6);
        let waste = order(r#"{"fault":{"waste":{"x_m":1,"y_m":1}},"every_s":1}"#);
        schedule.arm(waste, SimTime(5500)).unwrap();
        assert_eq!(turns(&mut schedule, 5500), [Apply(B)]);
        assert_eq!(schedule.status(B).phase, Phase::Armed);
        assert_eq!(turns(&mut schedule, 6500), [Apply(B)]);
    }

    #[test]
    fn a_fault_of_a_role_waits_for_a_robot_and_selects_one_each_time() {
        let mut schedule = Schedule::default();
        let again = r#"{"fault":{"mute":"executing:lift"},"at_s":1,"every_s":2,"for_s":1}"#;
        schedule.arm(order(again), SimTime(0)).unwrap();
        schedule
            .arm(order(r#"{"fault":{"deaf":"blue"},"at_s":1}"#), SimTime(0))
            .unwrap();
        let by = |robot: &'static str| {
            move |role: Role<'_>| (role == Role::Executing("lift")).then_some(robot)
        };
        let no_robot = |_: Role<'_>| None;
        // No robot has the role, so the next fault has its turn.
        assert_eq!(schedule.next(SimTime(1000), no_robot), Some(Apply(B)));
        assert_eq!(schedule.next(SimTime(1000), no_robot), None);
        assert_eq!(schedule.status(A).phase, Phase::Armed);
        assert_eq!(schedule.next(SimTime(1050), by("gold")), Some(Apply(A)));
        let target =
            |schedule: &Schedule| schedule.status(A).order.fault.robot().map(str::to_owned);
        assert_eq!(target(&schedule).as_deref(), Some("gold"));
        assert_eq!(schedule.status(A).applied_ms, Some(SimTime(1050)));
        assert_eq!(schedule.next(SimTime(2050), no_robot), Some(Heal(A)));
        assert_eq!(schedule.next(SimTime(3050), by("green")), Some(Apply(A)));
        assert_eq!(target(&schedule).as_deref(), Some("green"));
        // A fault of an idle robot works in the same way.
        let idle = order(r#"{"fault":{"deaf":"idle"}}"#);
        let idle = schedule.arm(idle, SimTime(3100)).unwrap();
        assert_eq!(schedule.next(SimTime(3100), by("green")), None);
        let rests = |role: Role<'_>| (role == Role::Idle).then_some("blue");
        assert_eq!(schedule.next(SimTime(3150), rests), Some(Apply(idle)));
        assert_eq!(schedule.status(idle).order.fault.robot(), Some("blue"));
    }

    #[test]
    fn the_end_of_a_tick_is_known_until_the_next_one_ends() {
        let mut schedule = Schedule::default();
        let first = order(r#"{"fault":{"mute":"blue"}}"#);
        schedule.arm(first, SimTime(0)).unwrap();
        schedule.end_tick();
        assert_eq!(turns(&mut schedule, 0), [Apply(A)]);
        schedule.hit(A);
        let second = order(r#"{"fault":{"deaf":"blue"}}"#);
        schedule.arm(second, SimTime(0)).unwrap();
        let ended = schedule.ended();
        assert_eq!((ended.len(), ended[0].phase), (1, Phase::Armed));
        assert_eq!(ended[0].hits, 0);
        schedule.end_tick();
        schedule.hit(A);
        let ended = schedule.ended();
        assert_eq!((ended.len(), ended[0].phase), (2, Phase::InForce));
        assert_eq!(ended[0].hits, 1);
    }

    #[test]
    fn an_event_triggers_once() {
        let mut schedule = Schedule::default();
        let waits = order(r#"{"fault":{"mute":"blue"},"when":"gold dies","for_s":1}"#);
        schedule.arm(waits, SimTime(0)).unwrap();
        assert_eq!(schedule.due(A), None);
        assert_eq!(schedule.waiting().count(), 1);
        schedule.trigger(A, SimTime(300));
        assert_eq!(schedule.waiting().count(), 0);
        assert_eq!(turns(&mut schedule, 300), [Apply(A)]);
        assert_eq!(turns(&mut schedule, 1300), [Heal(A)]);
        assert_eq!(schedule.waiting().count(), 0);
    }

    #[test]
    fn clearing_heals_or_disarms_for_good() {
        let mut schedule = Schedule::default();
        let again = order(r#"{"fault":{"mute":"blue"},"every_s":2,"for_s":1}"#);
        let waits = order(r#"{"fault":{"mute":"blue"},"when":"gold dies"}"#);
        schedule.arm(again, SimTime(0)).unwrap();
        schedule.arm(waits, SimTime(0)).unwrap();
        assert_eq!(turns(&mut schedule, 0), [Apply(A)]);
        assert_eq!(schedule.clear(A, SimTime(100)), Some(true));
        assert_eq!(schedule.clear(A, SimTime(100)), None);
        assert_eq!(schedule.clear(B, SimTime(100)), Some(false));
        assert_eq!(schedule.waiting().count(), 0);
        assert!(turns(&mut schedule, 1_000_000).is_empty());
        assert_eq!(schedule.status(A).healed_ms, Some(SimTime(100)));
        assert_eq!(schedule.status(B).healed_ms, None);
    }

    #[test]
    fn a_disarmed_fault_does_not_begin_and_one_in_force_ends_without_repeating() {
        let mut schedule = Schedule::default();
        let again = order(r#"{"fault":{"mute":"blue"},"every_s":2,"for_s":1}"#);
        let later = order(r#"{"fault":{"deaf":"blue"},"at_s":3}"#);
        schedule.arm(again, SimTime(0)).unwrap();
        schedule.arm(later, SimTime(0)).unwrap();
        assert_eq!(turns(&mut schedule, 0), [Transition::Apply(A)]);
        assert_eq!(
            schedule
                .all()
                .map(|fault| schedule.disarm(fault))
                .collect::<Vec<_>>(),
            [false, true]
        );
        assert_eq!(turns(&mut schedule, 1000), [Transition::Heal(A)]);
        assert!(turns(&mut schedule, 1_000_000).is_empty());
        assert!(schedule.statuses().all(|fault| fault.phase == Phase::Over));
    }

    #[test]
    fn each_id_is_used_once() {
        let mut schedule = Schedule::default();
        let named = |id: &str| order(&format!(r#"{{"id":"{id}","fault":{{"mute":"blue"}}}}"#));
        schedule.arm(named("f2"), SimTime(0)).unwrap();
        let given = schedule.arm(order(r#"{"fault":{"mute":"blue"}}"#), SimTime(0));
        assert_eq!(schedule.status(given.unwrap()).id, "f3");
        assert_eq!(schedule.find("f2"), Some(A));
        let error = schedule.arm(named("f2"), SimTime(0)).unwrap_err();
        let line = "id: 'f2' is already the id of another fault of this run; choose another id, or omit it";
        assert_eq!(error.to_string(), line);
    }
}
