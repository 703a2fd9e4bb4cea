//! A live run, as its observer hears of it. Pages get what is newest; however slow or many they are, the run does not wait.

use missions::Registry;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use alliance_proto::control::{ControlCommand, Reply};
use alliance_proto::event::EventNews;
use alliance_proto::rendezvous::{Rendezvous, User};
use alliance_proto::scenario::Setup;
use alliance_proto::tick::Outcome;
use alliance_proto::time::SimTime;
use alliance_proto::view::View;
use anyhow::{Context, bail};
use axum::extract::ws::{Message, Utf8Bytes, WebSocket};
use serde_json::{Value, json};
use tokio::sync::{broadcast, watch};
use zenoh::sample::SampleKind;

use super::about::about;
use super::past::Past;
use crate::control;
use crate::observer::Observer;

/// News that may wait for a slow page; it is told how much it has missed.
const NEWS_WAITING: usize = 1024;

/// What `GET /api/run`, the WebSocket and `POST /api/control` need.
pub struct Live {
    observer: Observer,
    about: Value,
    folder: String,
    heard: Arc<Heard>,
}

/// What has come over the bus.
struct Heard {
    memory: Mutex<Memory>,
    /// The newest view, as a frame.
    view: watch::Sender<Utf8Bytes>,
    /// Events and what has become of messages and curves, as frames.
    news: broadcast::Sender<Utf8Bytes>,
    /// Whether the run is over, and how it ended if that is known.
    over: watch::Sender<Option<Option<Outcome>>>,
    /// Whether this process leaves, though the run may go on.
    leaving: watch::Sender<bool>,
}

struct Memory {
    past: Past,
    /// Tick of the newest view, and of the newest events: what comes again later is nothing new.
    view: Option<u64>,
    events: Option<u64>,
}

impl Live {
    /// Joins a run and begins to observe it; `stays`: its log is shown at the same link afterwards.
    ///
    /// # Errors
    /// When the run cannot be reached or does not say what it is.
    pub async fn join(run: Rendezvous, stays: bool) -> anyhow::Result<Arc<Self>> {
        let observer = Observer::join(run, User::Operator).await?;
        let described = control::query(&observer, ControlCommand::Describe).await?;
        let Reply::Description(description) = described else {
            bail!("run '{}' does not say what it is", observer.run.run);
        };
        let described = "the world's description of the run";
        let vocabulary = Registry::of_this_program().vocabulary();
        let setup = Setup::from_json(&description.setup, &vocabulary)
            .map_err(anyhow::Error::msg)
            .context(described)?;
        let heard = Arc::new(Heard::new(SimTime(setup.scenario.step_ms)));

        let ears = Arc::clone(&heard);
        observer.on_events(move |news| ears.events(&news)).await?;
        let ears = Arc::clone(&heard);
        observer.on_view(move |view| ears.view(view)).await?;
        let ears = Arc::clone(&heard);
        observer
            .session
            .liveliness()
            .declare_subscriber(observer.keys.alive_world())
            .history(true)
            .callback(move |sample| {
                if sample.kind() == SampleKind::Delete {
                    ears.end(None);
                }
            })
            .background()
            .await
            .map_err(anyhow::Error::from_boxed)?;

        let folder = description.folder;
        let mut about = about("live", &observer.run.run, &folder, &setup, Value::Null);
        about["stays"] = stays.into();
        Ok(Arc::new(Self {
            observer,
            about,
            folder,
            heard,
        }))
    }

    /// What does not change.
    #[must_use]
    pub fn about(&self) -> &Value {
        &self.about
    }

    /// Until the run is over; how it ended, if that is known.
    pub async fn over(&self) -> Option<Outcome> {
        let mut over = self.heard.over.subscribe();
        // The sender lives as long as this does.
        over.wait_for(Option::is_some)
            .await
            .ok()
            .and_then(|outcome| outcome.flatten())
    }

    /// Leaves all pages.
    pub fn leave(&self) {
        self.heard.leaving.send_replace(true);
    }

    /// Until this process leaves.
    async fn left(&self) {
        let mut leaving = self.heard.leaving.subscribe();
        // The sender lives as long as this does.
        let _ = leaving.wait_for(|leaving| *leaving).await;
    }

    /// Until no page listens any more.
    pub async fn left_alone(&self) {
        self.heard.view.closed().await;
    }

    /// Asks the world something for a page.
    ///
    /// # Errors
    /// When it does not answer.
    pub async fn ask(&self, command: ControlCommand) -> anyhow::Result<Reply> {
        control::query(&self.observer, command).await
    }

