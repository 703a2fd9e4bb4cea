//! Discovery of live runs: one file per run in the user's runtime folder, readable only by that user.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use nix::unistd::Uid;
use serde::{Deserialize, Serialize};

use crate::member::{Login, Member};
use crate::os_process::OsProcess;
use proto::identity;
use proto::secret;

/// The connection data of a live run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rendezvous {
    /// The id of the run, which is the first chunk of its keys.
    pub run: String,
    /// The zenoh locator of the gateway, for operators and observers. Example:
    /// `unixsock-stream//run/user/1000/alliance/thesis-10929.10931.alliance.sock`.
    pub endpoint: String,
    /// The process id of the world.
    pub pid: u32,
    /// The secret of the run, which is the password at the gateway. A user with access to this file can change the run.
    pub token: String,
    /// The endpoint for robots and the launcher.
    pub team: JoinEndpoint,
    /// The start time of the world's process, see [`OsProcess::started`]; 0 if unknown.
    #[serde(default)]
    pub started: u64,
    /// Data of a run whose world is on another host. All other data is then that of this host's router.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub remote: Option<RemoteWorld>,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RemoteWorld {
    pub host: String,
    /// The zenoh locator of the world.
    pub world: String,
    /// The secrets of the host's robots, by name.
    pub robots: BTreeMap<String, String>,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct JoinEndpoint {
    /// The zenoh locator of the world.
    pub endpoint: String,
    pub password: String,
}

/// The role of a connection to a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConnectionRole {
    /// A robot's agent, the launcher or the gateway: connects to the world directly, and publishes and receives
    /// everything.
    Team,
    /// An operator or observer: connects to the gateway, sends queries on the control topic, and receives everything.
    /// The gateway drops all other data from it.
    Operator,
}

impl ConnectionRole {
    /// Returns the user name in zenoh, which is also part of the socket's name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Team => "team",
            Self::Operator => "alliance",
        }
    }

    #[must_use]
    pub fn password(self, run: &Rendezvous) -> &str {
        match self {
            Self::Team => &run.team.password,
            Self::Operator => &run.token,
        }
    }

    /// Returns the locator that this user connects to.
    #[must_use]
    pub fn endpoint(self, run: &Rendezvous) -> &str {
        match self {
            Self::Team => &run.team.endpoint,
            Self::Operator => &run.endpoint,
        }
    }
}

/// An error of finding or announcing a run.
#[derive(Debug, thiserror::Error)]
pub enum RendezvousError {
    #[error("no live run '{asked}'; live runs: {}", if live.is_empty() { "none".to_owned() } else { live.join(", ") })]
    Unknown {
        asked: String,
        /// The ids of the live runs, newest first.
        live: Vec<String>,
    },
    #[error("no run is live; start one with `alliance run` or `alliance cluster world`")]
    None,
    /// The world is on another host, and the robot does not belong to this host.
    #[error("run '{run}' has no robot '{robot}' on host {host}; its robots here are {}", here.join(", "))]
    OtherHost {
        run: String,
        robot: String,
        host: String,
        /// The robots of this host.
        here: Vec<String>,
    },
    /// The world is on another host.
    #[error("the world of run '{run}' is at {world}: control and observe the run from that host")]
    RemoteWorld { run: String, world: String },
    #[error("{0} is not a private folder of this user: remove it")]
    Unsafe(PathBuf),
    /// No folder for the files of runs can be used.
    #[error("{0}; set XDG_RUNTIME_DIR to a folder in which only this user can write")]
    NoFolder(Box<RendezvousError>),
    #[error("{path}: {error}")]
    Io { path: PathBuf, error: io::Error },
}

#[derive(Debug)]
#[must_use = "the announcement is removed when the guard is dropped"]
pub struct Announcement {
    path: PathBuf,
    run: Rendezvous,
}

impl Drop for Announcement {
    fn drop(&mut self) {
        self.run.withdraw(&self.path);
    }
}

