//! The results of the study as tables.

use std::fmt::Write;

use super::condition::{Condition, TrialFault};
use super::design::Design;
use super::trial::Trial;
use crate::columns::{Entry, Table};
use crate::sweep::statistics::mean;

pub struct Study {
    pub design: Design,
    pub trials: Vec<Trial>,
}

/// A function that returns one number of a cell, or `None` if no trial ended.
pub type Measure = fn(&Cell) -> Option<f64>;

/// The trials of a condition with one rule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// The number of trials that did not end within the limit.
    pub unfinished: usize,
    /// The mean ratio of the time to the least time over the trials that ended.
    pub time: Option<f64>,
    /// The mean ratio of the energy to the least energy over the same trials.
    pub energy: Option<f64>,
    /// The mean time at tasks that another robot already works on, over the same trials, robot-s.
    pub duplicate_s: Option<f64>,
}

/// Returns the indices of the condition and the rule, and the seed.
#[must_use]
pub fn trial_of_run(run: usize, design: &Design) -> (usize, usize, u64) {
    let cell = run / design.seeds;
    let seed = run % design.seeds + 1;
    let rules = design.rules.len();
    (cell / rules, cell % rules, seed as u64)
}

impl Study {
    #[must_use]
    pub fn cell(&self, condition: usize, rule: usize) -> Cell {
        let seeds = self.design.seeds;
        let first = (condition * self.design.rules.len() + rule) * seeds;
        let trials = &self.trials[first..first + seeds];
        let ended = trials
            .iter()
            .filter_map(|trial| Some((trial.time_s?, trial)));
        let ended: Vec<(f64, &Trial)> = ended.collect();
        let mean = |of: fn(f64, &Trial) -> f64| {
            let values = ended.iter().map(|(time_s, trial)| of(*time_s, trial));
            mean(&values.collect::<Vec<_>>())
        };
        Cell {
            unfinished: trials.len() - ended.len(),
            time: mean(|time_s, trial| time_s / trial.least_time_s),
            energy: mean(|_, trial| trial.energy_j / trial.least_energy_j),
            duplicate_s: mean(|_, trial| trial.doubled_s),
        }
    }

    /// Returns the cells of a rule without faults, with their conditions.
    pub fn without_faults(&self, rule: usize) -> impl Iterator<Item = (&Condition, Cell)> {
        let conditions = self.design.conditions.iter().enumerate();
        conditions
            .filter(|(_, condition)| condition.fault == TrialFault::None)
            .map(move |(place, condition)| (condition, self.cell(place, rule)))
    }

    #[must_use]
    pub fn markdown(&self) -> String {
        let mut text = format!(
            "Means over {} seeds; in brackets the number of runs that did not end, which the mean omits.\n",
            self.design.seeds
        );
        let rules = &self.design.rules;
        let tables: [(&str, Measure, usize); 3] = [
            ("Time by the least time", |cell| cell.time, 2),
            ("Energy by the least energy", |cell| cell.energy, 2),
            ("Two at one task, robot-s", |cell| cell.duplicate_s, 0),
        ];
        for (title, value, digits) in tables {
            let names: Vec<&str> = rules.iter().map(|rule| rule.name.as_str()).collect();
            let _ = write!(
                text,
                "\n**{title}**\n\n| (n,m,c), h | {} |\n|---{}|\n",
                names.join(" | "),
                "|---".repeat(rules.len())
            );
            let mut row = |name: String, cells: Vec<String>| {
                let _ = writeln!(text, "| {name} | {} |", cells.join(" | "));
            };
            let shown = |value: Option<f64>| {
                value.map_or_else(|| "–".to_owned(), |value| format!("{value:.digits$}"))
            };
            for (place, condition) in self.design.conditions.iter().enumerate() {
                let cells = (0..rules.len()).map(|rule| {
                    let cell = self.cell(place, rule);
                    let endless = match cell.unfinished {
                        0 => String::new(),
                        endless => format!(" ({endless})"),
                    };
                    shown(value(&cell)) + &endless
                });
                row(condition.to_string(), cells.collect());
            }
            let all = (0..rules.len()).map(|rule| {
                let cells = self.without_faults(rule);
                cells
                    .filter_map(|(_, cell)| value(&cell))
                    .collect::<Vec<f64>>()
            });
            let all: Vec<Vec<f64>> = all.collect();
            let means = all.iter().map(|values| shown(mean(values)));
            row("mean without faults".to_owned(), means.collect());
            let worst = all
                .iter()
                .map(|values| shown(values.iter().copied().reduce(f64::max)));
            row("worst of them".to_owned(), worst.collect());
        }
        text
    }

