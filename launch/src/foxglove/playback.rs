//! The playback of a finished run: clients play, pause, seek and set the speed for all clients.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use analysis::foxglove_messages::Message;
use foxglove::websocket::{PlaybackCommand, PlaybackControlRequest, PlaybackState, PlaybackStatus};

/// The largest speed, relative to real time.
const MAX_SPEED: f32 = 1000.0;

/// The position of the playback among the messages of a run.
#[derive(Debug)]
pub struct Playback {
    /// The time of each message, ns, in order.
    times_ns: Vec<u64>,
    /// The channel of each message.
    channels: Vec<u16>,
    /// The number of messages that have been sent.
    sent: usize,
    now_ns: u64,
    end_ns: u64,
    /// The speed relative to real time, above 0.
    speed: f32,
    is_playing: bool,
    /// `true` if a client has changed the time, and the state at that time has not been sent.
    is_moved: bool,
}

/// A playback that clients control while it runs.
#[derive(Clone)]
pub struct SharedPlayback(Arc<Mutex<Playback>>);

impl SharedPlayback {
    pub fn new(playback: Playback) -> Self {
        Self(Arc::new(Mutex::new(playback)))
    }

    pub fn lock(&self) -> MutexGuard<'_, Playback> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The messages to send next, as places among all messages.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Due {
    /// The state after a change of the time: the latest message of each channel. `None` without a change.
    pub state: Option<Vec<usize>>,
    /// The messages whose time has come.
    pub messages: Range<usize>,
    /// `true` if the playback has just reached its end.
    pub has_ended: bool,
}

impl Playback {
    /// Creates a playback that stands at time 0. The messages are in order of time.
    pub fn new(messages: &[Message]) -> Self {
        let times_ns: Vec<u64> = messages.iter().map(Message::time_ns).collect();
        Self {
            end_ns: times_ns.last().copied().unwrap_or(0),
            times_ns,
            channels: messages.iter().map(|message| message.channel).collect(),
            sent: 0,
            now_ns: 0,
            speed: 1.0,
            is_playing: false,
            is_moved: true,
        }
    }

    /// Returns the current time, ns.
    pub fn now_ns(&self) -> u64 {
        self.now_ns
    }

    /// Returns the time of the last message, ns.
    pub fn end_ns(&self) -> u64 {
        self.end_ns
    }

    /// Lets wall-clock time pass.
    pub fn advance(&mut self, elapsed: Duration) -> Due {
        let mut due = Due::default();
        if std::mem::take(&mut self.is_moved) {
            self.sent = self.count_until_now();
            due.state = Some(self.state_messages());
        } else if self.is_playing {
            let step_ns = elapsed.as_nanos() as f64 * f64::from(self.speed);
            self.now_ns = self.now_ns.saturating_add(step_ns as u64).min(self.end_ns);
        }
        let count = self.count_until_now();
        due.messages = self.sent..count;
        self.sent = count;
        if self.is_playing && self.now_ns == self.end_ns {
            self.is_playing = false;
            due.has_ended = true;
        }
        due
    }

    fn count_until_now(&self) -> usize {
        self.times_ns.partition_point(|at| *at <= self.now_ns)
    }

    /// Returns the latest message of each channel, in order of time.
    fn state_messages(&self) -> Vec<usize> {
        let sent = self.channels[..self.sent].iter().enumerate();
        let latest: BTreeMap<u16, usize> = sent.map(|(place, channel)| (*channel, place)).collect();
        let mut places: Vec<usize> = latest.into_values().collect();
        places.sort_unstable();
        places
    }

    /// Executes a request, and returns the new state. A speed that is no positive number changes nothing, and a time beyond
    /// the end is the end.
    pub fn control(&mut self, request: &PlaybackControlRequest) -> PlaybackState {
        if request.playback_speed.is_finite() && request.playback_speed > 0.0 {
            self.speed = request.playback_speed.min(MAX_SPEED);
        }
        if let Some(time_ns) = request.seek_time {
            self.now_ns = time_ns.min(self.end_ns);
            self.is_moved = true;
        }
        self.is_playing = match request.playback_command {
            PlaybackCommand::Play => self.now_ns < self.end_ns,
            PlaybackCommand::Pause => false,
        };
        PlaybackState {
            did_seek: request.seek_time.is_some(),
            ..self.state()
        }
    }

