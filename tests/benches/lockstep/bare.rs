//! The bare barrier: the rate at which the same processes exchange the same messages without other work.

use std::process::{Child, Command, Stdio};

use crate::traffic::Traffic;

pub fn ticks_per_s(agents: usize, traffic: &Traffic) -> f64 {
    // A run uses the same kind of endpoint.
    let folder = tempfile::tempdir().unwrap();
    let endpoint = format!("unixsock-stream/{}/sock", folder.path().display());
    let world = start(
        "world",
        &[
            ("endpoint", &endpoint),
            ("agents", &agents),
            ("ticks", &traffic.ticks),
            ("tick-bytes", &traffic.tick_bytes),
        ],
    );
    let team: Vec<Child> = (0..agents)
        .map(|rank| {
            start(
                "agent",
                &[
                    ("endpoint", &endpoint),
                    ("rank", &rank),
                    ("report-bytes", &traffic.report_bytes),
                    ("broadcast-bytes", &traffic.broadcast_bytes),
                    ("broadcast-every", &traffic.broadcast_every),
                ],
            )
        })
        .collect();
    let printed = world.wait_with_output().unwrap().stdout;
    for mut agent in team {
        agent.wait().unwrap();
    }
    String::from_utf8(printed).unwrap().trim().parse().unwrap()
}

fn start(part: &str, options: &[(&str, &dyn std::fmt::Display)]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_bare-barrier"))
        .arg(part)
        .args(
            options
                .iter()
                .map(|(name, value)| format!("--{name}={value}")),
        )
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap()
}
