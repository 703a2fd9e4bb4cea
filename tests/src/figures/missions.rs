//! The figures of each mission.

use std::collections::{BTreeMap, BTreeSet};

use missions::observe::data::ObserveSection;
use missions::push::data::PushSection;
use missions::waste::data::WasteSection;
use run_log::TargetRow;
use scenario::mission::FigureValue;

use super::{Calculated, Named, OfMission, ROUNDING, Tables};

/// The tolerance for a distance that decides whether a target is in range, m.
const EDGE_M: f32 = 1e-4;

pub fn waste(tables: &Tables<'_>) -> OfMission {
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
    let spills = section.spills.iter().map(|spill| u64::from(spill.items));
    let all: u64 = spills.chain(added).sum();
    let in_spills = tables.last("items_in_spills");
    let on_floor = tables.last("items_on_floor");
    let delivered = if section.respawn {
        count("respawned")
    } else {
        all - in_spills - on_floor - carried
    };
    let latest_ms = late_ms.iter().max().copied();
    let mut mission: Named = vec![
        ("items.in_spills", in_spills.into()),
        ("items.carried", carried.into()),
        ("items.on_floor", on_floor.into()),
        ("items.delivered", delivered.into()),
        ("reports_made", count("reported").into()),
        ("report_lateness_mean_ms", mean(&late_ms).into()),
        ("report_lateness_max_ms", latest_ms.into()),
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

pub(super) fn mean(ms: &[u64]) -> Option<f64> {
    (!ms.is_empty()).then(|| ms.iter().sum::<u64>() as f64 / ms.len() as f64)
}

/// The number of steps of a kind of work, as bounds.
#[derive(Clone, Copy, Default)]
pub(super) struct Steps {
    pub least: u64,
    pub most: u64,
}

impl Steps {
    pub fn add(&mut self, is_certain: bool) {
        self.least += u64::from(is_certain);
        self.most += 1;
    }

    pub fn plus(self, other: Self) -> Self {
        Self {
            least: self.least + other.least,
            most: self.most + other.most,
        }
    }

    pub fn times(self, step_s: f64) -> Calculated {
        Calculated::Between(
            self.least as f64 * step_s - ROUNDING,
            self.most as f64 * step_s + ROUNDING,
        )
    }
}

pub fn push(tables: &Tables<'_>) -> OfMission {
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
            let moved_m = row.detail.trim_end_matches(" m").parse::<f64>();
            let moved_m = moved_m.expect("an advance");
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
        totals[0] = totals[0].plus(strokes[0]).plus(strokes[1]);
        totals[1] = totals[1].plus(changes);
        let slack_m = pushes * DIGIT_M + 1e-9;
        let pushed_m = Calculated::Between(pushed_m - slack_m, pushed_m + slack_m);
        robots.push(vec![
            ("strokes_left", whole(strokes[0])),
            ("strokes_right", whole(strokes[1])),
            ("changes_of_end", whole(changes)),
            ("pushed_m", pushed_m),
        ]);
    }
    let makespan_ms = last_ms.filter(|_| tables.is_complete());
    let mission: Named = vec![
        ("arrived", arrived.into()),
        ("makespan_ms", makespan_ms.into()),
        ("strokes", totals[0].times(1.0)),
        ("changes_of_end", totals[1].times(1.0)),
        ("bars_arrived", arrived.into()),
        ("bars_left", (bars - arrived).into()),
    ];
    (mission, robots)
}

/// Counts the observed targets of each tick. A robot sees the targets in its range at the end of the step, if it looks.
pub fn observe(tables: &Tables<'_>, targets: &[TargetRow]) -> OfMission {
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
            let after = (next_ms, *robot);
            let place = at.get(&after).filter(|_| !moved.contains(&after));
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
            let is_unseen = |row: &&&TargetRow| row.observers == 0;
            let mut unseen_targets = possible.iter().filter(is_unseen);
            let cannot = unseen_targets.clone().count() == possible.len()
                || unseen_targets.any(|row| near(row, -EDGE_M));
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
    let a = (count > 0.0).then_some(a);
    let near = |value: Option<f64>| value.map_or(FigureValue::None.into(), Calculated::near);
    let unseen_ms = (count > 0.0).then_some(longest * tables.step_ms);
    let blind = match robot_steps {
        0 => FigureValue::None.into(),
        _ => Calculated::Between(share(blind.least) - ROUNDING, share(blind.most) + ROUNDING),
    };
    let mission: Named = vec![
        ("a", near(a)),
        ("h", near(h)),
        ("unseen.max_ms", unseen_ms.into()),
        ("blind_share", blind),
    ];
    (mission, vec![Named::new(); tables.robots.len()])
}
