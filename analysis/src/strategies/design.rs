//! The trials of the study: conditions, rules and seeds.

use std::fmt;

/// The numbers of robots, of tasks, and of robots that can do each task.
const SIZES: [(usize, usize, usize); 8] = [
    (2, 4, 2),
    (3, 6, 1),
    (3, 6, 2),
    (3, 6, 3),
    (4, 8, 3),
    (4, 8, 4),
    (5, 6, 5),
    (5, 10, 3),
];

/// h: a robot takes up to 1 + h times as long as the fastest possible robot, and draws up to 1 + h W.
pub const SPREADS: [f64; 3] = [0.5, 1.0, 2.0];

/// A team with its tasks, and a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Condition {
    pub robots: usize,
    pub tasks: usize,
    /// The number of robots that can do each task.
    pub coverage: usize,
    /// h, the spread of times and powers.
    pub spread: f64,
    pub mishap: TrialFault,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrialFault {
    None,
    /// The first robot is killed at 60 s.
    Crash,
    /// The first robot takes three times as long as its teammates expect.
    Slow,
}

/// The rule by which robots choose tasks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rule {
    pub name: &'static str,
    strategy: &'static str,
    ordering: &'static str,
    /// The shortest and longest delay, and the boredom time, s.
    delays_s: Option<(f64, f64, f64)>,
}

const fn rule(name: &'static str, strategy: &'static str, ordering: &'static str) -> Rule {
    Rule {
        name,
        strategy,
        ordering,
        delays_s: None,
    }
}

/// The strategies with their orderings, and strategy IV again with shorter delays.
pub const RULES: [Rule; 11] = [
    rule("I longest", "I", "longest-first"),
    rule("I shortest", "I", "shortest-first"),
    rule("I random", "I", "random"),
    rule("II longest", "II", "longest-first"),
    rule("II shortest", "II", "shortest-first"),
    rule("II random", "II", "random"),
    rule("III longest", "III", "longest-first"),
    rule("III shortest", "III", "shortest-first"),
    rule("III random", "III", "random"),
    rule("IV", "IV", "longest-first"),
    Rule {
        delays_s: Some((1.0, 4.0, 3.0)),
        ..rule("IV, 1 to 4 s", "IV", "longest-first")
    },
];

impl Rule {
    /// Returns the rule's lines of `[allocators.l-alliance]`.
    pub(super) fn parameters(&self) -> String {
        let mut text = format!(
            "strategy = '{}'\nordering = '{}'\n",
            self.strategy, self.ordering
        );
        if let Some((least_s, most_s, bored_s)) = self.delays_s {
            let rate = 1.0 / bored_s;
            text += &format!(
                "min_delay_s = {least_s:?}\nmax_delay_s = {most_s:?}\nboredom_rate = {rate:?}\n"
            );
        }
        text
    }
}

impl TrialFault {
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Crash => "r0 dies at 60 s",
            Self::Slow => "r0 is three times slower",
        }
    }
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            robots,
            tasks,
            coverage,
            spread,
            mishap,
        } = self;
        write!(f, "({robots},{tasks},{coverage}), {spread}")?;
        match mishap {
            TrialFault::None => Ok(()),
            mishap => write!(f, ", {}", mishap.as_str()),
        }
    }
}

/// Returns every size with every spread, and two conditions with a fault.
#[must_use]
pub fn conditions() -> Vec<Condition> {
    let sizes = SIZES.iter().flat_map(|&(robots, tasks, coverage)| {
        SPREADS.map(|spread| Condition {
            robots,
            tasks,
            coverage,
            spread,
            mishap: TrialFault::None,
        })
    });
    let mishaps = [TrialFault::Crash, TrialFault::Slow].map(|mishap| Condition {
        robots: 4,
        tasks: 8,
        coverage: 4,
        spread: 1.0,
        mishap,
    });
    sizes.chain(mishaps).collect()
}
