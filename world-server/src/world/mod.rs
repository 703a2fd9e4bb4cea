//! Physics and sensing: pure.
