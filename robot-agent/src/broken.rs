//! Rules that are broken on purpose, for tests of the search for violations (docs/HUNT.md).
//!
//! The released program contains none of them: without the feature `broken-rules`, [`is_broken`] is the constant `false`.
//! With it, the variable `ALLIANCE_BROKEN_RULE` names the broken rule of the whole team.

/// The variable with the name of the broken rule.
#[cfg(feature = "broken-rules")]
pub const VARIABLE: &str = "ALLIANCE_BROKEN_RULE";

/// The broken rules, each with its allocator.
pub const RULES: [(&str, &str); 22] = [
    ("ble-rows-never-age", "ble"),
    ("ble-ignores-other-rows", "ble"),
    ("ble-waits-for-a-row", "ble"),
    ("murdoch-leases-never-end", "murdoch"),
    ("murdoch-contracts-count-as-free", "murdoch"),
    ("cbba-left-tasks-stay-claimed", "cbba"),
    ("cbba-broadcasts-only-changes", "cbba"),
    ("acbba-keeps-bids-of-lost-robots", "acbba"),
    ("acbba-ignores-reports-about-itself", "acbba"),
    ("ssi-keeps-awards-of-lost-robots", "ssi"),
    ("ssi-waits-for-all-bids", "ssi"),
    ("pi-lost-tasks-stay-listed", "pi"),
    ("pi-left-tasks-stay-claimed", "pi"),
    ("hipc-keeps-claims-of-lost-robots", "hipc"),
    ("hipc-leaves-tasks-for-ever", "hipc"),
    ("dhba-rows-never-age", "dhba"),
    ("dhba-ignores-other-rows", "dhba"),
    ("grape-decisions-are-not-counted", "grape"),
    ("l-alliance-is-never-bored", "l-alliance"),
    ("first-come-later-robot-stays", "first-come"),
    ("first-come-waits-for-a-message", "first-come"),
    ("nearest-leaves-out-the-first-task", "nearest"),
];

/// Returns whether the rule is broken in this process.
///
/// # Panics
/// Panics if the variable names a rule that does not exist.
#[cfg(feature = "broken-rules")]
#[must_use]
pub fn is_broken(rule: &str) -> bool {
    static BROKEN: std::sync::OnceLock<String> = std::sync::OnceLock::new();
    let broken = BROKEN.get_or_init(|| {
        let name = std::env::var(VARIABLE).unwrap_or_default();
        let is_known = name.is_empty() || RULES.iter().any(|(known, _)| *known == name);
        assert!(is_known, "{VARIABLE}: there is no broken rule '{name}'");
        name
    });
    broken == rule
}

/// Returns `false`: this program contains no broken rule.
#[cfg(not(feature = "broken-rules"))]
#[inline]
#[must_use]
pub const fn is_broken(_rule: &str) -> bool {
    false
}