    /// Tells a page everything, as fast as it takes it, until it goes or the run ends.
    pub async fn tell(&self, mut page: WebSocket) {
        let mut view = self.heard.view.subscribe();
        view.mark_changed();
        let (past, mut news) = self.heard.catch_up();
        if page.send(Message::Text(past)).await.is_err() {
            return;
        }
        loop {
            let frame = tokio::select! {
                // The order says what is told first: nothing that is known is left out when the run ends.
                biased;
                said = page.recv() => match said {
                    Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                    // A page has nothing to say here.
                    Some(Ok(_)) => continue,
                },
                said = news.recv() => match said {
                    Ok(said) => said,
                    Err(broadcast::error::RecvError::Lagged(count)) => {
                        json!({"missed": count}).to_string().into()
                    }
                    Err(broadcast::error::RecvError::Closed) => return,
                },
                Ok(()) = view.changed() => {
                    let view = view.borrow_and_update().clone();
                    if view.is_empty() {
                        // None has come yet.
                        continue;
                    }
                    view
                }
                () = self.left() => {
                    let _ = page.send(Message::Close(None)).await;
                    return;
                }
                outcome = self.over() => {
                    let ended = json!({"ended": {"outcome": outcome, "folder": self.folder}});
                    // It may be gone already.
                    let _ = page.send(Message::Text(ended.to_string().into())).await;
                    if page.send(Message::Close(None)).await.is_ok() {
                        // A page that answers has all that was sent before.
                        while let Some(Ok(_)) = page.recv().await {}
                    }
                    return;
                }
            };
            if page.send(Message::Text(frame)).await.is_err() {
                return;
            }
        }
    }
}

impl Heard {
    /// Nothing yet, of a run with this step.
    fn new(step: SimTime) -> Self {
        Self {
            memory: Mutex::new(Memory {
                past: Past::new(step),
                view: None,
                events: None,
            }),
            view: watch::Sender::default(),
            news: broadcast::Sender::new(NEWS_WAITING),
            over: watch::Sender::default(),
            leaving: watch::Sender::default(),
        }
    }

