//! The `alliance` command, for the tests of this package. One thing is added: an agent that gets SIGUSR1 panics, as an agent
//! with a bug would.

use std::process::ExitCode;

use nix::sys::signal::{SigSet, Signal};

fn main() -> ExitCode {
    if std::env::args().nth(1).is_some_and(|part| part == "agent") {
        panic_on_signal();
    }
    launch::main(launch::Registry::built_in())
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
