//! The append-only files of a run: their names, their header lines, and how a row is written.

use std::fmt::Display;
use std::io::Write;

/// An append-only file of a run's folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Table {
    /// The motivations of each robot's behavior sets, with their factors.
    Motivations,
    /// Every broadcast at every receiver.
    Messages,
    /// What happened.
    Events,
    /// Where every robot was at the start of each tick.
    Poses,
    /// How far the mission has come; a row for the first tick and for each tick that changed something.
    Mission,
    /// What came from outside; JSON lines.
    Inputs,
    /// Hashes. The last to be written: what is not sealed there does not count.
    Ticks,
}

impl Table {
    /// All, in the order in which a flush writes them.
    pub const ALL: [Self; 7] = [
        Self::Motivations,
        Self::Messages,
        Self::Events,
        Self::Poses,
        Self::Mission,
        Self::Inputs,
        Self::Ticks,
    ];

    /// Name in the run's folder.
    #[must_use]
    pub fn file_name(self) -> &'static str {
        match self {
            Self::Motivations => "motivations.csv",
            Self::Messages => "messages.csv",
            Self::Events => "events.csv",
            Self::Poses => "poses.csv",
            Self::Mission => "mission.csv",
            Self::Inputs => "inputs.jsonl",
            Self::Ticks => "ticks.csv",
        }
    }

    /// First line with its line end; empty for JSON lines (DESIGN §8).
    #[must_use]
    pub fn header(self) -> &'static str {
        match self {
            Self::Motivations => {
                "t_ms,robot,behavior_set,task,motivation,impatience,sensory_feedback,activity_suppression,\
                 impatience_reset,acquiescence,state\n"
            }
            Self::Messages => {
                "t_ms,receiver,sender,incarnation,seq,kind,state,since_ms,behavior_set,task,progress,sent_ms,fate\n"
            }
            Self::Events => "t_ms,kind,robot,subject,reason,detail\n",
            Self::Poses => {
                "t_ms,robot,x_m,y_m,heading_rad,speed_m_s,carrying,behavior_set,energy\n"
            }
            Self::Mission => {
                "t_ms,items_in_spills,items_carried,items_on_floor,items_delivered,last_report_ms\n"
            }
            Self::Inputs => "",
            Self::Ticks => "t_ms,tick,robot,section,hash\n",
        }
    }
}

/// Writes one CSV row, field by field, without allocating.
pub(super) struct Row<'b>(&'b mut Vec<u8>);

impl<'b> Row<'b> {
    /// Begins a row at the end of `bytes`.
    pub fn new(bytes: &'b mut Vec<u8>) -> Self {
        Self(bytes)
    }

    /// A number: integers in decimal, floats in the shortest form that reads back to the same bits.
    pub fn number(self, value: impl Display) -> Self {
        // Writing to a Vec cannot fail.
        let _ = write!(self.0, "{value},");
        self
    }

    /// A number or nothing.
    pub fn optional(self, value: Option<impl Display>) -> Self {
        match value {
            Some(value) => self.number(value),
            None => self.text(""),
        }
    }

    /// A truth value, as 0 or 1.
    pub fn flag(self, value: bool) -> Self {
        self.0.extend_from_slice(if value { b"1," } else { b"0," });
        self
    }

    /// A hash, in 16 hexadecimal digits.
    pub fn hash(self, value: u64) -> Self {
        // Writing to a Vec cannot fail.
        let _ = write!(self.0, "{value:016x},");
        self
    }

    /// Text, quoted where CSV asks for it. Control characters become spaces, so that a row is always one line.
    pub fn text(self, text: &str) -> Self {
        let special = |byte: u8| byte.is_ascii_control() || byte == b',' || byte == b'"';
        if text.bytes().any(special) {
            self.0.push(b'"');
            for byte in text.bytes() {
                match byte {
                    b'"' => self.0.extend_from_slice(b"\"\""),
                    byte if byte.is_ascii_control() => self.0.push(b' '),
                    byte => self.0.push(byte),
                }
            }
            self.0.push(b'"');
        } else {
            self.0.extend_from_slice(text.as_bytes());
        }
        self.0.push(b',');
        self
    }

    /// Ends the row.
    pub fn end(self) {
        // Every field has left a comma behind it.
        if let Some(last) = self.0.last_mut() {
            *last = b'\n';
        }
    }
}

#[cfg(test)]
mod tests {
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
                    "t_ms,robot,behavior_set,task,motivation,impatience,sensory_feedback,activity_suppression,impatience_reset,acquiescence,state\n"
                ),
                (
                    "messages.csv",
                    "t_ms,receiver,sender,incarnation,seq,kind,state,since_ms,behavior_set,task,progress,sent_ms,fate\n"
                ),
                ("events.csv", "t_ms,kind,robot,subject,reason,detail\n"),
                (
                    "poses.csv",
                    "t_ms,robot,x_m,y_m,heading_rad,speed_m_s,carrying,behavior_set,energy\n"
                ),
                (
                    "mission.csv",
                    "t_ms,items_in_spills,items_carried,items_on_floor,items_delivered,last_report_ms\n"
                ),
                ("inputs.jsonl", ""),
                ("ticks.csv", "t_ms,tick,robot,section,hash\n"),
            ]
        );
    }

    #[test]
    fn fields() {
        let mut bytes = Vec::new();
        Row::new(&mut bytes)
            .number(7)
            .number(0.1_f32)
            .number(1e-7_f64)
            .number(100.0_f64)
            .optional(None::<u32>)
            .optional(Some(3))
            .flag(true)
            .hash(0xab)
            .text("")
            .text("a \"b\", c\nd")
            .end();
        assert_eq!(
            String::from_utf8(bytes).unwrap(),
            "7,0.1,0.0000001,100,,3,1,00000000000000ab,,\"a \"\"b\"\", c d\"\n"
        );
    }
}
