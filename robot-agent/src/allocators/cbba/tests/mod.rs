//! The properties of CBAA and CBBA (docs/allocators/cbba.md), tested in teams of several allocators.

pub(crate) mod laws;
mod life;
mod records;
pub(crate) mod reference;
mod windows;
