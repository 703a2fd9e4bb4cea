//! SVG figures of a parameter search.

use std::ops::Range;

use plotters::style::RGBColor;

use super::importance::importance;
use super::search::Method;
use super::task::Task;
use super::tuning::{Candidate, percent};
use super::verdict::AllocatorResult;
use crate::figures::Figure;
use crate::figures::canvas::{
    Area, Axes, Chart, DrawResult, FAINT, FRAME, Frame, INK, Mark, TextLabel, WIDTH_PX, chart,
    curve, fill, horizontal_line, line, part, svg,
};
use crate::figures::legend::{Legend, Sample};

const PLOT_PX: f64 = 330.0;
const ROW_PX: f64 = 26.0;
const NAMES_PX: f64 = 330.0;

/// The colors of the methods, which also differ in gray.
const COLORS: [RGBColor; 2] = [RGBColor(0, 114, 178), RGBColor(213, 94, 0)];

/// Draws search, importance, test, and bytes against the metric, for each allocator.
pub fn figures(task: &Task, results: &[AllocatorResult<'_>]) -> anyhow::Result<Vec<Vec<Figure>>> {
    let figures = results.iter().map(|result| {
        let (search, matters) = (search(task, result)?, matters(result)?);
        Ok(vec![
            search,
            matters,
            test(task, result)?,
            front(task, result)?,
        ])
    });
    figures.collect()
}

/// Returns the range of the values and 0, with a margin at both ends.
fn span(values: impl Iterator<Item = f64>) -> Range<f64> {
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

/// Draws a plot with the legend of the methods beside it.
fn beside_legend(
    title: &str,
    axes: &Axes<'_>,
    draw: impl FnOnce(&Area<'_>, &Chart<'_>) -> DrawResult,
) -> anyhow::Result<String> {
    svg(title, PLOT_PX + 10.0, |area| {
        let within = part(area, (0.0, 6.0), (WIDTH_PX - 170.0, PLOT_PX));
        draw(area, &chart(&within, FRAME, axes)?)?;
        legend().draw(area, 12.0)
    })
}

/// Draws a plot with one named row per entry of `names`, from above. `draw` calls its last argument to write a name.
fn rows(
    title: &str,
    (top_px, bottom_px): (f64, f64),
    (x, x_title): (Range<f64>, &str),
    names: &[&str],
    draw: impl FnOnce(&Area<'_>, &Chart<'_>, &dyn Fn(usize) -> DrawResult) -> DrawResult,
) -> anyhow::Result<String> {
    let height = ROW_PX * names.len() as f64 + 50.0;
    svg(title, top_px + height + bottom_px, |area| {
        let within = part(area, (NAMES_PX, top_px), (WIDTH_PX - NAMES_PX, height));
        let frame = Frame {
            left: 12.0,
            ..FRAME
        };
        let axes = Axes {
            x: (x, x_title),
            y: (0.0..(names.len() as f64).max(1.0), ""),
            y_labels: 0,
        };
        draw(area, &chart(&within, frame, &axes)?, &|row| {
            let y = top_px + 2.0 + ROW_PX * (row as f64 + 0.5);
            TextLabel::RIGHT.write(area, names[row], (NAMES_PX - 6.0, y))
        })
    })
}

fn search(task: &Task, result: &AllocatorResult<'_>) -> anyhow::Result<Figure> {
    let name = &result.allocator.name;
    let title = format!("{name}: best score so far against runs");
    let curves = Method::ALL.map(|method| {
        let candidates = result.tuned.candidates.iter();
        let candidates: Vec<&Candidate> = candidates
            .filter(|candidate| candidate.method == method && !candidate.dropped)
            .collect();
        let mut best = f64::INFINITY;
        let mut points: Vec<(f64, f64)> = Vec::new();
        for generation in candidates.chunk_by(|a, b| a.generation == b.generation) {
            let scores = generation.iter().map(|candidate| candidate.score);
            let runs = generation[0].runs as f64;
            if let Some((_, before)) = points.last().copied() {
                points.push((runs, before));
            }
            best = scores.fold(best, f64::min);
            points.push((runs, percent(best)));
        }
        points
    });
    let points = || curves.iter().flatten();
    let most = points().map(|point| point.0).fold(1.0, f64::max);
    let axes = Axes {
        x: (0.0..most, "runs of the method"),
        y: (
            span(points().map(|point| point.1)),
            "score relative to the defaults, %",
        ),
        y_labels: 6,
    };
    let svg = beside_legend(&title, &axes, |area, chart| {
        horizontal_line(chart, 0.0..most, 0.0, line(FAINT, 1.0))?;
        for (place, points) in curves.iter().enumerate() {
            curve(chart, points.clone(), line(COLORS[place], 2.0))?;
            for point in points {
                Mark::of_series(place).draw_at(area, chart, *point, COLORS[place])?;
            }
        }
        Ok(())
    })?;
    Ok(Figure {
        about: Vec::new(),
        numbers: None,
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
    let names = result.allocator.parameters.iter().take(all.len());
    let names: Vec<&str> = names.map(|parameter| &*parameter.key).collect();
    let x = (0.0..1.0, "share of the variance of scores, η²");
    let svg = rows(&title, (4.0, 4.0), x, &names, |_, chart, write_name| {
        for (place, importance) in all.iter().enumerate() {
            let y = (all.len() - place) as f64 - 0.5;
            fill(
                chart,
                0.0..importance.share,
                y - 0.3..y + 0.3,
                COLORS[0],
                1.0,
            )?;
            let ends = [y - 0.42, y + 0.42].map(|end| (importance.by_chance, end));
            curve(chart, ends.to_vec(), line(INK, 1.5))?;
            write_name(place)?;
        }
        Ok(())
    })?;
    Ok(Figure {
        about: Vec::new(),
        numbers: None,
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
    let conditions = result.verdicts[0].iter();
    let names: Vec<&str> = conditions.map(|verdict| &*verdict.condition).collect();
    let count = names.len() as f64;
    let verdicts = result.verdicts.iter().flatten();
    let x = span(verdicts.flat_map(|verdict| [verdict.percent.1.0, verdict.percent.1.1]));
    let x = (x, "change relative to the defaults, %");
    let svg = rows(&title, (48.0, 2.0), x, &names, |area, chart, write_name| {
        curve(chart, vec![(0.0, 0.0), (0.0, count)], line(FAINT, 1.0))?;
        for (place, verdicts) in result.verdicts.iter().enumerate() {
            for (row, verdict) in verdicts.iter().enumerate() {
                let y = count - row as f64 - 0.35 - 0.3 * place as f64;
                let (found, (from, to)) = verdict.percent;
                curve(chart, vec![(from, y), (to, y)], line(COLORS[place], 2.0))?;
                Mark::of_series(place).draw_at(area, chart, (found, y), COLORS[place])?;
                if place == 0 {
                    write_name(row)?;
                }
            }
        }
        legend().draw(area, 12.0)
    })?;
    Ok(Figure {
        about: Vec::new(),
        numbers: None,
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
    let candidates = result.tuned.candidates.iter();
    let candidates = candidates.filter(|candidate| !candidate.dropped);
    // The index of the method, and the change of metric and bytes.
    let points: Vec<(usize, (f64, f64))> = candidates
        .map(|candidate| {
            let place = usize::from(candidate.method == Method::Random);
            (place, (percent(candidate.metric), percent(candidate.bytes)))
        })
        .collect();
    let mut best: Vec<(f64, f64)> = points.iter().map(|(_, point)| *point).collect();
    best.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut least = f64::INFINITY;
    best.retain(|(_, bytes)| {
        let is_less = *bytes < least;
        least = least.min(*bytes);
        is_less
    });
    let axes = Axes {
        x: (
            span(points.iter().map(|(_, point)| point.0)),
            "metric relative to the defaults, %",
        ),
        y: (
            span(points.iter().map(|(_, point)| point.1)),
            "bytes relative to the defaults, %",
        ),
        y_labels: 6,
    };
    let svg = beside_legend(&title, &axes, |area, chart| {
        for &(place, at) in &points {
            Mark::of_series(place).draw_at(area, chart, at, COLORS[place])?;
        }
        curve(chart, best, line(INK, 1.5))
    })?;
    Ok(Figure {
        about: Vec::new(),
        numbers: None,
        name: format!("front-{name}"),
        caption: format!(
            "{title}, for all candidates that finished their race, each on its training seeds. The line joins the Pareto-optimal candidates."
        ),
        svg,
    })
}
