//! Precedence of points: the points that must be done before another one arrives.

use std::collections::BTreeMap;

use scenario::limits::check_known;
use scenario::{KeyPath, Problem};

use super::ServiceSection;

/// Returns the numbers of the points that must be done before each point at a stated place, by number. Empty if no
/// point has predecessors.
#[must_use]
pub fn predecessors(section: &ServiceSection) -> Vec<Vec<u32>> {
    if section.points.iter().all(|point| point.after.is_empty()) {
        return Vec::new();
    }
    let numbers = numbers(section);
    let of_point = section.points.iter().map(|point| {
        // The check of the scenario guarantees that the names exist.
        let mut before: Vec<u32> = (point.after.iter())
            .filter_map(|name| numbers.get(name).copied())
            .collect();
        before.sort_unstable();
        before.dedup();
        before
    });
    of_point.collect()
}

/// Returns the number of each point at a stated place, by its names.
fn numbers(section: &ServiceSection) -> BTreeMap<String, u32> {
    let points = section.points.iter().zip(0..);
    let names = points.flat_map(|(point, number): (_, u32)| {
        let names = [Some(format!("p{number}")), point.name.clone()];
        names.into_iter().flatten().map(move |name| (name, number))
    });
    names.collect()
}

/// Checks that all predecessors exist, that none of the points comes back, and that the precedence has no cycle.
pub(super) fn check(section: &ServiceSection) -> Result<(), Problem> {
    let at = KeyPath::new(["service", "points"]);
    let numbers = numbers(section);
    let kinds: Vec<usize> = section.kinds_of_points().collect();
    for (index, point) in section.points.iter().enumerate() {
        for (place, name) in point.after.iter().enumerate() {
            let at = at.index(index).key("after").index(place);
            let Some(&before) = numbers.get(name) else {
                let known = numbers.keys().map(String::as_str);
                return check_known(at, "there is no point", name, known);
            };
            for number in [index, before as usize] {
                let kind = &section.kinds[kinds[number]];
                if kind.period_s.is_some() {
                    let what = format!("p{number} comes back, and has no order with other points");
                    let remedy = format!("omit period_s of {}, or omit after", kind.name);
                    return Err(Problem::at(at, what, remedy));
                }
            }
        }
    }
    let Some(cycle) = cycle(&predecessors(section)) else {
        return Ok(());
    };
    let names: Vec<String> = cycle.iter().map(|point| format!("p{point}")).collect();
    let what = format!(
        "a cycle of precedence: {} after {}",
        names.join(" after "),
        names[0]
    );
    let at = at.index(cycle[0] as usize).key("after");
    Err(Problem::at(at, what, "omit one of them"))
}

/// Returns the points of a cycle, each a predecessor of the one before it; `None` if there is none. The first has the
/// lowest number.
fn cycle(before: &[Vec<u32>]) -> Option<Vec<u32>> {
    // Points without an open predecessor are removed, until only cycles and points behind them are left.
    let mut open: Vec<usize> = before.iter().map(Vec::len).collect();
    let after = successors(before);
    let mut free: Vec<usize> = (0..open.len()).filter(|point| open[*point] == 0).collect();
    while let Some(point) = free.pop() {
        for next in &after[point] {
            let next = *next as usize;
            open[next] -= 1;
            if open[next] == 0 {
                free.push(next);
            }
        }
    }
    // Each point that is left has a predecessor that is left, so that the way back ends in a cycle.
    let mut way = vec![open.iter().position(|count| *count > 0)? as u32];
    loop {
        let last = way[way.len() - 1] as usize;
        let mut before = before[last].iter();
        let next = *before.find(|point| open[**point as usize] > 0)?;
        if let Some(from) = way.iter().position(|point| *point == next) {
            let mut cycle = way.split_off(from);
            let lowest = cycle.iter().enumerate().min_by_key(|(_, point)| **point);
            let lowest = lowest.map_or(0, |(place, _)| place);
            cycle.rotate_left(lowest);
            return Some(cycle);
        }
        way.push(next);
    }
}

/// Returns the points that wait for each point, by number.
#[must_use]
pub fn successors(before: &[Vec<u32>]) -> Vec<Vec<u32>> {
    let mut after = vec![Vec::new(); before.len()];
    for (before, point) in before.iter().zip(0..) {
        for earlier in before {
            after[*earlier as usize].push(point);
        }
    }
    after
}
