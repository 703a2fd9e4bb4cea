//! What a comparison needs of its plan once the runs are done; journals carry it, so that shards can be put together without the
//! plan.

use alliance_proto::fault::{Fault, Who};
use alliance_proto::scenario::Scenario;
use serde::{Deserialize, Serialize};

use super::plan::hypothesis::Hypothesis;

/// What is asked, and of what.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// What its author wants to know.
    pub question: Option<String>,
    /// What its author expects.
    pub hypotheses: Vec<Hypothesis>,
    /// Of each block, in their order.
    pub axes: Vec<Axes>,
}

/// Numbers of a block against which something can be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Axes {
    /// Robots of the team.
    pub robots: usize,
    /// Share of messages that get lost on every link from the start to the end, where that is the only fault; 0 without any.
    pub loss: Option<f64>,
}

impl Axes {
    /// Those of a scenario.
    #[must_use]
    pub fn of(scenario: &Scenario) -> Self {
        let faults = &scenario.faults;
        let loss = match &faults.timeline[..] {
            _ if faults.random.is_some() => None,
            [] => Some(0.0),
            [order] => match &order.fault {
                Fault::Drop(loss)
                    if (&loss.from, &loss.to) == (&Who::All, &Who::All)
                        && order.at_s.unwrap_or(0.0) == 0.0
                        && loss.burst_s == 0.0
                        && (order.for_s, order.every_s) == (None, None)
                        && order.when.is_none() =>
                {
                    Some(loss.p)
                }
                _ => None,
            },
            _ => None,
        };
        Self {
            robots: scenario.robots.len(),
            loss,
        }
    }
}

#[cfg(test)]
mod tests {
    use missions::waste::data::default_scenario;

    use super::*;

    #[test]
    fn loss_is_what_befalls_every_link_all_the_time_and_nothing_else() {
        for (timeline, loss) in [
            ("", Some(0.0)),
            ("{ fault.drop = { p = 0.25 } }", Some(0.25)),
            (
                "{ fault.drop = { from = 'all', p = 0.5 }, at_s = 0.0 }",
                Some(0.5),
            ),
            ("{ fault.drop = { from = 'gold', p = 0.5 } }", None),
            ("{ fault.drop = { p = 0.5, burst_s = 2.0 } }", None),
            ("{ fault.drop = { p = 0.5 }, at_s = 9.0 }", None),
            ("{ fault.drop = { p = 0.5 }, for_s = 9.0 }", None),
            (
                "{ fault.drop = { p = 0.5 } }, { fault.kill = 'gold' }",
                None,
            ),
            ("{ fault.kill = 'gold' }", None),
        ] {
            let faults: toml::Table = toml::from_str(&format!("timeline = [{timeline}]")).unwrap();
            let scenario = Scenario {
                faults: faults.try_into().unwrap(),
                ..default_scenario()
            };
            assert_eq!(Axes::of(&scenario), Axes { robots: 3, loss }, "{timeline}");
        }
    }
}
