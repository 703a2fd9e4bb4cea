//! The options for the trigger and the duration of a fault.

use clap::Args;
use scenario::fault::{EventTrigger, Fault, Order};
use scenario::time::seconds;

// No doc comment, because clap would use it as the description of the mission's fault commands.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Time")]
pub struct Timing {
    /// Simulated time of its start, such as 60s or 2min; a past time means now
    #[arg(long = "at", value_name = "TIME", value_parser = seconds)]
    at_s: Option<f64>,
    /// Repeat the fault at this interval
    #[arg(long = "every", value_name = "TIME", value_parser = seconds)]
    every_s: Option<f64>,
    /// Event that starts it: "ROBOT|any VERB [SUBJECT]", as in "blue picks any"
    #[arg(long, value_name = "EVENT")]
    when: Option<EventTrigger>,
    /// Duration [default: until it is cleared]
    #[arg(long = "for", value_name = "TIME", value_parser = seconds)]
    for_s: Option<f64>,
    /// Id with which it can be cleared [default: assigned by the world]
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
