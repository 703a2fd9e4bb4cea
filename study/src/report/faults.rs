//! What went wrong, and when it was right again, as events.csv has it.

use alliance_proto::log::EventRow;
use alliance_proto::time::SimTime;

/// An event to be marked in the figures.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// When.
    pub at: SimTime,
    /// In a few words.
    pub label: String,
    /// More about it, if the log says more.
    pub detail: String,
    /// Which side of a fault it is.
    pub phase: Phase,
}

/// Which side of a fault an event is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// From now on something is wrong.
    Begin,
    /// From now on it is not any more, or not yet.
    End,
    /// One of possibly very many moments in which it had an effect.
    Hit,
}

/// All of them, in order. That robots join at the start is none.
#[must_use]
pub fn faults(events: &[EventRow]) -> Vec<Fault> {
    events.iter().filter_map(fault).collect()
}

fn fault(event: &EventRow) -> Option<Fault> {
    let EventRow { robot, subject, .. } = event;
    let (phase, label) = match event.kind.as_str() {
        "gone" => (Phase::Begin, format!("{robot} died")),
        "stalled" => (Phase::Begin, format!("{robot} stopped")),
        "back" => (Phase::End, format!("{robot} back")),
        "joined" if event.t_ms > SimTime::ZERO => (Phase::End, format!("{robot} joined")),
        "lost" => (Phase::Hit, format!("{robot} lost a message")),
        "hit" => (Phase::Hit, format!("{subject} hit")),
        kind @ ("applied" | "failed") => (Phase::Begin, format!("{subject} {kind}")),
        kind @ ("armed" | "healed" | "cleared") => (Phase::End, format!("{subject} {kind}")),
        _ => return None,
    };
    Some(Fault {
        at: event.t_ms,
        label,
        detail: event.detail.clone(),
        phase,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(t_ms: u64, kind: &str, robot: &str, subject: &str) -> EventRow {
        EventRow {
            t_ms: SimTime(t_ms),
            kind: kind.to_owned(),
            robot: robot.to_owned(),
            subject: subject.to_owned(),
            reason: String::new(),
            detail: String::new(),
        }
    }

    #[test]
    fn faults_by_kind() {
        let events = [
            event(0, "joined", "blue", ""),
            event(50, "activated", "blue", "move-spill(top)"),
            event(100, "armed", "", "cut"),
            event(150, "applied", "", "cut"),
            event(200, "hit", "gold", "cut"),
            event(250, "lost", "blue", "gold"),
            event(300, "healed", "", "cut"),
            event(350, "gone", "gold", ""),
            event(400, "joined", "gold", ""),
            event(450, "stalled", "green", ""),
            event(500, "back", "green", ""),
            event(550, "failed", "", "push"),
            event(600, "cleared", "", "push"),
        ];
        let found: Vec<_> = faults(&events)
            .into_iter()
            .map(|fault| (fault.at.0, fault.label, fault.phase))
            .collect();
        let expected = [
            (100, "cut armed", Phase::End),
            (150, "cut applied", Phase::Begin),
            (200, "cut hit", Phase::Hit),
            (250, "blue lost a message", Phase::Hit),
            (300, "cut healed", Phase::End),
            (350, "gold died", Phase::Begin),
            (400, "gold joined", Phase::End),
            (450, "green stopped", Phase::Begin),
            (500, "green back", Phase::End),
            (550, "push failed", Phase::Begin),
            (600, "push cleared", Phase::End),
        ]
        .map(|(at, label, phase)| (at, label.to_owned(), phase));
        assert_eq!(found, expected);
    }
}
