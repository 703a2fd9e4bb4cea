//! The figures of service: points with their outcomes, times and values, and the work of the robots.

use std::collections::{BTreeMap, BTreeSet};

use missions::service::data::{Point as StatedPoint, PointSpec, ServiceSection, points};
use run_log::{EventRow, PoseRow};

use super::missions::{Steps, mean};
use super::{Calculated, Named, OfMission, Tables};

/// A point of a service mission.
struct Point {
    kind: usize,
    /// The exact time of the arrival, which can lie between two ticks, ms.
    arrival_ms: u64,
    period_ms: u64,
    value: f64,
    /// True if robots wait at the point until its window opens.
    has_window: bool,
    state: State,
    /// True if a robot has worked on it since its arrival.
    begun: bool,
    /// True if a robot carries its load.
    carried: bool,
    /// The predecessors, by number.
    after: Vec<usize>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Waiting,
    Open,
    Over,
}

fn number_of(point: &str) -> usize {
    let number = point.trim_start_matches('p').parse();
    number.expect("the name of a point")
}

/// The work of a robot in a step.
#[derive(Clone, Copy)]
struct Working {
    point: usize,
    /// True if the log proves the work.
    is_certain: bool,
}

/// The robots that finish a point in a tick.
#[derive(Default)]
struct Finish {
    /// The rank of the robot that the event names.
    by: usize,
    /// The ranks of the robots that fill the slots of the point; empty if robots work alone.
    crew: BTreeSet<usize>,
    /// True if the robot only delivers the load.
    delivers: bool,
}

/// Everything that the events of the ticks so far state.
struct Follower<'a> {
    tables: &'a Tables<'a>,
    section: &'a ServiceSection,
    points: Vec<Point>,
    /// The number of the points at the start.
    initial: usize,
    /// The work of each robot in the last step, by rank.
    worked: Vec<Option<usize>>,
    work: Vec<Steps>,
    surplus: Vec<Steps>,
    waits_ms: Vec<u64>,
    responses_ms: Vec<u64>,
    done_ms: BTreeMap<usize, u64>,
    expired: u64,
    collected: f64,
    lost: f64,
}

/// Calculates the figures from the events. A robot works on a point from `begun` up to `left`, or until the point is
/// done, picked up or expired.
pub fn service(tables: &Tables<'_>) -> OfMission {
    let scenario = &tables.setup.scenario;
    let section = ServiceSection::of(scenario);
    let specs = points(scenario, tables.setup.seed);
    let team = tables.robots.len();
    let mut follower = Follower {
        tables,
        section,
        points: specs
            .iter()
            .map(|spec| new_point(section, spec.kind, spec.arrives.0))
            .collect(),
        initial: specs.len(),
        worked: vec![None; team],
        work: vec![Steps::default(); team],
        surplus: vec![Steps::default(); team],
        waits_ms: Vec::new(),
        responses_ms: Vec::new(),
        done_ms: BTreeMap::new(),
        expired: 0,
        collected: 0.0,
        lost: 0.0,
    };
    follower.add_properties();
    let mut left_over = tables.events.as_slice();
    for tick in 0..tables.ticks {
        let now_ms = tick * tables.step_ms;
        let count = left_over
            .iter()
            .take_while(|row| row.t_ms.0 <= now_ms)
            .count();
        let (events, rest) = left_over.split_at(count);
        left_over = rest;
        follower.follow(now_ms, events);
    }
    let has_needs = section.points.iter().any(StatedPoint::has_needs);
    if has_needs || section.kinds.iter().any(|kind| kind.kept) {
        // Surplus work has no events where the work of the others is kept, and at a slot that another robot fills.
        for (steps, counted) in follower.surplus.iter_mut().zip(&tables.counted) {
            steps.most += counted.len() as u64;
        }
    }
    let mut mission = follower.outcomes(&specs);
    if has_needs {
        mission.push((
            "deadlocks",
            (tables.of_kind("deadlock").count() as u64).into(),
        ));
    }
    mission.extend(follower.times());
    if scenario.energy.is_some() {
        mission.push(("energy_used_j", energy_used(tables)));
    }
    let robots = tables.robots.iter().enumerate();
    let step_s = tables.step_s();
    let robots = robots.map(|(rank, robot)| -> Named {
        vec![
            ("done", tables.count("done", robot).into()),
            ("work_s", follower.work[rank].times(step_s)),
            ("surplus_s", follower.surplus[rank].times(step_s)),
            ("way_m", way(tables, rank)),
        ]
    });
    (mission, robots.collect())
}

