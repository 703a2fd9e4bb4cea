//! The rows that a tick adds to each table.

use crate::{DeclaredRow, Input, InputLine, MessageRow, Table};
use proto::event::EventLine;
use proto::telemetry::{AllocationRow, Motivation, Reception};
use scenario::ids::RobotId;
use scenario::time::SimTime;

use super::answers::motivation_bits;
use super::changed_rows::{ChangedRows, RowChange, allocation_bits};
use super::in_flight::InFlight;
use super::names::Names;
use super::record::{BodyRecord, EventKind, TickRecord};
use super::repeated::{RowCache, body_bits};
use super::row::{CachedFields, Row};
use scenario::mission::FigureValue;

/// Encodes motivations.csv: one row per behavior set of each robot that counted.
pub(super) fn motivations(
    names: &Names,
    repeated: &mut RowCache,
    record: &TickRecord<'_>,
    rows: &mut Vec<u8>,
) {
    let answers = record.answers.iter().zip(&mut repeated.motivations);
    for (answer, tails) in answers.filter(|(answer, _)| answer.counts) {
        let report = &answer.report;
        tails.resize_with(report.motivations.len(), CachedFields::default);
        for (motivation, tail) in report.motivations.iter().zip(tails) {
            let row = Row::new(rows).fields(&repeated.now);
            row.end_with(tail, motivation_bits(motivation), |row| {
                motivation_values(names, row.text(names.robot(report.robot)), motivation);
            });
        }
    }
}

/// Encodes the rows of motivations.csv that a compact log writes.
pub(super) fn changed_motivations(
    names: &Names,
    repeated: &RowCache,
    changed: &mut ChangedRows,
    record: &TickRecord<'_>,
    rows: &mut Vec<u8>,
) {
    let robots = (0..).map(RobotId).zip(&mut changed.motivations);
    for ((robot, latest), answer) in robots.zip(record.answers) {
        let motivations = present(answer.counts, &answer.report.motivations);
        let bits = motivations.iter().map(motivation_bits);
        latest.update(&changed.rule, bits, |change| match change {
            RowChange::End => end(repeated, robot, Table::Motivations, rows),
            RowChange::Row(index) => {
                let row = start(repeated, robot, rows);
                motivation_values(names, row, &motivations[index]);
            }
        });
    }
}

fn motivation_values(names: &Names, row: Row<'_>, motivation: &Motivation) {
    row.text(names.set(Some(motivation.set)))
        .text(names.task_of(motivation.set))
        .real(motivation.motivation)
        .real(motivation.impatience)
        .flag(motivation.sensory_feedback)
        .flag(motivation.activity_suppression)
        .flag(motivation.impatience_reset)
        .flag(motivation.acquiescence)
        .word(motivation.state.as_str())
        .end();
}

/// Starts a row with the time and the robot.
fn start<'b>(repeated: &RowCache, robot: RobotId, rows: &'b mut Vec<u8>) -> Row<'b> {
    let row = Row::new(rows).fields(&repeated.now);
    row.fields(repeated.robot(robot))
}

/// Adds the row of a compact log that ends all earlier rows of the robot.
fn end(repeated: &RowCache, robot: RobotId, table: Table, rows: &mut Vec<u8>) {
    // The header line is missing only for mission.csv.
    let columns = table.header().unwrap_or_default().split(',').count();
    let row = start(repeated, robot, rows);
    (2..columns).fold(row, |row, _| row.text("")).end();
}

/// Returns the rows of a robot, or none if it is absent.
fn present<T>(is_present: bool, rows: &[T]) -> &[T] {
    if is_present { rows } else { &[] }
}

/// Encodes allocation.csv: one row per behavior set that a robot's allocator reports.
pub(super) fn allocation(
    names: &Names,
    repeated: &RowCache,
    record: &TickRecord<'_>,
    rows: &mut Vec<u8>,
) {
    for answer in record.counted() {
        for allocation in &answer.report.allocation {
            let row = Row::new(rows).fields(&repeated.now);
            allocation_values(
                names,
                row.text(names.robot(answer.report.robot)),
                allocation,
            );
        }
    }
}

/// Encodes the rows of allocation.csv that a compact log writes.
pub(super) fn changed_allocation(
    names: &Names,
    repeated: &RowCache,
    changed: &mut ChangedRows,
    record: &TickRecord<'_>,
    rows: &mut Vec<u8>,
) {
    let robots = (0..).map(RobotId).zip(&mut changed.allocation);
    for ((robot, latest), answer) in robots.zip(record.answers) {
        let allocation = present(answer.counts, &answer.report.allocation);
        let bits = allocation.iter().map(allocation_bits);
        latest.update(&changed.rule, bits, |change| match change {
            RowChange::End => end(repeated, robot, Table::Allocation, rows),
            RowChange::Row(index) => {
                let row = start(repeated, robot, rows);
                allocation_values(names, row, &allocation[index]);
            }
        });
    }
}

