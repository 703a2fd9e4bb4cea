//! The result in words: three sentences, and details.

use terminal::counted;

use super::analysis::{Analysis, Ranking};
use super::cell::AllocatorCell;
use super::data::ComparisonData;
use super::hypotheses::{Outcome, Verdict};
use super::metrics::Metric;
use super::power::seeds_needed;
use super::statistics::SIGNIFICANT;
use crate::distinct;

/// The largest number of blocks that a sentence lists.
const LISTED: usize = 4;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// The best allocator, the incomplete runs and the significance of the differences.
    pub sentences: Vec<String>,
    /// The outcomes of the hypotheses; `None` without hypotheses.
    pub claims: Option<String>,
    /// The best allocators of each class of faults, and the omitted data.
    pub details: Vec<String>,
}

#[must_use]
pub fn answer(data: &ComparisonData, analysis: &Analysis, verdicts: &[Verdict]) -> Answer {
    let ranking = analysis.primary();
    let reference = ranking.and_then(|ranking| reference(data, ranking));
    let classes = data.classes().into_iter();
    let classes = classes.filter_map(|class| under(data, analysis, class));
    let notes = [incomplete(data), no_chance(data), no_data(data)];
    let notes = notes.into_iter().flatten();
    let (best, complete) = (best_of_all(data, analysis), completeness(data));
    Answer {
        sentences: vec![best, complete, significance(data, analysis)],
        claims: claims(verdicts),
        details: reference.into_iter().chain(classes).chain(notes).collect(),
    }
}

/// Names the allocator with the best mean rank and those that are not significantly worse. Without a ranking, it names the
/// best allocator of each block.
fn best_of_all(data: &ComparisonData, analysis: &Analysis) -> String {
    let Some(ranking) = analysis.primary() else {
        let blocks = (0..data.blocks.len()).filter_map(|block| best_in(data, analysis, block));
        let blocks: Vec<String> = blocks.take(LISTED).collect();
        return match blocks.len() {
            0 => "All allocators with data have the same outcome by every measure.".to_owned(),
            _ => format!("Best: {}.", blocks.join("; ")),
        };
    };
    let ranks = &ranking.friedman.mean_ranks;
    let order = rivals(data, ranking);
    let first = order[0];
    let mut near = order[1..].to_vec();
    near.retain(|place| ranks[*place] - ranks[first] < ranking.critical);
    let no_chance = |block: &usize| analysis.blocks[*block].has_no_chance();
    let others = match near.len() {
        _ if ranking.blocks.iter().all(no_chance) => {
            "all seeds give the same run, so each block is one run of each (n = 1)".to_owned()
        }
        0 => "all others are significantly worse".to_owned(),
        _ if ranking.friedman.p >= SIGNIFICANT => format!(
            "the ranks of all allocators together do not differ significantly (Friedman, p {})",
            p_value(ranking.friedman.p)
        ),
        _ if near.len() + 1 == order.len() => "no other is significantly worse".to_owned(),
        _ => format!(
            "{} {} not significantly worse",
            names(data, &near),
            if near.len() == 1 { "is" } else { "are" }
        ),
    };
    format!(
        "Over {} blocks (a block is a mission under a class of faults) {} has the best mean rank, {:.1} of {}; {others}.",
        ranking.friedman.blocks,
        data.allocators[first],
        ranks[first],
        ranks.len(),
    )
}

/// Returns the allocators that compete, best first.
#[must_use]
pub fn rivals(data: &ComparisonData, ranking: &Ranking) -> Vec<usize> {
    let mut order = ranking.order();
    order.retain(|place| Some(*place) != data.reference);
    order
}

/// Explains a rank of the reference behind the best allocator.
fn reference(data: &ComparisonData, ranking: &Ranking) -> Option<String> {
    let reference = data.reference?;
    let ranks = &ranking.friedman.mean_ranks;
    let best = *rivals(data, ranking).first()?;
    (ranks[reference] > ranks[best]).then(|| {
        format!(
            "{} has the mean rank {:.1}, behind {}: it has the ground truth, but plans one step only. It is a reference and \
             no bound, and does not compete.",
            data.allocators[reference], ranks[reference], data.allocators[best]
        )
    })
}

