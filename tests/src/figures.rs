//! The figures of a run and of its report, calculated a second time from the tables of the log.
//!
//! The calculation shares no code with the mission worlds, the recorder or the report. It reads the tables, the
//! scenario and the draws of the scenario (the points of a service mission), and nothing else of run.json. Figures that
//! the tables do not determine exactly, such as the motion in the last step, have bounds.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::{Debug, Display};

use analysis::report::{History, HistoryError, Metrics};
use missions::observe::data::ObserveSection;
use missions::push::data::PushSection;
use missions::service::data::{ServiceSection, points};
use missions::waste::data::WasteSection;
use proto::control::{FaultStatus, Phase};
use proto::tick::Outcome;
use run_log::{
    AllocationRow, EventRow, Input, MessageRow, MissionRow, MotivationRow, PoseRow, ReadError,
    RunLog, RunOutcome, TargetRow, TickRow,
};
use scenario::Setup;
use scenario::mission::{FigureValue, MissionFigures};

/// The tolerance for sums of real numbers, relative to the sum.
const ROUNDING: f64 = 1e-9;

/// The tolerance for a distance that decides whether a target is in range, m.
const EDGE_M: f32 = 1e-4;

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
        let lives = tables.count("joined", robot);
        let counts = [
            ("lives", stated.lives.into(), lives),
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
                "messages_heard",
                stated.messages_heard,
                received(&["heard", "delayed"]),
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

fn waste(tables: &Tables<'_>) -> OfMission {
    let section = WasteSection::of(&tables.setup.scenario);
    let period_ms = (1000.0 * section.report_period_s).round() as u64;
    let (mut before_ms, mut late_ms) = (0, Vec::new());
    for report in tables.of_kind("reported") {
        late_ms.push(report.t_ms.0.saturating_sub(before_ms + period_ms));
        before_ms = report.t_ms.0;
    }
    let count = |kind: &str| tables.of_kind(kind).count() as u64;
    let carried = count("picked") - count("dropped") - count("delivered");
    let added = tables.of_kind("hit").filter_map(|row| {
        let words: Vec<&str> = row.detail.split(' ').collect();
        let items = words.iter().position(|word| *word == "--items");
        (words[0] == "waste").then(|| items.map_or(1, |at| words[at + 1].parse().unwrap_or(0)))
    });
    let all = section
        .spills
        .iter()
        .map(|spill| u64::from(spill.items))
        .sum::<u64>()
        + added.sum::<u64>();
    let in_spills = tables.last("items_in_spills");
    let on_floor = tables.last("items_on_floor");
    let delivered = if section.respawn {
        count("respawned")
    } else {
        all - in_spills - on_floor - carried
    };
    let mean =
        |ms: &[u64]| (!ms.is_empty()).then(|| ms.iter().sum::<u64>() as f64 / ms.len() as f64);
    let mut mission: Named = vec![
        ("items.in_spills", in_spills.into()),
        ("items.carried", carried.into()),
        ("items.on_floor", on_floor.into()),
        ("items.delivered", delivered.into()),
        ("reports_made", count("reported").into()),
        ("report_lateness_mean_ms", mean(&late_ms).into()),
        (
            "report_lateness_max_ms",
            late_ms.iter().max().copied().into(),
        ),
    ];
    if section.respawn {
        let hours = (tables.ticks * tables.step_ms) as f64 / 3_600_000.0;
        mission.push(("items_per_hour", Calculated::near(delivered as f64 / hours)));
    }
    let robots = tables.robots.iter().map(|robot| -> Named {
        vec![
            ("items_delivered", tables.count("delivered", robot).into()),
            ("reports_made", tables.count("reported", robot).into()),
        ]
    });
    (mission, robots.collect())
}

/// A point of a service mission.
struct Point {
    kind: usize,
    /// The exact time of the arrival, which can lie between two ticks, ms.
    arrival_ms: u64,
    period_ms: u64,
    has_arrived: bool,
    open: bool,
    /// True if a robot has worked on it since its arrival.
    begun: bool,
}

/// The number of steps of a kind of work, as bounds.
#[derive(Clone, Copy, Default)]
struct Steps {
    least: u64,
    most: u64,
}

impl Steps {
    fn add(&mut self, is_certain: bool) {
        self.least += u64::from(is_certain);
        self.most += 1;
    }

    fn times(self, step_s: f64) -> Calculated {
        Calculated::Between(
            self.least as f64 * step_s - ROUNDING,
            self.most as f64 * step_s + ROUNDING,
        )
    }
}

fn number_of(point: &str) -> usize {
    point
        .trim_start_matches('p')
        .parse()
        .expect("the name of a point")
}

/// Follows the workers of all points through the events. A robot works on a point from `begun` up to `left`, or until
/// the point is done or expired.
fn service(tables: &Tables<'_>) -> OfMission {
    let scenario = &tables.setup.scenario;
    let section = ServiceSection::of(scenario);
    let until_ms = section
        .duration_s
        .map_or(u64::MAX, |end_s| (1000.0 * end_s).round() as u64);
    let period_ms = |kind: usize| {
        let period_s = section.kinds[kind].period_s.unwrap_or_default();
        (1000.0 * period_s).round() as u64
    };
    let new = |kind: usize, arrival_ms: u64| Point {
        kind,
        arrival_ms,
        period_ms: period_ms(kind),
        has_arrived: false,
        open: false,
        begun: false,
    };
    let mut all: Vec<Point> = points(scenario, tables.setup.seed)
        .iter()
        .map(|point| new(point.kind, point.arrives.0))
        .collect();
    let team = tables.robots.len();
    let mut worked: Vec<Option<usize>> = vec![None; team];
    let (mut work, mut surplus) = (vec![Steps::default(); team], vec![Steps::default(); team]);
    let (mut waits_ms, mut responses_ms) = (Vec::new(), Vec::new());
    let (mut expired, mut last_done_ms) = (0_u64, None);
    let mut left_over = tables.events.as_slice();
    for tick in 0..tables.ticks {
        let now_ms = tick * tables.step_ms;
        let count = left_over
            .iter()
            .take_while(|row| row.t_ms.0 <= now_ms)
            .count();
        let (events, rest) = left_over.split_at(count);
        left_over = rest;
        let mut done_by: BTreeMap<usize, usize> = BTreeMap::new();
        let mut begun: Vec<Option<usize>> = vec![None; team];
        let mut left = vec![false; team];
        for row in events {
            let rank = tables.rank(&row.robot);
            match (row.kind.as_str(), rank) {
                ("hit", _) if row.detail.starts_with("point ") => {
                    let name = row.detail.split(' ').next_back().unwrap_or_default();
                    all.push(new(section.kind_named(name).unwrap_or(0), now_ms));
                }
                ("arrived", _) => {
                    let point = &mut all[number_of(&row.subject)];
                    point.arrival_ms += u64::from(point.has_arrived) * point.period_ms;
                    (point.has_arrived, point.open, point.begun) = (true, true, false);
                }
                ("expired", _) => {
                    all[number_of(&row.subject)].open = false;
                    expired += 1;
                }
                ("begun", Some(rank)) => begun[rank] = Some(number_of(&row.subject)),
                ("left", Some(rank)) => left[rank] = true,
                ("done", Some(rank)) => {
                    let point = number_of(&row.subject);
                    done_by.insert(point, rank);
                    all[point].open = false;
                    responses_ms.push(now_ms - all[point].arrival_ms);
                    last_done_ms = Some(now_ms);
                }
                _ => {}
            }
        }
        // The workers of each point in order of rank, each with whether the log proves the work.
        let mut workers: BTreeMap<usize, Vec<(usize, bool)>> = BTreeMap::new();
        for rank in 0..team {
            let goes_on = worked[rank].filter(|_| !left[rank]).and_then(|point| {
                // A robot of a lower rank acts before the point is done, if it works in that step at all.
                match done_by.get(&point) {
                    None => all[point].open.then_some((point, true)),
                    Some(by) if *by == rank => Some((point, true)),
                    Some(by) => (rank < *by).then_some((point, false)),
                }
            });
            let works = begun[rank].map(|point| (point, true)).or(goes_on);
            worked[rank] = works.map(|(point, _)| point);
            if let Some((point, is_certain)) = works {
                workers.entry(point).or_default().push((rank, is_certain));
            }
        }
        for (number, workers) in workers {
            let point = &mut all[number];
            if !std::mem::replace(&mut point.begun, true) {
                waits_ms.push(now_ms - point.arrival_ms);
            }
            let kind = &section.kinds[point.kind];
            let are_certain = workers.iter().all(|(_, is_certain)| *is_certain);
            for (place, (rank, is_certain)) in workers.into_iter().enumerate() {
                let is_surplus = !kind.kept && place >= kind.workers as usize;
                if are_certain || kind.kept {
                    let steps = if is_surplus { &mut surplus } else { &mut work };
                    steps[rank].add(is_certain);
                } else {
                    work[rank].add(false);
                    surplus[rank].add(false);
                }
            }
        }
    }
    if section.kinds.iter().any(|kind| kind.kept) {
        // Work at a point with enough workers has no events if the work of the others is kept.
        for (steps, counted) in surplus.iter_mut().zip(&tables.counted) {
            steps.most += counted.len() as u64;
        }
    }
    let pending = all
        .iter()
        .filter(|point| !point.has_arrived && point.arrival_ms < until_ms);
    let open = pending.count() + all.iter().filter(|point| point.open).count();
    responses_ms.sort_unstable();
    let mean =
        |ms: &[u64]| (!ms.is_empty()).then(|| ms.iter().sum::<u64>() as f64 / ms.len() as f64);
    let p95 = |ms: &[u64]| (!ms.is_empty()).then(|| ms[(ms.len() * 95).div_ceil(100) - 1]);
    let step_s = tables.step_s();
    let wasted = surplus.iter().fold(Steps::default(), |sum, steps| Steps {
        least: sum.least + steps.least,
        most: sum.most + steps.most,
    });
    let mission: Named = vec![
        ("done", (responses_ms.len() as u64).into()),
        ("expired", expired.into()),
        ("open", (open as u64).into()),
        (
            "makespan_ms",
            last_done_ms.filter(|_| tables.is_complete()).into(),
        ),
        ("wait.mean_ms", mean(&waits_ms).into()),
        ("response.mean_ms", mean(&responses_ms).into()),
        ("response.p95_ms", p95(&responses_ms).into()),
        ("wasted_robot_s", wasted.times(step_s)),
    ];
    let robots = tables
        .robots
        .iter()
        .enumerate()
        .map(|(rank, robot)| -> Named {
            vec![
                ("done", tables.count("done", robot).into()),
                ("work_s", work[rank].times(step_s)),
                ("surplus_s", surplus[rank].times(step_s)),
                ("way_m", way(tables, rank)),
            ]
        });
    (mission, robots.collect())
}

/// Returns the way of a robot, m. A row of poses.csv has the speed of the previous step, so that the last step before
/// the end or before an absence is not in the table.
fn way(tables: &Tables<'_>, rank: usize) -> Calculated {
    let robot = &tables.setup.scenario.robots[rank];
    let own = tables.poses.iter().filter(|row| row.robot == robot.name);
    let own: Vec<&PoseRow> = own.collect();
    let way_m: f64 = own
        .iter()
        .map(|row| f64::from(row.speed_m_s) * tables.step_s())
        .sum();
    let gaps = own
        .windows(2)
        .filter(|pair| pair[1].t_ms.0 - pair[0].t_ms.0 > tables.step_ms)
        .count();
    let fastest_m_s = f64::from(tables.setup.scenario.body_of(robot).speed_m_s);
    let slack_m = 1e-6 * way_m.max(1.0);
    let missing_m = (gaps + 1) as f64 * fastest_m_s * tables.step_s();
    Calculated::Between(way_m - slack_m, way_m + missing_m + slack_m)
}

fn push(tables: &Tables<'_>) -> OfMission {
    /// The rounding of a logged advance, m.
    const DIGIT_M: f64 = 0.0005 + 1e-9;
    let section = PushSection::of(&tables.setup.scenario);
    let least_m = f64::from(section.stroke_m / 4.0);
    let bars = section.bars.len() as u64;
    let arrived = tables.of_kind("arrived").count() as u64;
    let last_ms = tables.of_kind("arrived").last().map(|row| row.t_ms.0);
    let (mut totals, mut robots) = ([Steps::default(); 2], Vec::new());
    for robot in &tables.robots {
        let (mut strokes, mut changes) = ([Steps::default(); 2], Steps::default());
        let (mut pushed_m, mut pushes, mut before, mut is_sure) = (0.0, 0.0, None, true);
        for row in tables.of_kind("pushed").filter(|row| row.robot == *robot) {
            let moved_m: f64 = row
                .detail
                .trim_end_matches(" m")
                .parse()
                .expect("an advance");
            pushed_m += moved_m;
            pushes += 1.0;
            // An advance at the limit can be a stroke or none.
            let is_clear = (moved_m - least_m).abs() > DIGIT_M;
            if is_clear && moved_m < least_m {
                continue;
            }
            is_sure &= is_clear;
            strokes[usize::from(row.subject.ends_with("right"))].add(is_clear);
            if before.is_some_and(|before| before != row.subject.as_str()) {
                changes.add(is_sure);
            }
            before = Some(row.subject.as_str());
        }
        if !is_sure {
            changes.least = 0;
            changes.most = strokes.iter().map(|strokes| strokes.most).sum();
        }
        let whole = |steps: Steps| match steps.least == steps.most {
            true => Calculated::from(steps.most),
            false => steps.times(1.0),
        };
        let all = [strokes[0], strokes[1], changes];
        for (total, part) in totals.iter_mut().zip([
            Steps {
                least: strokes[0].least + strokes[1].least,
                most: strokes[0].most + strokes[1].most,
            },
            changes,
        ]) {
            total.least += part.least;
            total.most += part.most;
        }
        let named = ["strokes_left", "strokes_right", "changes_of_end"]
            .into_iter()
            .zip(all.map(whole));
        let mut figures: Named = named.collect();
        let slack_m = pushes * DIGIT_M + 1e-9;
        figures.push((
            "pushed_m",
            Calculated::Between(pushed_m - slack_m, pushed_m + slack_m),
        ));
        robots.push(figures);
    }
    let mission: Named = vec![
        ("arrived", arrived.into()),
        (
            "makespan_ms",
            last_ms.filter(|_| tables.is_complete()).into(),
        ),
        ("strokes", totals[0].times(1.0)),
        ("changes_of_end", totals[1].times(1.0)),
        ("bars_arrived", arrived.into()),
        ("bars_left", (bars - arrived).into()),
    ];
    (mission, robots)
}

/// Counts the observed targets of each tick. A robot sees the targets in its range at the end of the step, if it looks.
fn observe(tables: &Tables<'_>, targets: &[TargetRow]) -> OfMission {
    let range_m = ObserveSection::from_scenario(&tables.setup.scenario).range_m;
    let mut at: BTreeMap<(u64, &str), (f32, f32)> = BTreeMap::new();
    for row in &tables.poses {
        at.insert((row.t_ms.0, row.robot.as_str()), (row.x_m, row.y_m));
    }
    // A fault that moves a robot takes effect between the end of a step and the next poses.
    let moved: BTreeSet<(u64, &str)> = tables
        .of_kind("applied")
        .filter(|row| row.detail.starts_with("move-robot "))
        .map(|row| (row.t_ms.0, row.robot.as_str()))
        .collect();
    let (mut seen, mut unseen, mut longest) = (BTreeMap::new(), BTreeMap::new(), 0);
    let mut blind = Steps::default();
    let mut robot_steps = 0;
    for step in targets.chunk_by(|a, b| a.t_ms == b.t_ms) {
        let now_ms = step[0].t_ms.0;
        let next_ms = now_ms + tables.step_ms;
        for row in step {
            let run: &mut u64 = unseen.entry(row.target.as_str()).or_default();
            *run = if row.observers == 0 { *run + 1 } else { 0 };
            longest = longest.max(*run);
            *seen.entry(row.target.as_str()).or_insert(0_u64) += u64::from(row.observers > 0);
        }
        for robot in &tables.robots {
            if !at.contains_key(&(now_ms, robot)) {
                continue;
            }
            robot_steps += 1;
            let place = at
                .get(&(next_ms, *robot))
                .filter(|_| !moved.contains(&(next_ms, *robot)));
            let Some((x_m, y_m)) = place else {
                blind.add(false);
                continue;
            };
            let near = |row: &&TargetRow, margin_m: f32| {
                (row.x_m - x_m).hypot(row.y_m - y_m) <= range_m + margin_m
            };
            let possible: Vec<&TargetRow> = step.iter().filter(|row| near(row, EDGE_M)).collect();
            let others = |row: &TargetRow| {
                let others = tables.robots.iter().filter(|other| *other != robot);
                let places = others
                    .filter_map(|other| at.get(&(next_ms, *other)).or(at.get(&(now_ms, *other))));
                let fast_m = 10.0 * tables.step_s() as f32;
                places
                    .filter(|(x_m, y_m)| (row.x_m - x_m).hypot(row.y_m - y_m) <= range_m + fast_m)
                    .count() as u32
            };
            // It looks if a target has more observers than others can be; it does not if a target in range has none.
            let must_see = possible
                .iter()
                .any(|row| near(row, -EDGE_M) && row.observers > others(row));
            let cannot = possible.iter().all(|row| row.observers == 0)
                || possible
                    .iter()
                    .any(|row| near(row, -EDGE_M) && row.observers == 0);
            if !must_see {
                blind.add(cannot);
            }
        }
    }
    let steps = tables.ticks;
    let observed: u64 = seen.values().sum();
    let count = seen.len() as f64;
    let entropy: f64 = seen
        .values()
        .filter(|times| **times > 0)
        .map(|times| *times as f64 / observed as f64)
        .map(|part| -part * part.ln())
        .sum();
    let h = (observed > 0 && count > 1.0).then(|| entropy / count.ln());
    let share = |part: u64| part as f64 / robot_steps as f64;
    let a = observed as f64 / (steps as f64 * count);
    let mission: Named = vec![
        (
            "a",
            if count > 0.0 {
                Calculated::near(a)
            } else {
                FigureValue::None.into()
            },
        ),
        ("h", h.map_or(FigureValue::None.into(), Calculated::near)),
        (
            "unseen.max_ms",
            (count > 0.0).then_some(longest * tables.step_ms).into(),
        ),
        (
            "blind_share",
            match robot_steps {
                0 => FigureValue::None.into(),
                _ => {
                    Calculated::Between(share(blind.least) - ROUNDING, share(blind.most) + ROUNDING)
                }
            },
        ),
    ];
    (mission, vec![Named::new(); tables.robots.len()])
}

/// Compares the tables of a report with the tables of a full log.
///
/// # Errors
/// Returns an error if the log cannot be read.
pub fn report(log: &RunLog) -> Result<Differences, HistoryError> {
    let history = History::read(log)?;
    let metrics = Metrics::compute(&history, &log.run);
    let tables = Tables::read(log)?;
    let work = Work::read(&tables, log)?;
    let mut found = Differences::new();
    let ms = |ticks: usize| ticks as u64 * tables.step_ms;
    let makespan_ms = tables.is_complete().then(|| ms(tables.ticks as usize));
    let stated_ms = metrics.makespan.map(|time| time.0);
    same(&mut found, "makespan", &stated_ms, &makespan_ms);
    for (rank, robot) in tables.robots.iter().enumerate() {
        let stated = &metrics.robots[rank];
        let present = &tables.counted[rank];
        let is_idle = |tick: &&u64| work.sets_of(rank).all(|set| !set.active[**tick as usize]);
        let idle = present.iter().filter(is_idle).count();
        let named = |name: &str| format!("report: {name} of {robot}");
        same(
            &mut found,
            named("present"),
            &stated.present.0,
            &ms(present.len()),
        );
        same(&mut found, named("idle"), &stated.idle.0, &ms(idle));
        let activations = tables.count("activated", robot);
        same(
            &mut found,
            named("activations"),
            &stated.activations.into(),
            &activations,
        );
    }
    let stints = work.stints(&tables);
    for (task, stated) in tables.setup.catalog.tasks.iter().zip(&metrics.tasks) {
        let ticks = 0..tables.ticks as usize;
        let sets: Vec<&SetWork> = work
            .sets
            .iter()
            .filter(|set| set.task == task.name)
            .collect();
        let applicable = |tick: &usize| sets.iter().any(|set| set.applicable[*tick]);
        let active = |tick: &usize| sets.iter().filter(|set| set.active[*tick]).count();
        let mut productive = vec![false; tables.ticks as usize];
        for stint in stints.iter().filter(|stint| stint.task == task.name) {
            productive[stint.from..stint.idle_since(stint.to)].fill(true);
        }
        let named = |name: &str| format!("report: {name} of {}", task.name);
        let count = |fits: &dyn Fn(&usize) -> bool| ms(ticks.clone().filter(fits).count());
        let applicable_ms = count(&applicable);
        same(
            &mut found,
            named("applicable"),
            &stated.applicable.total().0,
            &applicable_ms,
        );
        let unattended_ms = count(&|tick| applicable(tick) && active(tick) == 0);
        same(
            &mut found,
            named("unattended"),
            &stated.unattended.total().0,
            &unattended_ms,
        );
        let orphan_ms = count(&|tick| applicable(tick) && !productive[*tick]);
        same(
            &mut found,
            named("orphan"),
            &stated.orphan.total().0,
            &orphan_ms,
        );
        let twice_ms = (task.max_robots == 1).then(|| count(&|tick| active(tick) > 1));
        let stated_ms = stated.duplicate.as_ref().map(|spans| spans.total().0);
        same(&mut found, named("duplicate"), &stated_ms, &twice_ms);
    }
    let losses: Vec<_> = tables
        .events
        .iter()
        .filter(|row| row.kind == "gone" || row.kind == "stalled")
        .filter_map(|row| {
            let rank = tables.rank(&row.robot)?;
            let tick = row.t_ms.0 / tables.step_ms;
            let back = tables.counted[rank].range(tick + 1..).next();
            Some((row.t_ms.0, rank, back.map(|tick| tick * tables.step_ms)))
        })
        .collect();
    let stated: Vec<_> = metrics
        .failures
        .iter()
        .map(|loss| (loss.at.0, loss.robot, loss.returned_at.map(|back| back.0)))
        .collect();
    same(
        &mut found,
        "report: losses (at, robot, back)",
        &stated,
        &losses,
    );
    let stated: Vec<_> = metrics
        .takeovers
        .iter()
        .map(|takeover| {
            let task = tables.setup.catalog.tasks[takeover.task.index()]
                .name
                .as_str();
            (
                takeover.at.0,
                task,
                takeover.from,
                takeover.robot,
                takeover.idle_since.0,
            )
        })
        .collect();
    let takeovers = takeovers(&tables, &stints);
    same(
        &mut found,
        "report: takeovers (at, task, from, to, idle since)",
        &stated,
        &takeovers,
    );
    for recurring in &metrics.recurring {
        let period_ms = recurring.period.map(|period| period.0);
        let mut before_ms = 0;
        let calculated: Vec<_> = tables
            .of_kind(recurring.event)
            .map(|row| {
                let interval_ms = row.t_ms.0 - before_ms;
                before_ms = row.t_ms.0;
                let late_ms =
                    period_ms.map_or(0, |period_ms| interval_ms.saturating_sub(period_ms));
                (row.t_ms.0, tables.rank(&row.robot), interval_ms, late_ms)
            })
            .collect();
        let stated: Vec<_> = recurring
            .moments
            .iter()
            .map(|moment| (moment.at.0, moment.by, moment.interval.0, moment.late.0))
            .collect();
        same(
            &mut found,
            format!("report: each '{}'", recurring.event),
            &stated,
            &calculated,
        );
    }
    Ok(found)
}

/// The state of all behavior sets in each tick.
struct Work<'a> {
    sets: Vec<SetWork<'a>>,
}

