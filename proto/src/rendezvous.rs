//! Where a live run is found: one file per run in the user's runtime folder, readable by that user alone (DESIGN §3).

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use nix::unistd::Uid;
use serde::{Deserialize, Serialize};

use crate::member::{self, Login, Member};
use crate::os_process::OsProcess;
use crate::secret;

/// How to reach the world of a live run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rendezvous {
    /// The run's id, first chunk of its keys.
    pub run: String,
    /// Zenoh locator of its gateway, for those who order and watch, such as
    /// `unixsock-stream//run/user/1000/alliance/thesis-10929.10931.alliance.sock`.
    pub endpoint: String,
    /// Process id of the world.
    pub pid: u32,
    /// Secret of the run: who can read this file may change the run. Password at the gateway.
    pub token: String,
    /// Of the robots and of the launcher.
    pub team: Entrance,
    /// When that process started, see [`OsProcess::started`]; 0: not known.
    #[serde(default)]
    pub started: u64,
    /// Of a run whose world is on another host; then all the above is that of the router of this host.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub far: Option<Far>,
}

/// A host's part in a run whose world is on another one.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Far {
    /// Name of this host.
    pub host: String,
    /// Zenoh locator of the world.
    pub world: String,
    /// The secrets of its robots, by name.
    pub robots: BTreeMap<String, String>,
}

/// How the members of the team reach the world.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entrance {
    /// Zenoh locator of the world.
    pub endpoint: String,
    /// Password.
    pub password: String,
}

/// As whom somebody connects to a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum User {
    /// A robot's agent, the launcher or the gateway, at the world itself: puts and hears everything.
    Team,
    /// Whoever orders and watches, at the gateway: asks on the control topic, and hears everything. What else it puts is not passed on.
    Operator,
}

impl User {
    /// The name that zenoh knows, and that of the socket.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Team => "team",
            Self::Operator => "alliance",
        }
    }

    /// Password.
    #[must_use]
    pub fn password(self, run: &Rendezvous) -> &str {
        match self {
            Self::Team => &run.team.password,
            Self::Operator => &run.token,
        }
    }

    /// Where it connects.
    #[must_use]
    pub fn endpoint(self, run: &Rendezvous) -> &str {
        match self {
            Self::Team => &run.team.endpoint,
            Self::Operator => &run.endpoint,
        }
    }
}

/// Why no run was found, or none could be announced.
#[derive(Debug, thiserror::Error)]
pub enum RendezvousError {
    /// No live run of that id.
    #[error("no live run '{asked}'; live runs: {}", if live.is_empty() { "none".to_owned() } else { live.join(", ") })]
    Unknown {
        /// What was asked for.
        asked: String,
        /// What there is, newest first.
        live: Vec<String>,
    },
    /// No live run at all.
    #[error("no run is live; start one with `alliance run` or `alliance world`")]
    None,
    /// The run's world is elsewhere, and the robot is not one of this host's.
    #[error("run '{run}' has no robot '{robot}' on host {host}; its robots here are {}", here.join(", "))]
    NotHere {
        /// The run.
        run: String,
        /// The robot.
        robot: String,
        /// This host.
        host: String,
        /// The robots that are.
        here: Vec<String>,
    },
    /// The run's world is elsewhere.
    #[error("the world of run '{run}' is at {world}: order and watch it on that host")]
    Elsewhere {
        /// The run.
        run: String,
        /// Where.
        world: String,
    },
    /// The folder is not this user's alone.
    #[error("{0} is not a folder of this user alone: remove it")]
    Unsafe(PathBuf),
    /// The file system refused.
    #[error("{path}: {error}")]
    Io {
        /// Which file or folder.
        path: PathBuf,
        /// What it said.
        error: io::Error,
    },
}

/// Removes the announcement of a run, and its sockets, when the run ends.
#[derive(Debug)]
#[must_use = "the announcement goes with the guard"]
pub struct Announcement {
    path: PathBuf,
    run: Rendezvous,
}

impl Drop for Announcement {
    fn drop(&mut self) {
        self.run.withdraw(&self.path);
    }
}