fn allocation_values(names: &Names, row: Row<'_>, allocation: &AllocationRow) {
    row.text(names.task(Some(allocation.task)))
        .text(names.set(Some(allocation.behavior)))
        .real(allocation.utility)
        .text(allocation.holder.map_or("", |holder| names.robot(holder)))
        .word(allocation.state.as_str())
        .end();
}

/// Encodes messages.csv: one row per broadcast and receiver when its delivery is final. Second copies have rows of their own.
pub(super) fn messages(
    names: &Names,
    repeated: &mut RowCache,
    on_their_way: &mut InFlight,
    record: &TickRecord<'_>,
    rows: &mut Vec<u8>,
) {
    for counted in record.counted() {
        let (receiver, incarnation) = (counted.report.robot, counted.report.incarnation);
        for reception in &counted.report.receptions {
            if on_their_way.register(receiver, incarnation, reception) {
                message(names, repeated, receiver, reception, rows);
            }
        }
    }
    for input in record.inputs {
        if let Input::Gone {
            robot, incarnation, ..
        } = input
            && let Some(receiver) = names.roster.find(robot)
        {
            let in_flight = on_their_way.take_of_incarnation(receiver, *incarnation);
            pending(names, repeated, &in_flight, rows);
        }
    }
}

/// Encodes rows of messages.csv for broadcasts that are still in flight and will not be reported again.
pub(super) fn pending(
    names: &Names,
    repeated: &mut RowCache,
    in_flight: &[(RobotId, Reception)],
    rows: &mut Vec<u8>,
) {
    for (receiver, reception) in in_flight {
        message(names, repeated, *receiver, reception, rows);
    }
}

fn message(
    names: &Names,
    repeated: &mut RowCache,
    receiver: RobotId,
    reception: &Reception,
    rows: &mut Vec<u8>,
) {
    // Any slot is correct, because the key contains the sender.
    let slot = reception.sender.index() % repeated.messages.len();
    // The time is not part of the key, because it is encoded at the start of the row.
    let key = Reception {
        at: SimTime::default(),
        ..*reception
    };
    // Unknown senders share a name, so their rows are always complete.
    let is_known = slot == reception.sender.index();
    if repeated.omits_repeated && is_known && repeated.messages[slot].are_of(&key) {
        let row = Row::new(rows).number(reception.at.0);
        let row = row
            .fields(repeated.robot(receiver))
            .fields(repeated.robot(reception.sender));
        (3..MessageRow::COLUMNS.len())
            .fold(row, |row, _| row.text(""))
            .end();
        return;
    }
    Row::new(rows)
        .number(reception.at.0)
        .fields(repeated.robot(receiver))
        .end_with(&mut repeated.messages[slot], key, |row| {
            let content = reception.content;
            let state = content.and_then(|content| content.state);
            row.text(names.robot(reception.sender))
                .number(reception.incarnation)
                .optional(content.map(|content| content.seq))
                .text(content.map_or("", |content| names.broadcast(content.kind)))
                .text(state.map_or("", |state| state.as_str()))
                .optional(
                    content
                        .and_then(|content| content.since)
                        .map(|since| since.0),
                )
                .text(names.set(content.and_then(|content| content.set)))
                .text(names.task(content.and_then(|content| content.task)))
                .optional(content.and_then(|content| content.progress))
                .number(reception.sent.0)
                .text(reception.delivery.as_str())
                .end();
        });
}

/// Returns the events of a tick: inputs first, then state changes and notes of each robot, then events of faults and the world.
pub(super) fn events(names: &Names, record: &TickRecord<'_>) -> Vec<EventLine> {
    let mut lines = Vec::new();
    let mut line = |kind: EventKind, [robot, subject, reason, detail]: [&str; 4]| {
        lines.push(EventLine {
            t_ms: record.now,
            kind: kind.to_string(),
            robot: robot.to_owned(),
            subject: subject.to_owned(),
            reason: reason.to_owned(),
            detail: detail.to_owned(),
        });
    };
    for (kind, robot, subject, detail) in record.inputs.iter().filter_map(describe) {
        line(kind, [robot, subject, "", &detail]);
    }
    for counted in record.counted() {
        let report = &counted.report;
        for change in &report.changes {
            let robot = names.robot(report.robot);
            let reason = change.reason.describe(|robot| names.robot(robot));
            let (set, task) = (names.set(Some(change.set)), names.task_of(change.set));
            line(EventKind::State(change.to), [robot, set, &reason, task]);
        }
        for note in &report.notes {
            line(
                EventKind::Note(names.note(note.kind)),
                [names.robot(report.robot), "", "", &note.detail],
            );
        }
    }
    for event in record.events {
        let robot = event.robot.map_or("", |robot| names.robot(robot));
        line(
            event.kind,
            [robot, &event.subject, &event.reason, &event.detail],
        );
    }
    lines
}

pub(super) fn event_rows(lines: &[EventLine], rows: &mut Vec<u8>) {
    for line in lines {
        Row::new(rows)
            .number(line.t_ms.0)
            .text(&line.kind)
            .text(&line.robot)
            .text(&line.subject)
            .text(&line.reason)
            .text(&line.detail)
            .end();
    }
}

