//! The figures of a run and of its report, calculated a second time from the tables of the log.
//!
//! The calculation shares no code with the mission worlds, the recorder or the report. It reads the tables, the
//! scenario and the draws of the scenario (the points of a service mission), and nothing else of run.json. Figures that
//! the tables do not determine exactly, such as the motion in the last step, have bounds.

mod missions;
mod report;
mod service;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::{Debug, Display};

use ::missions::observe::data::ObserveSection;
use ::missions::waste::data::WasteSection;
use proto::control::{FaultStatus, Phase};
use proto::tick::Outcome;
use run_log::{
    EventRow, HitRow, Input, MessageRow, MissionRow, PoseRow, ReadError, RunLog, RunOutcome,
    SentRow, TickRow,
};
use scenario::Setup;
use scenario::mission::{FigureValue, MissionFigures};
use scenario::time::SimTime;

use self::missions::{observe, push, waste};
use self::service::service;
pub use report::{report, report_of};

/// The tolerance for sums of real numbers, relative to the sum.
const ROUNDING: f64 = 1e-9;

/// The differences between stated and calculated figures, one text for each.
#[derive(Clone, Debug, Default)]
pub struct Differences(pub Vec<String>);

impl Differences {
    /// Adds a difference if the log has another value.
    fn compare<T: PartialEq + Debug>(&mut self, name: impl Display, stated: T, calculated: T) {
        if stated != calculated {
            let text = format!("{name}: {stated:?}, but the log has {calculated:?}");
            self.0.push(text);
        }
    }

    /// Adds a text if the condition does not hold.
    fn require(&mut self, holds: bool, text: impl Display) {
        if !holds {
            self.0.push(text.to_string());
        }
    }

    /// Compares all figures of a mission. A figure without a calculation is a difference, too.
    fn compare_all(&mut self, of: &str, stated: &MissionFigures, calculated: &Named) {
        let names: Vec<&str> = stated.iter().map(|(name, _)| name).collect();
        let known: Vec<&str> = calculated.iter().map(|(name, _)| *name).collect();
        self.compare(format!("the figures of '{of}'"), names, known);
        for (name, calculated) in calculated {
            let value = stated.get(name);
            let text = format!("{of}{name}: {value:?}, but the log has {calculated:?}");
            self.require(calculated.holds(value), text);
        }
    }
}

/// A figure as the tables determine it.
#[derive(Clone, Copy, Debug)]
enum Calculated {
    Exactly(FigureValue),
    /// A number in this range, inclusive.
    Between(f64, f64),
}

impl<T: Into<FigureValue>> From<T> for Calculated {
    fn from(value: T) -> Self {
        Self::Exactly(value.into())
    }
}

impl Calculated {
    fn near(number: f64) -> Self {
        let slack = ROUNDING * number.abs().max(1.0);
        Self::Between(number - slack, number + slack)
    }

    fn holds(self, stated: FigureValue) -> bool {
        match self {
            Self::Exactly(value) => stated == value,
            Self::Between(least, most) => stated
                .number()
                .is_some_and(|number| (least..=most).contains(&number)),
        }
    }
}

type Named = Vec<(&'static str, Calculated)>;

/// The figures of a mission and of each robot, by rank.
type OfMission = (Named, Vec<Named>);

/// The tables of a full log.
struct Tables<'a> {
    setup: &'a Setup,
    robots: Vec<&'a str>,
    step_ms: u64,
    ticks: u64,
    events: Vec<EventRow>,
    hits: Vec<HitRow>,
    poses: Vec<PoseRow>,
    /// The ticks in which a report of each robot counted, by rank.
    counted: Vec<BTreeSet<u64>>,
    mission: Vec<MissionRow>,
    outcome: RunOutcome,
}