struct SetWork<'a> {
    robot: usize,
    name: &'a str,
    task: &'a str,
    applicable: Vec<bool>,
    active: Vec<bool>,
}

/// An unbroken time in which a robot works on a task, in ticks.
struct Stint<'a> {
    robot: usize,
    task: &'a str,
    from: usize,
    to: usize,
    effects: Vec<usize>,
    end: StintEnd,
    is_continuous: bool,
}

#[derive(PartialEq)]
enum StintEnd {
    Left(String),
    /// The end of the run.
    Ongoing,
    /// The loss of the robot.
    Absent,
}

impl Stint<'_> {
    fn idle_since(&self, tick: usize) -> usize {
        if self.is_continuous {
            return tick.min(self.to);
        }
        let before = self.effects.iter().filter(|effect| **effect <= tick).max();
        before.copied().unwrap_or(self.from)
    }
}

impl<'a> Work<'a> {
    fn read(tables: &Tables<'a>, log: &RunLog) -> Result<Self, ReadError> {
        let catalog = &tables.setup.catalog;
        let ticks = tables.ticks as usize;
        let mut sets = Vec::new();
        for (rank, robot) in tables.setup.scenario.robots.iter().enumerate() {
            for id in catalog.behaviors_of(robot) {
                let set = &catalog.sets[id.index()];
                sets.push(SetWork {
                    robot: rank,
                    name: &set.name,
                    task: &catalog.tasks[set.task.index()].name,
                    applicable: vec![false; ticks],
                    active: vec![false; ticks],
                });
            }
        }
        let mut work = Self { sets };
        let tick = |ms: u64| (ms / tables.step_ms) as usize;
        for row in log.each_row::<MotivationRow>() {
            let row = row?;
            if row.sensory_feedback {
                work.set(tables, &row.robot, &row.behavior_set).applicable[tick(row.t_ms.0)] = true;
            }
        }
        for row in log.each_row::<AllocationRow>() {
            let row = row?;
            work.set(tables, &row.robot, &row.behavior_set).applicable[tick(row.t_ms.0)] = true;
        }
        work.follow_events(tables);
        Ok(work)
    }

