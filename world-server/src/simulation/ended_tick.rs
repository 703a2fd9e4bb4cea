//! The result of an ended tick, for the recorder.

use prefetch::prefetch;
use proto::readings::Actuation;
use proto::team::Broadcast;
use run_log::Input;
use run_log::recorder::{Answer, BodyRecord, Event, FaultHits, Record, RecordError, TickRecord};
use scenario::ids::Tick;
use scenario::time::SimTime;

use super::Simulation;
use crate::barrier::TickResult;
use crate::mission::{FigureValue, MissionWorld, Target, TeamFigures};

#[derive(Clone, Default)]
pub(super) struct EndedTick {
    /// The tick's number and time, until it is recorded.
    pub at: Option<(Tick, SimTime)>,
    pub gathered: TickResult,
    pub inputs: Vec<Input>,
    pub bodies: Vec<BodyRecord>,
    pub commands: Vec<Option<Actuation>>,
    pub events: Vec<Event>,
    /// The effects of faults, each fault once.
    pub hits: Vec<FaultHits>,
    /// The broadcasts of external controllers that count, by sender and index.
    broadcasts: Vec<Broadcast>,
    /// The messages of allocators whose reports count, by sender and index.
    allocation_messages: Vec<Broadcast>,
    mission: Vec<FigureValue>,
    targets: Vec<Target>,
    mission_state: u64,
    /// The mission's figures at the end of the tick, if the mission has changed since.
    pub figures: Option<Box<TeamFigures>>,
}

impl EndedTick {
    /// Moves the broadcasts of counting reports here and drops the others.
    pub fn take_broadcasts(
        &mut self,
        answers: &[Answer],
        external: &mut Vec<Broadcast>,
        allocation_messages: Option<&mut Vec<Vec<Broadcast>>>,
    ) {
        let counts = |broadcast: &Broadcast| {
            let answer = &answers[broadcast.sender.index()];
            answer.counts && answer.report.incarnation == broadcast.incarnation
        };
        self.broadcasts.clear();
        self.broadcasts.extend(external.drain(..).filter(counts));
        self.allocation_messages.clear();
        for messages in allocation_messages.into_iter().flatten() {
            messages.sort_by_key(|message| message.index);
            self.allocation_messages
                .extend(messages.drain(..).filter(counts));
        }
    }

    /// Requests the memory of the lists, see [`prefetch`](mod@prefetch). They will have as many entries as in the latest tick.
    pub fn prefetch(&self) {
        prefetch(&*self.gathered.counted);
        prefetch(&*self.bodies);
        prefetch(&*self.commands);
        prefetch(&*self.mission);
        prefetch(&*self.targets);
    }

    /// Reads the mission's values at the end of the tick.
    pub fn read_mission(&mut self, mission: &dyn MissionWorld) {
        self.mission.clear();
        mission.row(&mut self.mission);
        self.targets.clear();
        mission.targets(&mut self.targets);
        self.mission_state = mission.state_hash();
    }
}

impl Simulation {
    /// Passes the data of the ended tick to the recorder, once. Returns whether there was such a tick.
    ///
    /// # Errors
    /// If the log cannot be written.
    pub fn record(&mut self, recorder: &mut dyn Record) -> Result<bool, RecordError> {
        let ended = &mut self.ended;
        let Some((tick, now)) = ended.at.take() else {
            return Ok(false);
        };
        recorder.record(&TickRecord {
            tick,
            now,
            inputs: &ended.inputs,
            bodies: &ended.bodies,
            answers: self.answers.all(),
            external: &self.external,
            broadcasts: &ended.broadcasts,
            allocation_messages: &ended.allocation_messages,
            events: &ended.events,
            hits: &ended.hits,
            mission: &ended.mission,
            targets: &ended.targets,
            mission_state: ended.mission_state,
        })?;
        Ok(true)
    }
}
