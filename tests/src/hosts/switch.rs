//! A switch in user space: every frame between hosts passes through it, and may be lost or late.

#![allow(clippy::disallowed_methods)] // A delay is one of the real clock.

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

/// Frames that are under way at once, at most; who sends more waits.
const UNDER_WAY: usize = 1 << 16;

/// A switch with one cable for each host.
pub struct Switch {
    inner: Arc<Inner>,
}

struct Inner {
    /// The switch's end of each cable.
    cables: Vec<File>,
    wires: Mutex<Wires>,
}

/// What happens to frames, hosts by index.
pub struct Wires {
    /// Hosts without a cable.
    pub unplugged: BTreeSet<usize>,
    /// From whom nothing gets to whom.
    pub cut: BTreeSet<(usize, usize)>,
    /// How likely a frame is lost.
    pub loss: f64,
    /// How long a frame takes.
    pub delay: Duration,
    /// What has become of frames so far.
    pub frames: Frames,
    draws: ChaCha8Rng,
}

/// What has become of frames; of a broadcast, one for each host that it is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Frames {
    /// Delivered, or under way.
    pub passed: u64,
    /// Lost by chance.
    pub lost: u64,
    /// Stopped where no way was.
    pub stopped: u64,
}

/// A frame that is under way.
struct Late {
    due: Instant,
    to: usize,
    frame: Vec<u8>,
}

impl Switch {
    /// One that has an interface of these names each in the present namespace, where frames come and go.
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
        // The delay is the same for all, so frames arrive in the order in which they are sent.
        let (later, late) = sync_channel(UNDER_WAY);
        let delivering = Arc::clone(&inner);
        thread::spawn(move || delivering.deliver(&late));
        for from in 0..names.len() {
            let (switching, later) = (Arc::clone(&inner), later.clone());
            thread::spawn(move || switching.forward(from, &later));
        }
        Self { inner }
    }

    /// What happens to frames from now on.
    pub fn wires(&self) -> MutexGuard<'_, Wires> {
        self.inner.wires.lock().unwrap()
    }
}

impl Inner {
    /// Whatever a host sends.
    fn forward(&self, from: usize, later: &SyncSender<Late>) {
        let mut frame = [0; 2048];
        while let Ok(length) = (&self.cables[from]).read(&mut frame) {
            let frame = &frame[..length];
            // To a host, by the last byte of its address; or to all.
            let group = frame[0] & 1 == 1;
            for to in 0..self.cables.len() {
                if to == from || !(group || usize::from(frame[5]) == to + 1) {
                    continue;
                }
                match self.wires.lock().unwrap().fate(from, to) {
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
        // It fails where the host has shut its interface down: then nobody is there to be told.
        let _ = (&self.cables[to]).write(frame);
    }
}

impl Wires {
    /// How long the next frame takes, if it arrives.
    fn fate(&mut self, from: usize, to: usize) -> Option<Duration> {
        let out = [from, to].iter().any(|host| self.unplugged.contains(host));
        if out || self.cut.contains(&(from, to)) {
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

/// A new interface, whose frames are read and written by what is returned.
fn tap(name: &str) -> io::Result<File> {
    nix::ioctl_write_ptr_bad!(attach, TUNSETIFF, ifreq);
    let tap = OpenOptions::new()
        .read(true)
        .write(true)
        .open("/dev/net/tun")?;
    // SAFETY: an ifreq is plain numbers, for which zero is a value.
    #[allow(unsafe_code)]
    let mut request: ifreq = unsafe { std::mem::zeroed() };
    for (to, from) in request.ifr_name.iter_mut().zip(name.bytes()) {
        *to = from as _;
    }
    request.ifr_ifru.ifru_flags = (IFF_TAP | IFF_NO_PI) as _;
    // SAFETY: TUNSETIFF takes an ifreq, which lives as long as the call.
    #[allow(unsafe_code)]
    unsafe { attach(tap.as_raw_fd(), &request) }?;
    Ok(tap)
}
