//! The append-only files of a run: their names and their header lines.

/// An append-only file of a run's folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Table {
    /// The motivations of each robot's behavior sets, with their factors.
    Motivations,
    /// What allocators without motivations hold of each behavior set; there only if a robot of the run has one.
    Allocation,
    /// Every broadcast at every receiver.
    Messages,
    /// What happened.
    Events,
    /// Where every robot was at the start of each tick.
    Poses,
    /// How far the mission has come; a row for the first tick and for each tick that changed something.
    Mission,
    /// Where every target was after each tick, and how many robots see it; there only if the mission has targets.
    Targets,
    /// What came from outside; JSON lines.
    Inputs,
    /// The answers of robots whose minds are programs of their own ([`super::foreign`]); there only if a robot of the run has one.
    Foreign,
    /// Hashes. The last to be written: what is not sealed there does not count.
    Ticks,
}

impl Table {
    /// All, in the order in which a flush writes them.
    pub const ALL: [Self; 10] = [
        Self::Motivations,
        Self::Allocation,
        Self::Messages,
        Self::Events,
        Self::Poses,
        Self::Mission,
        Self::Targets,
        Self::Inputs,
        Self::Foreign,
        Self::Ticks,
    ];

    /// Name in the run's folder.
    #[must_use]
    pub fn file_name(self) -> &'static str {
        match self {
            Self::Motivations => "motivations.csv",
            Self::Allocation => "allocation.csv",
            Self::Messages => "messages.csv",
            Self::Events => "events.csv",
            Self::Poses => "poses.csv",
            Self::Mission => "mission.csv",
            Self::Targets => "targets.csv",
            Self::Inputs => "inputs.jsonl",
            Self::Foreign => "foreign.bin",
            Self::Ticks => "ticks.csv",
        }
    }

    /// Whether the file is there only if it has rows.
    #[must_use]
    pub fn is_optional(self) -> bool {
        matches!(self, Self::Allocation | Self::Targets | Self::Foreign)
    }

    /// First line with its line end; empty for JSON lines (DESIGN §8). `None` of mission.csv: the mission has
    /// its own, after `t_ms`.
    #[must_use]
    pub fn header(self) -> Option<&'static str> {
        Some(match self {
            Self::Motivations => {
                "t_ms,robot,behavior_set,task,motivation,impatience,sensory_feedback,activity_suppression,\
                 impatience_reset,acquiescence,state\n"
            }
            Self::Allocation => "t_ms,robot,task,behavior_set,utility,holder,state\n",
            Self::Messages => {
                "t_ms,receiver,sender,incarnation,seq,kind,state,since_ms,behavior_set,task,progress,sent_ms,fate\n"
            }
            Self::Events => "t_ms,kind,robot,subject,reason,detail\n",
            Self::Poses => {
                "t_ms,robot,x_m,y_m,heading_rad,speed_m_s,carrying,behavior_set,energy\n"
            }
            Self::Mission => return None,
            Self::Targets => "t_ms,target,x_m,y_m,observers\n",
            Self::Inputs => "",
            Self::Foreign => super::foreign::HEADER,
            Self::Ticks => "t_ms,tick,robot,section,hash\n",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::foreign::HEADER;
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
                    "messages.csv",
                    Some(
                        "t_ms,receiver,sender,incarnation,seq,kind,state,since_ms,behavior_set,task,progress,sent_ms,fate\n"
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
