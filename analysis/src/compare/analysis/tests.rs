use super::super::answer::{answer, best, ties};
use super::super::data::tests::{data, data_with, far_by, own};
use super::*;

const JOBS: NonZeroUsize = NonZeroUsize::new(3).unwrap();

/// Creates data in which nearest needs 5 s more than alliance and has no data in the last block.
fn sample() -> ComparisonData {
    data(
        |block, rival, seed| match (block, rival) {
            (3, 2) => None,
            (_, 1) => Some(30.0),
            (_, rival) => Some(40.0 + (seed * seed % 7) as f64 + 2.5 * rival as f64),
        },
        12,
    )
}

#[test]
fn pairs_means_and_ranks() {
    let data = sample();
    let analysis = Analysis::new(&data, JOBS);
    let par2 = data.metric_index(&Metric::Par2);
    let summary = analysis.blocks[0].summaries[1][par2].unwrap();
    // All runs of the oracle are equal.
    assert_eq!(
        (summary.n, summary.mean, summary.interval),
        (1, 30.0, (30.0, 30.0))
    );
    let completion = data.metric_index(&Metric::Completion);
    let completion = analysis.blocks[0].summaries[0][completion].unwrap();
    assert_eq!(completion.interval, wilson(12, 12));

    let pair = analysis.pair(0, &Metric::Par2, 0, 2).unwrap();
    let five = Some((5.0, (5.0, 5.0)));
    assert_eq!((pair.n, pair.mean, pair.median), (12, five, five));
    assert_eq!(pair.effect, 1.0);
    assert!(pair.is_significant() && pair.adjusted >= pair.p);
    let turned = analysis.pair(0, &Metric::Par2, 2, 0).unwrap();
    assert_eq!(
        (turned.mean, turned.p),
        (Some((-5.0, (-5.0, -5.0))), pair.p)
    );
    assert_eq!(turned.effect, -1.0);
    let nothing = analysis.pair(3, &Metric::Par2, 0, 2).unwrap();
    assert_eq!((nothing.n, nothing.mean), (0, None));
    assert!(!nothing.is_significant());

    let ranking = &analysis.rankings[0];
    assert_eq!(
        (ranking.friedman.blocks, &*ranking.omitted_blocks),
        (3, &[3][..])
    );
    assert_eq!(ranking.friedman.mean_ranks, [2.0, 1.0, 3.0]);
    assert_eq!(ranking.order(), [1, 0, 2]);
}

#[test]
fn differences_of_medians_have_no_rounding_errors() {
    // 349.3 - 327.25 = 22.05000000000001 in floating point.
    let seconds = |_: usize, rival: usize, _: usize| Some([327.25, 327.25, 349.3][rival]);
    let data = data(seconds, 6);
    let pair = Analysis::new(&data, JOBS).pair(0, &Metric::Par2, 0, 2);
    let expected = Some((22.05, (22.05, 22.05)));
    assert_eq!(pair.unwrap().median, expected);
}

#[test]
fn the_number_of_workers_does_not_change_the_result() {
    let data = sample();
    let pairs = |jobs| {
        let blocks = Analysis::new(&data, jobs).blocks.into_iter();
        blocks.map(|block| block.pairs).collect::<Vec<_>>()
    };
    assert_eq!(pairs(JOBS), pairs(NonZeroUsize::MIN));
}

/// Eight pairs whose differences have the same size in whole milliseconds. As seconds, they differ in the last digits:
/// 0.05000000000001137 and 0.049999999999954525.
#[test]
fn equal_differences_are_ties() {
    let signs = [-1.0, -1.0, -1.0, 1.0, 1.0, 1.0, -1.0, -1.0];
    let starts = [338.05, 211.2, 512.35, 127.85, 301.7, 64.1, 255.9, 409.15];
    let data = data(
        |_, rival, seed| Some(starts[seed] + if rival == 2 { signs[seed] * 0.05 } else { 0.0 }),
        8,
    );
    let analysis = Analysis::new(&data, JOBS);
    let pair = analysis.pair(0, &Metric::Par2, 0, 2).unwrap();
    // Eight ranks of 4.5: W⁺ = 13.5 of 36. At most 3 of 8 signs are positive in 1 + 8 + 28 + 56 of 256 cases.
    assert_eq!(pair.effect, -0.25);
    assert_eq!(pair.p, Some(2.0 * 93.0 / 256.0));
    let (mean, _) = pair.mean.unwrap();
    assert!((mean + 0.0125).abs() < 1e-12, "{mean}");
}

/// Two allocators whose runs are all equal have an exact difference; the number of seeds is no evidence.
#[test]
fn equal_runs_have_an_exact_difference() {
    let data = data(|_, rival, _| Some(30.0 + rival as f64), 8);
    let analysis = Analysis::new(&data, JOBS);
    let pair = analysis.pair(0, &Metric::Par2, 0, 2).unwrap();
    assert_eq!((pair.n, pair.effect, pair.p), (1, 1.0, None));
    assert!(pair.is_significant() && pair.adjusted.is_none());
    let completed = analysis.pair(0, &Metric::Completion, 0, 2).unwrap();
    assert!(!completed.is_significant());
    let completion = data.metric_index(&Metric::Completion);
    let summary = analysis.blocks[0].summaries[0][completion].unwrap();
    assert_eq!((summary.n, summary.interval), (1, (1.0, 1.0)));
    let found = answer(&data, &analysis, &[]);
    let details = found.details.join("\n");
    let text = "All seeds give the same run, which counts once: near, none; near, dead; far, none; far, dead.";
    assert!(details.contains(text), "{details}");
    assert_eq!(
        [&*found.sentences[0], &found.sentences[2]],
        [
            "Over 4 blocks (a block is a mission under a class of faults) alliance has the best mean rank, 1.0 of 3; \
             all seeds give the same run, so each block is one run of each (n = 1).",
            "In 4 of 4 blocks some allocator is worse than the best, by an exact difference without a test, \
             because all seeds give the same run (n = 1).",
        ]
    );
    assert!(!details.contains("significant"), "{details}");
}

