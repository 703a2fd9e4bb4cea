//! ALLIANCE: pure.
