//! Faults and recoveries in events.csv.

use run_log::EventRow;
use scenario::time::SimTime;

use observation::stints::Span;

/// An event that the report lists as a fault.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaultMark {
    pub at: SimTime,
    pub label: String,
    /// The detail from the log; may be empty.
    pub detail: String,
    pub phase: FaultMarkPhase,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultMarkPhase {
    Begin,
    /// The end of the fault, or its announcement before the start.
    End,
    /// One effect of the fault; a fault can have thousands.
    Hit,
}

/// Returns all faults in order of time. Joins at the start do not count.
#[must_use]
pub fn faults(events: &[EventRow]) -> Vec<FaultMark> {
    events.iter().filter_map(fault).collect()
}

fn fault(event: &EventRow) -> Option<FaultMark> {
    let EventRow { robot, subject, .. } = event;
    let (phase, label) = match event.kind.as_str() {
        "gone" => (FaultMarkPhase::Begin, format!("{robot} died")),
        "stalled" => (FaultMarkPhase::Begin, format!("{robot} stopped")),
        "back" => (FaultMarkPhase::End, format!("{robot} back")),
        "joined" if event.t_ms > SimTime::ZERO => (FaultMarkPhase::End, format!("{robot} joined")),
        "lost" => (FaultMarkPhase::Hit, format!("{robot} lost a message")),
        "hit" => (FaultMarkPhase::Hit, format!("{subject} hit")),
        kind @ ("applied" | "failed") => (FaultMarkPhase::Begin, format!("{subject} {kind}")),
        kind @ ("armed" | "healed" | "disarmed") => {
            (FaultMarkPhase::End, format!("{subject} {kind}"))
        }
        _ => return None,
    };
    Some(FaultMark {
        at: event.t_ms,
        label,
        detail: event.detail.clone(),
        phase,
    })
}

/// The period of a fault; empty for a momentary fault.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaultSpan {
    pub span: Span,
    pub label: String,
}

/// Returns the faults of a run that lasted until `end`, by start time. Deaths and stops without a scripted fault count
/// too. Faults with equal labels and times are merged.
#[must_use]
pub fn fault_spans(events: &[EventRow], end: SimTime) -> Vec<FaultSpan> {
    // Each entry has the event's subject or robot, by which the end event finds it.
    let mut all: Vec<(&str, FaultSpan)> = Vec::new();
    let mut open: Vec<usize> = Vec::new();
    for event in events {
        let at = event.t_ms;
        let scripted = |words: &[&str]| {
            let mut same = events.iter().filter(|other| other.t_ms == at);
            same.any(|other| {
                let (kind, target) = other.detail.split_once(' ').unwrap_or_default();
                other.kind == "applied" && words.contains(&kind) && target == event.robot
            })
        };
        let begun = match event.kind.as_str() {
            "applied" => Some((event.subject.as_str(), short_label(&event.detail))),
            "gone" if !scripted(&["kill", "terminate", "remove", "restart"]) => {
                Some((event.robot.as_str(), format!("{} died", event.robot)))
            }
            "stalled" if !scripted(&["pause"]) => {
                Some((event.robot.as_str(), format!("{} stopped", event.robot)))
            }
            _ => None,
        };
        let ended = match event.kind.as_str() {
            "healed" => event.subject.as_str(),
            "joined" | "back" => event.robot.as_str(),
            _ => "",
        };
        open.retain(|place| {
            let (owner, fault) = &mut all[*place];
            let ends = *owner == ended;
            if ends {
                fault.span.to = at;
            }
            !ends
        });
        if let Some((owner, label)) = begun {
            let kind = event.detail.split(' ').next().unwrap_or_default();
            let lasts =
                event.kind != "applied" || !scenario::fault::Fault::is_instantaneous_name(kind);
            if lasts {
                open.push(all.len());
            }
            let to = if lasts { end } else { at };
            let span = Span { from: at, to };
            all.push((owner, FaultSpan { span, label }));
        }
    }
    let mut merged: Vec<(usize, FaultSpan)> = Vec::new();
    for (_, fault) in all {
        match merged.iter_mut().find(|(_, other)| *other == fault) {
            Some((count, _)) => *count += 1,
            None => merged.push((1, fault)),
        }
    }
    let named = merged.into_iter().map(|(count, fault)| match count {
        1 => fault,
        _ => FaultSpan {
            label: format!("{count} × {}", fault.label),
            ..fault
        },
    });
    named.collect()
}

