//! Checks of `[push]` beyond the ranges of its parameters.

use std::f32::consts::SQRT_2;

use scenario::limits::WIDEST_M;
use scenario::{Catalog, KeyPath, Problem, Scenario};
use world_server::world::{Bar, Outline};

use super::PushSection;
use crate::coverage::uncovered_tasks;

pub(super) fn check(scenario: &Scenario) -> Result<(), Problem> {
    let section = PushSection::of(scenario);
    let at = KeyPath::new(["push"]);
    scenario.room.check(WIDEST_M)?;
    sizes(scenario, section, &at)?;
    for (index, bar) in section.bars.iter().enumerate() {
        let at = at.key("bars").index(index);
        let width_m = section.half_width_m;
        let half_m = section.length_m / 2.0 + width_m;
        let radius_m = scenario.body.radius_m;
        let room = scenario.room;
        let (low, high) = (room.low(), room.high());
        let fits = bar.y_m >= low.y + half_m && bar.y_m <= high.y - half_m;
        if !fits {
            let what = format!("a bar of {} m does not fit there", section.length_m);
            let remedy = format!("it must be at least {} m from the border", readable(half_m));
            return Err(Problem::at(at.key("y_m"), what, remedy));
        }
        let least_m = low.x + (width_m + 2.0 * radius_m);
        if bar.x_m.is_nan() || bar.x_m < least_m {
            let what = format!("no robot of radius {radius_m} m fits behind the bar");
            let remedy = format!("write at least {}", readable(least_m));
            return Err(Problem::at(at.key("x_m"), what, remedy));
        }
        let most_m = high.x - width_m - section.skew_m;
        if !(bar.goal_x_m > bar.x_m && bar.goal_x_m <= most_m) {
            let what = format!("{} cannot be reached from {}", bar.goal_x_m, bar.x_m);
            let remedy = format!(
                "it must be above {} and at most {}, because one end leads",
                bar.x_m,
                readable(most_m)
            );
            return Err(Problem::at(at.key("goal_x_m"), what, remedy));
        }
        let outline = section.outline(&bar.pose());
        for obstacle in scenario.obstacles.iter().filter(|each| each.is_solid()) {
            let min = glam::Vec2::new(obstacle.x_m, obstacle.y_m);
            let max = min + glam::Vec2::new(obstacle.width_m, obstacle.height_m);
            if outline.distance_to(&Outline::Rectangle { min, max }) < LEAST_M {
                let what = "a bar overlaps an obstacle";
                return Err(Problem::at(at, what, "move one of them"));
            }
        }
    }
    apart(section, &at)?;
    covered(scenario, &at)
}

/// The least distance between a bar and solid objects at the start, m.
const LEAST_M: f32 = 0.01;

/// Rounds to a millimeter, for readers.
fn readable(length_m: f32) -> f64 {
    (f64::from(length_m) * 1000.0).round() / 1000.0
}

/// Checks that bars, strokes and robots fit together.
fn sizes(scenario: &Scenario, section: &PushSection, at: &KeyPath) -> Result<(), Problem> {
    let (length_m, radius_m) = (section.length_m, scenario.body.radius_m);
    let least_m = 6.0 * radius_m;
    if length_m.is_nan() || length_m < least_m {
        let what =
            format!("two robots of radius {radius_m} m have no room behind a bar of {length_m} m");
        let remedy = format!("write at least {}", readable(least_m));
        return Err(Problem::at(at.key("length_m"), what, remedy));
    }
    let most_m = length_m / 2.0;
    if section.skew_m.is_nan() || section.skew_m > most_m {
        let what = format!("a bar of {length_m} m would stand at more than 30 degrees");
        let remedy = format!("write at most {}", readable(most_m));
        return Err(Problem::at(at.key("skew_m"), what, remedy));
    }
    // The worst case starts half a stroke ahead, and the other end moves back.
    let most_m = section.skew_m / (SQRT_2 + 0.5);
    if section.stroke_m.is_nan() || section.stroke_m > most_m {
        let what = format!(
            "a stroke of one robot alone would end at the skew of {} m",
            section.skew_m
        );
        let remedy = format!("write at most {}", readable(most_m));
        return Err(Problem::at(at.key("stroke_m"), what, remedy));
    }
    Ok(())
}

fn apart(section: &PushSection, at: &KeyPath) -> Result<(), Problem> {
    let mut bars: Vec<(usize, Bar)> = section
        .bars
        .iter()
        .map(|bar| section.outline(&bar.pose()))
        .enumerate()
        .collect();
    bars.sort_by(|(_, one), (_, other)| one.from.x.total_cmp(&other.from.x));
    let near_m = 2.0 * section.half_width_m + LEAST_M;
    for (place, (index, bar)) in bars.iter().enumerate() {
        let next = bars[place + 1..].iter();
        let near = next.take_while(|(_, other)| other.from.x - bar.from.x <= near_m);
        for (other, outline) in near {
            if bar.distance_to(&Outline::Bar(*outline)) < LEAST_M {
                let (first, second) = (index.min(other), index.max(other));
                let what = format!("it overlaps bars[{first}]");
                let at = at.key("bars").index(*second);
                return Err(Problem::at(at, what, "move one of them"));
            }
        }
    }
    Ok(())
}

fn covered(scenario: &Scenario, at: &KeyPath) -> Result<(), Problem> {
    let catalog = Catalog::new(scenario);
    let uncovered = uncovered_tasks(scenario, &catalog);
    let Some(&task) = uncovered.first() else {
        return Ok(());
    };
    let what = format!("no robot has {} among its tasks", catalog.tasks[task].name);
    let others = match uncovered.len() {
        1 => String::new(),
        all => format!(", and {all} tasks in total have no robot"),
    };
    let remedy = "assign the tasks to a robot";
    Err(Problem::at(at.key("bars"), what + &others, remedy))
}
