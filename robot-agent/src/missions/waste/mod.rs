//! The waste clean-up: behavior sets and knowledge.
