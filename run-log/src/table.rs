//! The append-only files of a run, with their names.

/// An append-only file of a run folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Table {
    /// The motivations of each robot's behavior sets, with their factors.
    Motivations,
    /// The state of allocators without motivations, per behavior set. Optional.
    Allocation,
    /// The contents of the messages of allocators, per entry. Optional.
    AllocationMessages,
    /// The delivery of every broadcast at every receiver.
    Messages,
    /// The sent broadcasts of every robot that sent one in that tick. Optional.
    Sent,
    /// The effects of every fault that had one in that tick. Optional.
    Hits,
    Events,
    /// The bodies at the start of each step.
    Poses,
    /// The progress of the mission at the end of the step, with a row for the first tick and for each tick with a change.
    Mission,
    /// The position of every target at the end of each step and the number of robots that see it. Optional. The poses of
    /// the same instant are those of the next tick.
    Targets,
    /// The external inputs, as JSON lines.
    Inputs,
    /// The answers of external controllers ([`super::external`]). Optional.
    External,
    /// Hashes. This table is written last: data without a seal in it does not count.
    Ticks,
}

impl Table {
    /// The tables in the order in which a flush writes them.
    pub const ALL: [Self; 13] = [
        Self::Motivations,
        Self::Allocation,
        Self::AllocationMessages,
        Self::Messages,
        Self::Sent,
        Self::Hits,
        Self::Events,
        Self::Poses,
        Self::Mission,
        Self::Targets,
        Self::Inputs,
        Self::External,
        Self::Ticks,
    ];

    /// Returns the file name in the run folder.
    #[must_use]
    pub fn file_name(self) -> &'static str {
        match self {
            Self::Motivations => "motivations.csv",
            Self::Allocation => "allocation.csv",
            Self::AllocationMessages => "allocation_messages.csv",
            Self::Messages => "messages.csv",
            Self::Sent => "sent.csv",
            Self::Hits => "hits.csv",
            Self::Events => "events.csv",
            Self::Poses => "poses.csv",
            Self::Mission => "mission.csv",
            Self::Targets => "targets.csv",
            Self::Inputs => "inputs.jsonl",
            Self::External => "foreign.bin",
            Self::Ticks => "ticks.csv",
        }
    }

    /// Returns whether the file exists only if it has rows.
    #[must_use]
    pub fn is_optional(self) -> bool {
        matches!(
            self,
            Self::Allocation
                | Self::AllocationMessages
                | Self::Sent
                | Self::Hits
                | Self::Targets
                | Self::External
        )
    }
}
