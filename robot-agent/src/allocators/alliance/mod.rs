//! ALLIANCE (Parker 1998), as ALLIANCE.md states it: one robot's motivational behaviors, pure.
//!
//! [`Engine::step`] takes what the robot heard and senses in a step and gives back its motivations, the changes of state
//! with their reasons, and what it has to tell its teammates. No clock, no bus, no chance: the same inputs give the same
//! outputs on every machine.
//!
//! - `history`: *comm_received*, from the first and last receive time per teammate and task;
//! - `teammates`: who says to execute a task or to wait for it: waiting and arbitration;
//! - `motivation`: the equations 2.3 to 2.7, one function each;
//! - `behavior`: a behavior set's motivation and state;
//! - `heartbeats`: what to announce, and when;
//! - `params`: the values in force, by rank;
//! - `steady`: steps that can be left out, for speed alone;
//! - `learned`: values that a rule which learns puts in their place, as L-ALLIANCE does;
//! - `kind`: ALLIANCE as an allocator that scenarios name.
//!
//! # What the sources leave open
//!
//! The switches are ALLIANCE.md §3's ([`Switches`](alliance_proto::scenario::Switches)). Decided here on top of them:
//!
//! - A message counts at the time of the step in which it is heard. It is ignored when a later one of the same sender on
//!   the same task has been heard before it.
//! - A set that activates suppresses the others from the next step on: their motivations of this step have been computed
//!   when the choice is made. A set that was waiting stays so for that last step, but says nothing unless
//!   `wish_when_suppressed`; a set that has just come to θ on an occupied task starts to wait in such a step only with that
//!   switch.
//! - If several factors are 0 at once, the reason is the first of: not applicable, suppressed, reset, ψ, λ.
//! - The log's impatience_reset is the factor that acted: 1 for an active set that the reset may not switch off.
//! - "Longer than" ψ, λ and the waiting bound ψ + τ are strict, as in eq. 2.6.
//! - A task for n > 1 robots is occupied while n teammates execute it; of more than n claims the n earliest stay. ψ, reset
//!   and impatience treat a fellow worker as the formulas do.
//! - Arbitration compares all claims that are known, not just those of one step: a claim that was lost on the air loses as
//!   soon as it is heard. A set that waited its bound in vain does not give way to the teammates that it waited for,
//!   whatever they claim: there ψ decides.
//! - The bound ψ + τ is on all waits together since the set last hibernated: a robot that claims, lets go and claims again
//!   gains nothing by it (docs/BOUNDS.md).
//! - An announced wish or claim ends with the sender's next heartbeat that contradicts it: one that waits executes nothing,
//!   one that executes waits for nothing, one that is idle does neither. So does the first message of a new incarnation.
//! - A set that hibernates is not released while another set of the robot executes or waits for the same task.
//! - Idle heartbeats come at the longest 1/ρ of the robot's sets.

mod behavior;
mod engine;
mod heartbeats;
mod history;
mod kind;
mod learned;
mod motivation;
mod params;
mod steady;
mod teammates;
#[cfg(test)]
mod tests;
mod values;

pub use engine::{Engine, StepInput};
pub use kind::Alliance;
pub use params::Parameters;
pub(super) use params::Toward;
pub(super) use values::{Learned, Values};
