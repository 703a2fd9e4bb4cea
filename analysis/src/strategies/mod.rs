//! L-ALLIANCE's strategies against the optimum, for one-shot tasks without travel (Parker, ORNL report 1995; Advanced Robotics
//! 11(4), 1997). docs/allocators/l-alliance.md contains the results.
//!
//! - [`condition`]: a team with its tasks, a fault and a rule.
//! - [`instance`]: random times and powers of a team, and the team as a mission of `service`.
//! - [`optimum`]: the least makespan and the least energy of an instance.
//! - [`trial`]: an instance with one strategy.
//! - [`design`]: the plan of the study (`analysis/sweeps/l-alliance-strategies.toml`). [`results`]: its tables. [`figure`]: its figure.
//! - [`command`]: its execution by `alliance sweep`.

pub mod command;
pub mod condition;
pub mod design;
pub mod figure;
pub mod instance;
pub mod optimum;
pub mod results;
pub mod trial;
