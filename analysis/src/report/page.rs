//! The page of a report, as one file that needs no other.

use maud::{Markup, html};
use run_log::{RunFile, RunOutcome};
use scenario::mission::columns::{display_name, format_value, short_summary};
use scenario::time::SimTime;
use terminal::counted;

use super::failures::{DetectionSign, OrphanOutcome};
use super::faults::{FaultMark, FaultMarkPhase, faults};
use super::files;
use super::history::History;
use super::links::links;
use super::made::RunOrigin;
use super::metrics::{Metrics, Recurring};
use super::verdict::verdict;
use crate::figures::Figure;
use crate::figures::files::SCRIPT;
use crate::page::{contents, document, heading, scrolled, sorting, table};
use crate::table::figure;
use observation::stints::Loss;
use observation::takeovers::{Takeover, TakeoverCause};

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The maximum size of inline figures, bytes. A page of this size opens at once, also from a mail.
pub(super) const INLINE_BYTES: usize = 1_500_000;

/// The maximum number of rows in the fault table. A lossy link can cause thousands of events.
const FAULT_ROWS: usize = 200;

/// The maximum number of rows of a table that is shown at once. A longer one is opened by the reader.
const OPEN_ROWS: usize = 40;

/// Returns the definitions of all metrics.
pub(super) fn definitions() -> Markup {
    html! {
        (heading("Definitions"))
        dl {
            dt { "makespan" } dd { "Simulated time from the start to the end of the tick in which the mission was complete; none if it was not completed." }
            dt { "present" } dd { "Time of the ticks in which the robot's report counted: it was neither dead nor stopped." }
            dt { "idle share" } dd { "Part of the time present in which none of the robot's behavior sets was active; waiting counts as idle." }
            dt { "activations per minute" } dd { "How often a behavior set of the robot became active, per minute present." }
            dt { "messages and bytes per second" } dd { "Broadcasts of the robot, each counted once, and their payloads (encoded and sealed, without the overhead of zenoh and TCP), per second present. Taken from run.json; unknown for a killed run." }
            dt { "delivered" } dd { "Share of a link's messages that its receiver got, at once, late or with bit errors. Second copies and messages in flight do not count. Messages beyond the radio range are not in the log." }
            dt { "applicable" } dd { "Time in which a behavior set for the task had sensory feedback 1 in a robot that was present." }
            dt { "orphan" } dd { "Part of the time applicable in which no robot was productive. A robot is productive from its activation for the task to the last effect of that stint: an event that changed a column of mission.csv, or progress that the robot noted. The time after the last effect, and a stint without effects, are not productive." }
            dt { "unattended" } dd { "Part of the time applicable in which no behavior set for the task was active in any robot that was present." }
            dt { "duplicate" } dd { "Time in which behavior sets for an exclusive task were active in two or more robots that were present." }
            dt { "detection latency" } dd { "From the death or stop of a robot that was executing a task to the first sign that a teammate has detected it: the teammate's ceased-after time (τ) has passed since it last received the robot's claim of the task, its impatience rate for the task rose to fast, or it activated the task. Only signs before the robot's return count." }
            dt { "takeover latency" } dd { "From the last progress on an exclusive task to its activation by another robot than the one that executed it last. The last progress is the death or stop of that robot; if it lives, the last effect of its stint, or its activation if there was none. A claim that lasts one step is a bid: it is no takeover and makes no robot the previous one. The same holds for a claim that its robot leaves for another claim or another task, if it has not worked on the task or if the other claim was there before. Taking up a task that was left as not applicable is no takeover, nor is joining a robot that continues to work on it." }
            dt { "lateness" } dd { "How much longer than the wanted period an interval between recurring events was; the first interval starts with the run. An event in time counts as 0." }
        }
    }
}

/// The data that a page shows of one run.
pub struct RunSection<'r> {
    pub run: &'r RunFile,
    pub history: &'r History,
    pub metrics: &'r Metrics,
    pub figures: Vec<Figure>,
    /// The names of the figures that are not drawn.
    pub undrawn: Vec<String>,
    pub made: RunOrigin,
}

/// The inline figures of a page, up to a size limit.
pub(super) struct InlineFigures {
    room: usize,
    /// The number of figures without room.
    pub left_out: usize,
}

impl InlineFigures {
    pub fn new() -> Self {
        Self {
            room: INLINE_BYTES,
            left_out: 0,
        }
    }

