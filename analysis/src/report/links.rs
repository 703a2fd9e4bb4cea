//! The share of delivered messages of each radio link.

use std::collections::BTreeMap;

use maud::{Markup, html};
use run_log::MessageRow;

use crate::page::table;

/// The maximum number of rows of the table.
const ROWS_MAX: usize = 30;

/// The messages of a directed link, without second copies and messages in flight.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LinkHistory {
    pub received: u64,
    /// The lost messages by their delivery in messages.csv.
    pub lost: BTreeMap<String, u64>,
}

impl LinkHistory {
    pub(super) fn add(&mut self, row: &MessageRow) {
        match row.delivery.as_str() {
            "received" | "delayed" | "damaged" => self.received += 1,
            "duplicate" | "pending" => {}
            reason => *self.lost.entry(reason.to_owned()).or_default() += 1,
        }
    }

    /// Returns the number of messages.
    #[must_use]
    pub fn messages(&self) -> u64 {
        self.received + self.lost.values().sum::<u64>()
    }

    /// Returns the share of received messages, 0 to 1; 1 without messages.
    #[must_use]
    pub fn delivered_share(&self) -> f64 {
        match self.messages() {
            0 => 1.0,
            messages => self.received as f64 / messages as f64,
        }
    }
}

/// Returns the table of the links with losses, the worst first. `None` if no link has any. A link has the ranks of its
/// sender and its receiver.
pub(super) fn links<'n>(
    links: &BTreeMap<(usize, usize), LinkHistory>,
    name: impl Fn(usize) -> &'n str,
) -> Option<Markup> {
    let mut lossy: Vec<_> = links
        .iter()
        .filter(|(_, link)| !link.lost.is_empty())
        .collect();
    let share = |link: &LinkHistory| link.delivered_share();
    lossy.sort_by(|(_, one), (_, other)| share(one).total_cmp(&share(other)));
    let more = lossy.len().saturating_sub(ROWS_MAX);
    lossy.truncate(ROWS_MAX);
    let reasons = |link: &LinkHistory| {
        let reasons = link.lost.iter();
        let reasons = reasons.map(|(reason, count)| format!("{reason} {count}"));
        reasons.collect::<Vec<_>>().join(", ")
    };
    (!lossy.is_empty()).then(|| {
        html! {
            (table(
                &html! { th { "link" } th { "messages" } th { "delivered" } th { "lost" } },
                &html! {
                    @for ((sender, receiver), link) in &lossy {
                        tr {
                            td { (name(*sender)) " → " (name(*receiver)) }
                            td { (link.messages()) }
                            td { (format!("{:.1} %", 100.0 * share(link))) }
                            td.text { (reasons(link)) }
                        }
                    }
                },
            ))
            @if more > 0 { p.note { "Links with fewer losses not listed: " (more) "." } }
        }
    })
}