    /// Returns the state for clients.
    pub fn state(&self) -> PlaybackState {
        let status = match self.is_playing {
            true => PlaybackStatus::Playing,
            false if self.now_ns == self.end_ns => PlaybackStatus::Ended,
            false => PlaybackStatus::Paused,
        };
        PlaybackState {
            status,
            current_time: self.now_ns,
            playback_speed: self.speed,
            did_seek: false,
            request_id: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use scenario::time::SimTime;

    use super::*;

    /// The times of the messages, ms, and their channels.
    const MESSAGES: [(u64, u16); 5] = [(0, 0), (0, 1), (50, 0), (100, 0), (100, 2)];

    fn playback() -> Playback {
        let messages = MESSAGES.map(|(at, channel)| Message {
            at: SimTime(at),
            channel,
            bytes: Vec::new(),
        });
        Playback::new(&messages)
    }

    fn request(
        playback: &mut Playback,
        command: PlaybackCommand,
        speed: f32,
        seek_ms: Option<u64>,
    ) -> PlaybackState {
        playback.control(&PlaybackControlRequest {
            playback_command: command,
            playback_speed: speed,
            seek_time: seek_ms.map(|time| time * 1_000_000),
            request_id: "a".to_owned(),
        })
    }

    fn after(playback: &mut Playback, elapsed_ms: u64) -> Due {
        playback.advance(Duration::from_millis(elapsed_ms))
    }

    #[test]
    fn a_playback_begins_with_its_state_and_stands() {
        let mut playback = playback();
        let due = after(&mut playback, 20);
        assert_eq!((due.state, due.messages), (Some(vec![0, 1]), 2..2));
        assert_eq!(after(&mut playback, 1000).messages, 2..2);
        assert_eq!(playback.state().status, PlaybackStatus::Paused);
    }

    #[test]
    fn messages_follow_at_the_speed_until_the_end() {
        let mut playback = playback();
        after(&mut playback, 20);
        let state = request(&mut playback, PlaybackCommand::Play, 2.0, None);
        assert_eq!(state.status, PlaybackStatus::Playing);
        assert_eq!(after(&mut playback, 20).messages, 2..2);
        assert_eq!(after(&mut playback, 5).messages, 2..3);
        let due = after(&mut playback, 1000);
        assert_eq!((due.messages, due.has_ended), (3..5, true));
        assert_eq!(playback.state().status, PlaybackStatus::Ended);
        assert_eq!(
            after(&mut playback, 1000),
            Due {
                messages: 5..5,
                ..Due::default()
            }
        );
        // There is nothing to play at the end.
        let state = request(&mut playback, PlaybackCommand::Play, 1.0, None);
        assert_eq!(state.status, PlaybackStatus::Ended);
    }

    #[test]
    fn a_change_of_the_time_sends_the_state_there() {
        let mut playback = playback();
        let state = request(&mut playback, PlaybackCommand::Pause, 1.0, Some(70));
        assert!(state.did_seek && state.current_time == 70_000_000);
        let due = after(&mut playback, 20);
        assert_eq!((due.state, due.messages), (Some(vec![1, 2]), 3..3));
        let state = request(
            &mut playback,
            PlaybackCommand::Play,
            1.0,
            Some(u64::MAX / 1_000_000),
        );
        assert_eq!(
            (state.status, state.current_time),
            (PlaybackStatus::Ended, 100_000_000)
        );
        assert_eq!(after(&mut playback, 20).state, Some(vec![1, 3, 4]));
        // Backward.
        request(&mut playback, PlaybackCommand::Play, 1.0, Some(0));
        assert_eq!(after(&mut playback, 20).state, Some(vec![0, 1]));
        assert_eq!(after(&mut playback, 50).messages, 2..3);
    }

    #[test]
    fn impossible_speeds_change_nothing() {
        let mut playback = playback();
        for speed in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            let state = request(&mut playback, PlaybackCommand::Pause, speed, None);
            assert_eq!(state.playback_speed, 1.0);
        }
        let state = request(&mut playback, PlaybackCommand::Pause, 1e9, None);
        assert_eq!(state.playback_speed, MAX_SPEED);
    }
}
