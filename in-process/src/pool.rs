//! The step of a whole team on several threads. The bytes are the same as group by group, because a robot's step depends only
//! on the state at the start of the tick. Everything that depends on the order of robots follows in order of rank.

use proto::team::Broadcast;
use rayon::ThreadPoolBuildError;
use robot_agent::agent::{Agent, Workspace};
use run_log::recorder::SectionHash;
use scenario::ids::RobotId;
use world_server::simulation::{Simulation, TeamPart, TickContext};

use crate::broadcast_store::BroadcastStore;
use crate::external_command::BodyCommand;
use crate::seat::{Seat, TOGETHER};
use crate::threads::Threads;

/// The least number of robots for each thread. With fewer robots, waking the threads takes longer than they save.
const LEAST_PER_THREAD: usize = 128;

/// Returns the number of threads for a team: at most `most`, and fewer for a small team.
#[must_use]
pub fn threads_for(robots: usize, most: usize) -> usize {
    most.min(robots / LEAST_PER_THREAD).max(1)
}

/// The threads of a team and their buffers.
pub(super) struct WorkerPool {
    threads: Threads,
    workers: Vec<Worker>,
    /// The robots that were sent the tick.
    asked: Vec<RobotId>,
    /// One entry for every [`TOGETHER`] robots, in order of rank.
    chunks: Vec<Chunk>,
}

/// The buffers of one thread.
#[derive(Default)]
struct Worker {
    spaces: Vec<Workspace>,
    hash: SectionHash,
}

/// Robots with adjacent ranks that one thread steps together.
#[derive(Default)]
pub(super) struct Chunk {
    /// The answers of the robots that were sent the tick.
    pub sent: Vec<Sent>,
    /// The broadcasts of these robots, in order.
    pub broadcasts: Vec<Broadcast>,
    /// Used broadcasts, whose buffers the robots reuse.
    pub used: Vec<Broadcast>,
}

/// The answer of a robot.
pub(super) struct Sent {
    pub robot: RobotId,
    /// The number of its broadcasts.
    pub broadcasts: usize,
    pub is_valid: bool,
}

/// The data that all chunks of a tick read.
struct Shared<'a> {
    context: TickContext<'a>,
    asked: &'a [RobotId],
    is_prepared: bool,
    broadcasts: &'a BroadcastStore,
    driven: &'a [Option<BodyCommand>],
}

/// The robots of a chunk, by rank.
struct Robots<'a> {
    chunk: &'a mut Chunk,
    seats: &'a mut [Seat],
    part: TeamPart<'a>,
}

impl WorkerPool {
    pub fn new(robots: usize, threads: usize) -> Result<Self, ThreadPoolBuildError> {
        let worker = || Worker {
            spaces: (0..TOGETHER).map(|_| Workspace::default()).collect(),
            hash: SectionHash::default(),
        };
        let chunks = 0..robots.div_ceil(TOGETHER);
        Ok(Self {
            threads: Threads::new(threads)?,
            workers: (0..threads).map(|_| worker()).collect(),
            asked: Vec::new(),
            chunks: chunks.map(|_| Chunk::default()).collect(),
        })
    }

    /// Steps all robots that wait for the tick. Returns their answers, in order of rank; `None` if there are no such robots.
    pub fn step(
        &mut self,
        simulation: &mut Simulation,
        seats: &mut [Seat],
        broadcasts: &BroadcastStore,
        driven: &[Option<BodyCommand>],
    ) -> Option<&mut [Chunk]> {
        let WorkerPool {
            threads,
            workers,
            asked,
            chunks,
        } = self;
        simulation.take_recipients(asked);
        if asked.is_empty() {
            return None;
        }
        let is_prepared = !simulation.readings_are_intact();
        let (context, team) = simulation.split();
        let shared = Shared {
            context,
            asked,
            is_prepared,
            broadcasts,
            driven,
        };
        let robots = (chunks.iter_mut().zip(seats.chunks_mut(TOGETHER)))
            .zip(team.chunks(TOGETHER))
            .map(|((chunk, seats), part)| Robots { chunk, seats, part });
        threads.share(workers, robots, |worker, robots| {
            robots.step(worker, &shared)
        });
        Some(chunks)
    }
}

impl Robots<'_> {
    /// Steps the robots of the chunk that were sent the tick. Each part runs for all of them, so that its code stays in the
    /// cache.
    fn step(self, worker: &mut Worker, shared: &Shared<'_>) {
        let Self {
            chunk,
            seats,
            mut part,
        } = self;
        let spaces = &mut worker.spaces;
        let asked = part.among(shared.asked);
        for (&robot, space) in asked.iter().zip(&mut *spaces) {
            if !shared.is_prepared {
                part.prepare(&shared.context, robot);
            }
            let message = part.message(robot);
            let is_lost = |_, _, _| false;
            let arrived = &mut space.arrived;
            shared
                .broadcasts
                .collect(&message.manifest, is_lost, arrived);
        }
        for phase in [Agent::perceive, Agent::allocate] {
            for (&robot, space) in asked.iter().zip(&mut *spaces) {
                if let Seat::Agent(agent) = &mut seats[part.index_of(robot)] {
                    phase(agent, part.message(robot), space);
                }
            }
        }
        for (&robot, space) in asked.iter().zip(&mut *spaces) {
            if let Seat::Agent(agent) = &mut seats[part.index_of(robot)] {
                std::mem::swap(&mut space.used_broadcasts, &mut chunk.used);
                agent.act(part.message(robot), space);
                std::mem::swap(&mut space.used_broadcasts, &mut chunk.used);
            }
        }
        for (&robot, space) in asked.iter().zip(&mut *spaces) {
            if !matches!(seats[part.index_of(robot)], Seat::Agent(_)) {
                continue;
            }
            if let Some(Some(command)) = shared.driven.get(robot.index()) {
                command.apply_to(&mut space.report.actuation);
            }
            chunk.sent.push(Sent {
                robot,
                broadcasts: space.broadcasts.len(),
                is_valid: part.store(&shared.context, &space.report, &mut worker.hash),
            });
            chunk.broadcasts.append(&mut space.broadcasts);
        }
    }
}
