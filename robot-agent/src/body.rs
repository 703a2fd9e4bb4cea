//! Drive and obstacle avoidance: pure.