/// Compares every figure of run.json with the tables of a full log.
///
/// # Errors
/// Returns an error if a table of the log cannot be read.
pub fn run_file(log: &RunLog) -> Result<Differences, ReadError> {
    let tables = Tables::read(log)?;
    let (run, mut found) = (&log.run, Differences::default());
    let ticks: Vec<TickRow> = log.rows()?;
    let last = ticks.iter().rev().find(|row| row.section == "run");
    let hash = last.map(|row| format!("{:016x}", row.hash));
    found.compare("hash", &run.hash, &hash);
    found.compare("ticks", run.result.ticks, tables.ticks);
    let end_ms = tables.ticks * tables.step_ms;
    found.compare("sim_time_ms", run.result.sim_time_ms.0, end_ms);
    tables.check_outcome(&mut found);

    let inputs = log.inputs()?;
    let unscripted = inputs.iter().any(|line| match &line.input {
        Input::StallBegin { scripted, .. } => !scripted,
        Input::Lost { .. } | Input::Failed { .. } | Input::Body(_) => true,
        _ => false,
    });
    found.compare("unscripted", run.unscripted, unscripted);
    for fault in &run.faults {
        tables.check_fault(fault, &mut found);
    }

    let messages: Vec<MessageRow> = log.rows()?;
    let sent: Vec<SentRow> = log.rows()?;
    let team: BTreeSet<&str> = tables.robots.iter().copied().collect();
    let names = run.result.robots.keys().map(String::as_str);
    found.compare("robots", names.collect(), team);
    let mission_name = tables.setup.catalog.mission.name();
    let (mission, by_robot) = match mission_name {
        "waste" => waste(&tables),
        "service" => service(&tables),
        "observe" => observe(&tables, &log.rows()?),
        "push" => push(&tables),
        other => panic!("there is no calculation for the mission '{other}'"),
    };
    found.compare_all("", &run.result.mission, &mission);
    for (rank, robot) in tables.robots.iter().enumerate() {
        let stated = &run.result.robots[*robot];
        let received = |deliveries: &str| {
            let is_one = |row: &&MessageRow| deliveries.split(' ').any(|one| one == row.delivery);
            let own = messages.iter().filter(|row| row.receiver == *robot);
            own.filter(is_one).count() as u64
        };
        let own_sent = |value: fn(&SentRow) -> u32| -> u64 {
            let own = sent.iter().filter(|row| row.robot == *robot);
            own.map(|row| u64::from(value(row))).sum()
        };
        let named = |name: &str| format!("robots.{robot}.{name}");
        let (joins, activations) = (
            u64::from(stated.incarnations),
            u64::from(stated.activations),
        );
        let counted = tables.counted[rank].len() as u64;
        for (name, stated, calculated) in [
            ("incarnations", joins, tables.count("joined", robot)),
            ("ticks_counted", stated.ticks_counted, counted),
            ("activations", activations, tables.count("activated", robot)),
            (
                "received",
                stated.messages_received,
                received("received delayed damaged"),
            ),
            (
                "lost",
                stated.messages_lost,
                received("lost dropped cut faded blocked corrupted"),
            ),
            ("delayed", stated.messages_delayed, received("delayed")),
            ("sent", stated.messages_sent, own_sent(|row| row.messages)),
            ("bytes", stated.bytes_sent, own_sent(|row| row.bytes)),
            (
                "duplicate",
                stated.messages_duplicate,
                received("duplicate"),
            ),
        ] {
            found.compare(named(name), stated, calculated);
        }
        // messages.csv lists a broadcast only if another robot was to receive it.
        let mut latest: BTreeMap<u32, u64> = BTreeMap::new();
        for row in messages.iter().filter(|row| row.sender == *robot) {
            let sent = latest.entry(row.incarnation).or_default();
            *sent = (*sent).max(row.seq.map_or(0, |seq| seq + 1));
        }
        let least: u64 = latest.values().sum();
        let sent = stated.messages_sent;
        let text = format!("{robot} sent {sent}, at least {least} in messages.csv");
        found.require(sent >= least, text);
        found.compare_all(&named(""), &stated.mission, &by_robot[rank]);
    }
    if mission_name == "service" {
        let parts = run.result.robots.values();
        let parts = parts.filter_map(|robot| robot.mission.get("surplus_s").number());
        let total = Calculated::near(parts.sum());
        let stated = run.result.mission.get("wasted_robot_s");
        let text = format!("wasted_robot_s: {stated:?}, but the robots' sum is {total:?}");
        found.require(total.holds(stated), text);
    }
    Ok(found)
}

impl<'a> Tables<'a> {
    fn read(log: &'a RunLog) -> Result<Self, ReadError> {
        let setup = &log.run.setup;
        let step_ms = setup.scenario.step_ms;
        let robots = setup.scenario.robots.iter();
        let robots: Vec<&str> = robots.map(|robot| robot.name.as_str()).collect();
        let mut counted = vec![BTreeSet::new(); robots.len()];
        let mut ticks = 0;
        for row in log.each_row::<TickRow>() {
            let row = row?;
            ticks = ticks.max(row.tick + 1);
            let rank = robots.iter().position(|robot| *robot == row.robot);
            if let Some(rank) = rank.filter(|_| row.section == "readings") {
                counted[rank].insert(row.tick);
            }
        }
        Ok(Self {
            setup,
            robots,
            step_ms,
            ticks,
            events: log.rows()?,
            hits: log.rows()?,
            poses: log.rows()?,
            counted,
            mission: log.rows()?,
            outcome: log.run.outcome,
        })
    }

