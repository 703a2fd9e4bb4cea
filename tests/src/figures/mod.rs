//! The figures of a run and of its report, calculated a second time from the tables of the log.
//!
//! The calculation shares no code with the mission worlds, the recorder or the report. It reads the tables, the
//! scenario and the draws of the scenario (the points of a service mission), and nothing else of run.json. Figures that
//! the tables do not determine exactly, such as the motion in the last step, have bounds.

mod missions;
mod report;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::{Debug, Display};

use ::missions::observe::data::ObserveSection;
use ::missions::waste::data::WasteSection;
use proto::control::{FaultStatus, Phase};
use proto::tick::Outcome;
use run_log::{
    EventRow, Input, MessageRow, MissionRow, PoseRow, ReadError, RunLog, RunOutcome, TickRow,
};
use scenario::Setup;
use scenario::mission::{FigureValue, MissionFigures};

use self::missions::{observe, push, service, waste};
pub use report::report;

/// The tolerance for sums of real numbers, relative to the sum.
const ROUNDING: f64 = 1e-9;

/// The differences between stated and calculated figures, one text for each.
pub type Differences = Vec<String>;

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
    let (run, mut found) = (&log.run, Differences::new());
    let ticks: Vec<TickRow> = log.rows()?;
    let last = ticks.iter().rev().find(|row| row.section == "run");
    let hash = last.map(|row| format!("{:016x}", row.hash));
    same(&mut found, "hash", &run.hash, &hash);
    same(&mut found, "ticks", &run.result.ticks, &tables.ticks);
    let end_ms = tables.ticks * tables.step_ms;
    same(
        &mut found,
        "sim_time_ms",
        &run.result.sim_time_ms.0,
        &end_ms,
    );
    tables.check_outcome(&mut found);

    let inputs = log.inputs()?;
    let unscripted = inputs.iter().any(|line| match &line.input {
        Input::StallBegin { scripted, .. } => !scripted,
        Input::Lost { .. } | Input::Failed { .. } => true,
        _ => false,
    });
    same(&mut found, "unscripted", &run.unscripted, &unscripted);
    for fault in &run.faults {
        tables.check_fault(fault, &mut found);
    }

    let messages: Vec<MessageRow> = log.rows()?;
    let names: Vec<&str> = run.result.robots.keys().map(String::as_str).collect();
    let team: BTreeSet<&str> = tables.robots.iter().copied().collect();
    same(&mut found, "robots", &names, &team.into_iter().collect());
    let (mission, by_robot) = match tables.setup.catalog.mission.name() {
        "waste" => waste(&tables),
        "service" => service(&tables),
        "observe" => observe(&tables, &log.rows()?),
        "push" => push(&tables),
        other => panic!("there is no calculation for the mission '{other}'"),
    };
    compare("", &run.result.mission, &mission, &mut found);
    for (rank, robot) in tables.robots.iter().enumerate() {
        let stated = &run.result.robots[*robot];
        let received = |deliveries: &[&str]| {
            let own = messages.iter().filter(|row| row.receiver == *robot);
            own.filter(|row| deliveries.contains(&row.delivery.as_str()))
                .count() as u64
        };
        let named = |name: &str| format!("robots.{robot}.{name}");
        let incarnations = tables.count("joined", robot);
        let counts = [
            ("incarnations", stated.incarnations.into(), incarnations),
            (
                "ticks_counted",
                stated.ticks_counted,
                tables.counted[rank].len() as u64,
            ),
            (
                "activations",
                stated.activations.into(),
                tables.count("activated", robot),
            ),
            (
                "messages_received",
                stated.messages_received,
                received(&["received", "delayed"]),
            ),
            (
                "messages_lost",
                stated.messages_lost,
                received(&["lost", "dropped", "cut"]),
            ),
            (
                "messages_delayed",
                stated.messages_delayed,
                received(&["delayed"]),
            ),
            (
                "messages_duplicate",
                stated.messages_duplicate,
                received(&["duplicate"]),
            ),
        ];
        for (name, stated, calculated) in counts {
            same(&mut found, named(name), &stated, &calculated);
        }
        // The log lists a broadcast only if another robot was to receive it.
        let mut latest: BTreeMap<u32, u64> = BTreeMap::new();
        for row in messages.iter().filter(|row| row.sender == *robot) {
            let sent = latest.entry(row.incarnation).or_default();
            *sent = (*sent).max(row.seq.map_or(0, |seq| seq + 1));
        }
        let least: u64 = latest.values().sum();
        if stated.messages_sent < least || (stated.bytes_sent == 0) != (stated.messages_sent == 0) {
            let (sent, bytes) = (stated.messages_sent, stated.bytes_sent);
            found.push(format!(
                "{}: {sent} of {bytes} bytes, at least {least}",
                named("messages_sent")
            ));
        }
        compare(&named(""), &stated.mission, &by_robot[rank], &mut found);
    }
    if tables.setup.catalog.mission.name() == "service" {
        let parts = run.result.robots.values();
        let parts = parts.filter_map(|robot| robot.mission.get("surplus_s").number());
        let total = Calculated::near(parts.sum());
        let stated = run.result.mission.get("wasted_robot_s");
        if !total.holds(stated) {
            found.push(format!(
                "wasted_robot_s: {stated:?}, but the robots' sum is {total:?}"
            ));
        }
    }
    Ok(found)
}