    /// Returns the markup of a figure with its caption. `folder` is the path from the page to its file, empty or with a
    /// trailing slash.
    pub fn put(&mut self, figure: &Figure, folder: &str) -> Markup {
        let Figure {
            name, svg, caption, ..
        } = figure;
        let id = format!("{folder}{name}").replace('/', "-");
        let drawing = if svg.len() <= self.room {
            self.room -= svg.len();
            scrolled(svg)
        } else {
            self.left_out += 1;
            let file = format!("{folder}{name}.svg");
            html! { p { "Too large for this page: " a href=(file) { (file) } "." } }
        };
        html! { figure id=(id) { (drawing) figcaption { (caption) } } }
    }
}

/// Returns the page and the number of figures left out.
#[must_use]
pub fn page(part: &RunSection<'_>) -> (String, usize) {
    let mut frames = InlineFigures::new();
    let figures = part.figures.iter();
    let shown: Vec<Markup> = figures.map(|figure| frames.put(figure, "")).collect();
    // The Gantt figure comes before all tables because it explains the run.
    let (first, rest) = shown.split_at(shown.len().min(1));
    let scenario = &part.run.setup.scenario;
    let title = format!("{}, seed {}", scenario.name, part.run.setup.seed);
    let recurring = part.metrics.recurring.iter();
    let recurring = recurring.map(|recurring| {
        let title = format!("Events: {}", recurring.event);
        (title, moments(part.history, recurring))
    });
    let links = links(&part.history.links, |rank| &part.history.robots[rank].name)
        .map(|table| ("Links".to_owned(), table));
    let sections = tables(part).map(|(title, table)| (title.to_owned(), table));
    let sections = sections.into_iter().chain(links).chain(recurring);
    let sections: Vec<(String, Markup)> = sections.collect();
    let parts = html! {
        @for (title, content) in &sections {
            (heading(title))
            (content)
        }
        (heading("Figures"))
        @for figure in rest { (figure) }
        (undrawn(&part.undrawn))
        p.note {
            "Beside this page: these tables for LaTeX (" code { (files::LATEX) } "), the numbers as CSV ("
            @for (place, name) in files::TABLES.iter().enumerate() { @if place > 0 { ", " } code { (name) ".csv" } }
            "), and a script that draws them with matplotlib (" code { (SCRIPT) } ")."
        }
        (definitions())
    };
    let body = html! {
        h1 { (title) }
        p { (scenario.description) }
        @if let Some(window) = &part.made.window { p.note { "Figures show the run " (window) "; tables show the whole run." } }
        ul.answer {
            @for sentence in verdict(part.run, part.history, part.metrics) { li { (sentence) } }
        }
        p.note {
            @match &part.made.page {
                Some(page) => { a href=(page) { "The page of the run" } " shows each moment; the times of losses, takeovers and faults below open it there." },
                None => { "After an export with " code { "--html" } ", a new report links the times of losses, takeovers and faults to the page of the run." },
            }
        }
        (contents(&parts))
        @for figure in first { (figure) }
        div.wide tabindex="0" { table { tbody {
            @for (name, value) in facts(part) { tr { td { (name) } td.text { (value) } } }
        } } }
        (parts)
        (sorting())
    };
    (document(&title, "", &body), frames.left_out)
}

/// Lists the figures that are not drawn, with the command that draws them.
pub(super) fn undrawn(names: &[String]) -> Markup {
    html! {
        @if !names.is_empty() {
            details {
                summary {
                    (counted(names.len(), "more figure")) " on request, by " code { "--only" }
                }
                p.note { @for name in names { code { (name) } " " } }
            }
        }
    }
}

pub(super) fn tables(part: &RunSection<'_>) -> [(&'static str, Markup); 6] {
    let (run, history, metrics) = (part.run, part.history, part.metrics);
    [
        ("Robots", robots(history, metrics)),
        ("Tasks", tasks(history, metrics)),
        ("Mission", mission(run, history)),
        ("Lost robots", losses(part)),
        ("Takeovers", takeovers(part)),
        ("Faults", fault_table(part, &faults(&history.events))),
    ]
}

