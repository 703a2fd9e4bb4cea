//! The properties of PI (docs/allocators/pi.md): hand-computed impacts, and teams of several robots in lockstep.

mod impacts;
mod laws;
mod reference;