/// The zenoh locator of a run's socket for those users in the runtime folder, which nobody else's programs reach; `None` where such a
/// path is no locator or too long for a socket. `pid` is the world's.
///
/// # Errors
/// When the runtime folder cannot be made, or belongs to somebody else.
pub fn socket(run: &str, pid: u32, user: User) -> Result<Option<String>, RendezvousError> {
    // Of that process alone: one that is left over is removed without a look at who has taken its name since.
    let path = folder()?.join(format!("{run}.{pid}.{}.sock", user.name()));
    let path = path.to_str().filter(|path| path.len() <= LONGEST_SOCKET);
    let path = path.filter(|path| !path.contains(['?', '#']));
    Ok(path.map(|path| format!("{SOCKET}{path}")))
}

/// How locators of such sockets begin.
const SOCKET: &str = "unixsock-stream/";

/// Bytes of the longest path of a socket: `sun_path` of unix(7) without its zero.
const LONGEST_SOCKET: usize = 107;

impl Rendezvous {
    /// Of a run whose world is this process, with secrets of its own; nobody can reach it yet.
    ///
    /// # Errors
    /// When the system has no random bits.
    pub fn new(run: String) -> io::Result<Self> {
        let random = || secret::random().map(|number| format!("{number:032x}"));
        let pid = std::process::id();
        Ok(Self {
            run,
            endpoint: String::new(),
            pid,
            token: random()?,
            team: Entrance {
                endpoint: String::new(),
                password: random()?,
            },
            started: OsProcess::of(pid).map_or(0, |me| me.started),
            far: None,
        })
    }

    /// How a process of this machine connects.
    ///
    /// # Errors
    /// For those who order and watch, when the world is elsewhere.
    pub fn login(&self, user: User) -> Result<Login, RendezvousError> {
        if let (Some(far), User::Operator) = (&self.far, user) {
            return Err(RendezvousError::Elsewhere {
                run: self.run.clone(),
                world: far.world.clone(),
            });
        }
        Ok(Login {
            endpoint: user.endpoint(self).to_owned(),
            user: user.name().to_owned(),
            password: user.password(self).to_owned(),
            keyring: None,
        })
    }

    /// What the agent of that robot needs on this machine.
    ///
    /// # Errors
    /// When the world is elsewhere and the robot is not one of this host's.
    pub fn member(&self, robot: &str) -> Result<Member, RendezvousError> {
        let Some(far) = &self.far else {
            let login = self.login(User::Team)?;
            let (run, token) = (self.run.clone(), self.token.clone());
            return Ok(Member::near(run, robot, login, token));
        };
        let secret = far
            .robots
            .get(robot)
            .ok_or_else(|| RendezvousError::NotHere {
                run: self.run.clone(),
                robot: robot.to_owned(),
                host: far.host.clone(),
                here: far.robots.keys().cloned().collect(),
            })?;
        Ok(Member {
            run: self.run.clone(),
            login: Login {
                endpoint: self.team.endpoint.clone(),
                user: member::robot(robot),
                password: secret.clone(),
                keyring: None,
            },
            secret: secret.clone(),
            token: None,
            is_far: true,
        })
    }

    /// Leaves this run where others find it, until the guard goes.
    ///
    /// # Errors
    /// When the runtime folder cannot be made or written, or belongs to somebody else.
    pub fn announce(&self) -> Result<Announcement, RendezvousError> {
        let folder = folder()?;
        let path = folder.join(format!("{}.json", self.run));
        let at = |error| RendezvousError::Io {
            path: path.clone(),
            error,
        };
        let text = serde_json::to_string(self).map_err(|error| at(error.into()))?;
        // Written beside and renamed: a reader never sees half of it.
        let fresh = folder.join(format!("{}.new", self.run));
        let mut file = fs::OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(true)
            .mode(0o600)
            .open(&fresh)
            .map_err(at)?;
        file.write_all(text.as_bytes()).map_err(at)?;
        fs::rename(&fresh, &path).map_err(at)?;
        let run = self.clone();
        Ok(Announcement { path, run })
    }