/// States the number of incomplete runs and of cells without data.
fn completeness(data: &ComparisonData) -> String {
    let cells = || data.blocks.iter().flat_map(|block| &block.cells);
    let place = data.metric_index(&Metric::Completion);
    let outcomes = || cells().flat_map(|cell| cell.values[place].iter().flatten());
    let (runs, complete) = (outcomes().count(), outcomes().sum::<f64>() as usize);
    let all = counted(runs, "counted run");
    let ends = (0..data.blocks.len()).filter_map(|block| common_end_s(data, block));
    let ends: Vec<f64> = ends.collect();
    let mut text = match (runs - complete, &ends[..]) {
        (0, [end_s]) if data.blocks.len() == 1 => {
            format!("Every counted run lasted {end_s} s, so completion and time show no difference")
        }
        (0, ends) if ends.len() == data.blocks.len() => {
            "All counted runs of a block lasted the same time, so completion and time show no difference".to_owned()
        }
        (0, []) => "Every counted run completed its mission".to_owned(),
        (0, _) => format!("Every counted run completed its mission{}", fixed(&ends)),
        (incomplete, _) => format!("{incomplete} of {all} did not complete their mission"),
    };
    let worst = (0..data.allocators.len()).map(|rival| (incomplete_of(data, rival), rival));
    if let Some((most, rival)) = worst.max_by_key(|(count, rival)| (*count, usize::MAX - rival))
        && most > 0
    {
        text += &format!(", {most} of them with {}", data.allocators[rival]);
    }
    let empty = cells().filter(|cell| cell.counted() == 0).count();
    if empty > 0 {
        let all = counted(cells().count(), "cell");
        text += &format!("; no data in {empty} of {all}");
    }
    text + "."
}

/// Names the number of blocks in which completion and time are constants.
fn fixed(ends: &[f64]) -> String {
    let blocks = counted(ends.len(), "block");
    format!(" (in {blocks} all runs last the same time, so completion shows nothing)")
}

/// Returns the time at which all counted runs of a block end as complete, s; `None` if they end at different times.
fn common_end_s(data: &ComparisonData, block: usize) -> Option<f64> {
    let place = data.metric_index(&Metric::Makespan);
    let cells = data.blocks[block].cells.iter();
    let counted: usize = cells.clone().map(AllocatorCell::counted).sum();
    let ends: Vec<f64> = cells
        .flat_map(|cell| cell.values[place].iter().flatten().copied())
        .collect();
    let first = *ends.first()?;
    let is_common = ends.len() == counted && ends.iter().all(|end| *end == first);
    is_common.then_some(first)
}

/// Returns the number of incomplete runs of an allocator.
fn incomplete_of(data: &ComparisonData, rival: usize) -> usize {
    let place = data.metric_index(&Metric::Completion);
    let cells = data.blocks.iter().map(|block| &block.cells[rival]);
    let outcomes = cells.flat_map(|cell| cell.values[place].iter().flatten());
    outcomes.filter(|outcome| **outcome == 0.0).count()
}

/// States in how many blocks some allocator is significantly worse than the best, or exactly in missions without chance,
/// or that the seeds are too few.
fn significance(data: &ComparisonData, analysis: &Analysis) -> String {
    let blocks = 0..data.blocks.len();
    let compared = blocks.filter(|block| data.deciding(*block).is_some());
    let (can, cannot): (Vec<usize>, Vec<usize>) =
        compared.partition(|block| can_differ(data, analysis, *block));
    if can.is_empty() && cannot.is_empty() {
        return "In no block do the allocators differ by any measure of the outcome.".to_owned();
    }
    if can.is_empty() {
        let seeds = data.blocks[0].cells[0].runs;
        return format!(
            "{} {} too few to show any difference within a block: with {} at least {} are needed, so the page shows none and claims no equality.",
            counted(seeds, "seed"),
            if seeds == 1 { "is" } else { "are" },
            counted(data.allocators.len(), "allocator"),
            seeds_needed(data.allocators.len())
        );
    }
    let shows = |block: &&usize| {
        best(data, **block).is_some_and(|best| !worse(analysis, data, **block, best).is_empty())
    };
    let (exact, tested): (Vec<usize>, Vec<usize>) = can
        .into_iter()
        .partition(|block| analysis.blocks[*block].has_no_chance());
    let mut parts = Vec::new();
    for (blocks, is_worse) in [
        (tested, "is significantly worse than the best"),
        (
            exact,
            "is worse than the best, by an exact difference without a test, because all seeds give the same run (n = 1)",
        ),
    ] {
        if !blocks.is_empty() {
            let some = blocks.iter().filter(shows).count();
            let of = match parts.is_empty() {
                true => format!("In {some} of {}", counted(blocks.len(), "block")),
                false => format!("in {some} of {} more", blocks.len()),
            };
            parts.push(format!("{of} some allocator {is_worse}"));
        }
    }
    if !cannot.is_empty() {
        let count = cannot.len();
        parts.push(format!(
            "{count} more have too few runs to show a difference"
        ));
    }
    parts.join("; ") + "." + &undecided_by_primary(data)
}