    fn step_s(&self) -> f64 {
        self.step_ms as f64 / 1000.0
    }

    fn rank(&self, robot: &str) -> Option<usize> {
        self.robots.iter().position(|name| *name == robot)
    }

    fn of_kind(&self, kind: &str) -> impl Iterator<Item = &EventRow> {
        self.events.iter().filter(move |row| row.kind == kind)
    }

    fn count(&self, kind: &str, robot: &str) -> u64 {
        self.of_kind(kind).filter(|row| row.robot == robot).count() as u64
    }

    /// Returns a value of the last row of mission.csv.
    fn last(&self, column: &str) -> u64 {
        let row = self.mission.last();
        row.and_then(|row| row.get(column)).unwrap_or_default() as u64
    }

    fn is_complete(&self) -> bool {
        self.outcome == RunOutcome::Ended(Outcome::Complete)
    }

    /// Checks the outcome by the remaining work in mission.csv and by the time limit.
    fn check_outcome(&self, found: &mut Differences) {
        let scenario = &self.setup.scenario;
        let end_ms = self.ticks * self.step_ms;
        let is_over = |limit_s: f64| end_ms >= (1000.0 * limit_s).round() as u64;
        let is_done = match self.setup.catalog.mission.name() {
            "waste" => {
                let section = WasteSection::of(scenario);
                let left = ["items_in_spills", "items_carried", "items_on_floor"];
                match section.respawn {
                    true => is_over(section.duration_s.unwrap_or(scenario.limit_s)),
                    false => left.iter().all(|column| self.last(column) == 0),
                }
            }
            "observe" => is_over(ObserveSection::from_scenario(scenario).duration_s),
            "push" => self.last("bars_left") == 0,
            _ => self.last("open") == 0 && self.last("expired") == 0 && self.is_complete(),
        };
        found.compare("a complete mission", self.is_complete(), is_done);
        let (is_over, has_expired) = (is_over(scenario.limit_s), self.last("expired") > 0);
        let agrees = match self.outcome {
            RunOutcome::Ended(Outcome::TimeLimit) => is_over,
            RunOutcome::Ended(Outcome::Expired) => has_expired,
            _ => true,
        };
        found.require(agrees, format!("{:?} at {end_ms} ms", self.outcome));
    }

    /// Checks the status of a fault by its events.
    fn check_fault(&self, fault: &FaultStatus, found: &mut Differences) {
        let of_fault = || self.events.iter().filter(|row| row.subject == fault.id);
        let last = |kinds: &[&str]| of_fault().rfind(|row| kinds.contains(&row.kind.as_str()));
        let named = |name: &str| format!("fault {} {name}", fault.id);
        let time = |kind: &str| last(&[kind]).map(|row| row.t_ms);
        // A change at the end is in a tick that never ended, so that no table contains it.
        let end_ms = self.ticks * self.step_ms;
        let in_tables = |stated: &SimTime| stated.0 < end_ms;
        for (name, stated, kind) in [
            ("applied_ms", fault.applied_ms, "applied"),
            ("healed_ms", fault.healed_ms, "healed"),
        ] {
            if stated.as_ref().is_none_or(in_tables) {
                found.compare(named(name), stated, time(kind));
            }
        }
        let of_fault_hits = self.hits.iter().filter(|row| row.fault == fault.id);
        let hits: u64 = of_fault_hits.clone().map(|row| row.hits).sum();
        found.compare(named("hits"), fault.hits, hits);
        // The event is of the tick of the first effect after the fault was applied.
        let first_hits = of_fault().filter(|row| row.kind == "hit");
        let are_listed = first_hits.map(|row| row.t_ms).all(|at| {
            let mut rows = of_fault_hits.clone();
            rows.any(|row| row.t_ms == at)
        });
        found.require(are_listed, named("has a first effect that hits.csv lacks"));
        let change = last(&["applied", "healed", "disarmed"]);
        let is_over = change.is_some_and(|row| row.kind == "disarmed");
        let text = format!("{:?} after it was disarmed", fault.phase);
        found.require(!is_over || fault.phase == Phase::Over, named(&text));
    }
}
