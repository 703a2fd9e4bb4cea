//! The bare barrier: the rate at which the same processes exchange the same messages without other work.

use std::process::{Child, Command, Stdio};

use crate::mission::Traffic;

pub fn ticks_per_s(agents: usize, traffic: &Traffic) -> f64 {
    // A run uses the same kind of endpoint.
    let folder = tempfile::tempdir().unwrap();
    let endpoint = format!("unixsock-stream/{}/sock", folder.path().display());
    let start = |arguments: String| -> Child {
        Command::new(env!("CARGO_BIN_EXE_bare-barrier"))
            .args(arguments.split(' '))
            .arg(format!("--endpoint={endpoint}"))
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let (ticks, tick_bytes) = (traffic.ticks, traffic.tick_bytes);
    let world = format!("world --agents={agents} --ticks={ticks} --tick-bytes={tick_bytes}");
    let world = start(world);
    let messages = format!(
        "--report-bytes={} --broadcast-bytes={} --broadcast-every={}",
        traffic.report_bytes, traffic.broadcast_bytes, traffic.broadcast_every
    );
    let team = (0..agents).map(|rank| start(format!("agent --rank={rank} {messages}")));
    let team: Vec<Child> = team.collect();
    let printed = world.wait_with_output().unwrap().stdout;
    for mut agent in team {
        agent.wait().unwrap();
    }
    String::from_utf8(printed).unwrap().trim().parse().unwrap()
}
