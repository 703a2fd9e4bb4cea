//! Takes scenes at given ticks of a replayed run.

use std::collections::{BTreeSet, VecDeque};

use glam::Vec2;
use proto::control::AgentState;
use proto::view::MessageView;
use run_log::{LogLevel, MemoryLog, RunLog};
use scenario::ids::{RobotId, Tick};
use scenario::time::SimTime;
use world_server::simulation::Simulation;

use super::scene::{Scene, Transmission};
use crate::replay_views::retrace_into;

/// The past in a picture. In a large team, long paths and many transmissions would hide the robots.
struct Past {
    /// The size of the largest team with this past.
    robots: usize,
    trail_s: f64,
    /// By default, each robot sends once per second.
    transmissions: SimTime,
}

const PASTS: [Past; 3] = [
    Past {
        robots: 12,
        trail_s: 30.0,
        transmissions: SimTime(1000),
    },
    Past {
        robots: 60,
        trail_s: 12.0,
        transmissions: SimTime(250),
    },
    Past {
        robots: usize::MAX,
        trail_s: 5.0,
        transmissions: SimTime(100),
    },
];

/// Replays a run and passes the scene at each of the `ticks`, which ascend, to `take`. Returns the difference from the
/// logged run, if there is one.
///
/// # Errors
/// Returns the errors of the replay, and the first error of `take`.
pub fn take_scenes(
    logged: &RunLog,
    ticks: &[Tick],
    mut take: impl FnMut(Scene) -> anyhow::Result<()>,
) -> anyhow::Result<Option<String>> {
    let mut camera = Camera::new(logged, ticks);
    let mut failed = Ok(());
    let see = |simulation: &mut Simulation| {
        if failed.is_ok() {
            failed = camera.see(simulation, &mut take);
        }
    };
    let replayed = retrace_into(logged, LogLevel::Off, MemoryLog::default(), see)?;
    failed?;
    Ok(replayed.differs)
}

struct Camera<'t> {
    /// The ticks that are still wanted, in ascending order.
    ticks: &'t [Tick],
    step: SimTime,
    /// The number of positions of a trail.
    positions: usize,
    transmissions: SimTime,
    trails: Vec<VecDeque<Vec2>>,
    messages: VecDeque<MessageView>,
}

impl<'t> Camera<'t> {
    fn new(logged: &RunLog, ticks: &'t [Tick]) -> Self {
        let scenario = &logged.run.setup.scenario;
        let robots = scenario.robots.len();
        let step = SimTime(scenario.step_ms);
        let [.., last] = &PASTS;
        let past = PASTS.iter().find(|past| robots <= past.robots);
        let past = past.unwrap_or(last);
        Self {
            ticks,
            step,
            positions: (past.trail_s / step.as_secs_f64()) as usize + 1,
            transmissions: past.transmissions,
            trails: vec![VecDeque::new(); robots],
            messages: VecDeque::new(),
        }
    }

    fn see(
        &mut self,
        simulation: &mut Simulation,
        take: &mut impl FnMut(Scene) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let Some(&next) = self.ticks.first() else {
            return Ok(());
        };
        let tick = simulation.tick();
        let ahead = next.saturating_sub(tick);
        if ahead < self.positions as u64 {
            self.follow(simulation);
        } else {
            self.trails.iter_mut().for_each(VecDeque::clear);
        }
        if SimTime(ahead * self.step.0) <= self.transmissions {
            self.listen(simulation);
        }
        if next > tick {
            return Ok(());
        }
        self.ticks = &self.ticks[1..];
        take(self.scene(simulation))
    }

    /// Adds the present positions to the trails. A robot outside the mission has no trail.
    fn follow(&mut self, simulation: &Simulation) {
        for (rank, trail) in (0..).zip(&mut self.trails) {
            if simulation.agent_state(RobotId(rank)) == AgentState::Absent {
                trail.clear();
                continue;
            }
            if trail.len() == self.positions {
                trail.pop_front();
            }
            trail.push_back(simulation.world().pose(RobotId(rank)).position);
        }
    }

    /// Adds the latest messages, and drops those that are too old.
    fn listen(&mut self, simulation: &mut Simulation) {
        self.messages.extend(simulation.take_messages());
        let now = SimTime(simulation.tick() * self.step.0);
        let span = self.transmissions;
        self.messages
            .retain(|message| now.since(message.reception.at) <= span);
    }

    fn scene(&self, simulation: &Simulation) -> Scene {
        let trails = self.trails.iter();
        let transmissions = self.messages.iter().filter_map(Transmission::new);
        let transmissions: BTreeSet<Transmission> = transmissions.collect();
        Scene {
            view: simulation.view_without_history(),
            trails: trails
                .map(|trail| trail.iter().copied().collect())
                .collect(),
            transmissions: transmissions.into_iter().collect(),
        }
    }
}
