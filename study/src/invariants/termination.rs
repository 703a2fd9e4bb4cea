//! A mission that is covered ends (ALLIANCE.md §5).
//!
//! The mission is owed from the moment on at which nothing more is about to change (every fault that heals has healed, and none
//! will come at a known time), ψ and λ are longer than a unit of work, and the mission is covered ([`super::coverage`]). It must
//! then end within a time that is longer where robots have to search ([`super::strewn`]). If the moment passes, as when a fault strikes that has waited for an event, it is owed from the next one on.
//! Where a robot keeps to tasks that it was given before the start, and cannot work, nothing is owed: nobody takes over.

use alliance_proto::control::{FaultStatus, Phase};
use alliance_proto::mission::promises::Promises;
use alliance_proto::scenario::{BehaviorParams, Body, Robot, Scenario, Setup};
use alliance_proto::time::SimTime;
use missions::Registry;

use super::coverage::{is_covered, is_sound, is_within_reach};
use super::strewn::Strewn;
use super::{WorldState, is_delivered};

/// How many times longer than by one robot alone, in an empty room, a mission may take.
const PATIENCE: f64 = 5.0;

/// Units of work that finding the locations takes, and going there.
const SEARCH_UNITS: f64 = 8.0;

/// What one robot alone needs for items that are strewn anywhere, in an empty room.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Far {
    /// There and back, s.
    unit_s: f64,
    /// To search everywhere, s.
    search_s: f64,
    /// The shortest ψ or λ of whoever brings it, s.
    patience_s: f64,
}

/// What is known of the end so far.
#[derive(Clone, Debug)]
pub struct Termination {
    /// The shortest ψ or λ, s.
    patience_s: f64,
    /// The longest unit of work, s.
    unit_s: f64,
    /// `None` where robots do not search.
    far: Option<Far>,
    /// How long one useless teammate, that talks, can keep a task from a robot (docs/BOUNDS.md), s.
    kept_s: f64,
    /// Robots, by rank, that keep to tasks which they were given before the start: nobody else does those.
    fixed: Vec<usize>,
    /// Since when the mission is owed, and how long it may take.
    owed: Option<(SimTime, f64)>,
    strewn: Strewn,
    promises: Promises,
}