    /// Removes what its world leaves behind. What cannot be removed is harmless: nobody takes it for a live run's.
    fn withdraw(&self, announcement: &Path) {
        let _ = fs::remove_file(announcement);
        let endpoints = [&self.endpoint, &self.team.endpoint];
        for socket in endpoints.iter().filter_map(|at| at.strip_prefix(SOCKET)) {
            let _ = fs::remove_file(socket);
            let _ = fs::remove_file(format!("{socket}.lock"));
        }
    }

    /// Whether its world lives; another process may have its id by now.
    fn is_live(&self) -> bool {
        let world = OsProcess::of(self.pid);
        world.is_some_and(|world| self.started == 0 || world.started == self.started)
    }

    /// The run of that id, or the newest live one.
    ///
    /// # Errors
    /// When there is none, or the runtime folder cannot be read.
    pub fn find(run: Option<&str>) -> Result<Self, RendezvousError> {
        let live = live()?;
        match run {
            None => live.into_iter().next().ok_or(RendezvousError::None),
            Some(asked) => match live.iter().position(|found| found.run == asked) {
                Some(index) => Ok(live[index].clone()),
                None => Err(RendezvousError::Unknown {
                    asked: asked.to_owned(),
                    live: live.into_iter().map(|found| found.run).collect(),
                }),
            },
        }
    }
}

/// All live runs of this user, newest first; announcements of dead worlds are removed.
///
/// # Errors
/// When the runtime folder cannot be read.
pub fn live() -> Result<Vec<Rendezvous>, RendezvousError> {
    let folder = folder()?;
    let entries = fs::read_dir(&folder).map_err(|error| RendezvousError::Io {
        path: folder.clone(),
        error,
    })?;
    let mut found: Vec<(SystemTime, Rendezvous)> = Vec::new();
    for path in entries.flatten().map(|entry| entry.path()) {
        if path.extension().is_none_or(|extension| extension != "json") {
            continue;
        }
        // A file that vanishes or cannot be read meanwhile is that of a run which is ending.
        let Some((changed, run)) = read(&path) else {
            continue;
        };
        if run.is_live() {
            found.push((changed, run));
        } else {
            run.withdraw(&path);
        }
    }
    found.sort_by(|(a, x), (b, y)| b.cmp(a).then_with(|| x.run.cmp(&y.run)));
    Ok(found.into_iter().map(|(_, run)| run).collect())
}

fn read(path: &Path) -> Option<(SystemTime, Rendezvous)> {
    let changed = fs::metadata(path).ok()?.modified().ok()?;
    let run = serde_json::from_str(&fs::read_to_string(path).ok()?).ok()?;
    Some((changed, run))
}

/// `$XDG_RUNTIME_DIR/alliance`; without it `alliance-<uid>` in the folder for temporary files, and where somebody else has made that
/// one, `.cache/alliance` at home.
fn folder() -> Result<PathBuf, RendezvousError> {
    let base = |name: &str| std::env::var_os(name).map(PathBuf::from);
    if let Some(base) = base("XDG_RUNTIME_DIR").filter(|base| base.is_dir()) {
        return own_folder(base.join("alliance"));
    }
    let folder = own_folder(std::env::temp_dir().join(format!("alliance-{}", Uid::effective())));
    match (&folder, base("HOME")) {
        (Err(RendezvousError::Unsafe(_)), Some(home)) => own_folder(home.join(".cache/alliance")),
        _ => folder,
    }
}

/// A folder that this user alone can look into, made if it is not there.
fn own_folder(folder: PathBuf) -> Result<PathBuf, RendezvousError> {
    let at = |error| RendezvousError::Io {
        path: folder.clone(),
        error,
    };
    fs::DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(&folder)
        .map_err(at)?;
    let metadata = fs::symlink_metadata(&folder).map_err(at)?;
    let owner = std::os::unix::fs::MetadataExt::uid(&metadata);
    if !metadata.is_dir()
        || owner != Uid::effective().as_raw()
        || metadata.permissions().mode() & 0o077 != 0
    {
        return Err(RendezvousError::Unsafe(folder));
    }
    Ok(folder)
}
