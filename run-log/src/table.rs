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
    pub const ALL: [Self; 11] = [
        Self::Motivations,
        Self::Allocation,
        Self::AllocationMessages,
        Self::Messages,
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
            Self::Allocation | Self::AllocationMessages | Self::Targets | Self::External
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::external::HEADER;
    use super::*;

    #[test]
    fn header_lines() {
        let headers: Vec<_> = Table::ALL
            .map(|table| (table.file_name(), table.header()))
            .into();
        assert_eq!(
            headers,
            [
                (
                    "motivations.csv",
                    Some(
                        "t_ms,robot,behavior_set,task,motivation,impatience,sensory_feedback,activity_suppression,impatience_reset,acquiescence,state\n"
                    )
                ),
                (
                    "allocation.csv",
                    Some("t_ms,robot,task,behavior_set,utility,holder,state\n")
                ),
                (
                    "allocation_messages.csv",
                    Some(
                        "t_ms,sender,incarnation,seq,kind,task,slot,robot,bid,round_ms,time_ms,auction,evolution,stamp,detail\n"
                    )
                ),
                (
                    "messages.csv",
                    Some(
                        "t_ms,receiver,sender,incarnation,seq,kind,state,since_ms,behavior_set,task,progress,sent_ms,delivery\n"
                    )
                ),
                (
                    "events.csv",
                    Some("t_ms,kind,robot,subject,reason,detail\n")
                ),
                (
                    "poses.csv",
                    Some("t_ms,robot,x_m,y_m,heading_rad,speed_m_s,carrying,behavior_set,energy\n")
                ),
                ("mission.csv", None),
                ("targets.csv", Some("t_ms,target,x_m,y_m,observers\n")),
                ("inputs.jsonl", Some("")),
                ("foreign.bin", Some(HEADER)),
                ("ticks.csv", Some("t_ms,tick,robot,section,hash\n")),
            ]
        );
    }
}
