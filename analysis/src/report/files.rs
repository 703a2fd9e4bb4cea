//! The results of a report as files for papers: its tables for LaTeX, its numbers as CSV, and a script that draws them.

use std::path::Path;

use super::history::History;
use super::metrics::Metrics;
use super::spans::Spans;
use crate::columns::latex::{self, LatexCell};
use crate::columns::{Entry, Table};
use crate::figures::files::write_script;
use crate::figures::palette;
use crate::new_file::{make_folder, write_atomically};

/// The name of the file with the tables for LaTeX.
pub const LATEX: &str = "metrics.tex";

/// The names of the CSV files without their ending: metrics by robot and by task, and the work of each robot on each task.
pub const TABLES: [&str; 3] = ["robots", "tasks", "stints"];

/// Writes all files into a folder.
///
/// # Errors
/// Returns an error if a file cannot be written.
pub fn write(out: &Path, history: &History, metrics: &Metrics) -> anyhow::Result<()> {
    make_folder(out)?;
    let tables = [
        robots(history, metrics),
        tasks(history, metrics),
        stints(history, metrics),
    ];
    for (name, table) in TABLES.iter().zip(&tables) {
        table.write_csv(out, name)?;
    }
    write_atomically(&out.join(LATEX), tex(history, metrics).as_bytes())?;
    write_script(out)
}

fn robots(history: &History, metrics: &Metrics) -> Table {
    let robots = history.robots.iter().zip(&metrics.robots);
    Table::of_rows(robots.map(|(robot, found)| {
        let sent = found.sent.map(|sent| sent.messages as f64);
        [
            ("robot", Entry::text(&robot.name)),
            ("present_s", Entry::number(found.present.as_secs_f64())),
            ("idle_share", Entry::number(found.idle_share())),
            ("activations", Entry::count(found.activations as usize)),
            ("messages_sent", Entry::number(sent)),
        ]
    }))
}

fn tasks(history: &History, metrics: &Metrics) -> Table {
    let tasks = history.catalog.tasks.iter().zip(&metrics.tasks);
    Table::of_rows(tasks.map(|(task, found)| {
        let duplicate = found.duplicate.as_ref();
        let duplicate = duplicate.map(|spans| spans.total().as_secs_f64());
        let [applicable, orphan, unattended] =
            [&found.applicable, &found.orphan, &found.unattended]
                .map(|spans| (!history.is_summary).then(|| spans.total().as_secs_f64()))
                .map(Entry::number);
        [
            ("task", Entry::text(&task.name)),
            ("applicable_s", applicable),
            ("orphan_s", orphan),
            ("unattended_s", unattended),
            ("duplicate_s", Entry::number(duplicate)),
        ]
    }))
}

/// Returns the data of the Gantt figure, with the color of each robot.
fn stints(history: &History, metrics: &Metrics) -> Table {
    let names = history.robots.iter().map(|robot| robot.name.as_str());
    let colors = palette::colors(names);
    Table::of_rows(metrics.stints.iter().map(|stint| {
        [
            ("task", Entry::text(history.catalog.task_name(stint.task))),
            ("robot", Entry::text(&history.robots[stint.robot].name)),
            ("from_s", Entry::number(stint.span.from.as_secs_f64())),
            ("to_s", Entry::number(stint.span.to.as_secs_f64())),
            ("color", Entry::text(palette::css(colors[stint.robot]))),
        ]
    }))
}

fn tex(history: &History, metrics: &Metrics) -> String {
    let heads = ["robot", "present, s", "idle", "activations", "messages"];
    let rows = history
        .robots
        .iter()
        .zip(&metrics.robots)
        .map(|(robot, found)| {
            let sent = found.sent.map(|sent| sent.messages.to_string());
            [
                robot.name.clone(),
                format!("{:.1}", found.present.as_secs_f64()),
                format!("{:.1} %", 100.0 * found.idle_share()),
                found.activations.to_string(),
                sent.unwrap_or_else(|| "–".to_owned()),
            ]
        });
    let robots = table(
        "robots",
        "Time of each robot in the run, its idle share, its activations and its broadcasts.",
        &heads,
        rows,
    );
    let heads = [
        "task",
        "applicable, s",
        "orphan, s",
        "unattended, s",
        "duplicate, s",
    ];
    let rows = history
        .catalog
        .tasks
        .iter()
        .zip(&metrics.tasks)
        .map(|(task, found)| {
            let known = |spans| Some(spans).filter(|_| !history.is_summary);
            let seconds = |spans: Option<&Spans>| {
                let total = spans.map(|spans| spans.total().as_secs_f64());
                total.map_or_else(|| "–".to_owned(), |total| format!("{total:.1}"))
            };
            [
                task.name.clone(),
                seconds(known(&found.applicable)),
                seconds(known(&found.orphan)),
                seconds(known(&found.unattended)),
                seconds(found.duplicate.as_ref()),
            ]
        });
    format!(
        "{robots}\n{}",
        table(
            "tasks",
            "Time in which each task was applicable, without a productive robot, without any robot, and with two or more.",
            &heads,
            rows
        )
    )
}

fn table<const N: usize>(
    name: &str,
    note: &str,
    heads: &[&str; N],
    rows: impl Iterator<Item = [String; N]>,
) -> String {
    let heads = heads.map(str::to_owned);
    let rows = rows.map(|row| row.map(LatexCell::new).to_vec());
    latex::table(name, note, &heads, &rows.collect::<Vec<_>>())
}
