//! Invariant: a covered mission ends (ALLIANCE.md §5).
//!
//! The mission becomes due when three conditions hold. No fault is about to begin or heal at a known time, ψ and λ are
//! longer than a unit of work, and the mission is covered ([`super::coverage`]). It must then end within a bound, which
//! is longer if robots must search ([`super::strewn`]). If a condition fails, for example through a fault that waited
//! for an event, the mission becomes due again later. It never becomes due while a robot with a fixed assignment cannot
//! work, because no other robot takes over its tasks.

use std::collections::HashSet;

use missions::Registry;
use proto::control::{FaultStatus, Phase};
use scenario::mission::expected_properties::ExpectedProperties;
use scenario::time::SimTime;
use scenario::{BehaviorParams, Body, Robot, Scenario, Setup};

use super::coverage::{is_covered, is_operational, is_within_reach};
use super::strewn::Strewn;
use super::{WorldState, is_delivered};

/// The bound, as a multiple of the time of one robot alone in an empty room.
const PATIENCE: f64 = 5.0;

/// The largest room in which an overdue mission is searched for paths, m².
const LARGEST_M2: f32 = 1e6;

/// Units of work for finding the locations, including the travel.
const SEARCH_UNITS: f64 = 8.0;

/// The times of one robot alone for strewn items, in an empty room.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SearchTimes {
    /// Travel there and back, s.
    unit_s: f64,
    /// Search of the whole room, s.
    search_s: f64,
    /// The shortest ψ or λ of the sets that bring items, s.
    patience_s: f64,
}

#[derive(Clone, Debug)]
pub struct Termination {
    /// The shortest ψ or λ, s.
    patience_s: f64,
    /// The longest unit of work, s.
    unit_s: f64,
    /// Times for strewn items; `None` if robots do not search.
    search: Option<SearchTimes>,
    /// The time for which one useless teammate that sends messages can keep a task from a robot (docs/BOUNDS.md), s.
    kept_s: f64,
    /// Robots, by rank, with a fixed assignment. No other robot does their tasks.
    fixed: Vec<usize>,
    /// The time since which the mission is due, and its bound, s.
    due: Option<(SimTime, f64)>,
    strewn: Strewn,
    promises: ExpectedProperties,
}

impl Termination {
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
        let unit_s_of = setup.catalog.mission.work_unit_s(scenario);
        let units = setup.catalog.sets.iter().map(|set| {
            // Without a named skill, all robots have 1.
            let named = set.skill.iter().flat_map(|_| &scenario.robots);
            let able = (named.map(|robot| robot.skill_at(set))).filter(|skill| *skill > 0.0);
            let least = able.reduce(f64::min).unwrap_or(1.0);
            unit_s_of(&slowest, least, set)
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
        let bring = catalog.sets.iter().filter(|set| {
            catalog
                .mission
                .behavior_properties(scenario, set)
                .is_long_running
        });
        let bring: HashSet<&str> = bring.map(|set| set.name.as_str()).collect();
        let sets = (setup.alliance.robots.values()).flat_map(|robot| &robot.sets);
        let bringing = sets.filter(|(name, _)| bring.contains(name.as_str()));
        let bringing = bringing.map(|(_, set)| set);
        let search = catalog
            .mission
            .search_s(scenario, &slowest)
            .map(|search_s| SearchTimes {
                unit_s: there_and_back_s.into(),
                search_s,
                patience_s: bringing
                    .map(|set| set.before_yielding_s.min(set.before_giving_up_s))
                    .fold(f64::INFINITY, f64::min),
            });
        let has_fixed_assignment = |robot: &Robot| {
            let allocators = Registry::current().agents();
            allocators.uses_assignment(scenario.decider_of(robot))
        };
        let robots = scenario.robots.iter().enumerate();
        let fixed = robots.filter(|(_, robot)| has_fixed_assignment(robot));
        Self {
            fixed: fixed.map(|(rank, _)| rank).collect(),
            patience_s: shortest(|set| set.before_yielding_s.min(set.before_giving_up_s)),
            unit_s,
            search,
            kept_s: 2.0 * rise_s + slow_s + wait_s,
            due: None,
            strewn: Strewn::default(),
            promises: setup.catalog.mission.expected_properties(scenario),
        }
    }

    /// Checks the mission after a tick. The error describes the violation. In a room above 1 km², nothing is checked.
    pub fn check(&mut self, scenario: &Scenario, state: &WorldState) -> Result<(), String> {
        if scenario.room.width_m * scenario.room.height_m > LARGEST_M2 {
            return Ok(());
        }
        let left = state
            .items
            .iter()
            .filter(|item| !is_delivered(&self.promises, item))
            .count();
        self.strewn.update(state);
        let off = self
            .strewn
            .needing_search(&self.promises, scenario.mission().is_searched(scenario));
        let is_patient = self.patience_s > self.unit_s
            && (off == 0
                || self
                    .search
                    .is_some_and(|search| search.patience_s > search.unit_s));
        let is_covered = self.promises.ends
            && is_patient
            && left > 0
            && is_calm(state)
            && is_covered(scenario, state)
            && self
                .fixed
                .iter()
                .all(|rank| is_operational(scenario, state, *rank));
        if !is_covered {
            self.due = None;
            return Ok(());
        }
        let due_s = self.due_s(left, off, scenario, state);
        let (since, before_s) = self.due.unwrap_or((state.now, due_s));
        let due_s = before_s.max(due_s);
        self.due = Some((since, due_s));
        if state.now.since(since).as_secs_f64() <= due_s {
            return Ok(());
        }
        if !is_within_reach(scenario, &self.promises, state) {
            // Reachability changes as items and bodies move.
            self.due = None;
            return Ok(());
        }
        let items = match left {
            1 => "1 item is".to_owned(),
            _ => format!("{left} items are"),
        };
        Err(format!(
            "{items} left, although no fault has been pending since {since}; the bound is {due_s:.0} s"
        ))
    }

    /// Returns the bound for the mission, s: five times what one robot needs for the search and the remaining items,
    /// plus twice `kept_s` for each useless teammate. For strewn items, the robots search one after another.
    fn due_s(&self, left: usize, off: usize, scenario: &Scenario, state: &WorldState) -> f64 {
        let robots = state.robots.iter().filter(|robot| robot.takes_part).count();
        let strewn_s = match self.search {
            Some(search) if off > 0 => search.search_s * robots as f64 + search.unit_s * off as f64,
            _ => 0.0,
        };
        let alone_s = self.unit_s * (SEARCH_UNITS + left as f64) + strewn_s;
        let useless = useless(scenario, state) as f64;
        PATIENCE * alone_s + 2.0 * self.kept_s * useless
    }
}

/// Returns the number of robots that take part but cannot work.
fn useless(scenario: &Scenario, state: &WorldState) -> usize {
    let robots = state.robots.iter().enumerate();
    robots
        .filter(|&(rank, robot)| robot.takes_part && !is_operational(scenario, state, rank))
        .count()
}

/// Returns whether no fault is about to begin or heal. Faults that wait for an event do not count.
pub(crate) fn is_calm(state: &WorldState) -> bool {
    let unsettled = |fault: &&FaultStatus| {
        let order = &fault.order;
        let comes = fault.phase == Phase::Armed && order.when.is_none();
        let heals = fault.phase == Phase::InForce && order.for_s.is_some();
        let just_came = fault.applied_ms == Some(state.now);
        comes || heals || just_came
    };
    !state.faults.iter().any(|fault| unsettled(&fault))
}
