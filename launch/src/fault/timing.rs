//! When a fault happens and how long it lasts, as options of its command.

use alliance_proto::fault::{Fault, Order, When};
use alliance_proto::time::seconds;
use clap::Args;

/// When a fault happens and how long it lasts. Without any of it: at once, until it is cleared.
#[derive(Args, Clone, Debug)]
pub struct Timing {
    /// At this simulated time, such as 60s, 1.5s or 2min; one that has passed is now
    #[arg(long = "at", value_name = "TIME", value_parser = seconds)]
    at_s: Option<f64>,
    /// Again and again, this long after the time before
    #[arg(long = "every", value_name = "TIME", value_parser = seconds)]
    every_s: Option<f64>,
    /// When this happens next: "ROBOT|any VERB [SUBJECT]", as in "blue activates report-progress"
    #[arg(long, value_name = "EVENT")]
    when: Option<When>,
    /// How long it lasts [default: until it is cleared]
    #[arg(long = "for", value_name = "TIME", value_parser = seconds)]
    for_s: Option<f64>,
    /// Name, by which it can be cleared [default: the world gives it one]
    #[arg(long, value_name = "NAME")]
    id: Option<String>,
}

impl Timing {
    pub(super) fn order(self, fault: Fault) -> Order {
        Order {
            fault,
            id: self.id,
            at_s: self.at_s,
            every_s: self.every_s,
            when: self.when,
            for_s: self.for_s,
        }
    }
}