/// Returns setup and result of a run as named values.
pub(super) fn facts(part: &RunSection<'_>) -> Vec<(String, Markup)> {
    let (run, history, metrics) = (part.run, part.history, part.metrics);
    let outcome = match run.outcome {
        RunOutcome::Ended(outcome) => outcome.as_str().to_owned(),
        RunOutcome::Running => format!(
            "not ended: the world process was killed or is still running; the log is complete up to {}",
            seconds(history.end)
        ),
    };
    let so_far = match history.latest().as_slice() {
        [] => "not in the log".to_owned(),
        row => short_summary(row),
    };
    let detection = metrics.failures.iter().filter_map(|failure| {
        let found = failure.orphan.as_ref()?.detection?;
        Some(found.at.since(failure.at))
    });
    let latencies = |after_loss: bool| {
        let takeovers = metrics.takeovers.iter();
        let takeovers = takeovers.filter(|takeover| takeover.cause.is_loss() == after_loss);
        summary(takeovers.map(Takeover::latency))
    };
    let makespan = match metrics.makespan {
        Some(makespan) => seconds(makespan),
        None => format!("none; {} simulated", seconds(history.end)),
    };
    let setup = &run.setup;
    let scenario = format!(
        "{}, seed {}, {}, preset {}",
        setup.scenario.name,
        setup.seed,
        setup.scenario.allocator_list(),
        setup.scenario.alliance.preset.name()
    );
    let mut facts = Vec::new();
    let mut add = |name: &str, value: Markup| facts.push((name.to_owned(), value));
    add("outcome", html! { (outcome) });
    if let Some(origin) = &run.branch {
        let (parent, hash) = (&origin.run, &origin.hash);
        add(
            "branch",
            html! { "of " (parent) " at " (origin.t_ms) ", hash " (hash) },
        );
    }
    add("makespan", html! { (makespan) });
    add("progress", html! { (so_far) });
    for recurring in &metrics.recurring {
        if recurring.period.is_some() {
            let late = summary(recurring.moments.iter().map(|moment| moment.late));
            let name = format!("lateness of '{}'", recurring.event);
            add(&name, html! { (late) });
        }
    }
    add("detection latency", html! { (summary(detection)) });
    let after_loss = latencies(true);
    add("takeover latency after a loss", html! { (after_loss) });
    add("takeover latency, other", html! { (latencies(false)) });
    let unscripted = ["none", "yes"][usize::from(run.unscripted)];
    add("unscripted stalls or losses", html! { (unscripted) });
    add("hash", html! { (run.hash.as_deref().unwrap_or("none")) });
    add("scenario", html! { (scenario) });
    if let Some(command) = &part.made.command {
        add("command", html! { code { (command) } });
    }
    if let Some(date) = &part.made.date {
        add("started", html! { (date) });
    }
    add(
        "version",
        html! { "alliance " (run.version) @if run.version != VERSION { "; page written by " (VERSION) } },
    );
    facts
}

/// Returns a table of this many robots, tasks and so on. A long one is folded.
fn folded(count: usize, noun: &str, table: Markup) -> Markup {
    if count <= OPEN_ROWS {
        return table;
    }
    html! { details { summary { (counted(count, noun)) } (table) } }
}

fn robots(history: &History, metrics: &Metrics) -> Markup {
    html! {
        (folded(history.robots.len(), "robot", table(&html! {
            th { "robot" } th { "present" } th { "idle share" } th { "activations" } th { "per minute" }
            th { "messages" } th { "per second" } th { "bytes per second" }
        }, &html! {
            @for (robot, figures) in history.robots.iter().zip(&metrics.robots) {
                tr {
                    td { (robot.name) }
                    td { (seconds(figures.present)) }
                    td { (format!("{:.1} %", 100.0 * figures.idle_share())) }
                    td { (figures.activations) }
                    td { (format!("{:.2}", figures.activations_per_min())) }
                    @if let Some(sent) = figures.sent {
                        @let (messages, bytes) = sent.per_s(figures.present);
                        td { (sent.messages) }
                        td { (format!("{messages:.2}")) }
                        td { (format!("{bytes:.1}")) }
                    } @else {
                        td { "unknown" } td { "unknown" } td { "unknown" }
                    }
                }
            }
        })))
    }
}

