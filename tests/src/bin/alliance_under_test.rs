//! The `alliance` command, for the tests of this package. Three things are added: an agent that gets SIGUSR1 panics, as an agent
//! with a bug would; it reads scenarios of the drill, whose robots may lack any behavior; and with the environment variable `VISIT` the
//! command knows the mission of the examples, as its user's would.

// As its author wrote and formats it.
#[rustfmt::skip]
#[path = "../../../docs/examples/own-mission/src/data.rs"]
mod data;
#[rustfmt::skip]
#[path = "../../../docs/examples/own-mission/src/mind.rs"]
mod mind;
#[rustfmt::skip]
#[path = "../../../docs/examples/own-mission/src/world.rs"]
mod world;

use std::process::ExitCode;

use alliance_proto::testkit::DRILL;
use missions::{MissionParts, waste};
use nix::sys::signal::{SigSet, Signal};
use robot_agent::mission::MissionMind;
use world_server::mission::MissionWorld;

/// It can be read, and is never run.
const READ_ONLY: MissionParts = MissionParts {
    world: MissionWorld {
        data: DRILL,
        ..waste::PARTS.world
    },
    mind: MissionMind {
        data: DRILL,
        ..waste::PARTS.mind
    },
};

fn main() -> ExitCode {
    if std::env::args().nth(1).is_some_and(|part| part == "agent") {
        panic_on_signal();
    }
    let registry = launch::Registry::built_in().mission(READ_ONLY);
    launch::main(match std::env::var_os("VISIT") {
        Some(_) => registry.mission(MissionParts::of::<world::Visit, mind::Visitor>(data::VISIT)),
        None => registry,
    })
}

/// The thread does nothing but wait, so it is no concern of whoever needs to be alone in the process.
fn panic_on_signal() {
    let mut bug = SigSet::empty();
    bug.add(Signal::SIGUSR1);
    // Blocked in this thread and in all that it starts, so that the one below gets it.
    if bug.thread_block().is_ok() {
        std::thread::spawn(move || {
            if bug.wait().is_ok() {
                panic!("a bug in the agent");
            }
        });
    }
}
