//! The identity of this program's build. Programs of different builds can decide differently, also with equal versions
//! of the protocol.

use std::sync::OnceLock;

static BUILD: OnceLock<&'static str> = OnceLock::new();

/// Sets the identity. The program's `main` calls this once, before it joins or records a run. Later calls have no
/// effect.
pub fn set(build: &'static str) {
    let _ = BUILD.set(build);
}

/// Returns the identity, 16 hexadecimal digits. It is empty if it is not known, such as in a library's tests.
#[must_use]
pub fn get() -> &'static str {
    BUILD.get().copied().unwrap_or_default()
}

/// Returns whether `other` is the identity of another build. An unknown identity is no other build.
#[must_use]
pub fn is_other(other: &str) -> bool {
    differ(get(), other)
}

/// Returns whether two identities are of different builds. An unknown identity differs from no other.
#[must_use]
pub fn differ(a: &str, b: &str) -> bool {
    !a.is_empty() && !b.is_empty() && a != b
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_known_identities_differ() {
        assert!(differ("0123456789abcdef", "0123456789abcdee"));
        assert!(!differ("0123456789abcdef", "0123456789abcdef"));
        assert!(!differ("", "0123456789abcdef") && !differ("0123456789abcdef", ""));
    }
}