fn tasks(history: &History, metrics: &Metrics) -> Markup {
    html! {
        (folded(history.catalog.tasks.len(), "task", table(&html! { th { "task" } th { "applicable" } th { "orphan" } th { "unattended" } th { "duplicate" } }, &html! {
            @for (task, figures) in history.catalog.tasks.iter().zip(&metrics.tasks) {
                tr {
                    td { (task.name) }
                    @for spans in [&figures.applicable, &figures.orphan, &figures.unattended] {
                        td {
                            @match history.is_summary {
                                true => "unknown",
                                false => (seconds(spans.total())),
                            }
                        }
                    }
                    td {
                        @match &figures.duplicate {
                            Some(spans) => (seconds(spans.total())),
                            None => "not exclusive",
                        }
                    }
                }
            }
        })))
    }
}

/// Returns the mission's figures of the run and of each robot, from run.json.
fn mission(run: &RunFile, history: &History) -> Markup {
    let figures = run.result.mission.iter();
    let figures = figures.map(|(name, value)| format_value(name, value));
    let figures: Vec<String> = figures.collect();
    let robots = &run.result.robots;
    // In the order of the other tables, r2 before r10.
    let by_rank = history.robots.iter();
    let by_rank = by_rank.filter_map(|robot| Some((&robot.name, robots.get(&robot.name)?)));
    let names = robots.values().next().map(|robot| robot.mission.iter());
    let names: Vec<&str> = names.into_iter().flatten().map(|(name, _)| name).collect();
    html! {
        p.note {
            @if figures.is_empty() { "The mission has no figures for this run." } @else { (figures.join(", ")) "." }
        }
        @if !names.is_empty() {
            (folded(robots.len(), "robot", table(&html! { th { "robot" } @for name in &names { th { (display_name(name)) } } }, &html! {
                @for (robot, figures) in by_rank {
                    tr {
                        td { (robot) }
                        @for name in &names { td { (figure(figures.mission.get(name))) } }
                    }
                }
            })))
        }
    }
}

fn moments(history: &History, recurring: &Recurring) -> Markup {
    let period_s = recurring.period.map(SimTime::as_secs_f64);
    html! {
        @if let Some(period_s) = period_s {
            p.note {
                "Wanted period: " (format!("{period_s} s")) ". "
                @if recurring.overdue > SimTime::ZERO {
                    "At the end of the log, the next event was overdue by " (seconds(recurring.overdue)) "."
                }
            }
        }
        @if recurring.moments.is_empty() { p.note { "The log has no such event." } } @else {
            (table(&html! {
                th { "at" } th { "by" } th { "after" }
                @if period_s.is_some() { th { "late" } th { "of the period" } }
            }, &html! {
                @for moment in &recurring.moments {
                    tr {
                        td { (seconds(moment.at)) }
                        td { (moment.by.map_or("?", |rank| name(history, rank))) }
                        td { (seconds(moment.interval)) }
                        @if let Some(period_s) = period_s {
                            td { (seconds(moment.late)) }
                            td { (format!("{:.1} %", 100.0 * moment.late.as_secs_f64() / period_s)) }
                        }
                    }
                }
            }))
        }
    }
}

/// Returns a time as a link to that moment of the run's page, if there is such a page.
fn moment(part: &RunSection<'_>, at: SimTime) -> Markup {
    match &part.made.page {
        None => html! { (seconds(at)) },
        Some(page) => html! { a href={ (page) "#t=" (at.as_secs_f64()) } { (seconds(at)) } },
    }
}

fn losses(part: &RunSection<'_>) -> Markup {
    let (history, metrics) = (part.history, part.metrics);
    if metrics.failures.is_empty() {
        return html! { p.note { "No robot died or was stopped." } };
    }
    html! {
        (table(&html! {
            th { "at" } th.text { "robot" } th.text { "back" } th.text { "task" } th.text { "detected after" }
            th.text { "outcome" }
        }, &html! {
            @for failure in &metrics.failures {
                tr {
                    td { (moment(part, failure.at)) }
                    td.text { (name(history, failure.robot)) " " (loss(failure.loss)) }
                    td.text { (failure.returned_at.map_or_else(|| "never".to_owned(), seconds)) }
                    @match &failure.orphan {
                        None => { td.text { "none" } td.text { "" } td.text { "" } },
                        Some(orphan) => {
                            td.text { (history.catalog.task_name(orphan.task)) }
                            td.text {
                                @match orphan.detection {
                                    Some(found) => {
                                        (seconds(found.at.since(failure.at))) " by " (name(history, found.robot))
                                        " (" (sign(found.sign)) ")"
                                    },
                                    None if history.is_summary => "unknown",
                                    None => "not detected",
                                }
                            }
                            td.text { (aftermath(history, failure.at, orphan.aftermath)) }
                        },
                    }
                }
            }
        }))
    }
}

