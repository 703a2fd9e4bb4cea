//! The key expressions of the bus, below `alliance/<run>/`.

use scenario::ids::Incarnation;

/// A builder of the key expressions of one run. Different keys separate the runs on one machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyExpressions {
    prefix: String,
}

impl KeyExpressions {
    #[must_use]
    pub fn new(run: &str) -> Self {
        Self {
            prefix: format!("alliance/{run}"),
        }
    }

    /// Matches everything in the run.
    #[must_use]
    pub fn all(&self) -> String {
        format!("{}/**", self.prefix)
    }

    /// Matches all published data except that of operators.
    #[must_use]
    pub fn published(&self) -> [String; 6] {
        let ticks = format!("{}/robot/*/tick", self.prefix);
        let [view, event, process] = [self.view(), self.event(), self.processes()];
        [view, event, process, ticks, self.reports(), self.team_all()]
    }

    /// Returns the key of a robot's [join](crate::join) request.
    #[must_use]
    pub fn join(&self, robot: &str) -> String {
        format!("{}/join/{robot}", self.prefix)
    }

    /// Returns the world's queryable for join requests. It also matches the key of protocol versions up to 9.
    #[must_use]
    pub fn joins(&self) -> String {
        self.join("**")
    }

    /// Returns the key of a host's [request](crate::membership) for its robots.
    #[must_use]
    pub fn enlist(&self, host: &str) -> String {
        format!("{}/enlist/{host}", self.prefix)
    }

    /// Returns the key that seals the answer to an enlist request.
    #[must_use]
    pub fn enlist_answer(&self, host: &str, nonce: u128) -> String {
        format!("{}/{nonce:032x}", self.enlist(host))
    }

    /// Returns the liveliness token of the world.
    #[must_use]
    pub fn alive_world(&self) -> String {
        format!("{}/alive/world", self.prefix)
    }

    /// Returns the key that seals the answer to a join request. It is unique to the request.
    #[must_use]
    pub fn join_answer(&self, robot: &str, nonce: u128) -> String {
        format!("{}/{nonce:032x}", self.join(robot))
    }

    /// Returns the liveliness token of an incarnation of a robot's agent. The token must be stamped
    /// ([`crate::secret::Secret::stamp`]), so that others cannot forge it.
    #[must_use]
    pub fn alive(&self, robot: &str, incarnation: Incarnation) -> String {
        format!("{}/alive/{robot}/{incarnation}", self.prefix)
    }

    /// Matches all liveliness tokens of a robot's agents, stamps included.
    #[must_use]
    pub fn alive_of(&self, robot: &str) -> String {
        format!("{}/alive/{robot}/*/*", self.prefix)
    }

    /// Matches all agents' liveliness tokens, stamps included.
    #[must_use]
    pub fn alive_agents(&self) -> String {
        self.alive_of("*")
    }

    /// Parses the robot and incarnation of an agent's token without its stamp; `None` for any other key.
    #[inline]
    #[must_use]
    pub fn parse_alive<'k>(&self, key: &'k str) -> Option<(&'k str, Incarnation)> {
        let rest = key.strip_prefix(&self.prefix)?.strip_prefix("/alive/")?;
        let (robot, incarnation) = rest.split_once('/')?;
        Some((robot, incarnation.parse().ok()?))
    }

    /// Returns the key of [`crate::tick::ToAgent`] messages to one agent.
    #[must_use]
    pub fn tick(&self, robot: &str) -> String {
        format!("{}/robot/{robot}/tick", self.prefix)
    }

    /// Returns the key of one agent's [`crate::tick::Report`]s.
    #[must_use]
    pub fn report(&self, robot: &str) -> String {
        format!("{}/robot/{robot}/report", self.prefix)
    }

    /// Matches all agents' reports.
    #[must_use]
    pub fn reports(&self) -> String {
        format!("{}/robot/*/report", self.prefix)
    }

    /// Returns the key of one agent's [`crate::team::Broadcast`]s of a [kind](crate::team::BroadcastKind::name).
    #[must_use]
    pub fn team(&self, robot: &str, kind: &str) -> String {
        format!("{}/team/{robot}/{kind}", self.prefix)
    }

    /// Matches all broadcasts of the team.
    #[must_use]
    pub fn team_all(&self) -> String {
        format!("{}/team/*/*", self.prefix)
    }

    /// Parses the robot of a `robot/<robot>/…` or `team/<robot>/…` key; `None` for any other key.
    #[inline]
    #[must_use]
    pub fn parse_robot<'k>(&self, key: &'k str) -> Option<&'k str> {
        let rest = key.strip_prefix(&self.prefix)?;
        let rest = rest
            .strip_prefix("/robot/")
            .or_else(|| rest.strip_prefix("/team/"))?;
        rest.split_once('/').map(|(robot, _)| robot)
    }

    /// Returns the key of a launcher's process news to the world. The launcher's queryable has the same key.
    #[must_use]
    pub fn process(&self, host: &str) -> String {
        format!("{}/process/{host}", self.prefix)
    }

    /// Matches all hosts' process news.
    #[must_use]
    pub fn processes(&self) -> String {
        self.process("*")
    }

    /// Returns the sender of a `join/…`, `enlist/…` or `process/…` key: its last chunk.
    #[inline]
    #[must_use]
    pub fn parse_sender(key: &str) -> &str {
        key.rsplit_once('/').map_or(key, |(_, name)| name)
    }

    /// Returns the key of [`crate::control::Request`]s to the world, as a put or as a query for a
    /// [`crate::control::Reply`].
    #[must_use]
    pub fn control(&self) -> String {
        format!("{}/control", self.prefix)
    }

    /// Returns the key that seals a `crate::process::ProcessOrder` and its answer. It differs from [`Self::process`],
    /// so neither can be mistaken for news.
    #[must_use]
    pub fn process_order(&self, host: &str) -> String {
        format!("{}/order", self.process(host))
    }

    /// Returns the key of [`crate::event::TickEvents`] to observers, droppable.
    #[must_use]
    pub fn event(&self) -> String {
        format!("{}/event", self.prefix)
    }

    /// Returns the key of the [`crate::view::View`] for observers, at a bounded rate, droppable.
    #[must_use]
    pub fn view(&self) -> String {
        format!("{}/view", self.prefix)
    }
}

/// A pattern of all worlds' liveliness tokens, with which a remote host finds the run.
pub const ALIVE_WORLDS: &str = "alliance/*/alive/world";

/// Returns the run whose world has this liveliness token.
#[must_use]
pub fn run_of_world(key: &str) -> Option<&str> {
    let run = key
        .strip_prefix("alliance/")?
        .strip_suffix("/alive/world")?;
    scenario::names::is_name(run).then_some(run)
}

/// The host name of the launcher that started the world; no other host can use it.
pub const LAUNCHER_HOST: &str = scenario::names::LAUNCHER;