    /// The newest view wins; what has become of messages and curves does not come twice, and so goes its own way.
    fn view(&self, mut view: View) {
        let mut memory = self.memory();
        if memory.view.is_some_and(|newest| view.tick < newest) {
            return;
        }
        memory.view = Some(view.tick);
        let messages = std::mem::take(&mut view.messages);
        let left_out = std::mem::take(&mut view.messages_left_out);
        if !messages.is_empty() || left_out > 0 {
            for message in &messages {
                memory.past.keep_message(json!(message).to_string());
            }
            memory.past.leave_messages_out(left_out);
            let frame = json!({"messages": {"receptions": messages, "left_out": left_out}});
            // While the lock is held, as with events.
            let _ = self.news.send(frame.to_string().into());
        }
        let bends = std::mem::take(&mut view.bends);
        if !bends.is_empty() {
            for bend in &bends {
                memory.past.keep_bend(json!(bend).to_string());
            }
            let _ = self.news.send(json!({"bends": bends}).to_string().into());
        }
        // Its maps have string keys and it goes to memory, so nothing is left to fail.
        let text = serde_json::to_string(&view).unwrap_or_default();
        memory.past.keep_view(view.now, &text);
        self.view
            .send_replace(format!(r#"{{"view":{text}}}"#).into());
        drop(memory);
        if view.outcome.is_some() {
            self.end(view.outcome);
        }
    }

    fn events(&self, news: &EventNews) {
        let mut memory = self.memory();
        if memory.events.is_some_and(|newest| news.tick <= newest) {
            return;
        }
        memory.events = Some(news.tick);
        for event in &news.events {
            memory.past.keep_event(json!(event).to_string());
        }
        let frame = json!({"events": news.events}).to_string();
        // While the lock is held: who catches up gets it there or here, and not twice. Nobody may be listening.
        let _ = self.news.send(frame.into());
    }

    fn end(&self, outcome: Option<Outcome>) {
        self.over.send_if_modified(|over| {
            let first = over.is_none();
            over.get_or_insert(outcome);
            first
        });
    }

    /// What has been, as a frame, and what comes from now on.
    fn catch_up(&self) -> (Utf8Bytes, broadcast::Receiver<Utf8Bytes>) {
        let memory = self.memory();
        let past = format!(r#"{{"past":{}}}"#, memory.past.to_json());
        (past.into(), self.news.subscribe())
    }

    /// A panic ends the process, so a poisoned lock is never seen.
    fn memory(&self) -> MutexGuard<'_, Memory> {
        self.memory.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use alliance_proto::event::EventLine;
    use alliance_proto::ids::{BehaviorId, RobotId};
    use alliance_proto::telemetry::BehaviorState;
    use alliance_proto::view::Bend;
    use tokio::sync::broadcast::error::TryRecvError;

    use super::*;

    fn view(tick: u64, outcome: Option<Outcome>) -> View {
        View {
            tick,
            now: SimTime(50 * tick),
            outcome,
            ..View::default()
        }
    }

    fn news(tick: u64) -> EventNews {
        EventNews {
            tick,
            events: vec![EventLine {
                t_ms: SimTime(50 * tick),
                kind: "picked".to_owned(),
                robot: "gold".to_owned(),
                subject: format!("item-{tick}"),
                reason: String::new(),
                detail: String::new(),
            }],
        }
    }

    fn tick_of(frame: &str) -> u64 {
        let frame: Value = serde_json::from_str(frame).unwrap();
        frame["view"]["tick"].as_u64().unwrap()
    }

    #[test]
    fn a_slow_page_gets_the_newest_view_and_is_told_what_it_has_missed() {
        let heard = Heard::new(SimTime(50));
        let slow = heard.view.subscribe();
        let (_, mut events) = heard.catch_up();
        let ticks = NEWS_WAITING as u64 + 10;
        for tick in 0..ticks {
            heard.view(view(tick, None));
            heard.events(&news(tick));
        }
        assert_eq!(tick_of(&slow.borrow()), ticks - 1);
        assert_eq!(events.try_recv(), Err(TryRecvError::Lagged(10)));
        let next: Value = serde_json::from_str(&events.try_recv().unwrap()).unwrap();
        assert_eq!(next["events"][0]["subject"], "item-10");
    }

    #[test]
    fn what_is_put_again_is_no_news() {
        let heard = Heard::new(SimTime(50));
        let (_, mut events) = heard.catch_up();
        heard.view(view(7, None));
        heard.view(view(3, None));
        assert_eq!(tick_of(&heard.view.subscribe().borrow()), 7);
        for tick in [7, 7, 3] {
            heard.events(&news(tick));
        }
        assert!(events.try_recv().is_ok());
        assert_eq!(events.try_recv(), Err(TryRecvError::Empty));
    }

    #[test]
    fn corners_of_curves_are_in_no_view_and_lost_with_none() {
        let heard = Heard::new(SimTime(50));
        let (_, mut news) = heard.catch_up();
        for tick in 0..3 {
            let bend = Bend {
                robot: RobotId(0),
                set: BehaviorId(1),
                at: SimTime(50 * tick),
                level: 7.5,
                state: BehaviorState::Waiting,
                last: false,
            };
            heard.view(View {
                bends: vec![bend],
                ..view(tick, None)
            });
        }
        let shown: Value = serde_json::from_str(&heard.view.subscribe().borrow()).unwrap();
        assert_eq!(shown["view"]["bends"], json!([]));
        for tick in 0..3 {
            let told: Value = serde_json::from_str(&news.try_recv().unwrap()).unwrap();
            assert_eq!(
                told["bends"],
                json!([{"robot": 0, "set": 1, "at": 50 * tick, "level": 7.5, "state": "Waiting", "last": false}])
            );
        }
        let (past, _) = heard.catch_up();
        let past: Value = serde_json::from_str(&past).unwrap();
        assert_eq!(past["past"]["bends"].as_array().unwrap().len(), 3);
    }

    #[test]
    fn who_comes_later_gets_each_event_once() {
        let heard = Heard::new(SimTime(50));
        heard.events(&news(1));
        let (past, mut events) = heard.catch_up();
        heard.events(&news(2));
        let past: Value = serde_json::from_str(&past).unwrap();
        let subjects: Vec<&Value> = past["past"]["events"]
            .as_array()
            .unwrap()
            .iter()
            .map(|event| &event["subject"])
            .collect();
        assert_eq!(subjects, ["item-1"]);
        assert!(events.try_recv().unwrap().contains("item-2"));
        assert_eq!(events.try_recv(), Err(TryRecvError::Empty));
    }

    #[test]
    fn a_run_ends_once_and_its_outcome_is_not_forgotten() {
        let heard = Heard::new(SimTime(50));
        let over = heard.over.subscribe();
        assert_eq!(*over.borrow(), None);
        heard.view(view(9, Some(Outcome::Complete)));
        // The world's token goes a little later.
        heard.end(None);
        assert_eq!(*over.borrow(), Some(Some(Outcome::Complete)));
    }
}
