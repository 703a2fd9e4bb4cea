//! The comparison at a glance: what was compared, by which measure and which tests, what is left out, and what would change
//! the answer.

use terminal::counted;

use super::analysis::{Analysis, BlockAnalysis, Ranking};
use super::answer::{best, named, next_best, p_value, rivals};
use super::data::ComparisonData;
use super::metrics::Metric;
use super::power::pairs_of;
use super::statistics::SIGNIFICANT;
use crate::distinct;

/// The largest number of names in a list.
const LISTED: usize = 12;

/// A fact about the comparison: its heading, and one or more sentences.
pub type Fact = (&'static str, String);

/// Returns the facts. `runs` are the numbers of all runs and of failed ones.
#[must_use]
pub fn overview(data: &ComparisonData, analysis: &Analysis, runs: (usize, usize)) -> Vec<Fact> {
    let facts = [
        ("Compared", Some(compared(data, runs.0))),
        ("Measure", Some(measure(data))),
        ("Effect", effect(data, analysis)),
        ("Tests", Some(tests(data, analysis))),
        ("Left out", Some(left_out(data, analysis, runs.1))),
        ("What would change it", Some(sensitivity(data, analysis))),
    ];
    let facts = facts.into_iter();
    facts
        .filter_map(|(heading, text)| Some((heading, text?)))
        .collect()
}

fn compared(data: &ComparisonData, runs: usize) -> String {
    let (missions, classes) = (data.missions().len(), data.classes().len());
    let blocks = match data.blocks.len() {
        1 => "one block".to_owned(),
        all if all == missions * classes => format!(
            "{all} blocks ({} × {})",
            counted(missions, "mission"),
            match classes {
                1 => "1 class of faults".to_owned(),
                _ => format!("{classes} classes of faults"),
            }
        ),
        all => format!("{all} blocks"),
    };
    let seeds = data.blocks[0].cells.iter().map(|cell| cell.runs).max();
    format!(
        "{} in {blocks}, with {} each: {}. The same seed gives each allocator the same world and the same random numbers of the radio.",
        listed(&data.allocators, "allocator"),
        counted(seeds.unwrap_or_default(), "seed"),
        counted(runs, "run"),
    )
}

fn measure(data: &ComparisonData) -> String {
    let metrics = distinct(data.blocks.iter().map(|block| &block.primary));
    let parts = metrics.iter().map(|metric| {
        let of_metric = data.blocks.iter().filter(|block| block.primary == **metric);
        let missions = distinct(of_metric.map(|block| block.mission.clone()));
        let direction = if metric.more_is_better() {
            "more"
        } else {
            "less"
        };
        let missions = match metrics.len() {
            1 => String::new(),
            _ => format!(" in {}", listed(&missions, "mission")),
        };
        format!("{} ({direction} is better){missions}", metric.heading())
    });
    let mut text = parts.collect::<Vec<_>>().join("; ") + ".";
    if metrics.contains(&&Metric::Par2) {
        text += " PAR2 is the time until the mission is complete. A run without completion is censored at its limit, and counts as twice the limit.";
    }
    text
}

/// Returns the size of the best allocator's lead, with intervals.
fn effect(data: &ComparisonData, analysis: &Analysis) -> Option<String> {
    match analysis.primary() {
        Some(ranking) => lead_in_ranks(data, ranking),
        None => (0..data.blocks.len()).find_map(|block| lead_in_block(data, analysis, block)),
    }
}

fn lead_in_ranks(data: &ComparisonData, ranking: &Ranking) -> Option<String> {
    let order = rivals(data, ranking);
    let (first, second) = (*order.first()?, *order.get(1)?);
    let ranks = &ranking.friedman.mean_ranks;
    let shown = |place: usize| {
        let (from, to) = ranking.intervals[place];
        format!(
            "{} {:.2} ({from:.2} to {to:.2})",
            data.allocators[place], ranks[place]
        )
    };
    Some(format!(
        "Mean ranks with 95 % intervals: {}, then {}. The difference is {:.2}, p {} by Nemenyi's test; {:.2} is significant.",
        shown(first),
        shown(second),
        ranks[second] - ranks[first],
        p_value(ranking.p(first, second)),
        ranking.critical,
    ))
}

fn lead_in_block(data: &ComparisonData, analysis: &Analysis, block: usize) -> Option<String> {
    let first = best(data, block)?;
    let second = next_best(data, block, first)?;
    let (metric, pair) = analysis.decided(data, block, (first, second))?;
    let summary = analysis.blocks[block].summaries[first][data.metric_index(metric)]?;
    let (mean, interval) = pair.mean?;
    let show = |(from, to): (f64, f64)| format!("{} to {}", metric.show(from), metric.show(to));
    let head = format!(
        "{}{}: {} {}",
        if data.blocks.len() == 1 {
            String::new()
        } else {
            format!("In {}, ", data.blocks[block].name())
        },
        data.allocators[first],
        metric.heading().trim_end_matches(" in s"),
        metric.show(summary.mean),
    );
    let (next, lead) = (&data.allocators[second], metric.show(mean));
    if pair.is_exact() {
        return Some(format!(
            "{head}. The next, {next}, differs by {lead}: exact, because all seeds give the same run (n = 1)."
        ));
    }
    let p = pair.adjusted.map_or_else(String::new, |p| {
        let pairs = counted(pair.n, "pair");
        format!(
            ", p {} by Wilcoxon's test after Holm's correction, {pairs}",
            p_value(p)
        )
    });
    Some(format!(
        "{head} (95 %: {}). The next, {next}, differs by {lead} ({}): effect {:.2}{p}.",
        show(summary.interval),
        show(interval),
        pair.effect,
    ))
}

fn tests(data: &ComparisonData, analysis: &Analysis) -> String {
    let over_blocks = analysis.primary().map(|ranking| {
        let friedman = &ranking.friedman;
        format!(
            "Over {}: Friedman's (χ² = {:.1}, p {}), then Nemenyi's. ",
            counted(friedman.blocks, "block"),
            friedman.statistic,
            p_value(friedman.p),
        )
    });
    let over_blocks = over_blocks.unwrap_or_default();
    if analysis.blocks.iter().all(BlockAnalysis::has_no_chance) {
        return format!(
            "{over_blocks}Within a block: none. All seeds give the same run, so differences are exact (n = 1)."
        );
    }
    format!(
        "{over_blocks}Within a block: Wilcoxon's signed-rank test of runs with the same seed, with Holm's correction for {}. A difference is significant below {SIGNIFICANT}.",
        counted(pairs_of(data.allocators.len()), "pair"),
    )
}

fn left_out(data: &ComparisonData, analysis: &Analysis, failed: usize) -> String {
    let cells = || data.blocks.iter().flat_map(|block| &block.cells);
    let without_effect: usize = cells().map(|cell| cell.without_effect).sum();
    let constant = cells().filter(|cell| cell.is_constant).count();
    let mut parts = Vec::new();
    if failed > 0 {
        parts.push(format!("{} that failed", counted(failed, "run")));
    }
    if without_effect > 0 {
        parts.push(format!(
            "{} in which no fault took effect",
            counted(without_effect, "run")
        ));
    }
    let ranking = analysis.primary();
    if let Some(ranking) = ranking.filter(|ranking| !ranking.omitted_blocks.is_empty()) {
        let blocks = ranking.omitted_blocks.iter();
        let blocks: Vec<String> = blocks.map(|block| data.blocks[*block].name()).collect();
        parts.push(format!(
            "from the ranks {}, in which an allocator has no data or all are equal: {}",
            counted(blocks.len(), "block"),
            named(&blocks),
        ));
    }
    if let Some(reference) = data.reference {
        parts.push(format!(
            "from the competition {}, which has the ground truth",
            data.allocators[reference]
        ));
    }
    let mut text = match parts.is_empty() {
        true => "No run.".to_owned(),
        false => capitalized(&parts.join("; ")) + ".",
    };
    if constant > 0 {
        let cells = counted(constant, "cell");
        text += &format!(" In {cells} all seeds give the same run, which counts once.");
    }
    text
}

fn capitalized(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|first| first.to_ascii_uppercase());
    first.into_iter().chain(letters).collect()
}

