//! Command line, output files and terminal output of `alliance compare`.

use std::num::NonZeroUsize;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, bail};
use clap::Args;
use scenario::Problem;
use scenario::limits::check_known;
use terminal::{counted, stderr_line};
use world_server::mission_args::Known;

use super::analysis::Analysis;
use super::answer::answer;
use super::blocks::{ALLOCATOR, allocators, blocks, first_run, names};
use super::data::ComparisonData;
use super::figures::figures;
use super::hypotheses::{check, judge};
use super::memory;
use super::metrics::Metric;
use super::page::Page;
use super::power::remarks;
use super::primary;
use super::tables::{LATEX, NamedTable, latex, tables};
use crate::controllers::ControllerFiles;
use crate::exit_status;
use crate::figures::canvas::Sheet;
use crate::figures::files;
use crate::new_file::write_atomically;
use crate::sweep::best_known::{BestKnown, read as read_best_known};
use crate::sweep::comparison::{Axes, Comparison, OwnFigure};
use crate::sweep::execution::{Arguments, PlanCommand, jobs_or_cores, read_text};
use crate::sweep::journal::Header;
use crate::sweep::plan::{Plan, setup};
use crate::sweep::results::{figures_of, results_table};
use crate::sweep::run::{Row, execute_run};
use crate::table::{bullets, paragraph};
use crate::workers::run_parallel;

const PAGE: &str = "comparison.html";

/// Compare allocators under the same faults, with significance
// A comparison is a sweep whose plan varies `allocator`. An interrupted comparison resumes where it stopped.
#[derive(Args, Clone, Debug)]
pub struct CompareCommand {
    #[command(flatten)]
    arguments: Arguments,
    /// Repeat all runs of one cell and print their rows as CSV, then exit
    #[arg(long, value_name = "CELL", help_heading = "Other", conflicts_with_all = ["shard", "merge", "out", "scenario", "dry_run"])]
    cell: Option<usize>,
}

impl CompareCommand {
    /// Returns the controllers in Python that the plan names.
    pub fn controllers(&mut self) -> &mut ControllerFiles {
        self.arguments.controllers()
    }

    /// Runs the command. Exit status: 0 all runs are done, 1 failed runs or an interruption, 2 invalid input or missing runs, 3 a file
    /// cannot be written. Incomplete missions are not failures.
    #[must_use]
    pub fn run(&self, known: &Known) -> ExitCode {
        match self.cell.map(|cell| self.again(known, cell)) {
            None => self.arguments.run(known, &STUDY),
            Some(Ok(text)) => terminal::print_result("alliance compare", text, ExitCode::SUCCESS),
            Some(Err(error)) => exit_status("compare", Err(error), 2),
        }
    }

    /// Repeats the runs of a cell. Returns their rows as CSV.
    fn again(&self, known: &Known, cell: usize) -> anyhow::Result<String> {
        let mut plan = self.arguments.plan(known)?;
        prepare(&mut plan, self.arguments.jobs())?;
        let seeds = plan.design.seeds_per_condition();
        let cells = plan.design.runs().unwrap_or_default() / seeds;
        if cell >= cells {
            bail!(
                "there is no cell {cell}; cells are numbered from 0 to {}",
                cells - 1
            );
        }
        let runs: Vec<usize> = (cell * seeds..(cell + 1) * seeds).collect();
        let mut rows: Vec<Row> = Vec::new();
        let attempt = |run, stops: &dyn Fn() -> bool| execute_run(&plan, run, stops);
        run_parallel(&runs, self.arguments.jobs(), &|| false, attempt, |row| {
            rows.push(row);
            Ok(())
        })?;
        rows.sort_by_key(|row| row.run);
        let csv = results_table(&plan.design, &rows).csv()?;
        Ok(String::from_utf8(csv)?)
    }
}

const STUDY: PlanCommand = PlanCommand {
    name: "compare",
    folder: "comparisons",
    prepare,
    remarks: |header| {
        let comparison = header.comparison.as_ref();
        let hypotheses = comparison.map_or(&[][..], |comparison| &comparison.hypotheses);
        let allocators = allocators(&header.design);
        let allocators = allocators.map_or(0, |place| header.design.factors[place].levels.len());
        remarks(allocators, header.design.seeds_per_condition(), hypotheses)
    },
    finish,
};