fn new_point(section: &ServiceSection, kind: usize, arrival_ms: u64) -> Point {
    let period_s = section.kinds[kind].period_s.unwrap_or_default();
    Point {
        kind,
        arrival_ms,
        period_ms: (1000.0 * period_s).round() as u64,
        value: 1.0,
        has_window: false,
        state: State::Waiting,
        begun: false,
        carried: false,
        after: Vec::new(),
    }
}

impl Follower<'_> {
    fn add_properties(&mut self) {
        let stated = self.section.points.iter();
        let names: BTreeMap<&str, usize> = stated
            .enumerate()
            .filter_map(|(number, point)| Some((point.name.as_deref()?, number)))
            .collect();
        for (point, stated) in self.points.iter_mut().zip(&self.section.points) {
            point.value = stated.value.unwrap_or(1.0);
            point.has_window = stated.opens_s.is_some_and(|opens_s| opens_s > 0.0);
            let after = stated.after.iter();
            let after = after.map(|name| names.get(name.as_str()).copied());
            let after = after.zip(&stated.after);
            point.after = after
                .map(|(named, name)| named.unwrap_or_else(|| number_of(name)))
                .collect();
        }
    }

    /// Follows the events of a tick, and then counts the work of its step.
    fn follow(&mut self, now_ms: u64, events: &[EventRow]) {
        let team = self.worked.len();
        let mut finished: BTreeMap<usize, Finish> = BTreeMap::new();
        let mut begun: Vec<Option<usize>> = vec![None; team];
        let mut left = vec![false; team];
        for row in events {
            let rank = self.tables.rank(&row.robot);
            match (row.kind.as_str(), rank) {
                ("hit", _) if row.detail.starts_with("point ") => {
                    let mut words = row.detail.split(' ').skip_while(|word| *word != "--kind");
                    let kind = words.nth(1).and_then(|name| self.section.kind_named(name));
                    let kind = kind.unwrap_or(0);
                    self.points.push(new_point(self.section, kind, now_ms));
                }
                ("arrived", _) => self.arrive(number_of(&row.subject)),
                ("expired", _) => {
                    let point = &mut self.points[number_of(&row.subject)];
                    (point.state, point.carried) = (State::Over, false);
                    self.expired += 1;
                    self.lost += point.value;
                }
                ("begun", Some(rank)) => begun[rank] = Some(number_of(&row.subject)),
                ("left", Some(rank)) => left[rank] = true,
                ("load-lost", Some(rank)) => {
                    self.points[number_of(&row.subject)].carried = false;
                    self.worked[rank] =
                        self.worked[rank].filter(|point| *point != number_of(&row.subject));
                }
                ("picked-up", Some(by)) => {
                    let point = number_of(&row.subject);
                    self.points[point].carried = true;
                    finished.insert(
                        point,
                        Finish {
                            by,
                            ..Finish::default()
                        },
                    );
                }
                ("done", Some(by)) => {
                    let point = number_of(&row.subject);
                    let crew = self.crew(&row.detail);
                    let delivers = self.points[point].carried;
                    finished.insert(point, Finish { by, crew, delivers });
                    self.finish(point, now_ms);
                }
                _ => {}
            }
        }
        self.count_work(now_ms, &finished, &begun, &left);
    }

    /// Begins the next round of a point. A successor arrives when its last predecessor is done, but not earlier than
    /// stated.
    fn arrive(&mut self, number: usize) {
        let after = self.points[number].after.iter();
        let ready_ms = after
            .filter_map(|before| self.done_ms.get(before))
            .max()
            .copied();
        let point = &mut self.points[number];
        let is_new_round = point.state == State::Over || point.state == State::Open;
        point.arrival_ms += u64::from(is_new_round) * point.period_ms;
        point.arrival_ms = point.arrival_ms.max(ready_ms.unwrap_or_default());
        (point.state, point.begun, point.carried) = (State::Open, false, false);
        if point.has_window {
            // The robots of the last round wait for the window.
            for worked in &mut self.worked {
                *worked = worked.filter(|worked| *worked != number);
            }
        }
    }

    fn finish(&mut self, number: usize, now_ms: u64) {
        let point = &mut self.points[number];
        (point.state, point.carried) = (State::Over, false);
        self.responses_ms.push(now_ms - point.arrival_ms);
        self.collected += point.value;
        self.done_ms.insert(number, now_ms);
    }

    /// Returns the ranks of the robots that an event names after `by`.
    fn crew(&self, detail: &str) -> BTreeSet<usize> {
        let names = detail
            .split_once(", by ")
            .map(|(_, names)| names.split(", "));
        let ranks = names
            .into_iter()
            .flatten()
            .filter_map(|name| self.tables.rank(name));
        ranks.collect()
    }

    fn count_work(
        &mut self,
        now_ms: u64,
        finished: &BTreeMap<usize, Finish>,
        begun: &[Option<usize>],
        left: &[bool],
    ) {
        // The workers of each point in order of rank, each with whether the log proves the work.
        let mut workers: BTreeMap<usize, Vec<(usize, bool)>> = BTreeMap::new();
        for rank in 0..self.worked.len() {
            let goes_on = self.worked[rank].filter(|_| !left[rank]);
            let goes_on = goes_on.and_then(|point| self.goes_on(rank, point, finished.get(&point)));
            let begins = begun[rank].map(|point| Working {
                point,
                is_certain: true,
            });
            let works = begins.or(goes_on);
            self.worked[rank] = works.map(|works| works.point);
            if let Some(Working { point, is_certain }) = works {
                workers.entry(point).or_default().push((rank, is_certain));
            }
        }
        for (number, workers) in workers {
            let point = &mut self.points[number];
            if !std::mem::replace(&mut point.begun, true) {
                self.waits_ms.push(now_ms - point.arrival_ms);
            }
            let kind = &self.section.kinds[point.kind];
            let is_crew = self
                .section
                .points
                .get(number)
                .is_some_and(StatedPoint::has_needs);
            let are_certain = workers.iter().all(|(_, is_certain)| *is_certain);
            for (place, (rank, is_certain)) in workers.into_iter().enumerate() {
                let is_surplus = !is_crew && !kind.kept && place >= kind.workers as usize;
                if are_certain || kind.kept || is_crew {
                    let steps = if is_surplus {
                        &mut self.surplus
                    } else {
                        &mut self.work
                    };
                    steps[rank].add(is_certain);
                } else {
                    self.work[rank].add(false);
                    self.surplus[rank].add(false);
                }
            }
        }
    }

    /// Returns whether a robot that worked on a point in the last step works on it again.
    fn goes_on(&self, rank: usize, point: usize, finished: Option<&Finish>) -> Option<Working> {
        let working = |is_certain| Working { point, is_certain };
        match finished {
            None => {
                let is_open =
                    self.points[point].state == State::Open && !self.points[point].carried;
                is_open.then(|| working(true))
            }
            Some(finish) if finish.delivers => None,
            Some(finish) if !finish.crew.is_empty() => {
                finish.crew.contains(&rank).then(|| working(true))
            }
            Some(finish) if finish.by == rank => Some(working(true)),
            // A robot of a lower rank acts before the point is done, if it works in that step at all.
            Some(finish) => (rank < finish.by).then(|| working(false)),
        }
    }

    /// Returns the numbers of the points that are neither done nor expired.
    fn unfinished(&self) -> impl Iterator<Item = usize> {
        let until_ms = self
            .section
            .duration_s
            .map_or(u64::MAX, |end_s| (1000.0 * end_s).round() as u64);
        // Only drawn points can be cut. Their numbers follow those of the stated points.
        let drawn = self.section.points.len()..self.initial;
        let points = self.points.iter().enumerate();
        let unfinished = points.filter(move |(number, point)| match point.state {
            State::Waiting => !drawn.contains(number) || point.arrival_ms < until_ms,
            State::Open => true,
            State::Over => false,
        });
        unfinished.map(|(number, _)| number)
    }

    fn outcomes(&self, specs: &[PointSpec]) -> Named {
        let done = self.responses_ms.len() as u64;
        let unfinished = self.unfinished().count() as u64;
        let mut named: Named = vec![("done", done.into()), ("expired", self.expired.into())];
        if !self.section.has_properties() && self.section.chargers.is_empty() {
            named.push(("open", unfinished.into()));
            return named;
        }
        let uncovered = self
            .unfinished()
            .filter(|number| self.is_uncovered(*number))
            .count() as u64;
        let covered = unfinished - uncovered;
        // No obstacle, no point without a way. The tables do not contain the ways around obstacles.
        let is_blocked = !self.tables.setup.scenario.obstacles.is_empty();
        let never_begun = |number: &usize| *number < specs.len() && !self.points[*number].begun;
        let most = self.unfinished().filter(never_begun).count() as u64;
        let unreachable = if is_blocked { most.min(covered) } else { 0 };
        let total = done + self.expired + unfinished;
        named.extend([
            (
                "open",
                Calculated::Between((covered - unreachable) as f64, covered as f64),
            ),
            ("uncovered", uncovered.into()),
            ("unreachable", Calculated::Between(0.0, unreachable as f64)),
            ("total", total.into()),
            ("value_collected", Calculated::near(self.collected)),
            ("value_lost", Calculated::near(self.lost)),
        ]);
        named
    }

    /// Returns whether no robots of the team can do the work of a point, each of which has the task and its skill.
    fn is_uncovered(&self, number: usize) -> bool {
        let scenario = &self.tables.setup.scenario;
        let needs = self.section.points.get(number).map(|point| &point.needs);
        let kind = &self.section.kinds[self.points[number].kind].name;
        let slots: Vec<&str> = match needs.filter(|needs| !needs.is_empty()) {
            Some(needs) => needs
                .iter()
                .flat_map(|(skill, count)| std::iter::repeat_n(skill.as_str(), *count as usize))
                .collect(),
            None => vec![kind],
        };
        let robots: Vec<&scenario::Robot> = scenario.robots.iter().collect();
        !can_fill(&robots, &slots)
    }

    fn times(&self) -> Named {
        let mut responses_ms = self.responses_ms.clone();
        responses_ms.sort_unstable();
        let p95 = |ms: &[u64]| (!ms.is_empty()).then(|| ms[(ms.len() * 95).div_ceil(100) - 1]);
        let wasted = self.surplus.iter().copied().reduce(Steps::plus);
        let wasted = wasted.unwrap_or_default();
        let last_ms = self.done_ms.values().max().copied();
        let makespan_ms = last_ms.filter(|_| self.tables.is_complete());
        vec![
            ("makespan_ms", makespan_ms.into()),
            ("wait.mean_ms", mean(&self.waits_ms).into()),
            ("response.mean_ms", mean(&responses_ms).into()),
            ("response.p95_ms", p95(&responses_ms).into()),
            ("wasted_robot_s", wasted.times(self.tables.step_s())),
        ]
    }
}

