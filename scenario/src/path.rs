//! Paths of values in an input, such as `alliance.sets."push(left)".fast_impatience`.

use std::fmt;

/// A step down from a table or an array.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum PathStep {
    Key(String),
    /// An index of an array, from 0.
    Index(usize),
    /// A key of a format without tables. It is shown as it was written.
    Verbatim(String),
}

/// The steps from the top of an input down to a value.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct KeyPath(pub(super) Vec<PathStep>);

impl KeyPath {
    /// Creates a path of table keys.
    #[must_use]
    pub fn new<const N: usize>(keys: [&str; N]) -> Self {
        keys.into()
    }

    /// Creates a path of one key in a format without tables. It is shown as it was written.
    #[must_use]
    pub fn verbatim(key: impl Into<String>) -> Self {
        PathStep::Verbatim(key.into()).into()
    }

    /// Returns the path extended by a table key.
    #[must_use]
    pub fn key(&self, key: &str) -> Self {
        self.then(PathStep::Key(key.to_owned()))
    }

    /// Returns the path extended by an array index.
    #[must_use]
    pub fn index(&self, index: usize) -> Self {
        self.then(PathStep::Index(index))
    }

    /// Returns the path extended by another one.
    pub(super) fn join(mut self, below: Self) -> Self {
        self.0.extend(below.0);
        self
    }

    fn then(&self, step: PathStep) -> Self {
        let mut steps = self.0.clone();
        steps.push(step);
        Self(steps)
    }
}

/// The path of the value itself.
impl From<()> for KeyPath {
    fn from((): ()) -> Self {
        Self::default()
    }
}

impl From<PathStep> for KeyPath {
    fn from(step: PathStep) -> Self {
        Self(vec![step])
    }
}

impl From<&KeyPath> for KeyPath {
    fn from(path: &KeyPath) -> Self {
        path.clone()
    }
}

impl<const N: usize> From<[&str; N]> for KeyPath {
    fn from(keys: [&str; N]) -> Self {
        Self(keys.map(|key| PathStep::Key(key.to_owned())).to_vec())
    }
}

/// Formats the path as in a TOML file, with `[INDEX]` for places in arrays.
impl fmt::Display for KeyPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, step) in self.0.iter().enumerate() {
            match step {
                PathStep::Index(index) => write!(f, "[{index}]")?,
                PathStep::Verbatim(key) => f.write_str(key)?,
                PathStep::Key(key) => {
                    if place > 0 {
                        f.write_str(".")?;
                    }
                    let bare = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
                    if !key.is_empty() && key.chars().all(bare) {
                        f.write_str(key)?;
                    } else {
                        write!(f, "{key:?}")?;
                    }
                }
            }
        }
        Ok(())
    }
}
