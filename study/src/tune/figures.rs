//! The figures of a tuning, as SVG.

use plotters::style::RGBColor;

use super::command::Result;
use super::importance::importance;
use super::search::Method;
use super::task::Task;
use super::tuning::{Candidate, percent};
use crate::report::figures::Figure;
use crate::report::figures::canvas::{
    Axes, FAINT, Frame, INK, Lettering, Mark, WIDTH_PX, chart, curve, fill, level, line, part, px,
    svg,
};

const PLOT_PX: f64 = 330.0;
const ROW_PX: f64 = 26.0;
const NAMES_PX: f64 = 330.0;

/// By method, and told apart in gray, too.
const COLORS: [RGBColor; 2] = [RGBColor(0, 114, 178), RGBColor(213, 94, 0)];
const MARKS: [Mark; 2] = [Mark::Square, Mark::Diamond];

const FRAME: Frame = Frame {
    left: 62.0,
    right: 8.0,
    bottom: 40.0,
};

/// The search, importance, test, and bytes against the metric, by allocator.
///
/// # Errors
/// When one cannot be drawn.
pub fn figures(task: &Task, results: &[Result<'_>]) -> anyhow::Result<Vec<Vec<Figure>>> {
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

/// From, to, with room at both ends.
fn span(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let (low, high) = values.fold((0.0_f64, 0.0_f64), |(low, high), it| {
        (low.min(it), high.max(it))
    });
    let room = (high - low).max(1.0) * 0.06;
    low - room..high + room
}

fn legend(
    area: &crate::report::figures::canvas::Area<'_>,
) -> crate::report::figures::canvas::Drawn {
    for (place, method) in Method::ALL.iter().enumerate() {
        let (x, y) = (WIDTH_PX - 150.0, 22.0 + 18.0 * place as f64);
        MARKS[place].draw(area, (px(x), px(y)), COLORS[place])?;
        Lettering::default().write(area, method.as_str(), (x + 12.0, y))?;
    }
    Ok(())
}

/// The best so far, by runs.
fn search(task: &Task, result: &Result<'_>) -> anyhow::Result<Figure> {
    let name = &result.allocator.name;
    let title = format!("{name}: the best so far against runs");
    let curves: Vec<Vec<(f64, f64)>> = Method::ALL
        .iter()
        .map(|method| {
            let own = result.tuned.candidates.iter();
            let own: Vec<&Candidate> = own
                .filter(|it| it.method == *method && !it.dropped)
                .collect();
            let mut best = f64::INFINITY;
            let mut points: Vec<(f64, f64)> = Vec::new();
            for generation in own.chunk_by(|a, b| a.generation == b.generation) {
                let least = generation
                    .iter()
                    .map(|it| it.score)
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
    let y = span(curves.iter().flatten().map(|it| it.1));
    let most = curves.iter().flatten().map(|it| it.0).fold(1.0, f64::max);
    let axes = Axes {
        x: (0.0..most, "runs of the method"),
        y: (y, "score over the defaults', %"),
        y_labels: 6,
    };
    let svg = svg(&title, PLOT_PX + 10.0, |area| {
        let within = part(area, (0.0, 6.0), (WIDTH_PX - 170.0, PLOT_PX));
        let chart = chart(&within, FRAME, &axes)?;
        level(&chart, 0.0..most, 0.0, line(FAINT, 1.0))?;
        for (place, points) in curves.iter().enumerate() {
            curve(&chart, points.clone(), line(COLORS[place], 2.0))?;
            for point in points {
                MARKS[place].draw(
                    area,
                    chart.plotting_area().map_coordinate(point),
                    COLORS[place],
                )?;
            }
        }
        legend(area)
    })?;
    Ok(Figure {
        name: format!("search-{name}"),
        caption: format!(
            "{title}, each on {} training seeds of its own generation: that is what was lucky, too, so the curves lie lower than what the test says. \
             The broken line: the defaults.",
            task.tuning.seeds_per_candidate
        ),
        svg,
    })
}

/// η² of each parameter.
fn matters(result: &Result<'_>) -> anyhow::Result<Figure> {
    let name = &result.allocator.name;
    let title = format!("{name}: which parameters matter");
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
        for (place, (parameter, it)) in result.allocator.parameters.iter().zip(&all).enumerate() {
            let y = rows - place as f64 - 0.5;
            fill(&chart, 0.0..it.share, y - 0.3..y + 0.3, COLORS[0], 1.0)?;
            curve(
                &chart,
                vec![(it.by_chance, y - 0.42), (it.by_chance, y + 0.42)],
                line(INK, 1.5),
            )?;
            let at = (NAMES_PX - 6.0, 6.0 + ROW_PX * (place as f64 + 0.5));
            RIGHT.write(area, &parameter.key, at)?;
        }
        Ok(())
    })?;
    Ok(Figure {
        name: format!("importance-{name}"),
        caption: format!(
            "{title}: share of the variance of random search's scores that lies between five equal parts of a parameter's range; \
             the upright stroke is that of a parameter that does not matter. One parameter at a time."
        ),
        svg,
    })
}

const RIGHT: Lettering = Lettering {
    size_px: crate::report::figures::canvas::TEXT_PX,
    bold: false,
    color: INK,
    anchor: (
        plotters::style::text_anchor::HPos::Right,
        plotters::style::text_anchor::VPos::Center,
    ),
    upright: false,
};

/// Tuned against default on the test seeds.
fn test(task: &Task, result: &Result<'_>) -> anyhow::Result<Figure> {
    let name = &result.allocator.name;
    let title = format!("{name}: tuned against default on test seeds");
    let rows = result.verdicts[0].len();
    let ends = result
        .verdicts
        .iter()
        .flatten()
        .flat_map(|it| [it.percent.1.0, it.percent.1.1]);
    let x = span(ends);
    let height = ROW_PX * rows as f64 + 50.0;
    let axes = Axes {
        x: (x, "more or less than with the defaults, %"),
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
                MARKS[place].draw(
                    area,
                    chart.plotting_area().map_coordinate(&(found, y)),
                    COLORS[place],
                )?;
                if place == 0 {
                    let at = (NAMES_PX - 6.0, 50.0 + ROW_PX * (row as f64 + 0.5));
                    RIGHT.write(area, &verdict.what, at)?;
                }
            }
        }
        legend(area)
    })?;
    Ok(Figure {
        name: format!("test-{name}"),
        caption: format!(
            "{title}: {}, by the mean logarithm of ratios in pairs of the same seed, with 95 % intervals; to the left is better.",
            task.metric.name()
        ),
        svg,
    })
}