/// Returns kind, robot, subject and detail of an input's row. Inputs about faults have none, because the fault schedule adds
/// events for them.
fn describe(input: &Input) -> Option<(EventKind, &str, &str, String)> {
    Some(match input {
        Input::Join {
            robot, incarnation, ..
        } => (
            EventKind::Joined,
            robot,
            "",
            format!("incarnation {incarnation}"),
        ),
        Input::Gone {
            robot,
            incarnation: 0,
            ..
        } => (EventKind::Gone, robot, "", "never joined".to_owned()),
        Input::Gone {
            robot,
            incarnation,
            last_counted,
            listed,
            ..
        } => {
            let counted = match last_counted {
                Some(tick) => format!("last counted in tick {tick}"),
                None => "never counted".to_owned(),
            };
            let broadcasts = if *listed { "listed" } else { "not listed" };
            let detail =
                format!("incarnation {incarnation}; {counted}; last broadcasts {broadcasts}");
            (EventKind::Gone, robot, "", detail)
        }
        Input::StallBegin { robot, .. } => (EventKind::Stalled, robot, "", String::new()),
        Input::StallEnd { robot, .. } => (EventKind::Back, robot, "", String::new()),
        Input::Lost {
            receiver,
            sender,
            sent_tick,
            index,
        } => {
            let detail = format!("broadcast {index} of tick {sent_tick}");
            (EventKind::Lost, receiver, sender, detail)
        }
        Input::Order { .. }
        | Input::Clear { .. }
        | Input::Failed { .. }
        | Input::Branch(_)
        | Input::Body(_) => return None,
    })
}

pub(super) fn poses(
    names: &Names,
    repeated: &mut RowCache,
    record: &TickRecord<'_>,
    rows: &mut Vec<u8>,
) {
    let bodies = record.bodies.iter().zip(names.robots());
    for ((body, name), tail) in bodies.zip(&mut repeated.poses) {
        if !body.present {
            continue;
        }
        let row = Row::new(rows).fields(&repeated.now);
        row.end_with(tail, body_bits(body), |row| {
            body_values(names, row.text(name), body);
        });
    }
}

/// Encodes the rows of poses.csv that a compact log writes.
pub(super) fn changed_poses(
    names: &Names,
    repeated: &RowCache,
    changed: &mut ChangedRows,
    record: &TickRecord<'_>,
    rows: &mut Vec<u8>,
) {
    let robots = (0..).map(RobotId).zip(&mut changed.poses);
    for ((robot, latest), body) in robots.zip(record.bodies) {
        let bodies = present(body.present, std::slice::from_ref(body));
        latest.update(
            &changed.rule,
            bodies.iter().map(body_bits),
            |change| match change {
                RowChange::End => end(repeated, robot, Table::Poses, rows),
                RowChange::Row(_) => body_values(names, start(repeated, robot, rows), body),
            },
        );
    }
}

fn body_values(names: &Names, row: Row<'_>, body: &BodyRecord) {
    let row = row
        .real(body.pose.position.x)
        .real(body.pose.position.y)
        .real(body.pose.heading_rad)
        .real(body.speed_m_s)
        .flag(body.carrying)
        .text(names.set(body.active));
    match body.energy_j {
        Some(energy_j) => row.real(energy_j).end(),
        None => row.text("").end(),
    }
}

pub(super) fn mission(record: &TickRecord<'_>, rows: &mut Vec<u8>) {
    let first = Row::new(rows).number(record.now.0);
    let values = record.mission.iter();
    let all = values.fold(first, |row, value| match *value {
        FigureValue::Count(count) => row.number(count),
        FigureValue::Real(number) => row.real(number),
        FigureValue::None => row.text(""),
    });
    all.end();
}

pub(super) fn sent(repeated: &RowCache, record: &TickRecord<'_>, rows: &mut Vec<u8>) {
    for report in record.senders() {
        Row::new(rows)
            .fields(&repeated.now)
            .fields(repeated.robot(report.robot))
            .number(report.broadcasts)
            .number(report.broadcast_bytes)
            .end();
    }
}

pub(super) fn hits(repeated: &RowCache, record: &TickRecord<'_>, rows: &mut Vec<u8>) {
    for hits in record.hits {
        Row::new(rows)
            .fields(&repeated.now)
            .text(&hits.fault)
            .number(hits.count)
            .end();
    }
}

pub(super) fn targets(repeated: &RowCache, record: &TickRecord<'_>, rows: &mut Vec<u8>) {
    for (number, target) in record.targets.iter().enumerate() {
        Row::new(rows)
            .fields(&repeated.now)
            .numbered('t', number)
            .real(target.at.x)
            .real(target.at.y)
            .number(target.observers)
            .end();
    }
}

pub(super) fn inputs(record: &TickRecord<'_>, lines: &mut Vec<u8>) {
    for input in record.inputs {
        let line = InputLine {
            tick: record.tick,
            input: input.clone(),
        };
        serde_json::to_writer(&mut *lines, &line)
            // Strings and numbers are written to memory, which cannot fail.
            .expect("an input can be encoded");
        lines.push(b'\n');
    }
}