fn sensitivity(data: &ComparisonData, analysis: &Analysis) -> String {
    match analysis.primary() {
        Some(ranking) => of_ranks(data, ranking),
        None => {
            let sentence = (0..data.blocks.len()).find_map(|block| of_block(data, analysis, block));
            sentence
                .unwrap_or_else(|| "Missions and faults in which the allocators differ.".to_owned())
        }
    }
}

/// States whether the first place depends on one mission or class of faults, and the number of blocks for a significant lead.
fn of_ranks(data: &ComparisonData, ranking: &Ranking) -> String {
    let order = rivals(data, ranking);
    let [first, second, ..] = order[..] else {
        return "Another allocator.".to_owned();
    };
    let is_rival = |place: &usize| Some(*place) != data.reference;
    let leader = |counts: &dyn Fn(usize) -> bool| {
        let ranks = ranking.mean_ranks_over(counts)?;
        let places = (0..ranks.len()).filter(is_rival);
        // The present leader stays first among equals.
        places.min_by(|a, b| {
            let key = |place: usize| (ranks[place], place != first);
            key(*a)
                .partial_cmp(&key(*b))
                .unwrap_or(std::cmp::Ordering::Equal)
        })
    };
    let missions = data.missions().into_iter().filter_map(|mission| {
        let leads = leader(&|block| data.blocks[block].mission != mission)?;
        (leads != first).then(|| format!("without {mission}, {} is first", data.allocators[leads]))
    });
    let classes = data.classes().into_iter().filter_map(|class| {
        let leads = leader(&|block| data.blocks[block].faults != class)?;
        (leads != first).then(|| {
            format!(
                "without the faults {class}, {} is first",
                data.allocators[leads]
            )
        })
    });
    let changes: Vec<String> = missions.chain(classes).collect();
    let name = &data.allocators[first];
    let has_parts = data.missions().len() > 1 || data.classes().len() > 1;
    let mut text = match changes.is_empty() {
        true if has_parts => format!(
            "No single mission or class of faults: without any one of them, {name} stays first."
        ),
        true => String::new(),
        false => format!("The choice of missions and faults: {}.", named(&changes)),
    };
    let ranks = &ranking.friedman.mean_ranks;
    let lead = ranks[second] - ranks[first];
    if lead < ranking.critical {
        let other = &data.allocators[second];
        // The critical difference falls with the square root of the number of blocks.
        let needed = (ranking.critical / lead).powi(2) * ranking.friedman.blocks as f64;
        text += &match needed {
            needed if needed.is_finite() && needed < 1e4 => format!(
                " With the same mean ranks, the lead over {other} would be significant over {} blocks, instead of {}.",
                needed.ceil(),
                ranking.friedman.blocks
            ),
            _ => format!(" More blocks alone would not show a lead over {other}."),
        };
    }
    text.trim_start().to_owned()
}