/// Names the primary metrics by which all allocators of a block are equal, and the metrics by which they differ.
fn undecided_by_primary(data: &ComparisonData) -> String {
    let blocks = data.blocks.iter().enumerate();
    let others = blocks.filter_map(|(number, block)| {
        let deciding = data.deciding(number)?;
        (*deciding != block.primary).then_some((&block.primary, deciding))
    });
    let others: Vec<(&Metric, &Metric)> = others.collect();
    let sentences = distinct(others.clone()).into_iter().map(|both| {
        let count = others.iter().filter(|other| **other == both).count();
        let (primary, deciding) = (both.0.name(), both.1.name());
        let blocks = counted(count, "block");
        format!(" In {blocks} {primary} is the same for all, but {deciding} differs.")
    });
    sentences.collect()
}

fn can_differ(data: &ComparisonData, analysis: &Analysis, block: usize) -> bool {
    let deciding = data.deciding(block).unwrap_or(&data.blocks[block].primary);
    analysis.blocks[block].can_differ(deciding)
}

/// Names the best allocator of each mission under a class of faults, and those without a significant difference to it.
fn under(data: &ComparisonData, analysis: &Analysis, class: &str) -> Option<String> {
    let blocks = (0..data.blocks.len()).filter(|block| data.blocks[*block].faults == class);
    let sentences = blocks.filter_map(|block| best_in(data, analysis, block));
    let class = match class {
        "" => "Best".to_owned(),
        class => format!("Best under {class}"),
    };
    listed(&class, sentences)
}

/// Names the best allocator of a block. Returns `None` without data, and if all allocators are equal.
fn best_in(data: &ComparisonData, analysis: &Analysis, block: usize) -> Option<String> {
    let deciding = data.deciding(block)?;
    let best = best(data, block)?;
    let mean = data.mean(block, best, deciding)?;
    let ties = ties(analysis, data, block, best);
    let ties = match ties.len() {
        0 => "all others are worse".to_owned(),
        _ if !can_differ(data, analysis, block) => "too few seeds for a difference".to_owned(),
        _ if analysis.blocks[block].has_no_chance() => format!("equal: {}", names(data, &ties)),
        _ => format!("no significant difference to {}", names(data, &ties)),
    };
    let mission = match data.blocks[block].mission.as_str() {
        "" => String::new(),
        mission => format!("in {mission} "),
    };
    let name = match deciding {
        Metric::Par2 => String::new(),
        other => format!("{} ", other.name()),
    };
    Some(format!(
        "{mission}{} ({name}{}; {ties})",
        data.allocators[best],
        deciding.show(mean)
    ))
}

/// Returns the first allocator of a block, except the reference.
#[must_use]
pub fn best(data: &ComparisonData, block: usize) -> Option<usize> {
    let order = data.order(block).into_iter().enumerate();
    let rivals = order.filter(|(place, _)| Some(*place) != data.reference);
    let places = rivals.filter_map(|(place, before)| Some((before?, place)));
    places.min().map(|(_, place)| place)
}

/// Returns the allocator that follows the best one in a block, except the reference.
#[must_use]
pub fn next_best(data: &ComparisonData, block: usize, best: usize) -> Option<usize> {
    let order = data.order(block);
    let others = others(data, best).into_iter();
    others
        .filter(|place| order[*place].is_some())
        .min_by_key(|place| order[*place])
}

/// Joins names, at most [`LISTED`] of them, and states the number of the others.
#[must_use]
pub fn named(names: &[String]) -> String {
    let shown = names[..names.len().min(LISTED)].join("; ");
    match names.len() - names.len().min(LISTED) {
        0 => shown,
        more => format!("{shown}; and {more} more"),
    }
}

/// Returns the allocators with data that are not significantly worse than the best.
#[must_use]
pub fn ties(analysis: &Analysis, data: &ComparisonData, block: usize, best: usize) -> Vec<usize> {
    let worse = worse(analysis, data, block, best);
    let mut others = others(data, best);
    others.retain(|place| {
        let pair = analysis.decided(data, block, (best, *place));
        !worse.contains(place) && pair.is_some_and(|(_, pair)| pair.n > 0)
    });
    others
}

