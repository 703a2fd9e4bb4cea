//! A part of a sweep, for one job of a job array.

use std::fmt;
use std::str::FromStr;

/// Every `of`-th run, starting with run `number`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    number: usize,
    of: usize,
}

impl Shard {
    #[must_use]
    pub fn contains(self, run: usize) -> bool {
        run % self.of == self.number
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text
            .split_once('/')
            .and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
        match numbers {
            Some((number, of)) if number < of => Ok(Self { number, of }),
            _ => Err("use I/N, from 0/N to N-1/N, such as 0/3, 1/3 and 2/3".to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_run_is_in_exactly_one_shard() {
        let shards = ["0/3", "1/3", "2/3"].map(|text| text.parse::<Shard>().unwrap());
        for run in 0..10 {
            assert_eq!(shards.iter().filter(|shard| shard.contains(run)).count(), 1);
        }
        assert_eq!(shards[2].to_string(), "2/3");
        for wrong in ["3/3", "0/0", "1", "a/b", "-1/3", ""] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }
}