    fn set(&mut self, tables: &Tables<'_>, robot: &str, name: &str) -> &mut SetWork<'a> {
        let rank = tables.rank(robot);
        let mut sets = self.sets.iter_mut();
        let found = sets.find(|set| Some(set.robot) == rank && set.name == name);
        found.expect("a behavior set of the robot")
    }

    /// Marks the ticks in which each set is active: from `activated` to the next change, while the robot takes part.
    fn follow_events(&mut self, tables: &Tables<'_>) {
        let mut rest = tables.events.as_slice();
        let mut is_active = vec![false; self.sets.len()];
        for tick in 0..tables.ticks {
            let now_ms = tick * tables.step_ms;
            let count = rest.iter().take_while(|row| row.t_ms.0 <= now_ms).count();
            let (events, later) = rest.split_at(count);
            rest = later;
            for row in events {
                let rank = tables.rank(&row.robot);
                for (set, is_active) in self.sets.iter().zip(&mut is_active) {
                    if Some(set.robot) != rank {
                        continue;
                    }
                    match row.kind.as_str() {
                        "joined" => *is_active = false,
                        "activated" if set.name == row.subject => *is_active = true,
                        "hibernated" | "waiting" if set.name == row.subject => *is_active = false,
                        _ => {}
                    }
                }
            }
            for (set, is_active) in self.sets.iter_mut().zip(&is_active) {
                let counts = tables.counted[set.robot].contains(&tick);
                set.active[tick as usize] = *is_active && counts;
            }
        }
    }

    fn sets_of(&self, rank: usize) -> impl Iterator<Item = &SetWork<'a>> {
        self.sets.iter().filter(move |set| set.robot == rank)
    }