/// Returns the zenoh locator of a run's socket in the private runtime folder. `None` if the path is not a valid locator
/// or too long for a socket. `pid` is the process id of the world.
pub fn socket(
    run: &str,
    pid: u32,
    user: ConnectionRole,
) -> Result<Option<String>, RendezvousError> {
    // The process id in the name makes leftover sockets distinguishable from those of newer processes.
    let path = folder()?.join(format!("{run}.{pid}.{}.sock", user.name()));
    let path = path.to_str().filter(|path| path.len() <= LONGEST_SOCKET);
    let path = path.filter(|path| !path.contains(['?', '#']));
    Ok(path.map(|path| format!("{SOCKET}{path}")))
}

const SOCKET: &str = "unixsock-stream/";

/// The maximum length of a socket path, bytes: `sun_path` of unix(7) without its zero byte.
const LONGEST_SOCKET: usize = 107;

impl Rendezvous {
    /// Creates the data of a run whose world is this process, with new secrets and without endpoints.
    pub fn new(run: String) -> io::Result<Self> {
        let random = || secret::random().map(|number| format!("{number:032x}"));
        let pid = std::process::id();
        Ok(Self {
            run,
            endpoint: String::new(),
            pid,
            token: random()?,
            team: JoinEndpoint {
                endpoint: String::new(),
                password: random()?,
            },
            started: OsProcess::find(pid).map_or(0, |process| process.started),
            remote: None,
        })
    }

    /// Returns the login of a process on this machine. Fails for operators if the world is on another host.
    pub fn login(&self, user: ConnectionRole) -> Result<Login, RendezvousError> {
        if let (Some(remote), ConnectionRole::Operator) = (&self.remote, user) {
            return Err(RendezvousError::RemoteWorld {
                run: self.run.clone(),
                world: remote.world.clone(),
            });
        }
        Ok(Login {
            endpoint: user.endpoint(self).to_owned(),
            user: user.name().to_owned(),
            password: user.password(self).to_owned(),
            keyring: None,
        })
    }

    /// Returns the data that a robot's agent needs on this machine. Fails if the world is on another host and the robot
    /// does not belong to this host.
    pub fn member(&self, robot: &str) -> Result<Member, RendezvousError> {
        let Some(remote) = &self.remote else {
            let login = self.login(ConnectionRole::Team)?;
            return Ok(Member::local(self.run.clone(), robot, login, &self.token));
        };
        let secret = remote
            .robots
            .get(robot)
            .ok_or_else(|| RendezvousError::OtherHost {
                run: self.run.clone(),
                robot: robot.to_owned(),
                host: remote.host.clone(),
                here: remote.robots.keys().cloned().collect(),
            })?;
        Ok(Member {
            run: self.run.clone(),
            login: Login {
                endpoint: self.team.endpoint.clone(),
                user: identity::robot(robot),
                password: secret.clone(),
                keyring: None,
            },
            secret: secret.clone(),
            is_remote: true,
        })
    }