/// Bytes against the metric, of all that were not dropped.
fn front(task: &Task, result: &Result<'_>) -> anyhow::Result<Figure> {
    let name = &result.allocator.name;
    let title = format!("{name}: {} against bytes", task.metric.name());
    let own = || result.tuned.candidates.iter().filter(|it| !it.dropped);
    let mut best: Vec<(f64, f64)> = own()
        .map(|it| (percent(it.metric), percent(it.bytes)))
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
            span(own().map(|it| percent(it.metric))),
            "metric over the defaults', %",
        ),
        y: (
            span(own().map(|it| percent(it.bytes))),
            "bytes over the defaults', %",
        ),
        y_labels: 6,
    };
    let svg = svg(&title, PLOT_PX + 10.0, |area| {
        let within = part(area, (0.0, 6.0), (WIDTH_PX - 170.0, PLOT_PX));
        let chart = chart(&within, FRAME, &axes)?;
        for candidate in own() {
            let place = usize::from(candidate.method == Method::Random);
            let at = (percent(candidate.metric), percent(candidate.bytes));
            MARKS[place].draw(
                area,
                chart.plotting_area().map_coordinate(&at),
                COLORS[place],
            )?;
        }
        curve(&chart, best.clone(), line(INK, 1.5))?;
        legend(area)
    })?;
    Ok(Figure {
        name: format!("front-{name}"),
        caption: format!(
            "{title}, of all candidates that ran their race to the end, each on its own training seeds; the line joins those to which none is better in both."
        ),
        svg,
    })
}
