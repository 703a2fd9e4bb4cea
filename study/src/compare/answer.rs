//! The answer in words, made from the numbers.

use super::analysis::{Analysis, LEVEL};
use super::data::Data;
use super::hypotheses::{Outcome, Verdict};
use super::metrics::Metric;

/// What the numbers say, a sentence or two in each.
#[must_use]
pub fn answer(data: &Data, analysis: &Analysis, verdicts: &[Verdict]) -> Vec<String> {
    let mut said: Vec<String> = Vec::new();
    said.extend(over_all(data, analysis));
    for class in data.classes() {
        said.extend(under(data, analysis, class));
    }
    said.extend(incomplete(data));
    said.extend(no_data(data));
    said.extend(claims(verdicts));
    said
}

/// Mean ranks over all blocks.
fn over_all(data: &Data, analysis: &Analysis) -> Option<String> {
    let ranking = analysis
        .rankings
        .iter()
        .find(|it| it.metric == Metric::Par2)?;
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
    let left = match ranking.left_out.len() {
        0 => String::new(),
        1 => "; 1 more block is left out, for an allocator has no data in it or all are alike"
            .to_owned(),
        left => format!(
            "; {left} more blocks are left out, for an allocator has no data in them or all are alike"
        ),
    };
    let differ = if ranking.friedman.p < 1.0 - LEVEL {
        "differ"
    } else {
        "do not differ beyond chance"
    };
    Some(format!(
        "Over {blocks} blocks (a mission under a class of faults) {} copes best: mean rank {:.1} of {} by mean PAR2. {} comes last. \
         All together, the ranks {differ} (Friedman, p {}); two of them do where they lie {:.1} apart (Nemenyi): {}{left}.",
        data.allocators[first],
        ranks[first],
        ranks.len(),
        named(last),
        p_value(ranking.friedman.p),
        ranking.critical,
        match near.len() {
            0 => "so all others are worse".to_owned(),
            _ => format!("so nothing is shown between it and {}", near.join(", ")),
        },
    ))
}

/// The best of each mission under a class of faults, and who cannot be told from it.
fn under(data: &Data, analysis: &Analysis, class: &str) -> Option<String> {
    let par2 = data.place(&Metric::Par2);
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
            .all(|it| it == mean)
        {
            let mission = &data.blocks[block].mission;
            sentences.push(format!("all alike in {mission} ({mean:.0} s)"));
            continue;
        }
        let ties = ties(analysis, data, block, best);
        let ties = match ties.len() {
            0 => "all others are worse".to_owned(),
            _ => format!("not told from {}", names(data, &ties)),
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

/// The allocator of least mean PAR2, but for the reference.
#[must_use]
pub fn best(data: &Data, block: usize) -> Option<usize> {
    let par2 = data.place(&Metric::Par2);
    let cells = data.blocks[block].cells.iter().enumerate();
    let rivals = cells.filter(|(place, _)| Some(*place) != data.reference);
    let means = rivals.filter_map(|(place, cell)| Some((place, cell.mean(par2)?)));
    means
        .min_by(|(_, a), (_, b)| a.total_cmp(b))
        .map(|(place, _)| place)
}

/// Those that are not shown to be worse than the best.
#[must_use]
pub fn ties(analysis: &Analysis, data: &Data, block: usize, best: usize) -> Vec<usize> {
    (0..data.allocators.len())
        .filter(|place| *place != best && Some(*place) != data.reference)
        .filter(|place| {
            let pair = analysis.pair(block, &Metric::Par2, best, *place);
            pair.is_some_and(|pair| pair.n > 0 && !(pair.is_real() && pair.effect > 0.0))
        })
        .collect()
}

/// Who does not always complete the mission.
fn incomplete(data: &Data) -> Option<String> {
    let completion = data.place(&Metric::Completion);
    let mut found = Vec::new();
    for (place, name) in data.allocators.iter().enumerate() {
        let cells = || data.blocks.iter().map(|block| &block.cells[place]);
        let present = || cells().flat_map(|cell| cell.present(completion));
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
        0 => "Every run that counts completed its mission.".to_owned(),
        _ => format!(
            "Completed runs of those that did not always complete: {}.",
            found.join("; ")
        ),
    })
}

/// Cells in which nothing happened.
fn no_data(data: &Data) -> Option<String> {
    let cells = data.blocks.iter().flat_map(|block| {
        let cells = block.cells.iter().zip(&data.allocators);
        let none = cells.filter(|(cell, _)| cell.counted() == 0);
        none.map(|(_, name)| format!("{name} in {}", block.name()))
    });
    let cells: Vec<String> = cells.collect();
    (!cells.is_empty()).then(|| {
        format!(
            "No data, for the fault never hit or every run failed: {}.",
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
        "Of {} hypotheses that were declared beforehand {}, {}, {}.",
        verdicts.len(),
        of(Outcome::Held),
        of(Outcome::Failed),
        of(Outcome::Undecided)
    ))
}

fn names(data: &Data, places: &[usize]) -> String {
    let names: Vec<&str> = places
        .iter()
        .map(|place| data.allocators[*place].as_str())
        .collect();
    names.join(", ")
}

/// With two digits that count, and whether it is that or less.
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
