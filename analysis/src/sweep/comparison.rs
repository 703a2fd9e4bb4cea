//! The part of a plan that a comparison needs after its runs. Journals contain it, so shards can be merged without the plan.

use scenario::Scenario;
use scenario::fault::{Fault, LinkEnd};
use scenario::mission::data::Objective;
use serde::{Deserialize, Serialize};

use super::best_known::BestKnown;
use super::plan::hypothesis::Hypothesis;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// The question that the plan states.
    pub question: Option<String>,
    pub hypotheses: Vec<Hypothesis>,
    /// One entry per block, in block order.
    pub axes: Vec<Axes>,
    /// The figure by which the scenario of each block ranks its runs, in block order. `None` for a common metric.
    #[serde(default)]
    pub objectives: Vec<Option<OwnFigure>>,
    /// The best known values; the first one that fits a run counts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub best_known: Vec<BestKnown>,
    /// The name of each block's primary metric, in block order. Empty in journals of older versions.
    #[serde(default)]
    pub primary: Vec<String>,
}

/// A figure of run.json by which a scenario ranks its runs ([`Objective::Figure`]).
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct OwnFigure {
    /// The name in comparisons.
    pub name: String,
    /// The name of the figure in the results of a run.
    pub figure: String,
    pub more_is_better: bool,
    /// The definition, in one sentence.
    pub meaning: String,
}

impl OwnFigure {
    /// Returns the figure of an objective, or `None` for a common metric.
    #[must_use]
    pub fn new(objective: Objective) -> Option<Self> {
        match objective {
            Objective::Time | Objective::Done => None,
            Objective::Figure {
                name,
                figure,
                more_is_better,
                meaning,
            } => Some(Self {
                name: name.to_owned(),
                figure: figure.replace('.', "_"),
                more_is_better,
                meaning: meaning.to_owned(),
            }),
        }
    }
}

/// The numbers of a block that can form the x axis of a curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Axes {
    pub robots: usize,
    /// The probability of message loss on every link during the entire run, 0 to 1. `None` if the block has any other fault
    /// or a fading radio; 0 without faults.
    pub loss: Option<f64>,
}

impl Axes {
    #[must_use]
    pub fn from_scenario(scenario: &Scenario) -> Self {
        let faults = &scenario.faults;
        let loss = match &faults.timeline[..] {
            _ if faults.random.is_some() || scenario.radio.fading.is_some() => None,
            [] => Some(0.0),
            [order] => match &order.fault {
                Fault::Drop(loss)
                    if (&loss.from, &loss.to) == (&LinkEnd::All, &LinkEnd::All)
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
    use scenario::Fading;

    use super::*;

    #[test]
    fn loss_is_set_only_for_constant_loss_on_every_link() {
        for (timeline, loss) in [
            ("", Some(0.0)),
            ("{ fault.drop = { p = 0.25 } }", Some(0.25)),
            (
                "{ fault.drop = { from = 'all', p = 0.5 }, at_s = 0 }",
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
            let expected = Axes { robots: 3, loss };
            assert_eq!(Axes::from_scenario(&scenario), expected, "{timeline}");
        }
        let mut faded = default_scenario();
        faded.radio.fading = Some(Fading {
            d0_m: 6.0,
            path_loss_exponent: 3.0,
        });
        assert_eq!(Axes::from_scenario(&faded).loss, None);
    }
}
