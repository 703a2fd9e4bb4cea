//! The laws of CBAA and CBBA (ALLOCATORS.md §6), in teams of several allocators.

mod laws;
mod life;
mod records;
mod reference;
mod rows;
pub(crate) mod team;
