//! L-ALLIANCE's strategies against the optimum, in the abstract: one-shot tasks without travel (Parker, ORNL report 1995; Advanced
//! Robotics 11(4), 1997; ALLOCATORS.md §3). What was found is told in docs/allocators/l-alliance.md.
//!
//! - [`instance`]: who can do what, in which time and at which power, drawn from a seed, and as a mission of `service`.
//! - [`optimum`]: the least makespan of an instance, and the least energy.
//! - [`trial`]: an instance by one strategy.
//! - [`design`]: all trials of the study. [`results`]: its tables. [`figure`]: its drawing. [`command`]: `alliance lalliance-strategies`.

pub mod command;
pub mod design;
pub mod figure;
pub mod instance;
pub mod optimum;
pub mod results;
pub mod trial;