/// Shortens a logged fault for a figure: `drop --from green --to all --p 0.3` becomes `drop green→all 0.3`. Places are
/// left out because the map shows them.
fn short_label(detail: &str) -> String {
    let words: Vec<&str> = detail.split(' ').collect();
    let kind = words[0];
    if kind == "obstacle" || !scenario::fault::Fault::COMMON_NAMES.contains(&kind) {
        return kind.to_owned();
    }
    let option = |name: &str| {
        let place = words.iter().position(|word| *word == name)?;
        words.get(place + 1).copied()
    };
    let mut parts = vec![kind.to_owned()];
    if let (Some(from), Some(to)) = (option("--from"), option("--to")) {
        parts.push(format!("{from}→{to}"));
    }
    let rest = words[1..].iter().enumerate().filter(|(place, word)| {
        let of_link = matches!(words[*place], "--from" | "--to");
        !word.starts_with("--") && !of_link
    });
    parts.extend(rest.map(|(_, word)| (*word).to_owned()));
    parts.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads events from lines with time, kind, robot, subject and detail.
    fn events(lines: &str) -> Vec<EventRow> {
        let lines = lines.lines().filter(|line| !line.trim().is_empty());
        let events = lines.map(|line| {
            let cells: Vec<&str> = line.split(',').map(str::trim).collect();
            EventRow {
                t_ms: SimTime(cells[0].parse().unwrap()),
                kind: cells[1].to_owned(),
                robot: cells[2].to_owned(),
                subject: cells[3].to_owned(),
                reason: String::new(),
                detail: cells[4].to_owned(),
            }
        });
        events.collect()
    }

    #[test]
    fn fault_spans_have_short_labels() {
        let events = events(
            "
            0, joined, blue, ,
            0, armed, , f1, kill gold
            100, gone, gold, , incarnation 1
            100, applied, gold, f1, kill gold
            150, applied, , f2, obstacle 0 6.55 0.05 1
            150, applied, , f3, obstacle 0.62 6.55 0.2 1
            200, applied, , f4, drop --from green --to all --p 0.3
            220, hit, gold, f4,
            250, joined, gold, , incarnation 2
            250, healed, gold, f1, kill gold
            300, applied, , f5, waste 1 1 --items 1
            350, healed, , f4, drop --from green --to all --p 0.3
            400, gone, blue, ,
            450, stalled, green, ,
            500, back, green, ,
            ",
        );
        let found: Vec<String> = fault_spans(&events, SimTime(900))
            .into_iter()
            .map(|fault| format!("{} {} {}", fault.span.from.0, fault.span.to.0, fault.label))
            .collect();
        let expected = [
            "100 250 kill gold",
            "150 900 2 × obstacle",
            "200 350 drop green→all 0.3",
            "300 300 waste",
            "400 900 blue died",
            "450 500 green stopped",
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn events_become_faults_by_kind() {
        let events = events(
            "
            0, joined, blue, ,
            50, activated, blue, move-spill(top),
            100, armed, , cut,
            150, applied, , cut,
            200, hit, gold, cut,
            250, lost, blue, gold,
            300, healed, , cut,
            350, gone, gold, ,
            400, joined, gold, ,
            450, stalled, green, ,
            500, back, green, ,
            550, failed, , push,
            600, disarmed, , push,
            ",
        );
        let found: Vec<String> = faults(&events)
            .into_iter()
            .map(|fault| format!("{} {} {:?}", fault.at.0, fault.label, fault.phase))
            .collect();
        let expected = [
            "100 cut armed End",
            "150 cut applied Begin",
            "200 cut hit Hit",
            "250 blue lost a message Hit",
            "300 cut healed End",
            "350 gold died Begin",
            "400 gold joined End",
            "450 green stopped Begin",
            "500 green back End",
            "550 push failed Begin",
            "600 push disarmed End",
        ];
        assert_eq!(found, expected);
    }
}