/// Returns whether the robots can fill the slots, each robot one: tries all assignments.
fn can_fill(robots: &[&scenario::Robot], slots: &[&str]) -> bool {
    let Some((slot, rest)) = slots.split_first() else {
        return true;
    };
    (0..robots.len()).any(|index| {
        let has_skill = robots[index].skill(slot).unwrap_or(1.0) > 0.0;
        let others: Vec<&scenario::Robot> = robots[..index]
            .iter()
            .chain(&robots[index + 1..])
            .copied()
            .collect();
        has_skill && can_fill(&others, rest)
    })
}

/// Returns the energy that all robots used, J. Beside chargers, it is what left the batteries. A robot at a charger stands,
/// so that it draws at most the idle power. The table does not contain the last step of the run.
fn energy_used(tables: &Tables<'_>) -> Calculated {
    /// The rounding of the logged energies, J.
    const DIGIT_J: f64 = 0.01;
    let Some(energy) = &tables.setup.scenario.energy else {
        return Calculated::Between(0.0, 0.0);
    };
    let idle_j = f64::from(energy.idle_w) * tables.step_s();
    let drive_j = f64::from(energy.drive_w) * tables.step_s();
    let (mut least_j, mut most_j) = (-DIGIT_J, DIGIT_J);
    for robot in &tables.robots {
        let charges = charges(tables, robot);
        // A robot can leave a charger in the last step of its stay.
        most_j += drive_j * charges.len() as f64;
        let mut before_j = f64::from(energy.capacity_j);
        let mut before_ms = 0;
        for row in tables.poses.iter().filter(|row| row.robot == *robot) {
            let left_j = row.energy.map_or(before_j, f64::from);
            // The step before a row changes the energy of the row.
            if charges
                .iter()
                .any(|[from, to]| before_ms <= *to && *from < row.t_ms.0)
            {
                most_j += idle_j * ((row.t_ms.0 - before_ms) / tables.step_ms) as f64;
            } else {
                least_j += before_j - left_j;
                most_j += before_j - left_j;
            }
            (before_j, before_ms) = (left_j, row.t_ms.0);
        }
        most_j += idle_j + drive_j;
    }
    Calculated::Between(least_j, most_j)
}

/// Returns the times of the first and the last step of each stay of a robot at a charger, ms. A robot can be at several
/// chargers at once.
fn charges(tables: &Tables<'_>, robot: &str) -> Vec<[u64; 2]> {
    let mut charges: Vec<(&str, [u64; 2])> = Vec::new();
    for row in tables.events.iter().filter(|row| row.robot == robot) {
        let charger = row.subject.as_str();
        match row.kind.as_str() {
            "charging" => charges.push((charger, [row.t_ms.0, u64::MAX])),
            "charged" => {
                let mut latest = charges.iter_mut().rev();
                let stay = latest.find(|(at, _)| *at == charger);
                stay.expect("the start of a stay").1[1] = row.t_ms.0;
            }
            _ => {}
        }
    }
    charges.into_iter().map(|(_, stay)| stay).collect()
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