/// With chance in one mission only, the tests concern that mission only.
#[test]
fn exact_and_tested_differences_are_told_apart() {
    let data = data(
        |block, rival, seed| {
            let varied = if block < 2 {
                (seed * seed % 7) as f64
            } else {
                0.0
            };
            Some(40.0 + varied + 2.5 * rival as f64)
        },
        8,
    );
    let analysis = Analysis::new(&data, JOBS);
    assert_eq!(
        answer(&data, &analysis, &[]).sentences[2],
        "In 2 of 2 blocks some allocator is significantly worse than the best; in 2 of 2 more some allocator is \
         worse than the best, by an exact difference without a test, because all seeds give the same run (n = 1)."
    );
}

#[test]
fn too_few_seeds_are_named_and_not_shown_as_equality() {
    // Each pair differs in all 4 runs, but 3 pairs of allocators need 7 seeds: 2 · 3 / 2⁷ = 0.047.
    let runs = |seeds| {
        data(
            |_, rival, seed| Some(40.0 + 3.0 * rival as f64 + (seed * seed % 5) as f64 / 4.0),
            seeds,
        )
    };
    let (few, enough) = (runs(4), runs(7));
    let (of_few, of_enough) = (Analysis::new(&few, JOBS), Analysis::new(&enough, JOBS));
    assert!(!of_few.blocks[0].can_differ(&Metric::Par2));
    let found = answer(&few, &of_few, &[]);
    assert_eq!(
        found.sentences[2],
        "4 seeds are too few to show any difference within a block: with 3 allocators at least 7 are needed, so the page shows none and claims no equality."
    );
    let details = found.details.join("\n");
    assert!(
        details.contains("in near alliance (41 s; too few seeds for a difference)"),
        "{details}"
    );
    assert!(!details.contains("no significant difference"), "{details}");
    assert!(of_enough.blocks[0].can_differ(&Metric::Par2));
    assert_eq!(
        answer(&enough, &of_enough, &[]).sentences[2],
        "In 4 of 4 blocks some allocator is significantly worse than the best."
    );
}

#[test]
fn allocators_are_equal_only_if_no_measure_of_the_outcome_differs() {
    let data = data(|_, _, _| Some(30.0), 4);
    let found = answer(&data, &Analysis::new(&data, JOBS), &[]);
    assert_eq!(
        found.sentences,
        [
            "All allocators with data have the same outcome by every measure.",
            "All counted runs of a block lasted the same time, so completion and time show no difference.",
            "In no block do the allocators differ by any measure of the outcome.",
        ]
    );
}

/// A mission that ranks its runs by another figure is judged by it, not by the equal times.
#[test]
fn a_mission_is_judged_by_its_own_figure() {
    let own = own("seen", "seen");
    let comparison = far_by(&own);
    let data = data_with(
        |block, rival, seed| {
            let varied = 40.0 + (seed * seed % 7) as f64 + 2.5 * rival as f64;
            Some(if block < 2 { varied } else { 60.0 })
        },
        12,
        &comparison,
    );
    let analysis = Analysis::new(&data, JOBS);
    let metric = Metric::Own(own);
    assert!(data.are_equal(2, &Metric::Par2) && !data.are_equal(2, &metric));
    // Alliance sees more in `far`, nearest is faster in no mission.
    assert_eq!([best(&data, 0), best(&data, 2)], [Some(0), Some(0)]);
    let ranking = analysis.primary().unwrap();
    assert_eq!(
        (ranking.name.as_str(), ranking.friedman.blocks),
        ("primary", 4)
    );
    let details = answer(&data, &analysis, &[]).details.join("\n");
    assert!(
        details.contains("in far alliance (seen 0.90; all others are worse)"),
        "{details}"
    );
}

#[test]
fn the_answer_names_the_best_ties_and_missing_data() {
    let data = sample();
    let analysis = Analysis::new(&data, JOBS);
    assert_eq!(best(&data, 0), Some(0), "the oracle does not compete");
    assert!(ties(&analysis, &data, 0, 0).is_empty());
    let found = answer(&data, &analysis, &[]);
    assert_eq!(
        found.sentences,
        [
            "Over 3 blocks (a block is a mission under a class of faults) alliance has the best mean rank, 2.0 of 3; \
             no other is significantly worse.",
            "Every counted run completed its mission; no data in 1 of 12 cells.",
            "In 3 of 4 blocks some allocator is significantly worse than the best.",
        ]
    );
    let details = found.details.join("\n");
    for part in [
        "Best under none: in near alliance (42 s; all others are worse); in far alliance",
        "No data, because the fault never hit or every run failed: nearest in far, dead.",
    ] {
        assert!(details.contains(part), "no '{part}' in {details}");
    }
}
