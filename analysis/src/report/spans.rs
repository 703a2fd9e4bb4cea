//! Sets of intervals of simulated time.

use observation::stints::Span;
use scenario::time::SimTime;

/// Ordered spans that neither overlap nor touch.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Spans(Vec<Span>);

impl Spans {
    /// Adds a span that starts no earlier than any existing one. A span that overlaps or touches the last one extends
    /// it.
    pub fn push(&mut self, span: Span) {
        match self.0.last_mut() {
            Some(last) if span.from <= last.to => last.to = last.to.max(span.to),
            _ if span.from == span.to => {}
            _ => self.0.push(span),
        }
    }

    pub fn iter(&self) -> impl DoubleEndedIterator<Item = Span> + '_ {
        self.0.iter().copied()
    }

    #[must_use]
    pub fn total(&self) -> SimTime {
        self.iter()
            .fold(SimTime::ZERO, |sum, span| sum + span.length())
    }

    /// Returns whether a time lies in one of the spans.
    #[must_use]
    pub fn contains(&self, at: SimTime) -> bool {
        let after = self.0.partition_point(|span| span.to <= at);
        self.0.get(after).is_some_and(|span| span.from <= at)
    }

    /// Returns the time that lies in at least `least` of the sets. `least` must be positive.
    #[must_use]
    pub fn in_at_least<'s>(least: usize, sets: impl IntoIterator<Item = &'s Spans>) -> Spans {
        // Ends come before starts: spans that touch do not overlap.
        let mut edges: Vec<(SimTime, bool)> = sets
            .into_iter()
            .flat_map(Spans::iter)
            .flat_map(|span| [(span.from, true), (span.to, false)])
            .collect();
        edges.sort_unstable();
        let mut found = Spans::default();
        let (mut open, mut from) = (0, SimTime::ZERO);
        for (at, begins) in edges {
            if begins {
                open += 1;
                if open == least {
                    from = at;
                }
            } else {
                if open == least && from < at {
                    found.push(Span { from, to: at });
                }
                open -= 1;
            }
        }
        found
    }

    /// Returns the time of these spans that does not lie in `others`.
    #[must_use]
    pub fn without(&self, others: &Spans) -> Spans {
        let mut left = Spans::default();
        let mut others = others.iter().peekable();
        for Span { mut from, to } in self.iter() {
            while others.next_if(|other| other.to <= from).is_some() {}
            while let Some(other) = others.peek().filter(|other| other.from < to) {
                if from < other.from {
                    let to = other.from;
                    left.push(Span { from, to });
                }
                from = other.to;
                if other.to > to {
                    break;
                }
                others.next();
            }
            if from < to {
                left.push(Span { from, to });
            }
        }
        left
    }
}

impl FromIterator<Span> for Spans {
    fn from_iter<I: IntoIterator<Item = Span>>(spans: I) -> Self {
        let mut all = Self::default();
        for span in spans {
            all.push(span);
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spans<const N: usize>(spans: [(u64, u64); N]) -> Spans {
        let span = |(from, to)| Span {
            from: SimTime(from),
            to: SimTime(to),
        };
        spans.into_iter().map(span).collect()
    }

    #[test]
    fn touching_spans_become_one_and_empty_ones_none() {
        let all = spans([(0, 50), (50, 100), (120, 120), (150, 200), (160, 170)]);
        assert_eq!(all, spans([(0, 100), (150, 200)]));
        assert_eq!(all.total(), SimTime(150));
    }

    #[test]
    fn a_span_holds_its_beginning_but_not_its_end() {
        let all = spans([(50, 100), (150, 200)]);
        let inside = [49, 50, 99, 100, 149, 150, 199, 200].map(|at| all.contains(SimTime(at)));
        assert_eq!(inside, [false, true, true, false, false, true, true, false]);
    }

    #[test]
    fn in_one_in_two_in_three() {
        let sets = [
            spans([(0, 100), (300, 400)]),
            spans([(50, 150), (400, 500)]),
            spans([(80, 90), (100, 120)]),
        ];
        assert_eq!(Spans::in_at_least(1, &sets), spans([(0, 150), (300, 500)]));
        assert_eq!(Spans::in_at_least(2, &sets), spans([(50, 120)]));
        assert_eq!(Spans::in_at_least(3, &sets), spans([(80, 90)]));
        assert_eq!(Spans::in_at_least(4, &sets), spans([]));
    }

    #[test]
    fn without() {
        let all = spans([(0, 100), (200, 300), (400, 500)]);
        let cases = [
            (spans([]), all.clone()),
            (spans([(0, 500)]), spans([])),
            (spans([(0, 100)]), spans([(200, 300), (400, 500)])),
            (
                spans([(20, 30), (40, 250), (299, 600)]),
                spans([(0, 20), (30, 40), (250, 299)]),
            ),
            (spans([(100, 200), (300, 400), (500, 600)]), all.clone()),
        ];
        for (others, left) in cases {
            assert_eq!(all.without(&others), left, "without {others:?}");
        }
    }
}
