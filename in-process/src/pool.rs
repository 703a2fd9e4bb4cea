//! The step of a whole team on several threads. The bytes are the same as group by group, because a robot's step depends only
//! on the state at the start of the tick. Everything that depends on the order of robots follows in order of rank.

use proto::team::Broadcast;
use proto::tick::TickMessage;
use rayon::ThreadPoolBuildError;
use robot_agent::agent::{Agent, Workspace};
use run_log::recorder::{Answer, SectionHash};
use scenario::StepOrder;
use scenario::ids::RobotId;
use world_server::simulation::TickContext;

use crate::broadcast_store::BroadcastStore;
use crate::external_command::BodyCommand;
use crate::group::TOGETHER;
use crate::inputs::TickInputs;
use crate::run::{Run, Seat};
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
struct Chunk {
    /// The robots that were sent the tick.
    asked: Vec<RobotId>,
    /// The answers of these robots.
    sent: Vec<Sent>,
    /// The broadcasts of these robots, in order.
    broadcasts: Vec<Broadcast>,
    /// Used broadcasts, whose buffers the robots reuse.
    used: Vec<Broadcast>,
}

struct Sent {
    robot: RobotId,
    broadcasts: usize,
    is_valid: bool,
}

/// The data that all chunks of a tick read.
struct Shared<'a> {
    context: TickContext<'a>,
    is_prepared: bool,
    broadcasts: &'a BroadcastStore,
    driven: &'a [Option<BodyCommand>],
}

/// The robots of a chunk, by rank.
struct Robots<'a> {
    first: usize,
    chunk: &'a mut Chunk,
    seats: &'a mut [Seat],
    messages: &'a mut [TickMessage],
    answers: &'a mut [Answer],
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
            chunks: chunks.map(|_| Chunk::default()).collect(),
        })
    }
}

impl Run {
    /// Returns the threads if they can step the team in this tick. They cannot if the inputs of the tick or the step order
    /// prescribe an order of robots, or if external controllers answer.
    pub(super) fn take_pool(&mut self, inputs: &TickInputs) -> Option<WorkerPool> {
        let is_free = inputs.leave_reports_alone()
            && self.answer_source.is_none()
            && self.simulation.setup().step_order != StepOrder::InOrder;
        if is_free { self.pool.take() } else { None }
    }

    /// Steps all robots that wait for the tick. Returns `false` if there are none.
    pub(super) fn step_team(&mut self, pool: &mut WorkerPool) -> bool {
        let WorkerPool {
            threads,
            workers,
            chunks,
        } = pool;
        for chunk in &mut *chunks {
            chunk.asked.clear();
        }
        let mut any = false;
        while let Some(robot) = self.simulation.next_unprepared() {
            chunks[robot.index() / TOGETHER].asked.push(robot);
            any = true;
        }
        if !any {
            return false;
        }
        let is_prepared = !self.simulation.readings_are_intact();
        let (context, messages, answers) = self.simulation.split();
        let shared = Shared {
            context,
            is_prepared,
            broadcasts: &self.broadcasts,
            driven: &self.driven,
        };
        let robots = (chunks.iter_mut().zip(self.seats.chunks_mut(TOGETHER)))
            .zip(messages.chunks_mut(TOGETHER))
            .zip(answers.chunks_mut(TOGETHER))
            .enumerate()
            .map(|(index, (((chunk, seats), messages), answers))| Robots {
                first: index * TOGETHER,
                chunk,
                seats,
                messages,
                answers,
            });
        threads.share(workers, robots, |worker, robots| {
            robots.step(worker, &shared)
        });
        for chunk in chunks {
            self.count(chunk);
        }
        true
    }

    /// Passes the broadcasts and reports of a chunk to the team and to the world.
    fn count(&mut self, chunk: &mut Chunk) {
        let mut broadcasts = chunk.broadcasts.drain(..);
        let mut own = Vec::new();
        let mut dismissed = Vec::new();
        for sent in chunk.sent.drain(..) {
            own.extend(broadcasts.by_ref().take(sent.broadcasts));
            self.send(sent.robot, &mut own, &mut chunk.used);
            if sent.is_valid {
                self.simulation.count_stored(sent.robot);
            } else {
                dismissed.push(sent.robot);
            }
        }
        // As in a group, agents end after all reports.
        for robot in dismissed {
            self.end_agent(robot);
        }
    }
}

impl Robots<'_> {
    /// Steps the robots of the chunk that were sent the tick. Each part runs for all of them, so that its code stays in the
    /// cache.
    fn step(self, worker: &mut Worker, shared: &Shared<'_>) {
        let Self {
            first,
            chunk,
            seats,
            messages,
            answers,
        } = self;
        let place = |robot: RobotId| robot.index() - first;
        let spaces = &mut worker.spaces;
        for (&robot, space) in chunk.asked.iter().zip(&mut *spaces) {
            let message = &mut messages[place(robot)];
            if !shared.is_prepared {
                let answer = &mut answers[place(robot)];
                shared.context.prepare(robot, message, answer);
            }
            let is_lost = |_, _, _| false;
            let arrived = &mut space.arrived;
            shared
                .broadcasts
                .collect(&message.manifest, is_lost, arrived);
        }
        for phase in [Agent::perceive, Agent::allocate] {
            for (&robot, space) in chunk.asked.iter().zip(&mut *spaces) {
                if let Seat::Agent(agent) = &mut seats[place(robot)] {
                    phase(agent, &messages[place(robot)], space);
                }
            }
        }
        for (&robot, space) in chunk.asked.iter().zip(&mut *spaces) {
            if let Seat::Agent(agent) = &mut seats[place(robot)] {
                std::mem::swap(&mut space.used_broadcasts, &mut chunk.used);
                agent.act(&messages[place(robot)], space);
                std::mem::swap(&mut space.used_broadcasts, &mut chunk.used);
            }
        }
        for (&robot, space) in chunk.asked.iter().zip(&mut *spaces) {
            if !matches!(seats[place(robot)], Seat::Agent(_)) {
                continue;
            }
            if let Some(Some(command)) = shared.driven.get(robot.index()) {
                command.apply_to(&mut space.report.actuation);
            }
            let (message, answer) = (&messages[place(robot)], &mut answers[place(robot)]);
            let hash = &mut worker.hash;
            chunk.sent.push(Sent {
                robot,
                broadcasts: space.broadcasts.len(),
                is_valid: shared.context.store(message, &space.report, answer, hash),
            });
            chunk.broadcasts.append(&mut space.broadcasts);
        }
    }
}