    /// Returns a row per trial.
    #[must_use]
    pub fn table(&self) -> Table {
        Table::of_rows(self.trials.iter().enumerate().map(|(run, trial)| {
            let (condition, rule, seed) = trial_of_run(run, &self.design);
            let condition = &self.design.conditions[condition];
            [
                ("robots", Entry::count(condition.robots)),
                ("tasks", Entry::count(condition.tasks)),
                ("coverage", Entry::count(condition.coverage)),
                ("spread", Entry::number(condition.spread)),
                ("mishap", Entry::text(condition.fault.as_str())),
                ("rule", Entry::text(&self.design.rules[rule].name)),
                // At most 10,000 seeds.
                ("seed", Entry::count(seed as usize)),
                ("time_s", Entry::number(trial.time_s)),
                ("least_time_s", Entry::number(trial.least_time_s)),
                ("energy_j", Entry::number(trial.energy_j)),
                ("least_energy_j", Entry::number(trial.least_energy_j)),
                ("doubled_s", Entry::number(trial.doubled_s)),
            ]
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::super::trial::run_trial;
    use super::*;

    /// The rules of the reduced study: one per strategy that ends, and strategy III with another order.
    const PLAYED: [&str; 4] = ["I longest", "III longest", "III shortest", "IV"];

    /// Returns the plan that ships, with another number of seeds.
    fn plan(seeds: usize) -> Design {
        let name = "l-alliance-strategies.toml";
        let text = include_str!("../../sweeps/l-alliance-strategies.toml");
        let design = Design::parse(name, text).unwrap().unwrap();
        assert_eq!(design.runs(), 57_200);
        Design { seeds, ..design }
    }

    /// Returns the reduced study: these rules, without faults.
    fn reduced(seeds: usize) -> Study {
        let design = plan(seeds);
        let trial = |run| {
            let (condition, rule, seed) = trial_of_run(run, &design);
            let (condition, rule) = (&design.conditions[condition], &design.rules[rule]);
            let is_played =
                PLAYED.contains(&rule.name.as_str()) && condition.fault == TrialFault::None;
            is_played.then(|| run_trial(condition, rule, seed).unwrap())
        };
        let trials = (0..design.runs()).map(|run| trial(run).unwrap_or(NONE));
        Study {
            trials: trials.collect(),
            design,
        }
    }

    const NONE: Trial = Trial {
        time_s: None,
        least_time_s: 1.0,
        energy_j: 0.0,
        least_energy_j: 1.0,
        doubled_s: 0.0,
    };

    fn named(study: &Study, name: &str) -> usize {
        study
            .design
            .rules
            .iter()
            .position(|rule| rule.name == name)
            .unwrap()
    }

    /// Bounds: docs/allocators/l-alliance.md, "The strategies against the optimum".
    #[test]
    fn strategies_meet_the_documented_bounds() {
        let study = reduced(8);
        for trial in &study.trials {
            let is_over = trial.time_s.is_some();
            let is_possible = trial
                .time_s
                .is_none_or(|time_s| time_s >= trial.least_time_s)
                && (!is_over || trial.energy_j >= trial.least_energy_j - 1e-6);
            assert!(is_possible, "better than the optimum: {trial:?}");
        }
        for name in PLAYED {
            for (condition, cell) in study.without_faults(named(&study, name)) {
                assert_eq!(cell.unfinished, 0, "{condition}, {name}");
                let is_alone = name == "I longest" || cell.duplicate_s == Some(0.0);
                assert!(is_alone, "{condition}, {name}: two at a task");
            }
        }
        let of = |name| study.without_faults(named(&study, name));
        for ((condition, four), (_, one)) in of("IV").zip(of("I longest")) {
            let (four, one) = (four.time.unwrap(), one.time.unwrap());
            let all_can = condition.coverage == 5;
            if condition.spread <= 1.0 && !all_can {
                assert!(four < 1.35, "{condition}: {four} times the optimum");
            }
            if condition.spread >= 1.0 || !all_can {
                assert!(four <= one + 0.03, "{condition}: IV {four}, I {one}");
            }
        }
    }

    /// Cells and tables of invented trials; the second trial of each cell does not end.
    #[test]
    fn means_include_only_trials_that_ended() {
        let trial = |run: usize| Trial {
            time_s: (run % 3 != 1).then_some(12.0 + (run % 3) as f64),
            least_time_s: 10.0,
            energy_j: 30.0,
            least_energy_j: 20.0,
            doubled_s: (run % 3) as f64,
        };
        let design = plan(3);
        let study = Study {
            trials: (0..design.runs()).map(trial).collect(),
            design,
        };
        let cell = study.cell(3, 2);
        // 12 and 14 of 10 s; 0 and 2 robot-s.
        assert_eq!(cell.unfinished, 1);
        assert!((cell.time.unwrap() - 1.3).abs() < 1e-9);
        assert_eq!((cell.energy, cell.duplicate_s), (Some(1.5), Some(1.0)));
        let text = study.markdown();
        assert!(text.contains("| (5,6,5), 0.5 | 1.30 (1) | "), "{text}");
        assert!(text.contains("| worst of them | 1.30 | "), "{text}");
        assert_eq!(study.table().rows(), study.design.runs());
        let svg = super::super::figure::draw(&study).unwrap();
        // One mark per condition and rule in both panels, and those of the legend.
        assert_eq!(
            svg.matches("<polygon").count(),
            24 * study.design.rules.len() * 2 + 3
        );
    }

    #[test]
    fn run_numbers_map_to_condition_rule_and_seed() {
        let design = plan(5);
        assert_eq!(trial_of_run(0, &design), (0, 0, 1));
        assert_eq!(trial_of_run(5 * 11 + 7, &design), (1, 1, 3));
    }

    #[test]
    fn a_mistake_in_the_plan_is_one_line() {
        let text = include_str!("../../sweeps/l-alliance-strategies.toml");
        let mistake = |from: &str, to: &str| {
            let text = text.replacen(from, to, 1);
            format!("{:#}", Design::parse("plan.toml", &text).unwrap_err())
        };
        let size = mistake("[3, 6, 1]", "[3, 6, 4]");
        assert!(
            size.contains(": strategies: the size (3, 6, 4) is out of range"),
            "{size}"
        );
        let rule = mistake("strategy = \"IV\"", "stratgy = \"IV\"");
        assert!(
            rule.starts_with("plan.toml: rule 'IV': ") && rule.contains("stratgy"),
            "{rule}"
        );
        assert!(mistake("spreads", "spread").starts_with("plan.toml:"));
        assert_eq!(Design::parse("plan.toml", "seeds = 3\n").unwrap(), None);
    }
}
