//! The results of the study as tables.

use std::fmt::Write;

use super::design::{Condition, RULES, TrialFault, conditions};
use super::trial::Trial;

pub struct Study {
    pub conditions: Vec<Condition>,
    /// The number of seeds; they start at 1.
    pub seeds: usize,
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

#[must_use]
pub fn trial_of_run(run: usize, seeds: usize) -> (usize, usize, u64) {
    let cell = run / seeds;
    let seed = run % seeds + 1;
    (cell / RULES.len(), cell % RULES.len(), seed as u64)
}

impl Study {
    #[must_use]
    pub fn runs(seeds: usize) -> usize {
        conditions().len() * RULES.len() * seeds
    }

    #[must_use]
    pub fn cell(&self, condition: usize, rule: usize) -> Cell {
        let first = (condition * RULES.len() + rule) * self.seeds;
        let trials = &self.trials[first..first + self.seeds];
        let ended: Vec<(f64, &Trial)> = trials
            .iter()
            .filter_map(|trial| Some((trial.time_s?, trial)))
            .collect();
        let mean = |of: &dyn Fn(f64, &Trial) -> f64| {
            let sum: f64 = ended.iter().map(|(time_s, trial)| of(*time_s, trial)).sum();
            (!ended.is_empty()).then(|| sum / ended.len() as f64)
        };
        Cell {
            unfinished: trials.len() - ended.len(),
            time: mean(&|time_s, trial| time_s / trial.least_time_s),
            energy: mean(&|_, trial| trial.energy_j / trial.least_energy_j),
            duplicate_s: mean(&|_, trial| trial.doubled_s),
        }
    }

    /// Returns the cells of a rule without faults, with their conditions.
    pub fn without_faults(&self, rule: usize) -> impl Iterator<Item = (&Condition, Cell)> {
        let conditions = self.conditions.iter().enumerate();
        conditions
            .filter(|(_, condition)| condition.mishap == TrialFault::None)
            .map(move |(place, condition)| (condition, self.cell(place, rule)))
    }

    #[must_use]
    pub fn markdown(&self) -> String {
        let mut text = format!(
            "Means over {} seeds; in brackets the number of runs that did not end, which the mean omits.\n",
            self.seeds
        );
        let tables: [(&str, Measure, usize); 3] = [
            ("Time by the least time", |cell| cell.time, 2),
            ("Energy by the least energy", |cell| cell.energy, 2),
            ("Two at one task, robot-s", |cell| cell.duplicate_s, 0),
        ];
        for (title, value, digits) in tables {
            let names: Vec<&str> = RULES.iter().map(|rule| rule.name).collect();
            let _ = write!(
                text,
                "\n**{title}**\n\n| (n,m,c), h | {} |\n|---{}|\n",
                names.join(" | "),
                "|---".repeat(RULES.len())
            );
            let mut row = |name: String, cells: Vec<String>| {
                let _ = writeln!(text, "| {name} | {} |", cells.join(" | "));
            };
            let shown = |value: Option<f64>| {
                value.map_or_else(|| "–".to_owned(), |value| format!("{value:.digits$}"))
            };
            for (place, condition) in self.conditions.iter().enumerate() {
                let cells = (0..RULES.len()).map(|rule| {
                    let cell = self.cell(place, rule);
                    let endless = match cell.unfinished {
                        0 => String::new(),
                        endless => format!(" ({endless})"),
                    };
                    shown(value(&cell)) + &endless
                });
                row(condition.to_string(), cells.collect());
            }
            let values = |rule| {
                let cells = self.without_faults(rule);
                let values: Vec<f64> = cells.filter_map(|(_, cell)| value(&cell)).collect();
                values
            };
            let mean = |rule| {
                let values = values(rule);
                (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
            };
            let worst = |rule| values(rule).into_iter().reduce(f64::max);
            let rules = || 0..RULES.len();
            row(
                "mean without faults".to_owned(),
                rules().map(|rule| shown(mean(rule))).collect(),
            );
            row(
                "worst of them".to_owned(),
                rules().map(|rule| shown(worst(rule))).collect(),
            );
        }
        text
    }

    pub fn csv(&self) -> anyhow::Result<Vec<u8>> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record([
            "robots",
            "tasks",
            "coverage",
            "spread",
            "mishap",
            "rule",
            "seed",
            "time_s",
            "least_time_s",
            "energy_j",
            "least_energy_j",
            "doubled_s",
        ])?;
        for (run, trial) in self.trials.iter().enumerate() {
            let (condition, rule, seed) = trial_of_run(run, self.seeds);
            let condition = &self.conditions[condition];
            writer.write_record([
                condition.robots.to_string(),
                condition.tasks.to_string(),
                condition.coverage.to_string(),
                condition.spread.to_string(),
                condition.mishap.as_str().to_owned(),
                RULES[rule].name.to_owned(),
                seed.to_string(),
                trial
                    .time_s
                    .map_or_else(String::new, |time_s| time_s.to_string()),
                trial.least_time_s.to_string(),
                trial.energy_j.to_string(),
                trial.least_energy_j.to_string(),
                trial.doubled_s.to_string(),
            ])?;
        }
        Ok(writer.into_inner()?)
    }
}
#[cfg(test)]
mod tests {
    use super::super::trial::run_trial;
    use super::*;