    /// Announces the run in the runtime folder until the guard is dropped.
    pub fn announce(&self) -> Result<Announcement, RendezvousError> {
        let folder = folder()?;
        let path = folder.join(format!("{}.json", self.run));
        let at = |error| RendezvousError::Io {
            path: path.clone(),
            error,
        };
        let text = serde_json::to_string(self).map_err(|error| at(error.into()))?;
        // The rename is atomic, so a reader never gets a part of the file.
        let fresh = folder.join(format!("{}.{}.new", self.run, self.pid));
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

    /// Removes the files that the world leaves behind. Failures are harmless: a leftover announcement is not live.
    fn withdraw(&self, announcement: &Path) {
        let _ = fs::remove_file(announcement);
        let endpoints = [&self.endpoint, &self.team.endpoint];
        for socket in endpoints.iter().filter_map(|at| at.strip_prefix(SOCKET)) {
            let _ = fs::remove_file(socket);
            let _ = fs::remove_file(format!("{socket}.lock"));
        }
    }

    /// Returns whether the world is live. The start time detects another process that reuses the id.
    fn is_live(&self) -> bool {
        let world = OsProcess::find(self.pid);
        world.is_some_and(|world| self.started == 0 || world.started == self.started)
    }

    /// Finds the run with this id, or the newest live run.
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

/// Lists the live runs of this user, newest first. Removes the files of ended worlds.
pub fn live() -> Result<Vec<Rendezvous>, RendezvousError> {
    let folder = folder()?;
    let entries = fs::read_dir(&folder).map_err(|error| RendezvousError::Io {
        path: folder.clone(),
        error,
    })?;
    let mut found: Vec<(SystemTime, Rendezvous)> = Vec::new();
    for path in entries.flatten().map(|entry| entry.path()) {
        if path.extension().is_none_or(|extension| extension != "json") {
            remove_leftover(&path);
            continue;
        }
        // A file that cannot be read or vanishes meanwhile belongs to a run that is ending.
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

/// Removes a socket, its lock or an unfinished announcement if the process in its name has ended. A world that is killed
/// while it starts has no announcement that leads to its other files.
fn remove_leftover(path: &Path) {
    let name = path.file_name().and_then(OsStr::to_str);
    if let Some(pid) = name.and_then(owner)
        && OsProcess::find(pid).is_none()
    {
        // Another command may remove the file at the same time.
        let _ = fs::remove_file(path);
    }
}

/// Returns the process id in the name of a socket, its lock or an unfinished announcement.
fn owner(name: &str) -> Option<u32> {
    let name = name.strip_suffix(".lock").unwrap_or(name);
    let of_process = match name.strip_suffix(".sock") {
        Some(socket) => socket.rsplit_once('.')?.0,
        None => name.strip_suffix(".new")?,
    };
    of_process.rsplit_once('.')?.1.parse().ok()
}

fn read(path: &Path) -> Option<(SystemTime, Rendezvous)> {
    let changed = fs::metadata(path).ok()?.modified().ok()?;
    let run = serde_json::from_str(&fs::read_to_string(path).ok()?).ok()?;
    Some((changed, run))
}

/// Returns the first of these folders that can be used: `$XDG_RUNTIME_DIR/alliance`, `alliance-<uid>` in the folder for
/// temporary files, and `.cache/alliance` in the home folder.
fn folder() -> Result<PathBuf, RendezvousError> {
    let base = |name: &str| std::env::var_os(name).map(PathBuf::from);
    if let Some(base) = base("XDG_RUNTIME_DIR").filter(|base| base.is_dir()) {
        let folder = private_folder(base.join("alliance"));
        return folder.map_err(|error| RendezvousError::NoFolder(Box::new(error)));
    }
    let folder =
        private_folder(std::env::temp_dir().join(format!("alliance-{}", Uid::effective())));
    folder.or_else(|error| {
        let home = base("HOME").map(|home| private_folder(home.join(".cache/alliance")));
        // The first error names the usual folder.
        let home = home.and_then(Result::ok);
        home.ok_or_else(|| RendezvousError::NoFolder(Box::new(error)))
    })
}

/// Returns the folder if only this user can access it. Creates it if it is missing.
fn private_folder(folder: PathBuf) -> Result<PathBuf, RendezvousError> {
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

#[cfg(test)]
mod tests {
    use std::process::Command;

    use tempfile::TempDir;

    use super::*;

    #[test]
    fn files_of_ended_processes_are_removed_and_others_stay() {
        let mut child = Command::new("true").spawn().unwrap();
        let (ended, live) = (child.id(), std::process::id());
        child.wait().unwrap();
        let folder = TempDir::new().unwrap();
        let files = |pid: u32| {
            let ends = ["team.sock", "team.sock.lock", "alliance.sock", "new"];
            ends.map(|end| folder.path().join(format!("my.run-7.{pid}.{end}")))
        };
        let others = ["my.run-7.json", "notes.txt", "7.sock", "a.b.new"];
        let others = others.map(|name| folder.path().join(name));
        let all = files(ended).into_iter().chain(files(live)).chain(others);
        for path in all {
            fs::write(&path, "").unwrap();
            remove_leftover(&path);
        }
        let mut left: Vec<PathBuf> = fs::read_dir(folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .collect();
        left.sort();
        let others = ["7.sock", "a.b.new", "my.run-7.json", "notes.txt"];
        let mut expected: Vec<PathBuf> = others.map(|name| folder.path().join(name)).into();
        expected.extend(files(live));
        expected.sort();
        assert_eq!(left, expected);
    }
}