/// States the number of seeds for a significant lead in a block, or that it is significant.
fn of_block(data: &ComparisonData, analysis: &Analysis, block: usize) -> Option<String> {
    let first = best(data, block)?;
    let second = next_best(data, block, first)?;
    let (_, pair) = analysis.decided(data, block, (first, second))?;
    let (mean, (from, to)) = pair.mean?;
    let other = &data.allocators[second];
    if pair.is_exact() {
        return Some(format!(
            "Other missions and faults: all seeds give the same run, so the difference to {other} is exact, and more seeds show nothing new."
        ));
    }
    if pair.is_significant() {
        return Some(format!(
            "Other missions and faults: this is one block. More seeds only narrow the intervals, as the lead over {other} is significant."
        ));
    }
    // An interval becomes narrower with the square root of the number of runs.
    let needed = ((to - from) / 2.0 / mean.abs()).powi(2) * pair.n as f64;
    Some(match needed {
        needed if needed.is_finite() && needed < 1e6 && needed > pair.n as f64 => format!(
            "More seeds: with about {} instead of {}, the interval of the difference to {other} would not include 0.",
            needed.ceil(),
            pair.n
        ),
        _ => format!("More seeds may show a difference to {other}, or none."),
    })
}

/// Joins the names of things; beyond [`LISTED`] only their number is stated.
fn listed(names: &[String], thing: &str) -> String {
    match names.len() {
        0 | 1 => names.join(""),
        many if many > LISTED => counted(many, thing),
        many => format!("{} and {}", names[..many - 1].join(", "), names[many - 1]),
    }
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroUsize;

    use super::super::data::tests::data;
    use super::*;

    fn facts(data: &ComparisonData) -> Vec<Fact> {
        let runs = data.blocks.iter().flat_map(|block| &block.cells);
        let runs = runs.map(|cell| cell.runs).sum();
        overview(data, &Analysis::new(data, NonZeroUsize::MIN), (runs, 0))
    }

    fn fact(facts: &[Fact], heading: &str) -> String {
        let mut found = facts.iter().filter(|(name, _)| *name == heading);
        found
            .next()
            .map_or_else(String::new, |(_, text)| text.clone())
    }

    /// Alliance is first in three of four blocks, nearest in `near` under `dead`, by 1 s each.
    #[test]
    fn facts_of_several_blocks() {
        let data = data(
            |block, rival, seed| match rival {
                1 => Some(30.0),
                _ => {
                    Some(40.0 + (seed * seed % 7) as f64 + f64::from((rival == 2) != (block == 1)))
                }
            },
            12,
        );
        let facts = facts(&data);
        assert_eq!(
            fact(&facts, "Compared"),
            "alliance, oracle and nearest in 4 blocks (2 missions × 2 classes of faults), with 12 seeds each: 144 runs. \
             The same seed gives each allocator the same world and the same random numbers of the radio."
        );
        assert!(fact(&facts, "Measure").starts_with("PAR2 in s (less is better). PAR2 is"));
        let effect = fact(&facts, "Effect");
        // Ranks of alliance: 2, 3, 2, 2; of nearest: 3, 2, 3, 3.
        assert!(effect.contains("alliance 2.25 (2.00 to 2.75), then nearest 2.75 (2.25 to 3.00). The difference is 0.50, p = "), "{effect}");
        assert!(fact(&facts, "Tests").starts_with("Over 4 blocks: Friedman's (χ² = "));
        assert_eq!(
            fact(&facts, "Left out"),
            "From the competition oracle, which has the ground truth. In 4 cells all seeds give the same run, which counts once."
        );
        // CD = 2.343 · √(3 · 4 / (6 · 4)) = 1.657; (1.657 / 0.5)² · 4 = 43.9.
        assert_eq!(
            fact(&facts, "What would change it"),
            "No single mission or class of faults: without any one of them, alliance stays first. \
             With the same mean ranks, the lead over nearest would be significant over 44 blocks, instead of 4."
        );
    }

    /// By hand, ranks with the oracle: alliance 1, 2, 3, 3; nearest 3, 3, 2, 2. In `far` nearest is before alliance.
    #[test]
    fn a_lead_that_depends_on_one_mission() {
        let data = data(
            |block, rival, seed| {
                let base = match (block, rival) {
                    (0, 0) => 20.0,
                    (_, 1) => 30.0,
                    (2.., 0) => 50.0,
                    (_, 0) => 40.0,
                    _ => 45.0,
                };
                Some(
                    base + if rival == 1 {
                        0.0
                    } else {
                        (seed * seed % 7) as f64 / 10.0
                    },
                )
            },
            8,
        );
        let text = fact(&facts(&data), "What would change it");
        assert!(
            text.starts_with("The choice of missions and faults: without near, nearest is first. With the same mean ranks"),
            "{text}"
        );
    }

    #[test]
    fn long_lists_state_what_they_count() {
        let names: Vec<String> = (0..13).map(|number| format!("m{number}")).collect();
        assert_eq!(listed(&names, "mission"), "13 missions");
        assert_eq!(listed(&names[..2], "mission"), "m0 and m1");
    }

    #[test]
    fn runs_without_effect_and_blocks_without_ranks_are_left_out() {
        let data = data(
            |block, rival, seed| match (block, rival) {
                (3, 2) => None,
                (_, 1) => Some(30.0),
                (_, rival) => Some(40.0 + (seed * seed % 7) as f64 + 2.5 * rival as f64),
            },
            12,
        );
        assert_eq!(
            fact(&facts(&data), "Left out"),
            "12 runs in which no fault took effect; from the ranks 1 block, in which an allocator has no data or all are \
             equal: far, dead; from the competition oracle, which has the ground truth. In 4 cells all seeds give the \
             same run, which counts once."
        );
    }
}