/// Checks the requirements of a comparison that a sweep does not have.
pub(super) fn prepare(plan: &mut Plan, jobs: NonZeroUsize) -> anyhow::Result<Option<Comparison>> {
    plan.measures = true;
    let design = &plan.design;
    let rivals = allocators(design).map(|place| names(&design.factors[place]));
    let rivals = rivals.unwrap_or_default();
    if rivals.len() < 2 {
        bail!(
            "a comparison needs two or more allocators, but the plan varies {}; write [grid] {ALLOCATOR} = [\"alliance\", \"cbba\"]",
            if rivals.is_empty() { "none" } else { "one" }
        );
    }
    let (mut axes, mut objectives, mut primary) = (Vec::new(), Vec::new(), Vec::new());
    let mut largest = 0.0_f64;
    for block in 0..blocks(design) {
        let run = first_run(design, block);
        let table = plan.scenario(run).map_err(anyhow::Error::msg);
        let setup = table.and_then(|table| setup(&table, design.seed(run)));
        let setup = setup.with_context(|| format!("run {run}"))?;
        largest = largest.max(memory::of_a_run(&setup));
        axes.push(Axes::from_scenario(&setup.scenario));
        let scenario = &setup.scenario;
        objectives.push(OwnFigure::new(scenario.mission().objective(scenario)));
        primary.push(primary::of_run(plan, run, scenario)?.name());
    }
    memory::check(largest, jobs, design.runs().unwrap_or_default())?;
    let mut comparison = Comparison {
        question: plan.question.clone(),
        hypotheses: plan.hypotheses.clone(),
        axes,
        objectives,
        best_known: Vec::new(),
        primary,
    };
    let data = ComparisonData::of(design, &comparison, &[]);
    if let Some(file) = &plan.best_known {
        comparison.best_known = best_known(file, &data)?;
    }
    check(
        &plan.hypotheses,
        &ComparisonData::of(design, &comparison, &[]),
    )?;
    Ok(Some(comparison))
}

/// Reads the best known values for the blocks of a comparison.
fn best_known(file: &Path, data: &ComparisonData) -> anyhow::Result<Vec<BestKnown>> {
    let (name, text) = (file.display().to_string(), read_text(file)?);
    let rows = read_best_known(&name, &text, &data.columns)?;
    for (line, row) in &rows {
        let at = || format!("{name}:{line}");
        let mut blocks = data.blocks.iter();
        if !blocks.any(|block| row.fits(&data.columns, &block.settings)) {
            let what = "the plan has no run with these values";
            let remedy = "see the columns of `--dry-run`, or remove the row";
            return Err(Problem::with_source(at(), what, remedy).into());
        }
        let metrics: Vec<String> = data.metrics.iter().map(Metric::name).collect();
        if let Some(stated) = &row.metric {
            let known = metrics.iter().map(String::as_str);
            let checked = check_known(["metric"], "there is no metric", stated, known);
            checked.map_err(|problem| Problem::with_source(at(), problem.to_string(), ""))?;
        }
    }
    Ok(rows.into_iter().map(|(_, row)| row).collect())
}

/// Writes and shows the results. Returns `true` if no run failed.
fn finish(
    folder: &Path,
    header: &Header,
    rows: &[Row],
    plan: Option<&str>,
    sheet: &Sheet,
) -> anyhow::Result<bool> {
    let comparison = header
        .comparison
        .as_ref()
        .context("the journal belongs to a sweep; use alliance sweep --merge")?;
    let design = &header.design;
    results_table(design, rows).write(folder, "results")?;

    let data = ComparisonData::of(design, comparison, rows);
    let analysis = Analysis::new(&data, jobs_or_cores(None));
    let verdicts = judge(&data, &comparison.hypotheses);
    let answer = answer(&data, &analysis, &verdicts);
    let tables = tables(&data, &analysis, &verdicts);
    for NamedTable { name, table, .. } in &tables {
        table.write(folder, name)?;
    }
    let figures = figures(&data, &analysis, sheet)?;
    for figure in &figures {
        files::write(figure, folder)?;
    }
    files::write_script(folder)?;
    let latex = latex(&data, &analysis);
    write_atomically(&folder.join(LATEX), latex.as_bytes())?;
    let failed = rows.iter().filter(|row| figures_of(row).is_none()).count();
    let page = Page {
        name: &header.sweep,
        question: comparison.question.as_deref(),
        answer: &answer,
        data: &data,
        analysis: &analysis,
        verdicts: &verdicts,
        figures: &figures,
        tables: &tables,
        runs: (rows.len(), failed),
    };
    write_atomically(&folder.join(PAGE), page.html().as_bytes())?;

    if let Some(question) = &comparison.question {
        stderr_line!("{}", paragraph(question));
    }
    let sentences = answer.sentences.iter().chain(&answer.claims);
    stderr_line!("{}", bullets(sentences));
    stderr_line!("{}, {failed} failed", counted(rows.len(), "run"));
    // After a merge, the folder of the plan is not known.
    if let Some(plan) = plan {
        stderr_line!("repeat   alliance compare {plan} --cell 0");
    }
    stderr_line!("numbers  {}", folder.join("cells.csv").display());
    stderr_line!("page     {}", folder.join(PAGE).display());
    Ok(failed == 0)
}
