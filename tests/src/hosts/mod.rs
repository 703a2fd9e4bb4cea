//! Several machines for a test: hosts `h1` … `hN` at 10.0.0.1 … N. Each is a network namespace on a switch that
//! simulates unplugged cables, partitions, loss and delay.
//!
//! A test begins with `let Some(hosts) = Hosts::enter(3) else { return };`. The test is then repeated in new
//! namespaces, where it continues after this line. Processes, interfaces and mounts end with the test. The hosts have
//! no route to other networks.

#![allow(clippy::unwrap_used)] // An error here fails the test.

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

pub struct Hosts {
    names: Vec<String>,
    switch: Switch,
}

impl Hosts {
    /// Returns `count` hosts inside the namespaces. Outside, repeats the test inside and returns `None`. Skips the
    /// test if namespaces are not available.
    ///
    /// # Panics
    /// Panics if the test fails inside, or if tests may not be skipped.
    #[track_caller]
    pub fn enter(count: u8) -> Option<Self> {
        if isolation::is_inside() {
            return Some(Self::connected(count));
        }
        match isolation::unshare_options() {
            Err(reason) => cannot_run(&format!(
                "no hosts in network namespaces ({reason}): install Debian's `iproute2` and `util-linux`, and let this user make namespaces \
                 and open /dev/net/tun"
            )),
            Ok(options) => {
                let thread = thread::current();
                let test = thread.name().expect("libtest names threads by tests");
                if let Err(output) = isolation::run(options, test) {
                    panic!("among {count} hosts: {output}");
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
            // IPv6 would send unsolicited frames. The file is missing on a kernel without IPv6.
            within(name, || {
                fs::write("/proc/sys/net/ipv6/conf/all/disable_ipv6", "1")
            })
            .ok();
            ip(&format!("link set {name} netns {name} name eth0"));
            // The switch uses the last byte of the address.
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

    pub fn address(&self, host: &str) -> Ipv4Addr {
        Ipv4Addr::new(10, 0, 0, self.index(host) as u8 + 1)
    }

    /// Returns a command for a program on a host, with the host's own runtime folder. The process id is that of the
    /// program.
    pub fn command(&self, host: &str, program: impl AsRef<OsStr>) -> Command {
        self.index(host);
        let mut command = Command::new("ip");
        command
            .args(["netns", "exec", host])
            .arg(program)
            .env("XDG_RUNTIME_DIR", runtime(host));
        command
    }

    /// Runs a closure on a host, in a new thread. Sockets that it creates belong to the host.
    pub fn within<T: Send>(&self, host: &str, act: impl FnOnce() -> T + Send) -> T {
        self.index(host);
        within(host, act)
    }

    /// Unplugs a host's cable. The interface of the host detects it.
    pub fn unplug(&self, host: &str) {
        self.switch.wires().unplugged.insert(self.index(host));
        ip(&format!("-n {host} link set eth0 carrier off"));
    }

    pub fn plug(&self, host: &str) {
        ip(&format!("-n {host} link set eth0 carrier on"));
        self.switch.wires().unplugged.remove(&self.index(host));
    }

    /// Drops all frames from one host to another. The opposite direction stays open, and no interface detects it.
    pub fn cut(&self, from: &str, to: &str) {
        let direction = (self.index(from), self.index(to));
        self.switch.wires().cut.insert(direction);
    }

    pub fn heal(&self) {
        self.switch.wires().cut.clear();
    }

    /// Sets the percentage of lost frames. Each frame is drawn separately.
    pub fn lose(&self, percent: f64) {
        self.switch.wires().loss = percent / 100.0;
    }

    /// Sets the delay of frames in each direction.
    pub fn delay(&self, delay: Duration) {
        self.switch.wires().delay = delay;
    }

    /// Returns the counts of all frames so far.
    pub fn frames(&self) -> Frames {
        self.switch.wires().frames
    }

    fn index(&self, host: &str) -> usize {
        let found = self.names.iter().position(|name| name == host);
        found.unwrap_or_else(|| panic!("no host '{host}' among {:?}", self.names))
    }
}

/// The folder in which iproute2 keeps its namespaces.
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

fn ip(arguments: &str) {
    let output = Command::new("ip").args(arguments.split(' ')).output();
    let output = output.unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "ip {arguments}: {stderr}");
}