fn takeovers(part: &RunSection<'_>) -> Markup {
    let (history, metrics) = (part.history, part.metrics);
    if metrics.takeovers.is_empty() {
        return html! { p.note { "No robot took over a task of another one." } };
    }
    html! {
        (table(&html! {
            th { "at" } th.text { "task" } th.text { "from" } th.text { "to" } th { "latency" } th.text { "because" }
        }, &html! {
            @for takeover in &metrics.takeovers {
                tr {
                    td { (moment(part, takeover.at)) }
                    td.text { (history.catalog.task_name(takeover.task)) }
                    td.text { (name(history, takeover.from)) }
                    td.text { (name(history, takeover.robot)) }
                    td { (seconds(takeover.latency())) }
                    td.text {
                        (name(history, takeover.from)) " "
                        @match &takeover.cause {
                            TakeoverCause::Lost(how) => (loss(*how)),
                            TakeoverCause::Left(reason) => { "left: " (reason) },
                            TakeoverCause::StillActive => "was still active",
                        }
                    }
                }
            }
        }))
    }
}

fn fault_table(part: &RunSection<'_>, faults: &[FaultMark]) -> Markup {
    if faults.is_empty() {
        return html! { p.note { "The log has no faults." } };
    }
    let (hits, named): (Vec<&FaultMark>, Vec<&FaultMark>) = faults
        .iter()
        .partition(|fault| fault.phase == FaultMarkPhase::Hit);
    let (hits, hidden) = (hits.len(), named.len().saturating_sub(FAULT_ROWS));
    html! {
        @if hits > 0 { p.note { "Single effects not listed, such as lost messages: " (hits) "." } }
        @if hidden > 0 { p.note { "Later faults not listed: " (hidden) "." } }
        (table(&html! { th { "at" } th.text { "fault" } th.text { "detail" } }, &html! {
            @for fault in named.iter().take(FAULT_ROWS) {
                tr {
                    td { (moment(part, fault.at)) }
                    td.text { (fault.label) }
                    td.text { (fault.detail) }
                }
            }
        }))
    }
}

fn name(history: &History, rank: usize) -> &str {
    &history.robots[rank].name
}

fn loss(loss: Loss) -> &'static str {
    match loss {
        Loss::Died => "died",
        Loss::Stopped => "was stopped",
    }
}

fn sign(sign: DetectionSign) -> &'static str {
    match sign {
        DetectionSign::Silence => "silence",
        DetectionSign::Impatience => "impatience",
        DetectionSign::Activation => "activation",
    }
}

fn aftermath(history: &History, lost: SimTime, aftermath: OrphanOutcome) -> String {
    let after = |at: SimTime| seconds(at.since(lost));
    let name = |rank| name(history, rank);
    match aftermath {
        OrphanOutcome::Covered { by } => format!("{} was also executing it", name(by)),
        OrphanOutcome::TakenOver { at, by } => {
            format!("{} took over after {}", name(by), after(at))
        }
        OrphanOutcome::Continued { at, by } => {
            format!("{} executed it next, after {}", name(by), after(at))
        }
        OrphanOutcome::Resumed { at } => format!("resumed by itself after {}", after(at)),
        OrphanOutcome::Abandoned => "no takeover".to_owned(),
    }
}

fn seconds(time: SimTime) -> String {
    format!("{:.2} s", time.as_secs_f64())
}

/// Returns mean and maximum of some times, in words.
fn summary(times: impl Iterator<Item = SimTime>) -> String {
    let times: Vec<SimTime> = times.collect();
    let Some(most) = times.iter().max() else {
        return "none".to_owned();
    };
    let total: f64 = times.iter().map(|time| time.as_secs_f64()).sum();
    let count = times.len();
    format!(
        "mean {:.2} s, longest {} (of {count})",
        total / count as f64,
        seconds(*most)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_tables_are_folded() {
        let rows = |count| folded(count, "robot", html! { table {} }).into_string();
        assert_eq!(rows(OPEN_ROWS), "<table></table>");
        let closed = "<details><summary>41 robots</summary><table></table></details>";
        assert_eq!(rows(OPEN_ROWS + 1), closed);
    }
}
