//! The properties of CBAA and CBBA (docs/allocators/cbba.md), tested in teams of several allocators.

mod laws;
mod life;
mod records;
mod reference;
mod rows;
pub(crate) mod team;
mod windows;
