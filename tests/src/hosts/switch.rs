//! A switch in user space: every frame between hosts passes through it, and can be lost or delayed.

#![allow(clippy::disallowed_methods)] // A delay uses the real clock.

use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::fd::AsRawFd;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread;
use std::time::{Duration, Instant};

use nix::libc::{IFF_NO_PI, IFF_TAP, TUNSETIFF, ifreq};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// The maximum number of frames in flight. A sender blocks above it.
const IN_FLIGHT: usize = 1 << 16;

pub struct Switch {
    inner: Arc<Inner>,
}

struct Inner {
    /// The switch's end of each cable.
    cables: Vec<File>,
    wires: Mutex<Wires>,
}

/// The state of the network. Hosts are indices.
pub struct Wires {
    pub unplugged: BTreeSet<usize>,
    /// The blocked directions: sender and receiver.
    pub cut: BTreeSet<(usize, usize)>,
    /// The probability of the loss of a frame.
    pub loss: f64,
    pub delay: Duration,
    pub frames: Frames,
    draws: ChaCha8Rng,
}

/// The counts of frames. A broadcast counts once per receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Frames {
    /// Frames that were delivered or are in flight.
    pub passed: u64,
    pub lost: u64,
    /// Frames that were dropped at an unplugged cable or a cut.
    pub stopped: u64,
}

/// A frame in flight, with the time of its delivery.
struct Late {
    due: Instant,
    to: usize,
    frame: Vec<u8>,
}

impl Switch {
    /// Creates a switch with one interface per name in the present namespace.
    pub fn start(names: &[String]) -> Self {
        let cables = names.iter().map(|name| tap(name).unwrap()).collect();
        let wires = Wires {
            unplugged: BTreeSet::new(),
            cut: BTreeSet::new(),
            loss: 0.0,
            delay: Duration::ZERO,
            frames: Frames::default(),
            draws: ChaCha8Rng::seed_from_u64(7),
        };
        let wires = Mutex::new(wires);
        let inner = Arc::new(Inner { cables, wires });
        // The delay is the same for all frames, so they arrive in order.
        let (later, late) = sync_channel(IN_FLIGHT);
        let delivering = Arc::clone(&inner);
        thread::spawn(move || delivering.deliver(&late));
        for from in 0..names.len() {
            let (switching, later) = (Arc::clone(&inner), later.clone());
            thread::spawn(move || switching.forward(from, &later));
        }
        Self { inner }
    }

    /// Returns the state of the network, for reading and changing.
    pub fn wires(&self) -> MutexGuard<'_, Wires> {
        self.inner.wires.lock().unwrap()
    }
}

impl Inner {
    /// Forwards the frames of a host.
    fn forward(&self, from: usize, later: &SyncSender<Late>) {
        let mut frame = [0; 2048];
        while let Ok(length) = (&self.cables[from]).read(&mut frame) {
            let frame = &frame[..length];
            // The last byte of the address selects a host. A group address selects all hosts.
            let group = frame[0] & 1 == 1;
            for to in 0..self.cables.len() {
                if to == from || !(group || usize::from(frame[5]) == to + 1) {
                    continue;
                }
                match self.wires.lock().unwrap().delivery(from, to) {
                    None => {}
                    Some(Duration::ZERO) => self.hand_over(to, frame),
                    Some(delay) => {
                        let due = Instant::now() + delay;
                        let frame = frame.to_vec();
                        let _ = later.send(Late { due, to, frame });
                    }
                }
            }
        }
    }

    fn deliver(&self, late: &Receiver<Late>) {
        for Late { due, to, frame } in late {
            thread::sleep(due.saturating_duration_since(Instant::now()));
            self.hand_over(to, &frame);
        }
    }

    fn hand_over(&self, to: usize, frame: &[u8]) {
        // The write fails if the host has shut down its interface. The frame is then lost.
        let _ = (&self.cables[to]).write(frame);
    }
}

impl Wires {
    /// Returns the delay of the next frame, or `None` if it is lost.
    fn delivery(&mut self, from: usize, to: usize) -> Option<Duration> {
        let is_unplugged = [from, to].iter().any(|host| self.unplugged.contains(host));
        if is_unplugged || self.cut.contains(&(from, to)) {
            self.frames.stopped += 1;
            return None;
        }
        if self.loss > 0.0 && self.draws.random_bool(self.loss) {
            self.frames.lost += 1;
            return None;
        }
        self.frames.passed += 1;
        Some(self.delay)
    }
}

/// Creates an interface. The returned file reads and writes its frames.
fn tap(name: &str) -> io::Result<File> {
    nix::ioctl_write_ptr_bad!(attach, TUNSETIFF, ifreq);
    let tap = OpenOptions::new()
        .read(true)
        .write(true)
        .open("/dev/net/tun")?;
    // SAFETY: an ifreq contains only numbers, for which zero is valid.
    #[allow(unsafe_code)]
    let mut request: ifreq = unsafe { std::mem::zeroed() };
    for (to, from) in request.ifr_name.iter_mut().zip(name.bytes()) {
        *to = from as _;
    }
    request.ifr_ifru.ifru_flags = (IFF_TAP | IFF_NO_PI) as _;
    // SAFETY: TUNSETIFF reads an ifreq, which is valid during the call.
    #[allow(unsafe_code)]
    unsafe { attach(tap.as_raw_fd(), &request) }?;
    Ok(tap)
}