    /// Returns all stints in order of start and rank.
    fn stints(&self, tables: &Tables<'_>) -> Vec<Stint<'a>> {
        let mut stints = Vec::new();
        for set in &self.sets {
            let mut from = 0;
            for run in set.active.chunk_by(|a, b| a == b) {
                if run[0] {
                    stints.push(stint(tables, set, from, from + run.len()));
                }
                from += run.len();
            }
        }
        stints.sort_by_key(|stint| (stint.from, stint.robot));
        stints
    }
}

fn stint<'a>(tables: &Tables<'_>, set: &SetWork<'a>, from: usize, to: usize) -> Stint<'a> {
    let terms = tables.setup.catalog.mission.vocabulary();
    let name = tables.robots[set.robot];
    let tick = |row: &EventRow| (row.t_ms.0 / tables.step_ms) as usize;
    let own = || tables.events.iter().filter(|row| row.robot == name);
    let effects = own().filter_map(|row| {
        let kind = row.kind.as_str();
        let changes_column = terms
            .columns
            .iter()
            .any(|column| column.event == Some(kind));
        let at = match kind {
            "progress" if row.detail == set.task => tick(row),
            _ if terms.effects.contains(&kind) => tick(row),
            _ if changes_column => tick(row) + 1,
            _ => return None,
        };
        (from < at && at <= to).then_some(at)
    });
    let change = own().find(|row| {
        tick(row) == to
            && row.subject == set.name
            && ["hibernated", "waiting"].contains(&row.kind.as_str())
    });
    Stint {
        robot: set.robot,
        task: set.task,
        from,
        to,
        effects: effects.collect(),
        end: match change {
            Some(row) => StintEnd::Left(row.reason.clone()),
            None if to as u64 >= tables.ticks => StintEnd::Ongoing,
            None => StintEnd::Absent,
        },
        is_continuous: terms.continuous,
    }
}

/// Returns time, task, previous robot, next robot and the time of the last progress of each takeover.
fn takeovers<'t>(
    tables: &Tables<'t>,
    stints: &[Stint<'t>],
) -> Vec<(u64, &'t str, usize, usize, u64)> {
    let gives_in = |stint: &Stint<'_>| {
        stint.end == StintEnd::Left("arbitration".to_owned())
            && stints.iter().any(|other| {
                other.robot != stint.robot
                    && other.task == stint.task
                    && (other.from..other.to).contains(&stint.from)
            })
    };
    let is_bid = |stint: &Stint<'_>| stint.end != StintEnd::Absent && stint.to - stint.from <= 1;
    let kept = || {
        stints
            .iter()
            .filter(|stint| !is_bid(stint) && !gives_in(stint))
    };
    let mut found = Vec::new();
    for next in kept() {
        let task = tables
            .setup
            .catalog
            .tasks
            .iter()
            .find(|task| task.name == next.task);
        let is_exclusive = task.is_some_and(|task| task.max_robots == 1);
        let returns = !tables.counted[next.robot].contains(&(next.from as u64).saturating_sub(1));
        let on_task = || kept().filter(|stint| stint.task == next.task);
        let is_second = on_task().any(|stint| stint.from == next.from && stint.robot < next.robot);
        if !is_exclusive || returns || is_second {
            continue;
        }
        let earlier = on_task().filter(|stint| stint.from < next.from);
        let Some(before) = earlier.max_by_key(|stint| (stint.to.min(next.from), stint.from)) else {
            continue;
        };
        if before.robot == next.robot {
            continue;
        }
        let progress = before.idle_since(next.from) as u64 * tables.step_ms;
        let since_ms = match &before.end {
            _ if before.to > next.from => progress,
            StintEnd::Left(reason) if reason == "not-applicable" => continue,
            StintEnd::Left(_) => progress,
            StintEnd::Ongoing | StintEnd::Absent => {
                let end_ms = before.to as u64 * tables.step_ms;
                let mut own = tables
                    .events
                    .iter()
                    .filter(|row| row.robot == tables.robots[before.robot]);
                let loss = own.find(|row| {
                    let is_loss = row.kind == "gone" || row.kind == "stalled";
                    is_loss && (row.t_ms.0..=row.t_ms.0 + tables.step_ms).contains(&end_ms)
                });
                let Some(loss) = loss else { continue };
                loss.t_ms.0
            }
        };
        let at_ms = next.from as u64 * tables.step_ms;
        found.push((at_ms, next.task, before.robot, next.robot, since_ms));
    }
    found
}
