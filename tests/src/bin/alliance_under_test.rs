//! The `alliance` command for the tests of this package, with two additions.
//!
//! An agent panics on SIGUSR1, like an agent with a bug. The command reads scenarios of the drill mission, whose
//! robots may lack any behavior.

use std::process::ExitCode;

use mimalloc::MiMalloc;
use missions::{MissionParts, waste};
use nix::sys::signal::{SigSet, Signal};
use robot_agent::mission::ControllerKind;
use scenario::testkit::DRILL;
use world_server::mission::WorldKind;

/// The memory allocator of the program, so that tests of memory measure the same.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

/// The drill mission, which can be read but not run.
const READ_ONLY: MissionParts = MissionParts {
    world: WorldKind {
        data: DRILL,
        ..waste::MISSION.world
    },
    controller: ControllerKind {
        data: DRILL,
        ..waste::MISSION.controller
    },
};

fn main() -> ExitCode {
    if std::env::args().nth(2).is_some_and(|part| part == "agent") {
        panic_on_signal();
    }
    launch::main(launch::Registry::built_in().with_mission(READ_ONLY))
}

fn panic_on_signal() {
    let mut bug = SigSet::empty();
    bug.add(Signal::SIGUSR1);
    // The signal is blocked in this thread and its children, so that only the new thread receives it.
    if bug.thread_block().is_ok() {
        std::thread::spawn(move || {
            if bug.wait().is_ok() {
                panic!("a bug in the agent");
            }
        });
    }
}
