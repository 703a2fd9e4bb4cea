//! Several machines for a test: hosts `h1` … `hN` at 10.0.0.1 … N, each a network namespace, on a switch that can do what networks do:
//! cables that are pulled, partitions one way or both, loss and delay.
//!
//! A test begins with `let Some(hosts) = Hosts::enter(3) else { return };`. It is then run once more in namespaces of its own, and what
//! follows that line happens in there. All of it ends with the test: processes, interfaces and mounts. No route leads out.

#![allow(clippy::unwrap_used)] // What fails here fails the test.

mod isolation;
mod switch;
#[cfg(test)]
mod tests;

use std::ffi::OsStr;
use std::fs::{self, DirBuilder, File};
use std::net::Ipv4Addr;
use std::os::unix::fs::DirBuilderExt;
use std::process::Command;
use std::thread;
use std::time::Duration;

use nix::sched::{CloneFlags, setns};

use crate::needs::cannot_run;
pub use switch::Frames;
use switch::Switch;

/// The hosts of one test.
pub struct Hosts {
    names: Vec<String>,
    switch: Switch,
}

impl Hosts {
    /// So many hosts, where the test has been run once more inside; `None` where that has been done, or cannot be done here.
    ///
    /// # Panics
    /// If the test fails inside, or must not be left out.
    #[track_caller]
    pub fn enter(count: u8) -> Option<Self> {
        if isolation::is_inside() {
            return Some(Self::connected(count));
        }
        match isolation::way() {
            Err(why) => cannot_run(&format!(
                "no hosts in network namespaces ({why}): install Debian's `iproute2` and `util-linux`, and let this user make namespaces \
                 and open /dev/net/tun"
            )),
            Ok(way) => {
                let thread = thread::current();
                let test = thread.name().expect("libtest names threads by tests");
                if let Err(said) = isolation::run(way, test) {
                    panic!("among {count} hosts: {said}");
                }
            }
        }
        None
    }

    fn connected(count: u8) -> Self {
        ip("link set lo up");
        let names: Vec<_> = (1..=count).map(|number| format!("h{number}")).collect();
        let switch = Switch::start(&names);
        for (number, name) in (1..).zip(&names) {
            ip(&format!("netns add {name}"));
            // Without IPv6, which sends frames that nobody has asked for. Where the kernel has none, this is not there.
            within(name, || {
                fs::write("/proc/sys/net/ipv6/conf/all/disable_ipv6", "1")
            })
            .ok();
            ip(&format!("link set {name} netns {name} name eth0"));
            // The switch goes by the last byte.
            ip(&format!(
                "-n {name} link set eth0 address 02:00:00:00:00:{number:02x} up"
            ));
            ip(&format!("-n {name} link set lo up"));
            ip(&format!(
                "-n {name} address add 10.0.0.{number}/24 dev eth0"
            ));
            let mut private = DirBuilder::new();
            private.mode(0o700).create(runtime(name)).unwrap();
        }
        Self { names, switch }
    }

    /// Where a host is reached.
    pub fn address(&self, host: &str) -> Ipv4Addr {
        Ipv4Addr::new(10, 0, 0, self.index(host) as u8 + 1)
    }

    /// A program on a host, with the host's own runtime folder. Its process id is that of the program.
    pub fn command(&self, host: &str, program: impl AsRef<OsStr>) -> Command {
        self.index(host);
        let mut command = Command::new("ip");
        command
            .args(["netns", "exec", host])
            .arg(program)
            .env("XDG_RUNTIME_DIR", runtime(host));
        command
    }

    /// Does something on a host, in a thread: sockets that are made there are the host's, and stay it.
    pub fn within<T: Send>(&self, host: &str, act: impl FnOnce() -> T + Send) -> T {
        self.index(host);
        within(host, act)
    }

    /// Pulls a host's cable; its interface tells it so.
    pub fn unplug(&self, host: &str) {
        self.switch.wires().unplugged.insert(self.index(host));
        ip(&format!("-n {host} link set eth0 carrier off"));
    }

    /// Puts the cable back.
    pub fn plug(&self, host: &str) {
        ip(&format!("-n {host} link set eth0 carrier on"));
        self.switch.wires().unplugged.remove(&self.index(host));
    }

    /// From now on nothing gets from one host to another; the way back stays. No interface tells.
    pub fn cut(&self, from: &str, to: &str) {
        let way = (self.index(from), self.index(to));
        self.switch.wires().cut.insert(way);
    }

    /// Undoes all cuts.
    pub fn heal(&self) {
        self.switch.wires().cut.clear();
    }

    /// From now on so many of 100 frames are lost, drawn one by one.
    pub fn lose(&self, percent: f64) {
        self.switch.wires().loss = percent / 100.0;
    }

    /// From now on frames take so long, each way.
    pub fn delay(&self, delay: Duration) {
        self.switch.wires().delay = delay;
    }

    /// What has become of all frames so far.
    pub fn frames(&self) -> Frames {
        self.switch.wires().frames
    }

    fn index(&self, host: &str) -> usize {
        let found = self.names.iter().position(|name| name == host);
        found.unwrap_or_else(|| panic!("no host '{host}' among {:?}", self.names))
    }
}

/// Where iproute2 keeps its namespaces.
const NAMESPACES: &str = "/run/netns";

fn runtime(host: &str) -> String {
    format!("/run/{host}")
}

fn within<T: Send>(host: &str, act: impl FnOnce() -> T + Send) -> T {
    let namespace = File::open(format!("{NAMESPACES}/{host}")).unwrap();
    let done = thread::scope(|scope| {
        let inside = scope.spawn(|| {
            setns(namespace, CloneFlags::CLONE_NEWNET).unwrap();
            act()
        });
        inside.join()
    });
    done.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

/// One command of iproute2.
fn ip(arguments: &str) {
    let said = Command::new("ip").args(arguments.split(' ')).output();
    let said = said.unwrap();
    let why = String::from_utf8_lossy(&said.stderr);
    assert!(said.status.success(), "ip {arguments}: {why}");
}
