//! SVG figures of a parameter search.

use plotters::style::RGBColor;

use super::importance::importance;
use super::result::AllocatorResult;
use super::search::Method;
use super::task::Task;
use super::tuning::{Candidate, percent};
use crate::figures::Figure;
use crate::figures::canvas::{
    Axes, FAINT, FRAME, Frame, INK, Mark, TextLabel, WIDTH_PX, chart, curve, fill, horizontal_line,
    line, part, svg,
};
use crate::figures::legend::{Legend, Sample};

const PLOT_PX: f64 = 330.0;
const ROW_PX: f64 = 26.0;
const NAMES_PX: f64 = 330.0;

/// The colors of the methods, which also differ in gray.
const COLORS: [RGBColor; 2] = [RGBColor(0, 114, 178), RGBColor(213, 94, 0)];

/// Draws search, importance, test, and bytes against the metric, for each allocator.
pub fn figures(task: &Task, results: &[AllocatorResult<'_>]) -> anyhow::Result<Vec<Vec<Figure>>> {
    results
        .iter()
        .map(|result| {
            Ok(vec![
                search(task, result)?,
                matters(result)?,
                test(task, result)?,
                front(task, result)?,
            ])
        })
        .collect()
}

/// Returns the range of the values and 0, with a margin at both ends.
fn span(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let (low, high) = values.fold((0.0_f64, 0.0_f64), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    let room = (high - low).max(1.0) * 0.06;
    low - room..high + room
}

fn legend() -> Legend<'static> {
    let samples = (0..)
        .zip(COLORS)
        .map(|(number, color)| Sample::Mark(Mark::of_series(number), color));
    let entries = samples.zip(Method::ALL.map(Method::as_str));
    Legend::column(entries.collect(), WIDTH_PX - 160.0)
}

fn search(task: &Task, result: &AllocatorResult<'_>) -> anyhow::Result<Figure> {
    let name = &result.allocator.name;
    let title = format!("{name}: best score so far against runs");
    let curves: Vec<Vec<(f64, f64)>> = Method::ALL
        .iter()
        .map(|method| {
            let candidates = result.tuned.candidates.iter();
            let candidates: Vec<&Candidate> = candidates
                .filter(|candidate| candidate.method == *method && !candidate.dropped)
                .collect();
            let mut best = f64::INFINITY;
            let mut points: Vec<(f64, f64)> = Vec::new();
            for generation in candidates.chunk_by(|a, b| a.generation == b.generation) {
                let least = generation
                    .iter()
                    .map(|candidate| candidate.score)
                    .fold(f64::INFINITY, f64::min);
                let runs = generation[0].runs as f64;
                if let Some((_, before)) = points.last().copied() {
                    points.push((runs, before));
                }
                best = best.min(least);
                points.push((runs, percent(best)));
            }
            points
        })
        .collect();
    let y = span(curves.iter().flatten().map(|point| point.1));
    let most = curves
        .iter()
        .flatten()
        .map(|point| point.0)
        .fold(1.0, f64::max);
    let axes = Axes {
        x: (0.0..most, "runs of the method"),
        y: (y, "score relative to the defaults, %"),
        y_labels: 6,
    };
    let svg = svg(&title, PLOT_PX + 10.0, |area| {
        let within = part(area, (0.0, 6.0), (WIDTH_PX - 170.0, PLOT_PX));
        let chart = chart(&within, FRAME, &axes)?;
        horizontal_line(&chart, 0.0..most, 0.0, line(FAINT, 1.0))?;
        for (place, points) in curves.iter().enumerate() {
            curve(&chart, points.clone(), line(COLORS[place], 2.0))?;
            for point in points {
                Mark::of_series(place).draw_at(area, &chart, *point, COLORS[place])?;
            }
        }
        legend().draw(area, 12.0)
    })?;
    Ok(Figure {
        name: format!("search-{name}"),
        caption: format!(
            "{title}, each on {} training seeds of its generation. Selecting the best includes luck, so the curves lie below the test result. \
             Broken line: the defaults.",
            task.tuning.seeds_per_candidate
        ),
        svg,
    })
}

fn matters(result: &AllocatorResult<'_>) -> anyhow::Result<Figure> {
    let name = &result.allocator.name;
    let title = format!("{name}: importance of the parameters");
    let all = importance(&result.tuned.candidates);
    let rows = all.len() as f64;
    let axes = Axes {
        x: (0.0..1.0, "share of the variance of scores, η²"),
        y: (0.0..rows.max(1.0), ""),
        y_labels: 0,
    };
    let height = ROW_PX * rows + 50.0;
    let svg = svg(&title, height + 8.0, |area| {
        let within = part(area, (NAMES_PX, 4.0), (WIDTH_PX - NAMES_PX, height));
        let chart = chart(
            &within,
            Frame {
                left: 12.0,
                ..FRAME
            },
            &axes,
        )?;
        for (place, (parameter, importance)) in
            result.allocator.parameters.iter().zip(&all).enumerate()
        {
            let y = rows - place as f64 - 0.5;
            fill(
                &chart,
                0.0..importance.share,
                y - 0.3..y + 0.3,
                COLORS[0],
                1.0,
            )?;
            curve(
                &chart,
                vec![
                    (importance.by_chance, y - 0.42),
                    (importance.by_chance, y + 0.42),
                ],
                line(INK, 1.5),
            )?;
            let at = (NAMES_PX - 6.0, 6.0 + ROW_PX * (place as f64 + 0.5));
            TextLabel::RIGHT.write(area, &parameter.key, at)?;
        }
        Ok(())
    })?;
    Ok(Figure {
        name: format!("importance-{name}"),
        caption: format!(
            "{title}: share of the variance of random search's scores between five equal parts of a parameter's range. \
             Vertical stroke: expected share of a parameter without effect. Interactions of parameters are not included."
        ),
        svg,
    })
}

fn test(task: &Task, result: &AllocatorResult<'_>) -> anyhow::Result<Figure> {
    let name = &result.allocator.name;
    let title = format!("{name}: tuned against default on test seeds");
    let rows = result.verdicts[0].len();
    let ends = result
        .verdicts
        .iter()
        .flatten()
        .flat_map(|verdict| [verdict.percent.1.0, verdict.percent.1.1]);
    let x = span(ends);
    let height = ROW_PX * rows as f64 + 50.0;
    let axes = Axes {
        x: (x, "change relative to the defaults, %"),
        y: (0.0..rows as f64, ""),
        y_labels: 0,
    };
    let svg = svg(&title, height + 50.0, |area| {
        let within = part(area, (NAMES_PX, 48.0), (WIDTH_PX - NAMES_PX, height));
        let chart = chart(
            &within,
            Frame {
                left: 12.0,
                ..FRAME
            },
            &axes,
        )?;
        curve(
            &chart,
            vec![(0.0, 0.0), (0.0, rows as f64)],
            line(FAINT, 1.0),
        )?;
        for (place, verdicts) in result.verdicts.iter().enumerate() {
            for (row, verdict) in verdicts.iter().enumerate() {
                let y = rows as f64 - row as f64 - 0.35 - 0.3 * place as f64;
                let (found, (from, to)) = verdict.percent;
                curve(&chart, vec![(from, y), (to, y)], line(COLORS[place], 2.0))?;
                Mark::of_series(place).draw_at(area, &chart, (found, y), COLORS[place])?;
                if place == 0 {
                    let at = (NAMES_PX - 6.0, 50.0 + ROW_PX * (row as f64 + 0.5));
                    TextLabel::RIGHT.write(area, &verdict.condition, at)?;
                }
            }
        }
        legend().draw(area, 12.0)
    })?;
    Ok(Figure {
        name: format!("test-{name}"),
        caption: format!(
            "{title}: {}, from the mean logarithm of ratios in pairs of the same seed, with 95 % intervals. Left is better.",
            task.metric.name()
        ),
        svg,
    })
}

fn front(task: &Task, result: &AllocatorResult<'_>) -> anyhow::Result<Figure> {
    let name = &result.allocator.name;
    let title = format!("{name}: {} against bytes", task.metric.name());
    let candidates = || {
        result
            .tuned
            .candidates
            .iter()
            .filter(|candidate| !candidate.dropped)
    };
    let mut best: Vec<(f64, f64)> = candidates()
        .map(|candidate| (percent(candidate.metric), percent(candidate.bytes)))
        .collect();
    best.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut least = f64::INFINITY;
    best.retain(|(_, bytes)| {
        let is_less = *bytes < least;
        least = least.min(*bytes);
        is_less
    });
    let axes = Axes {
        x: (
            span(candidates().map(|candidate| percent(candidate.metric))),
            "metric relative to the defaults, %",
        ),
        y: (
            span(candidates().map(|candidate| percent(candidate.bytes))),
            "bytes relative to the defaults, %",
        ),
        y_labels: 6,
    };
    let svg = svg(&title, PLOT_PX + 10.0, |area| {
        let within = part(area, (0.0, 6.0), (WIDTH_PX - 170.0, PLOT_PX));
        let chart = chart(&within, FRAME, &axes)?;
        for candidate in candidates() {
            let place = usize::from(candidate.method == Method::Random);
            let at = (percent(candidate.metric), percent(candidate.bytes));
            Mark::of_series(place).draw_at(area, &chart, at, COLORS[place])?;
        }
        curve(&chart, best.clone(), line(INK, 1.5))?;
        legend().draw(area, 12.0)
    })?;
    Ok(Figure {
        name: format!("front-{name}"),
        caption: format!(
            "{title}, for all candidates that finished their race, each on its training seeds. The line joins the Pareto-optimal candidates."
        ),
        svg,
    })
}
