//! A robot process that deviates from its protocol. Its argument states how:
//! - a number: it broadcasts the generated contents of [`alliance_tests::lies`] with this seed;
//! - `reports`: its broadcasts are true, and its reports list other broadcasts;
//! - `stopped`: everything is true, but the news of a stop of the process precedes a report.
//!
//! The environment names the robot and the run, as for every external controller.

use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use alliance_tests::lies::{answer, heartbeat, lies};
use alliance_tests::operator::{connect, join};
use anyhow::Context;
use cluster::rendezvous::{ConnectionRole, Rendezvous, RendezvousError};
use cluster::session;
use missions::Registry;
use proto::join::{JoinReply, JoinRequest, PROTOCOL_VERSION};
use proto::keys::{KeyExpressions, LAUNCHER_HOST};
use proto::process::{ProcessNews, ProcessState};
use proto::secret::Secret;
use proto::tick::ToAgent;
use robot_agent::agent::payload_bytes;
use robot_agent::args::{ROBOT, RUN};
use scenario::Setup;
use zenoh::{Result, Wait};

/// The tick before whose report the process seems to stop.
const STOP_TICK: u64 = 100;

/// The wall-clock time for which it seems to be stopped.
const STOP: Duration = Duration::from_secs(1);

fn main() -> Result<()> {
    let kind = std::env::args().nth(1).context("state a seed")?;
    let (has_false_reports, seems_stopped) = (kind == "reports", kind == "stopped");
    let lies = if has_false_reports || seems_stopped {
        vec![heartbeat()]
    } else {
        lies(kind.parse()?)
    };
    let (robot, run) = (std::env::var(ROBOT)?, find(&std::env::var(RUN)?)?);
    let keys = KeyExpressions::new(&run.run);
    let secret = Secret::of_robot(&run.token, &robot);

    session::prepare_process();
    let bus = connect(&run, ConnectionRole::Team);
    let (sender, from_world) = mpsc::sync_channel(64);
    let (opener, key) = (secret.clone(), keys.tick(&robot));
    bus.declare_subscriber(key.clone())
        .callback(move |sample| {
            if let Ok(message) = opener.open::<ToAgent>(&key, &sample.payload().to_bytes()) {
                // The receiver is dropped only when the process ends.
                let _ = sender.send(message);
            }
        })
        .background()
        .wait()?;

    let request = JoinRequest {
        version: PROTOCOL_VERSION,
        robot: robot.clone(),
        pid: std::process::id(),
        nonce: 1,
    };
    let welcome = match join(&bus, &run, &request, None) {
        JoinReply::Welcome(welcome) => welcome,
        JoinReply::Refused(refusal) => return Err(format!("refused: {refusal}").into()),
    };
    let vocabulary = Registry::built_in().vocabulary();
    let setup = Setup::from_json(&welcome.setup, &vocabulary)?;
    let bulletins = setup.catalog.mission.vocabulary().bulletins;
    let alive = secret.stamp(&keys.alive(&robot, welcome.incarnation));
    let _alive = bus.liveliness().declare_token(alive).wait();

    let report_state = |number, state| -> Result<()> {
        let news = ProcessNews {
            number,
            robot: robot.clone(),
            pid: request.pid,
            state,
        };
        let key = keys.process(LAUNCHER_HOST);
        let sealed = Secret::from_token(&run.token).seal(&key, &news)?;
        bus.put(key, sealed).wait()
    };

    while let Ok(message) = from_world.recv() {
        let tick = match message {
            ToAgent::Tick { tick, .. } => tick,
            ToAgent::End(_) | ToAgent::Dismissed(_) => break,
        };
        let (mut report, broadcasts) = answer(&lies, welcome.robot, &tick);
        report.broadcast_bytes = broadcasts.iter().map(payload_bytes).sum();
        let lists_more = has_false_reports && tick.tick % 4 == 1;
        report.broadcasts += u16::from(lists_more);
        let send_report = || -> Result<()> {
            let key = keys.report(&robot);
            let sealed = secret.seal(&key, &report)?;
            bus.put(key, sealed).wait()
        };
        let is_stopped = seems_stopped && tick.tick == STOP_TICK;
        if is_stopped {
            // Above the numbers of the launcher's own news, which the world then ignores.
            report_state(1_000, ProcessState::Stopped)?;
        }
        let is_early = has_false_reports && tick.tick % 4 == 3;
        if is_early {
            send_report()?;
        }
        for broadcast in &broadcasts {
            let key = keys.team(&robot, broadcast.body.kind().name(bulletins));
            let sealed = secret.seal(&key, broadcast)?;
            bus.put(key, sealed).wait()?;
        }
        if !is_early {
            send_report()?;
        }
        if is_stopped {
            thread::sleep(STOP);
            report_state(1_001, ProcessState::Continued)?;
        }
    }
    Ok(())
}

/// Waits for the run, because the launcher starts robots and world at once.
fn find(run: &str) -> std::result::Result<Rendezvous, RendezvousError> {
    for _ in 0..3000 {
        match Rendezvous::find(Some(run)) {
            Err(RendezvousError::None | RendezvousError::Unknown { .. }) => {
                thread::sleep(Duration::from_millis(10));
            }
            found => return found,
        }
    }
    Rendezvous::find(Some(run))
}