/// Returns the allocators that are significantly worse than the best.
fn worse(analysis: &Analysis, data: &ComparisonData, block: usize, best: usize) -> Vec<usize> {
    let mut others = others(data, best);
    others.retain(|place| {
        let pair = analysis.decided(data, block, (best, *place));
        pair.is_some_and(|(metric, pair)| {
            pair.is_significant() && metric.sign() * pair.effect > 0.0
        })
    });
    others
}

/// Returns the competing allocators except the best.
fn others(data: &ComparisonData, best: usize) -> Vec<usize> {
    let all = 0..data.allocators.len();
    all.filter(|place| *place != best && Some(*place) != data.reference)
        .collect()
}

/// Lists the allocators that did not always complete the mission.
fn incomplete(data: &ComparisonData) -> Option<String> {
    let completion = data.metric_index(&Metric::Completion);
    let mut found = Vec::new();
    for (place, name) in data.allocators.iter().enumerate() {
        let cells = data.blocks.iter().map(|block| &block.cells[place]);
        let runs = cells
            .flat_map(|cell| cell.values[completion].iter().flatten())
            .count();
        let incomplete = incomplete_of(data, place);
        if incomplete == 0 {
            continue;
        }
        let never = (0..data.blocks.len())
            .filter(|block| data.mean(*block, place, &Metric::Completion) == Some(0.0));
        let never: Vec<String> = never.map(|block| data.blocks[block].name()).collect();
        let never = match never.len() {
            0 => String::new(),
            1..=LISTED => format!(", never in {}", never.join("; ")),
            many => format!(", never in {many} blocks"),
        };
        found.push(format!("{name} {} of {runs}{never}", runs - incomplete));
    }
    let head = "Completed runs of the allocators that did not always complete";
    listed(head, found.into_iter())
}

/// Returns parts of a sentence after its head, or `None` without parts.
fn listed(head: &str, parts: impl Iterator<Item = String>) -> Option<String> {
    let parts: Vec<String> = parts.collect();
    (!parts.is_empty()).then(|| format!("{head}: {}.", parts.join("; ")))
}

/// Lists the cells in which the seed has no effect.
fn no_chance(data: &ComparisonData) -> Option<String> {
    let constant = data.blocks.iter().filter_map(|block| {
        let cells = block.cells.iter().zip(&data.allocators);
        let constant = cells.filter(|(cell, _)| cell.is_constant);
        let names: Vec<&str> = constant.map(|(_, name)| name.as_str()).collect();
        match names.len() {
            0 => None,
            all if all == block.cells.len() => Some(block.name()),
            _ => Some(format!("{} ({})", block.name(), names.join(", "))),
        }
    });
    listed("All seeds give the same run, which counts once", constant)
}

fn no_data(data: &ComparisonData) -> Option<String> {
    let cells = data.blocks.iter().flat_map(|block| {
        let cells = block.cells.iter().zip(&data.allocators);
        let none = cells.filter(|(cell, _)| cell.counted() == 0);
        none.map(|(_, name)| format!("{name} in {}", block.name()))
    });
    let head = "No data, because the fault never hit or every run failed";
    listed(head, cells)
}

fn claims(verdicts: &[Verdict]) -> Option<String> {
    if verdicts.is_empty() {
        return None;
    }
    let of = |outcome: Outcome| {
        let verdicts = verdicts.iter().filter(|verdict| verdict.outcome == outcome);
        let names: Vec<&str> = verdicts.map(|verdict| verdict.name.as_str()).collect();
        match names.len() {
            0 => format!("none {}", outcome.as_str()),
            count => format!("{count} {} ({})", outcome.as_str(), names.join(", ")),
        }
    };
    Some(format!(
        "Of {} declared before the first run, {}, {}, {}.",
        match verdicts.len() {
            1 => "1 hypothesis".to_owned(),
            count => format!("{count} hypotheses"),
        },
        of(Outcome::Held),
        of(Outcome::Failed),
        of(Outcome::Undecided)
    ))
}

fn names(data: &ComparisonData, places: &[usize]) -> String {
    let names = places.iter().map(|place| data.allocators[*place].as_str());
    names.collect::<Vec<_>>().join(", ")
}

/// Formats a p value with two significant digits, preceded by `=` or `<`.
#[must_use]
pub fn p_value(p: f64) -> String {
    let digits = match p {
        _ if p < 0.0001 => return "< 0.0001".to_owned(),
        _ if p < 0.001 => 5,
        _ if p < 0.1 => 4,
        _ => 2,
    };
    format!("= {p:.digits$}")
}
