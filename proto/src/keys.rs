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
        let [view, event, process] = [self.view(), self.event(), self.process()];
        [view, event, process, ticks, self.reports(), self.team_all()]
    }

    /// Queryable of the world: [`crate::join`].
    #[must_use]
    pub fn join(&self) -> String {
        format!("{}/join", self.prefix)
    }

    /// Liveliness token of the world.
    #[must_use]
    pub fn alive_world(&self) -> String {
        format!("{}/alive/world", self.prefix)
    }

    /// What an answer to a join request is sealed for: that request and no other.
    #[must_use]
    pub fn join_answer(&self, nonce: u128) -> String {
        format!("{}/join/{nonce:032x}", self.prefix)
    }

    /// Liveliness token of one incarnation of a robot's agent, to be stamped ([`crate::secret::Secret::stamp`]): a token that is there
    /// before its agent, or without one, must not be taken for it.
    #[must_use]
    pub fn alive(&self, robot: &str, incarnation: Incarnation) -> String {
        format!("{}/alive/{robot}/{incarnation}", self.prefix)
    }

    /// All agents' liveliness tokens, stamps included.
    #[must_use]
    pub fn alive_agents(&self) -> String {
        format!("{}/alive/*/*/*", self.prefix)
    }

    /// The robot and incarnation of an agent's token without its stamp, `None` for any other key.
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
    #[must_use]
    pub fn parse_robot<'k>(&self, key: &'k str) -> Option<&'k str> {
        let rest = key.strip_prefix(&self.prefix)?;
        let rest = rest
            .strip_prefix("/robot/")
            .or_else(|| rest.strip_prefix("/team/"))?;
        rest.split_once('/').map(|(robot, _)| robot)
    }

    /// Launcher → world: what the operating system says of the agents' processes; and the launcher's queryable.
    #[must_use]
    pub fn process(&self) -> String {
        format!("{}/process", self.prefix)
    }

    /// Anyone → world: [`crate::control::Request`]; put, or query for a [`crate::control::Reply`].
    #[must_use]
    pub fn control(&self) -> String {
        format!("{}/control", self.prefix)
    }

    /// What a query on [`Keys::process`] is sealed for, [`crate::process::ProcessOrder`], and its answer: so neither passes
    /// for the launcher's news.
    #[must_use]
    pub fn process_order(&self) -> String {
        format!("{}/process/order", self.prefix)
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
