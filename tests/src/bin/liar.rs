//! A robot process that broadcasts the generated contents of [`alliance_tests::lies`]. The argument is their seed. The
//! environment names the robot and the run, as for every external controller.

use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use alliance_tests::lies::{answer, lies};
use anyhow::{Context, bail};
use cluster::rendezvous::{Rendezvous, RendezvousError};
use cluster::session;
use missions::Registry;
use proto::join::{JoinReply, JoinRequest, PROTOCOL_VERSION};
use proto::keys::KeyExpressions;
use proto::secret::Secret;
use proto::tick::ToAgent;
use robot_agent::agent::payload_bytes;
use robot_agent::args::{ROBOT, RUN};
use scenario::Setup;
use zenoh::Wait;

fn main() -> anyhow::Result<()> {
    let seed = std::env::args().nth(1).context("state a seed")?.parse()?;
    let lies = lies(seed);
    let (robot, run) = (std::env::var(ROBOT)?, std::env::var(RUN)?);
    let member = find(&run)?.member(&robot)?;
    let keys = KeyExpressions::new(&member.run);
    let secret = Secret::from_token(&member.secret);
    let token = Secret::from_token(&member.token.context("a run on this machine has a token")?);

    session::prepare_process();
    let config = zenoh::Config::from_json5(&session::client(&member.login, false));
    let bus = zenoh::open(config.map_err(anyhow::Error::msg)?).wait();
    let bus = bus.map_err(anyhow::Error::msg)?;
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
        .wait()
        .map_err(anyhow::Error::msg)?;

    let request = JoinRequest {
        version: PROTOCOL_VERSION,
        robot: robot.clone(),
        pid: std::process::id(),
        nonce: 1,
    };
    let payload = secret.seal(&keys.join(&robot), &request)?;
    let replies = bus.get(keys.join(&robot)).payload(payload).wait();
    let replies = replies.map_err(anyhow::Error::msg)?;
    let reply = replies.recv().map_err(anyhow::Error::msg)?;
    let sample = reply
        .into_result()
        .map_err(|error| anyhow::anyhow!("{error}"))?;
    let bytes = sample.payload().to_bytes();
    let welcome = match secret.open(&keys.join_answer(&robot, request.nonce), &bytes)? {
        JoinReply::Welcome(welcome) => welcome,
        JoinReply::Refused(refusal) => bail!("refused: {refusal}"),
    };
    let vocabulary = Registry::built_in().vocabulary();
    let setup = Setup::from_json(&welcome.setup, &vocabulary).map_err(anyhow::Error::msg)?;
    let bulletins = setup.catalog.mission.vocabulary().bulletins;
    let alive = secret.stamp(&keys.alive(&robot, welcome.incarnation));
    let _alive = bus.liveliness().declare_token(alive).wait();

    while let Ok(message) = from_world.recv() {
        let tick = match message {
            ToAgent::Tick(tick) | ToAgent::Informed(tick, _) => tick,
            ToAgent::End(_) | ToAgent::Dismissed(_) => break,
        };
        let (mut report, broadcasts) = answer(&lies, welcome.robot, &tick);
        report.broadcast_bytes = broadcasts.iter().map(payload_bytes).sum();
        for broadcast in &broadcasts {
            let key = keys.team(&robot, broadcast.body.kind().name(bulletins));
            let sealed = token.seal(&key, broadcast)?;
            bus.put(key, sealed).wait().map_err(anyhow::Error::msg)?;
        }
        let key = keys.report(&robot);
        let sealed = secret.seal(&key, &report)?;
        bus.put(key, sealed).wait().map_err(anyhow::Error::msg)?;
    }
    Ok(())
}

/// Waits for the run, because the launcher starts robots and world at once.
fn find(run: &str) -> Result<Rendezvous, RendezvousError> {
    let mut attempts = 0..3000;
    loop {
        match Rendezvous::find(Some(run)) {
            Err(RendezvousError::None | RendezvousError::Unknown { .. })
                if attempts.next().is_some() =>
            {
                thread::sleep(Duration::from_millis(10));
            }
            found => return found,
        }
    }
}
