//! The process that serves a run.

use std::process::ExitCode;
use std::time::Duration;

use analysis::export::recorded_messages;
use analysis::foxglove_messages::{Channels, LiveMessages};
use analysis::{live, open_finished};
use run_log::{LogLevel, RunLog};
use scenario::time::SimTime;
use scenario::{Problem, Setup};
use terminal::stderr_line;
use tokio::time::{Instant, sleep};

use super::channels::FoxgloveChannels;
use super::playback::{Playback, SharedPlayback};
use super::{FoxgloveCommand, OPTION};
use crate::follow::{self, EndRequests, FollowedRun, follow};

/// The interval at which a playback sends messages.
const PLAYBACK_INTERVAL: Duration = Duration::from_millis(20);

/// The time for clients to receive the last messages and to leave.
const DRAIN_TIME: Duration = Duration::from_secs(2);

/// Checks that a run can be served.
///
/// # Errors
/// Returns an error if the run cannot be followed.
pub fn check(setup: &Setup, log: LogLevel) -> Result<(), Problem> {
    live::check(setup, log, OPTION)
}

/// Serves a run. Returns the exit status.
pub fn run(name: &str, command: &FoxgloveCommand) -> ExitCode {
    follow::run(name, publish(command))
}

async fn publish(command: &FoxgloveCommand) -> anyhow::Result<()> {
    let mut ends = EndRequests::new()?;
    if !command.from_start
        && let Some(log) = open_finished(&command.folder)?
    {
        return play(&log, command, &mut ends).await;
    }
    let followed = FollowedRun {
        folder: command.folder.clone(),
        from_start: command.from_start,
        option: OPTION,
    };
    let Some(mut run) = followed.open(&mut ends).await? else {
        return Ok(());
    };
    // A process that follows from now on keeps the past to itself.
    let channels = FoxgloveChannels::new(!command.from_start);
    let mut messages = LiveMessages::new(run.setup(), channels)?;
    let name = server_name(run.setup());
    let address = command.address;
    let control = command.control.as_deref();
    let serving = messages.channels.serve(name, address, control, None);
    serving.await?;
    stderr_line!("{}", command.describe());
    let followed = follow(&mut run, &mut messages, &mut ends, |messages| {
        messages.channels.catch_up();
    });
    followed.await?;
    ends.during(messages.channels.close(DRAIN_TIME)).await;
    Ok(())
}

fn server_name(setup: &Setup) -> String {
    format!("alliance: {}", setup.scenario.name)
}

/// Serves a finished run, which clients play, until a request to end.
async fn play(
    log: &RunLog,
    command: &FoxgloveCommand,
    ends: &mut EndRequests,
) -> anyhow::Result<()> {
    if command.control.is_some() {
        let run = command.folder.display();
        let what = format!("the run {run} is over and cannot be changed");
        return Err(Problem::with_source("--control", what, "leave it out").into());
    }
    let mut channels = FoxgloveChannels::new(false);
    let messages = recorded_messages(log, &mut channels)?;
    let playback = SharedPlayback::new(Playback::new(&messages));
    let name = server_name(&log.run.setup);
    let serving = channels.serve(name, command.address, None, Some(&playback));
    serving.await?;
    stderr_line!("{} (press Ctrl-C to end)", command.describe());
    let mut last = Instant::now();
    while ends.during(sleep(PLAYBACK_INTERVAL)).await.is_some() {
        let now = Instant::now();
        let mut playback = playback.lock();
        let due = playback.advance(now - last);
        last = now;
        let (time, state) = (SimTime(playback.now_ns() / 1_000_000), playback.state());
        // A request of a client would wait for the messages.
        drop(playback);
        let is_news = due.state.is_some() || due.has_ended || channels.has_new_client();
        if let Some(places) = due.state {
            channels.forget();
            for place in places {
                channels.send(messages[place].clone());
            }
        }
        if is_news || !due.messages.is_empty() {
            for message in &messages[due.messages] {
                channels.send(message.clone());
            }
            channels.set_time(time);
        }
        if is_news {
            channels.broadcast_playback(state);
        }
    }
    channels.close(Duration::ZERO).await;
    Ok(())
}
