//! The result in words.

use super::analysis::{Analysis, LEVEL};
use super::data::ComparisonData;
use super::hypotheses::{Outcome, Verdict};
use super::metrics::Metric;

#[must_use]
pub fn answer(data: &ComparisonData, analysis: &Analysis, verdicts: &[Verdict]) -> Vec<String> {
    let mut answer: Vec<String> = Vec::new();
    answer.extend(over_all(data, analysis));
    for class in data.classes() {
        answer.extend(under(data, analysis, class));
    }
    answer.extend(incomplete(data));
    answer.extend(no_data(data));
    answer.extend(claims(verdicts));
    answer
}

fn over_all(data: &ComparisonData, analysis: &Analysis) -> Option<String> {
    let ranking = analysis
        .rankings
        .iter()
        .find(|ranking| ranking.metric == Metric::Par2)?;
    let ranks = &ranking.friedman.mean_ranks;
    let named = |place: usize| format!("{} ({:.1})", data.allocators[place], ranks[place]);
    let order: Vec<usize> = ranking
        .order()
        .into_iter()
        .filter(|place| Some(*place) != data.reference)
        .collect();
    let (first, last) = (*order.first()?, *order.last()?);
    let blocks = ranking.friedman.blocks;
    let near: Vec<String> = order[1..]
        .iter()
        .filter(|place| ranks[**place] - ranks[first] < ranking.critical)
        .map(|place| named(*place))
        .collect();
    let left = match ranking.omitted_blocks.len() {
        0 => String::new(),
        1 => {
            " 1 more block is omitted: an allocator has no data in it, or all allocators are equal."
                .to_owned()
        }
        left => format!(
            " {left} more blocks are omitted: an allocator has no data in them, or all allocators are equal."
        ),
    };
    let differ = if ranking.friedman.p < 1.0 - LEVEL {
        "differ significantly"
    } else {
        "do not differ significantly"
    };
    Some(format!(
        "Over {blocks} blocks (a block is a mission under a class of faults), {} has the best mean rank by mean PAR2: {:.1} of {}. {} is last. \
         Taken together, the ranks {differ} (Friedman, p {}). Ranks less than {:.1} apart do not differ significantly (Nemenyi): {}.{left}",
        data.allocators[first],
        ranks[first],
        ranks.len(),
        named(last),
        p_value(ranking.friedman.p),
        ranking.critical,
        match near.len() {
            0 => "all other allocators are worse".to_owned(),
            _ => format!(
                "{} is not shown to be better than {}",
                data.allocators[first],
                near.join(", ")
            ),
        },
    ))
}

/// Names the best allocator of each mission under a class of faults, and those without a significant difference to it.
fn under(data: &ComparisonData, analysis: &Analysis, class: &str) -> Option<String> {
    let par2 = data.metric_index(&Metric::Par2);
    let blocks: Vec<usize> = (0..data.blocks.len())
        .filter(|block| data.blocks[*block].faults == class)
        .collect();
    let mut sentences: Vec<String> = Vec::new();
    for block in blocks {
        let Some(best) = best(data, block) else {
            continue;
        };
        let mean = data.blocks[block].cells[best].mean(par2)?;
        let cells = data.blocks[block].cells.iter();
        if cells
            .filter_map(|cell| cell.mean(par2))
            .all(|other| other == mean)
        {
            let mission = &data.blocks[block].mission;
            sentences.push(format!("all allocators equal in {mission} ({mean:.0} s)"));
            continue;
        }
        let ties = ties(analysis, data, block, best);
        let ties = match ties.len() {
            0 => "all others are worse".to_owned(),
            _ => format!("no significant difference to {}", names(data, &ties)),
        };
        let mission = match data.blocks[block].mission.as_str() {
            "" => String::new(),
            mission => format!("in {mission} "),
        };
        sentences.push(format!(
            "{mission}{} ({mean:.0} s; {ties})",
            data.allocators[best]
        ));
    }
    let class = if class.is_empty() {
        "Best".to_owned()
    } else {
        format!("Best under {class}")
    };
    (!sentences.is_empty()).then(|| format!("{class}: {}.", sentences.join("; ")))
}

/// Returns the allocator with the least mean PAR2, except the reference.
#[must_use]
pub fn best(data: &ComparisonData, block: usize) -> Option<usize> {
    let par2 = data.metric_index(&Metric::Par2);
    let cells = data.blocks[block].cells.iter().enumerate();
    let rivals = cells.filter(|(place, _)| Some(*place) != data.reference);
    let means = rivals.filter_map(|(place, cell)| Some((place, cell.mean(par2)?)));
    means
        .min_by(|(_, a), (_, b)| a.total_cmp(b))
        .map(|(place, _)| place)
}

/// Returns the allocators that are not significantly worse than the best.
#[must_use]
pub fn ties(analysis: &Analysis, data: &ComparisonData, block: usize, best: usize) -> Vec<usize> {
    (0..data.allocators.len())
        .filter(|place| *place != best && Some(*place) != data.reference)
        .filter(|place| {
            let pair = analysis.pair(block, &Metric::Par2, best, *place);
            pair.is_some_and(|pair| pair.n > 0 && !(pair.is_significant() && pair.effect > 0.0))
        })
        .collect()
}

/// Lists the allocators that did not always complete the mission.
fn incomplete(data: &ComparisonData) -> Option<String> {
    let completion = data.metric_index(&Metric::Completion);
    let mut found = Vec::new();
    for (place, name) in data.allocators.iter().enumerate() {
        let cells = || data.blocks.iter().map(|block| &block.cells[place]);
        let present = || cells().flat_map(|cell| cell.values_of(completion));
        let (runs, complete) = (present().count(), present().sum::<f64>() as usize);
        if complete == runs {
            continue;
        }
        let never = data.blocks.iter().filter(|block| {
            let cell = &block.cells[place];
            cell.counted() > 0 && cell.mean(completion) == Some(0.0)
        });
        let never: Vec<String> = never.map(|block| block.name()).collect();
        let never = match never.len() {
            0 => String::new(),
            1..=4 => format!(", never in {}", never.join("; ")),
            many => format!(", never in {many} blocks"),
        };
        found.push(format!("{name} {complete} of {runs}{never}"));
    }
    Some(match found.len() {
        0 => "Every counted run completed its mission.".to_owned(),
        _ => format!(
            "Completed runs of the allocators that did not always complete: {}.",
            found.join("; ")
        ),
    })
}

fn no_data(data: &ComparisonData) -> Option<String> {
    let cells = data.blocks.iter().flat_map(|block| {
        let cells = block.cells.iter().zip(&data.allocators);
        let none = cells.filter(|(cell, _)| cell.counted() == 0);
        none.map(|(_, name)| format!("{name} in {}", block.name()))
    });
    let cells: Vec<String> = cells.collect();
    (!cells.is_empty()).then(|| {
        format!(
            "No data, because the fault never hit or every run failed: {}.",
            cells.join("; ")
        )
    })
}

fn claims(verdicts: &[Verdict]) -> Option<String> {
    if verdicts.is_empty() {
        return None;
    }
    let of = |outcome: Outcome| {
        let names: Vec<&str> = verdicts
            .iter()
            .filter(|verdict| verdict.outcome == outcome)
            .map(|verdict| verdict.name.as_str())
            .collect();
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
    let names: Vec<&str> = places
        .iter()
        .map(|place| data.allocators[*place].as_str())
        .collect();
    names.join(", ")
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
