//! The history of a live run for pages that open later. Its size is bounded.

use std::collections::VecDeque;

use scenario::time::SimTime;

const VIEWS_MAX: usize = 400;

const BYTES_MAX: usize = 4 << 20;

/// The maximum number of events; the newest are kept.
const EVENTS_MAX: usize = 5000;

/// The maximum number of message receptions; the newest are kept.
const MESSAGES_MAX: usize = 2000;

/// The maximum number of curve corners; the newest are kept.
const CORNERS_MAX: usize = 20_000;

/// A bounded history of views, messages, curve corners and events as JSON texts.
#[derive(Debug)]
pub struct RecordedRun {
    /// Oldest first, at least `spacing` apart.
    views: VecDeque<(SimTime, String)>,
    spacing: SimTime,
    bytes: usize,
    messages: VecDeque<String>,
    messages_left_out: u64,
    corners: VecDeque<String>,
    events: VecDeque<String>,
}

impl RecordedRun {
    /// Creates a history without entries for a run with this step.
    #[must_use]
    pub fn new(step: SimTime) -> Self {
        Self {
            views: VecDeque::new(),
            spacing: step,
            bytes: 0,
            messages: VecDeque::new(),
            messages_left_out: 0,
            corners: VecDeque::new(),
            events: VecDeque::new(),
        }
    }

    /// Stores a view if the last one is at least `spacing` older. If the limits are exceeded, every second view is dropped.
    pub fn keep_view(&mut self, now: SimTime, view: &str) {
        let due = self
            .views
            .back()
            .is_none_or(|(last, _)| now >= *last + self.spacing);
        if !due {
            return;
        }
        self.bytes += view.len();
        self.views.push_back((now, view.to_owned()));
        while self.views.len() > VIEWS_MAX || (self.bytes > BYTES_MAX && self.views.len() > 2) {
            self.spacing = SimTime(self.spacing.0 * 2);
            let mut index = 0;
            self.views.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.bytes = self.views.iter().map(|(_, view)| view.len()).sum();
        }
    }

    pub fn keep_message(&mut self, message: String) {
        if self.messages.len() == MESSAGES_MAX {
            self.messages.pop_front();
            self.messages_left_out += 1;
        }
        self.messages.push_back(message);
    }

    pub fn count_dropped_messages(&mut self, count: u64) {
        self.messages_left_out += count;
    }

    pub fn keep_corner(&mut self, corner: String) {
        if self.corners.len() == CORNERS_MAX {
            self.corners.pop_front();
        }
        self.corners.push_back(corner);
    }

    pub fn keep_event(&mut self, event: String) {
        if self.events.len() == EVENTS_MAX {
            self.events.pop_front();
        }
        self.events.push_back(event);
    }

    /// Returns the history as JSON: `{"views": […], "messages": {"receptions": […], "left_out": N}, "corners": […], "events": […]}`.
    #[must_use]
    pub fn to_json(&self) -> String {
        let views: Vec<&str> = self.views.iter().map(|(_, view)| view.as_str()).collect();
        let join = |texts: &VecDeque<String>| {
            let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
            texts.join(",")
        };
        format!(
            r#"{{"views":[{}],"messages":{{"receptions":[{}],"left_out":{}}},"corners":[{}],"events":[{}]}}"#,
            views.join(","),
            join(&self.messages),
            self.messages_left_out,
            join(&self.corners),
            join(&self.events)
        )
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;

    fn times(past: &RecordedRun) -> Vec<u64> {
        past.views.iter().map(|(now, _)| now.0).collect()
    }

    #[test]
    fn a_long_history_is_thinned_evenly_from_the_start() {
        let mut past = RecordedRun::new(SimTime(50));
        for tick in 0..10_000_u64 {
            past.keep_view(SimTime(50 * tick), &tick.to_string());
        }
        let times = times(&past);
        assert_eq!(times[0], 0);
        assert!((VIEWS_MAX / 2..=VIEWS_MAX).contains(&times.len()));
        let spacing = times[1];
        assert!(times.windows(2).all(|pair| pair[1] - pair[0] == spacing));
        assert!(times[times.len() - 1] + spacing > 50 * 9999);
    }

    #[test]
    fn long_views_are_thinned_by_their_bytes() {
        let mut past = RecordedRun::new(SimTime(50));
        let long = "7".repeat(BYTES_MAX / 8);
        for tick in 0..100 {
            past.keep_view(SimTime(50 * tick), &long);
        }
        assert!(past.bytes <= BYTES_MAX && past.views.len() >= 2);
    }

    #[test]
    fn json_contains_all_kept_entries() {
        let mut past = RecordedRun::new(SimTime(50));
        let nothing =
            r#"{"views":[],"messages":{"receptions":[],"left_out":0},"corners":[],"events":[]}"#;
        assert_eq!(past.to_json(), nothing);
        past.keep_view(SimTime(0), r#"{"tick":0}"#);
        past.keep_view(SimTime(10), r#"{"tick":1}"#);
        past.keep_view(SimTime(50), r#"{"tick":2}"#);
        for number in 0..EVENTS_MAX + 3 {
            past.keep_event(number.to_string());
        }
        for number in 0..MESSAGES_MAX + 2 {
            past.keep_message(number.to_string());
        }
        past.count_dropped_messages(7);
        for number in 0..CORNERS_MAX + 4 {
            past.keep_corner(number.to_string());
        }
        let json: Value = serde_json::from_str(&past.to_json()).unwrap();
        assert_eq!(json["messages"]["left_out"], 9);
        let receptions = json["messages"]["receptions"].as_array().unwrap();
        assert_eq!(
            (receptions.len(), &receptions[0]),
            (MESSAGES_MAX, &2.into())
        );
        assert_eq!(json["views"], serde_json::json!([{"tick": 0}, {"tick": 2}]));
        assert_eq!(json["events"].as_array().unwrap().len(), EVENTS_MAX);
        assert_eq!(json["events"][0], 3);
        assert_eq!(json["corners"].as_array().unwrap().len(), CORNERS_MAX);
        assert_eq!(json["corners"][0], 4);
    }
}