fn same<T: PartialEq + Debug>(
    found: &mut Differences,
    name: impl Display,
    stated: &T,
    calculated: &T,
) {
    if stated != calculated {
        found.push(format!(
            "{name}: {stated:?}, but the log has {calculated:?}"
        ));
    }
}

/// Compares all figures of a mission. A figure without a calculation is a difference, too.
fn compare(of: &str, stated: &MissionFigures, calculated: &Named, found: &mut Differences) {
    let names: Vec<&str> = stated.iter().map(|(name, _)| name).collect();
    let known: Vec<&str> = calculated.iter().map(|(name, _)| *name).collect();
    same(found, format!("the figures of '{of}'"), &names, &known);
    for (name, calculated) in calculated {
        let stated = stated.get(name);
        if !calculated.holds(stated) {
            found.push(format!(
                "{of}{name}: {stated:?}, but the log has {calculated:?}"
            ));
        }
    }
}

impl<'a> Tables<'a> {
    fn read(log: &'a RunLog) -> Result<Self, ReadError> {
        let setup = &log.run.setup;
        let step_ms = setup.scenario.step_ms;
        let robots: Vec<&str> = setup
            .scenario
            .robots
            .iter()
            .map(|robot| robot.name.as_str())
            .collect();
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
        same(found, "a complete mission", &self.is_complete(), &is_done);
        match self.outcome {
            RunOutcome::Ended(Outcome::TimeLimit) if !is_over(scenario.limit_s) => {
                found.push(format!(
                    "outcome: time-limit, but the log ends at {end_ms} ms"
                ));
            }
            RunOutcome::Ended(Outcome::Expired) if self.last("expired") == 0 => {
                found.push("outcome: expired, but no work has expired".to_owned());
            }
            _ => {}
        }
    }

    /// Checks the status of a fault by its events.
    fn check_fault(&self, fault: &FaultStatus, found: &mut Differences) {
        let of_fault = || self.events.iter().filter(|row| row.subject == fault.id);
        let last = |kinds: &[&str]| of_fault().rfind(|row| kinds.contains(&row.kind.as_str()));
        let named = |name: &str| format!("fault {} {name}", fault.id);
        let time = |kind: &str| last(&[kind]).map(|row| row.t_ms);
        same(
            found,
            named("applied_ms"),
            &fault.applied_ms,
            &time("applied"),
        );
        same(found, named("healed_ms"), &fault.healed_ms, &time("healed"));
        let hits = of_fault().filter(|row| row.kind == "hit").count() as u64;
        if fault.hits < hits || (hits == 0) != (fault.hits == 0) {
            found.push(format!(
                "{}: {}, but the log has {hits} first hits",
                named("hits"),
                fault.hits
            ));
        }
        let is_over =
            last(&["applied", "healed", "disarmed"]).is_some_and(|row| row.kind == "disarmed");
        if is_over && fault.phase != Phase::Over {
            found.push(format!(
                "{}: {:?} after it was disarmed",
                named("phase"),
                fault.phase
            ));
        }
    }
}
