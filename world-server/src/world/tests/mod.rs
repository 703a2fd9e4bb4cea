//! Promises of the world as a whole.