impl Termination {
    /// Before the first tick.
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        let scenario = &setup.scenario;
        let bodies = scenario.robots.iter().map(|robot| scenario.body_of(robot));
        let slowest = bodies.fold(scenario.body, |slowest, body| Body {
            speed_m_s: slowest.speed_m_s.min(body.speed_m_s),
            push_m_s: slowest.push_m_s.min(body.push_m_s),
            turn_deg_s: slowest.turn_deg_s.min(body.turn_deg_s),
            ..slowest
        });
        let units = setup.catalog.sets.iter().map(|set| {
            let skills = scenario.robots.iter().map(|robot| robot.skill_at(set));
            let able = skills.filter(|skill| *skill > 0.0);
            let least = able.reduce(f64::min).unwrap_or(1.0);
            let mission = setup.catalog.mission;
            mission.unit_s(scenario, &slowest, least, set)
        });
        let unit_s = units.fold(0.0, f64::max);
        let across_m = scenario.room.width_m.hypot(scenario.room.height_m);
        let there_and_back_s = 2.0 * across_m / slowest.speed_m_s + 360.0 / slowest.turn_deg_s;
        let robots = setup.alliance.robots.values();
        let params: Vec<&BehaviorParams> = robots.flat_map(|robot| robot.sets.values()).collect();
        let shortest = |of: fn(&BehaviorParams) -> f64| {
            params
                .iter()
                .map(|set| of(set))
                .fold(f64::INFINITY, f64::min)
        };
        let longest =
            |of: fn(&BehaviorParams) -> f64| params.iter().map(|set| of(set)).fold(0.0, f64::max);
        let rise_s = setup.alliance.threshold / shortest(|set| set.fast_impatience);
        let slow_s = longest(|set| {
            set.willing_to_affect_s
                .values()
                .copied()
                .fold(0.0, f64::max)
        });
        let wait_s = longest(|set| set.before_yielding_s + set.ceased_after_s);
        let catalog = &setup.catalog;
        let bring = catalog
            .sets
            .iter()
            .filter(|set| catalog.mission.goes_on(set));
        let robots = setup.alliance.robots.values();
        let bringing =
            robots.flat_map(|robot| bring.clone().filter_map(|set| robot.sets.get(&set.name)));
        let far = catalog
            .mission
            .search_s(scenario, &slowest)
            .map(|search_s| Far {
                unit_s: there_and_back_s.into(),
                search_s,
                patience_s: bringing
                    .map(|set| set.before_yielding_s.min(set.before_giving_up_s))
                    .fold(f64::INFINITY, f64::min),
            });
        let goes_by_assignment = |robot: &Robot| {
            let allocators = Registry::of_this_program().agents();
            let prepared = allocators.prepare(scenario.allocator_of(robot), setup);
            prepared.is_ok_and(|it| it.wants_assignment())
        };
        let robots = scenario.robots.iter().enumerate();
        let fixed = robots.filter(|(_, robot)| goes_by_assignment(robot));
        Self {
            fixed: fixed.map(|(rank, _)| rank).collect(),
            patience_s: shortest(|set| set.before_yielding_s.min(set.before_giving_up_s)),
            unit_s,
            far,
            kept_s: 2.0 * rise_s + slow_s + wait_s,
            owed: None,
            strewn: Strewn::default(),
            promises: setup.catalog.mission.promises(scenario),
        }
    }

    /// Looks at the mission after a tick.
    ///
    /// # Errors
    /// What does not hold.
    pub fn check(&mut self, scenario: &Scenario, state: &WorldState) -> Result<(), String> {
        let left = state
            .items
            .iter()
            .filter(|item| !is_delivered(&self.promises, item))
            .count();
        self.strewn.note(state);
        let off = self.strewn.off_the_ways(scenario, &self.promises);
        let is_patient = self.patience_s > self.unit_s
            && (off == 0 || self.far.is_some_and(|far| far.patience_s > far.unit_s));
        let is_covered = self.promises.ends
            && is_patient
            && left > 0
            && is_calm(state)
            && is_covered(scenario, state)
            && self
                .fixed
                .iter()
                .all(|rank| is_sound(scenario, state, *rank));
        if !is_covered {
            self.owed = None;
            return Ok(());
        }
        let due_s = self.due_s(left, off, scenario, state);
        let (since, before_s) = self.owed.unwrap_or((state.now, due_s));
        let due_s = before_s.max(due_s);
        self.owed = Some((since, due_s));
        if state.now.since(since).as_secs_f64() <= due_s {
            return Ok(());
        }
        if !is_within_reach(scenario, &self.promises, state) {
            // What can be reached changes as items and bodies move.
            self.owed = None;
            return Ok(());
        }
        Err(format!(
            "{left} items are left, although all faults that heal have healed {since} into the run, and {due_s:.0} s should do"
        ))
    }

    /// The time that a mission may take, s: five times what one robot needs for the search and the items left, some of which lie
    /// off the ways, for which each robot searches by itself, one after the other; and, for each teammate that talks and gets
    /// nowhere, twice as long as it can keep a task from the others.
    fn due_s(&self, left: usize, off: usize, scenario: &Scenario, state: &WorldState) -> f64 {
        let robots = state.robots.iter().filter(|robot| robot.takes_part).count();
        let strewn_s = match self.far {
            Some(far) if off > 0 => far.search_s * robots as f64 + far.unit_s * off as f64,
            _ => 0.0,
        };
        let alone_s = self.unit_s * (SEARCH_UNITS + left as f64) + strewn_s;
        let useless = useless(scenario, state) as f64;
        PATIENCE * alone_s + 2.0 * self.kept_s * useless
    }
}

/// Robots that take part and cannot work.
fn useless(scenario: &Scenario, state: &WorldState) -> usize {
    let robots = state.robots.iter().enumerate();
    robots
        .filter(|&(rank, robot)| robot.takes_part && !is_sound(scenario, state, rank))
        .count()
}

/// Whether no fault is about to begin or to heal. What waits for an event may never come.
fn is_calm(state: &WorldState) -> bool {
    let unsettled = |fault: &&FaultStatus| {
        let order = &fault.order;
        let comes = fault.phase == Phase::Armed && order.when.is_none();
        let heals = fault.phase == Phase::InForce && order.for_s.is_some();
        let just_came = fault.applied_ms == Some(state.now);
        comes || heals || just_came
    };
    !state.faults.iter().any(|fault| unsettled(&fault))
}
