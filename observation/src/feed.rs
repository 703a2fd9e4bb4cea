//! A live run as frames for the page. The page's server lists the frames.

use proto::event::{EventLine, TickEvents};
use proto::view::View;
use scenario::Setup;
use scenario::time::SimTime;
use serde::Serialize;

use super::detections::DetectionWatch;
use super::past::RecordedRun;
use super::takeovers::{LossTakeover, TakeoverDetector};

/// The state that the frames of a run need: its history, and the losses that may become detections or takeovers.
pub struct Feed {
    past: RecordedRun,
    takeovers: TakeoverDetector,
    detections: DetectionWatch,
    /// The ticks of the newest view and the newest events, for the detection of repetitions.
    view: Option<u64>,
    events: Option<u64>,
}

/// The frames of a view.
pub struct ViewFrames {
    /// Events, messages and curve corners. A page needs all of them, in this order.
    pub news: Vec<String>,
    /// The view itself. A page may skip it if a newer one exists.
    pub view: String,
}

impl Feed {
    /// Creates the state of a run without data.
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        Self {
            past: RecordedRun::new(SimTime(setup.scenario.step_ms)),
            takeovers: TakeoverDetector::new(setup),
            detections: DetectionWatch::new(setup),
            view: None,
            events: None,
        }
    }

    /// Adds a view. Returns its frames, or `None` for an outdated view.
    pub fn add_view(&mut self, mut view: View) -> Option<ViewFrames> {
        if self.view.is_some_and(|newest| view.tick < newest) {
            return None;
        }
        self.view = Some(view.tick);
        let mut news = Vec::new();
        let mut found = self.detections.see(&view);
        let takeovers = match view.outcome {
            Some(_) => self.takeovers.finish(view.now),
            None => self.takeovers.take(view.now),
        };
        found.extend(takeovers.into_iter().map(LossTakeover::into_event));
        if !found.is_empty() {
            news.push(self.events_frame(&found));
        }
        let messages = std::mem::take(&mut view.messages);
        let left_out = std::mem::take(&mut view.messages_left_out);
        if !messages.is_empty() || left_out > 0 {
            let texts = texts(&messages);
            let receptions = texts.join(",");
            news.push(format!(
                r#"{{"messages":{{"receptions":[{receptions}],"left_out":{left_out}}}}}"#
            ));
            for text in texts {
                self.past.keep_message(text);
            }
            self.past.count_dropped_messages(left_out);
        }
        let corners = std::mem::take(&mut view.corners);
        if !corners.is_empty() {
            let texts = texts(&corners);
            news.push(format!(r#"{{"corners":[{}]}}"#, texts.join(",")));
            for text in texts {
                self.past.keep_corner(text);
            }
        }
        let text = json_text(&view);
        self.past.keep_view(view.now, &text);
        let view = format!(r#"{{"view":{text}}}"#);
        Some(ViewFrames { news, view })
    }

    /// Adds the events of a tick. Returns their frame, or `None` for a repetition.
    pub fn add_events(&mut self, news: &TickEvents) -> Option<String> {
        if self.events.is_some_and(|newest| news.tick <= newest) {
            return None;
        }
        self.events = Some(news.tick);
        for event in &news.events {
            self.takeovers.add(event);
        }
        Some(self.events_frame(&news.events))
    }

    /// Returns the history so far as a frame.
    #[must_use]
    pub fn past(&self) -> String {
        format!(r#"{{"past":{}}}"#, self.past.to_json())
    }

    fn events_frame(&mut self, events: &[EventLine]) -> String {
        let texts = texts(events);
        let frame = format!(r#"{{"events":[{}]}}"#, texts.join(","));
        for text in texts {
            self.past.keep_event(text);
        }
        frame
    }
}

/// Returns the JSON text of each value. It goes into a frame and into the history.
fn texts(values: &[impl Serialize]) -> Vec<String> {
    values.iter().map(json_text).collect()
}

fn json_text(value: &impl Serialize) -> String {
    // Serialization to memory cannot fail, because all map keys are strings.
    serde_json::to_string(value).unwrap_or_default()
}
