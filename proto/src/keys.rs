//! Key expressions below `alliance/<run>/` (DESIGN §3).

use crate::ids::Incarnation;

/// Builds the key expressions of one run, so that runs on one machine never hear each other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Keys {
    prefix: String,
}

impl Keys {
    /// Keys of the run of that id.
    #[must_use]
    pub fn new(run: &str) -> Self {
        Self {
            prefix: format!("alliance/{run}"),
        }
    }

    /// Everything of the run.
    #[must_use]
    pub fn all(&self) -> String {
        format!("{}/**", self.prefix)
    }

    /// Everything of the run that is put, but for what operators put.
    #[must_use]
    pub fn news(&self) -> [String; 6] {
        let ticks = format!("{}/robot/*/tick", self.prefix);
        let [view, event, process] = [self.view(), self.event(), self.processes()];
        [view, event, process, ticks, self.reports(), self.team_all()]
    }

    /// Where a robot asks to [join](crate::join).
    #[must_use]
    pub fn join(&self, robot: &str) -> String {
        format!("{}/join/{robot}", self.prefix)
    }

    /// Queryable of the world: all of them, and that on which robots asked up to version 9 of the protocol.
    #[must_use]
    pub fn joins(&self) -> String {
        self.join("**")
    }

    /// Where a host asks which robots are its own: [`crate::enlist`].
    #[must_use]
    pub fn enlist(&self, host: &str) -> String {
        format!("{}/enlist/{host}", self.prefix)
    }

    /// What an answer to that is sealed for.
    #[must_use]
    pub fn enlist_answer(&self, host: &str, nonce: u128) -> String {
        format!("{}/{nonce:032x}", self.enlist(host))
    }

    /// Liveliness token of the world.
    #[must_use]
    pub fn alive_world(&self) -> String {
        format!("{}/alive/world", self.prefix)
    }

    /// What an answer to a join request is sealed for: that request and no other.
    #[must_use]
    pub fn join_answer(&self, robot: &str, nonce: u128) -> String {
        format!("{}/{nonce:032x}", self.join(robot))
    }

    /// Liveliness token of one incarnation of a robot's agent, to be stamped ([`crate::secret::Secret::stamp`]): a token that is there
    /// before its agent, or without one, must not be taken for it.
    #[must_use]
    pub fn alive(&self, robot: &str, incarnation: Incarnation) -> String {
        format!("{}/alive/{robot}/{incarnation}", self.prefix)
    }

    /// All liveliness tokens of a robot's agents, stamps included.
    #[must_use]
    pub fn alive_of(&self, robot: &str) -> String {
        format!("{}/alive/{robot}/*/*", self.prefix)
    }

    /// All agents' liveliness tokens, stamps included.
    #[must_use]
    pub fn alive_agents(&self) -> String {
        self.alive_of("*")
    }

    /// The robot and incarnation of an agent's token without its stamp, `None` for any other key.
    #[inline]
    #[must_use]
    pub fn parse_alive<'k>(&self, key: &'k str) -> Option<(&'k str, Incarnation)> {
        let rest = key.strip_prefix(&self.prefix)?.strip_prefix("/alive/")?;
        let (robot, incarnation) = rest.split_once('/')?;
        Some((robot, incarnation.parse().ok()?))
    }

    /// World → one agent: [`crate::tick::ToAgent`].
    #[must_use]
    pub fn tick(&self, robot: &str) -> String {
        format!("{}/robot/{robot}/tick", self.prefix)
    }

    /// One agent → world: [`crate::tick::Report`].
    #[must_use]
    pub fn report(&self, robot: &str) -> String {
        format!("{}/robot/{robot}/report", self.prefix)
    }

    /// All agents' reports.
    #[must_use]
    pub fn reports(&self) -> String {
        format!("{}/robot/*/report", self.prefix)
    }

    /// One agent → all agents: [`crate::team::Broadcast`] of the [kind](crate::team::BroadcastKind::name) of that name.
    #[must_use]
    pub fn team(&self, robot: &str, kind: &str) -> String {
        format!("{}/team/{robot}/{kind}", self.prefix)
    }

    /// All broadcasts of the team.
    #[must_use]
    pub fn team_all(&self) -> String {
        format!("{}/team/*/*", self.prefix)
    }

    /// The robot a `robot/<robot>/…` or `team/<robot>/…` key speaks of, `None` for any other key.
    #[inline]
    #[must_use]
    pub fn parse_robot<'k>(&self, key: &'k str) -> Option<&'k str> {
        let rest = key.strip_prefix(&self.prefix)?;
        let rest = rest
            .strip_prefix("/robot/")
            .or_else(|| rest.strip_prefix("/team/"))?;
        rest.split_once('/').map(|(robot, _)| robot)
    }

    /// Launcher of a host → world: what the operating system says of its agents' processes; and the launcher's queryable.
    #[must_use]
    pub fn process(&self, host: &str) -> String {
        format!("{}/process/{host}", self.prefix)
    }

    /// All hosts' news.
    #[must_use]
    pub fn processes(&self) -> String {
        self.process("*")
    }

    /// The last chunk of a `join/…`, `enlist/…` or `process/…` key: who speaks.
    #[inline]
    #[must_use]
    pub fn parse_speaker(key: &str) -> &str {
        key.rsplit_once('/').map_or(key, |(_, name)| name)
    }

    /// Anyone → world: [`crate::control::Request`]; put, or query for a [`crate::control::Reply`].
    #[must_use]
    pub fn control(&self) -> String {
        format!("{}/control", self.prefix)
    }

    /// What a query on [`Keys::process`] is sealed for, [`crate::process::ProcessOrder`], and its answer: so neither passes
    /// for the launcher's news.
    #[must_use]
    pub fn process_order(&self, host: &str) -> String {
        format!("{}/order", self.process(host))
    }

    /// World → observers: [`crate::event::EventNews`], droppable.
    #[must_use]
    pub fn event(&self) -> String {
        format!("{}/event", self.prefix)
    }

    /// World → observers: [`crate::view::View`], at a bounded rate, droppable.
    #[must_use]
    pub fn view(&self) -> String {
        format!("{}/view", self.prefix)
    }
}

/// Liveliness tokens of the worlds of all runs: who comes from another host finds the run by it.
pub const ALIVE_WORLDS: &str = "alliance/*/alive/world";

/// The run whose world's token has that key.
#[must_use]
pub fn run_of_world(key: &str) -> Option<&str> {
    let run = key
        .strip_prefix("alliance/")?
        .strip_suffix("/alive/world")?;
    is_name(run).then_some(run)
}

/// The host of the launcher that started the world; no other has this name.
pub const LAUNCHER_HOST: &str = "launcher";

/// Whether a name may stand as one chunk of a key expression, in a file name and in a CSV column: letters, digits, `-`
/// and `_`, at most 32, starting with a letter or digit.
#[must_use]
pub fn is_name(name: &str) -> bool {
    name.len() <= 32
        && name.starts_with(|c: char| c.is_ascii_alphanumeric())
        && name
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_')
}