    /// The rules of the reduced study: one per strategy that ends, and strategy III with another order.
    const PLAYED: [&str; 4] = ["I longest", "III longest", "III shortest", "IV"];

    /// Returns the reduced study: these rules, without faults.
    fn reduced(seeds: usize) -> Study {
        let conditions = conditions();
        let trial = |run| {
            let (condition, rule, seed) = trial_of_run(run, seeds);
            let (condition, rule) = (&conditions[condition], &RULES[rule]);
            let is_played = PLAYED.contains(&rule.name) && condition.mishap == TrialFault::None;
            is_played.then(|| run_trial(condition, rule, seed).unwrap())
        };
        let trials = (0..Study::runs(seeds)).map(|run| trial(run).unwrap_or(NONE));
        Study {
            trials: trials.collect(),
            conditions,
            seeds,
        }
    }

    const NONE: Trial = Trial {
        time_s: None,
        least_time_s: 1.0,
        energy_j: 0.0,
        least_energy_j: 1.0,
        doubled_s: 0.0,
    };

    fn named(name: &str) -> usize {
        RULES.iter().position(|rule| rule.name == name).unwrap()
    }

    /// Bounds: docs/ALLOCATORS.md §3.
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
            for (condition, cell) in study.without_faults(named(name)) {
                assert_eq!(cell.unfinished, 0, "{condition}, {name}");
                let is_alone = name == "I longest" || cell.duplicate_s == Some(0.0);
                assert!(is_alone, "{condition}, {name}: two at a task");
            }
        }
        let of = |name| study.without_faults(named(name));
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
        let study = Study {
            conditions: conditions(),
            seeds: 3,
            trials: (0..Study::runs(3)).map(trial).collect(),
        };
        let cell = study.cell(3, 2);
        // 12 and 14 of 10 s; 0 and 2 robot-s.
        assert_eq!(cell.unfinished, 1);
        assert!((cell.time.unwrap() - 1.3).abs() < 1e-9);
        assert_eq!((cell.energy, cell.duplicate_s), (Some(1.5), Some(1.0)));
        let text = study.markdown();
        assert!(text.contains("| (5,6,5), 0.5 | 1.30 (1) | "), "{text}");
        assert!(text.contains("| worst of them | 1.30 | "), "{text}");
        assert_eq!(
            study
                .csv()
                .unwrap()
                .iter()
                .filter(|&&byte| byte == b'\n')
                .count(),
            1 + Study::runs(3)
        );
        let svg = super::super::figure::draw(&study).unwrap();
        // One mark per condition and rule in both panels, and those of the legend.
        assert_eq!(svg.matches("<polygon").count(), 24 * RULES.len() * 2 + 3);
    }

    #[test]
    fn run_numbers_map_to_condition_rule_and_seed() {
        assert_eq!(trial_of_run(0, 5), (0, 0, 1));
        assert_eq!(trial_of_run(5 * RULES.len() + 7, 5), (1, 1, 3));
    }
}
