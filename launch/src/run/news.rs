//! The lines that `alliance run` prints while the mission continues: faults, losses of robots, their detection and takeovers.

use std::mem;

use observation::detections::DetectionWatch;
use observation::takeovers::{LossTakeover, TakeoverDetector};
use proto::event::{EventLine, TickEvents};
use proto::view::View;
use scenario::ids::{BehaviorId, Tick};
use scenario::time::SimTime;
use scenario::{Setup, listed, shortened};

/// The maximum number of lines for each minute of simulated time. The number of the others is one more line.
const LINES_PER_MINUTE: usize = 20;

/// The maximum number of names in a line.
const NAMES: usize = 4;

/// One minute of simulated time.
const MINUTE: SimTime = SimTime(60_000);

/// The news of a run, found in its events and views. Equal events of a tick are one line.
pub struct RunNews {
    takeovers: TakeoverDetector,
    detections: DetectionWatch,
    /// The tick of the newest events, for the detection of repetitions.
    events: Option<Tick>,
    view: Option<Tick>,
    latest_loss: Option<SimTime>,
    /// The number of the current minute of simulated time.
    minute: u64,
    /// The number of lines in the current minute.
    lines: usize,
    left_out: usize,
}

impl RunNews {
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        Self {
            takeovers: TakeoverDetector::new(setup),
            detections: DetectionWatch::new(setup),
            events: None,
            view: None,
            latest_loss: None,
            minute: 0,
            lines: 0,
            left_out: 0,
        }
    }

    /// Adds the events of a tick and returns the lines about them.
    pub fn add(&mut self, news: &TickEvents) -> Vec<String> {
        if self.events.is_some_and(|newest| news.tick <= newest) {
            return Vec::new();
        }
        self.events = Some(news.tick);
        let failed = news.events.iter().filter(|event| event.kind == "failed");
        let failed: Vec<&str> = failed.map(|event| event.subject.as_str()).collect();
        let mut found = Vec::new();
        for kind in ["applied", "healed", "failed", "gone", "stalled", "back"] {
            let events = news.events.iter().filter(|event| event.kind == kind);
            // A fault that fails at once has only one line.
            let events =
                events.filter(|event| kind != "applied" || !failed.contains(&&*event.subject));
            let events: Vec<&EventLine> = events.collect();
            if let Some(first) = events.first() {
                let mut line = self.describe(kind, &events);
                if let ("applied", [one]) = (kind, &events[..])
                    && let Some(place) = place_of(one, news)
                {
                    line += &format!(": {place}");
                }
                found.push((first.t_ms, line));
            }
        }
        for event in &news.events {
            self.takeovers.add(event);
            if matches!(event.kind.as_str(), "gone" | "stalled") {
                self.latest_loss = Some(event.t_ms);
            }
        }
        self.bounded(found)
    }

    /// Returns whether the view of this time is needed for the exact time of a detection, shortly after a loss.
    #[must_use]
    pub fn needs_view(&self, now: SimTime) -> bool {
        self.latest_loss.is_some_and(|loss| now <= loss + MINUTE)
    }

    /// Sets the behavior sets that the robots execute, in a tick without a view.
    pub fn set_active(&mut self, active: impl Iterator<Item = Option<BehaviorId>>) {
        self.detections.set_active(active);
    }

    /// Adds a view and returns the lines about detections in it and about takeovers that are certain by then.
    pub fn see(&mut self, view: &View) -> Vec<String> {
        if self.view.is_some_and(|newest| view.tick < newest) {
            return Vec::new();
        }
        self.view = Some(view.tick);
        let detections = self.detections.see(view);
        match view.outcome {
            Some(_) => {
                let takeovers = self.takeovers.finish(view.now);
                self.lines_of(&takeovers, &detections)
            }
            None => self.takeovers_until(view.now, &detections),
        }
    }

    /// Returns the lines about takeovers that are certain at `now`, and about detections. A detection that is found together
    /// with its takeover, or while the takeover is undecided, has no line: it happened at an unknown earlier time.
    pub fn takeovers_until(&mut self, now: SimTime, detections: &[EventLine]) -> Vec<String> {
        let takeovers = self.takeovers.take(now);
        self.lines_of(&takeovers, detections)
    }

    fn lines_of(&mut self, takeovers: &[LossTakeover], detections: &[EventLine]) -> Vec<String> {
        let detections = detections.iter().filter(|event| {
            let mut taken = takeovers.iter();
            !taken.any(|each| each.task == event.subject && each.from == event.reason)
                && !self.takeovers.has_undecided_takeover(&event.subject)
        });
        let mut found: Vec<(SimTime, String)> = detections.map(detection).collect();
        found.extend(takeovers.iter().map(takeover));
        found.sort_by_key(|(at, _)| *at);
        self.bounded(found)
    }

    /// Returns the line about the lines that were left out in the current minute.
    pub fn finish(&mut self) -> Option<String> {
        let left_out = mem::take(&mut self.left_out);
        let [from, to] = [self.minute, self.minute + 1].map(|minute| minute * MINUTE.0 / 1000);
        (left_out > 0).then(|| {
            format!(
                "{from} s to {to} s: {left_out} more lines; at most {LINES_PER_MINUTE} for each simulated minute are \
                 printed, `alliance watch` shows all"
            )
        })
    }

    /// Describes events of one kind in one tick.
    fn describe(&self, kind: &str, events: &[&EventLine]) -> String {
        let is_fault = matches!(kind, "applied" | "healed" | "failed");
        let names = events.iter().map(|event| match is_fault {
            true => event.subject.as_str(),
            false => event.robot.as_str(),
        });
        let names = listed(&names.collect::<Vec<_>>(), NAMES);
        let does = match (kind, events) {
            ("gone", [_]) => "dies",
            ("gone", _) => "die",
            ("stalled", [_]) => "does not answer any more",
            ("stalled", _) => "do not answer any more",
            ("back", [_]) => "answers again",
            ("back", _) => "answer again",
            (fault, _) => fault,
        };
        let [event] = events else {
            return format!("{names} {does}");
        };
        if is_fault {
            let why = match event.reason.as_str() {
                "" => String::new(),
                reason => format!(" ({reason})"),
            };
            return format!("{names} {does} {}{why}", shortened(&event.detail));
        }
        let tasks = match kind {
            "gone" | "stalled" => self.takeovers.tasks_of(&event.robot),
            _ => Vec::new(),
        };
        match tasks.is_empty() {
            true => format!("{names} {does}"),
            false => format!("{names} {does}, executing {}", listed(&tasks, NAMES)),
        }
    }

    /// Returns the lines with their times. Those above [`LINES_PER_MINUTE`] are only counted.
    fn bounded(&mut self, found: Vec<(SimTime, String)>) -> Vec<String> {
        let mut lines = Vec::new();
        for (at, line) in found {
            let minute = at.0 / MINUTE.0;
            if minute > self.minute {
                lines.extend(self.finish());
                self.minute = minute;
                self.lines = 0;
            }
            if self.lines < LINES_PER_MINUTE {
                self.lines += 1;
                lines.push(format!("{at}: {line}"));
            } else {
                self.left_out += 1;
            }
        }
        lines
    }
}

fn takeover(takeover: &LossTakeover) -> (SimTime, String) {
    let (robot, task, from) = (&takeover.robot, &takeover.task, &takeover.from);
    let delay = takeover.delay();
    (
        takeover.at,
        format!("{robot} takes over {task} from {from}, {delay}"),
    )
}

fn detection(event: &EventLine) -> (SimTime, String) {
    let EventLine {
        t_ms,
        robot,
        subject,
        reason,
        detail,
        ..
    } = event;
    let line = format!("{robot} detects the loss of {reason} at {subject}, {detail}");
    (*t_ms, line)
}

/// Returns the thing that a fault placed, with its place, m. The place can differ from the wanted one.
fn place_of<'n>(applied: &EventLine, news: &'n TickEvents) -> Option<&'n str> {
    let mut hits = news.events.iter().filter(|event| event.kind == "hit");
    let hit = hits.find(|event| event.subject == applied.subject)?;
    Some(hit.reason.as_str()).filter(|reason| reason.contains(' '))
}

#[cfg(test)]
mod tests {
    use scenario::testkit::default_setup;

    use super::*;

    fn event(tick: Tick, kind: &str, robot: &str, subject: &str) -> EventLine {
        EventLine {
            t_ms: SimTime(50 * tick),
            kind: kind.to_owned(),
            robot: robot.to_owned(),
            subject: subject.to_owned(),
            reason: String::new(),
            detail: String::new(),
        }
    }

    fn at(tick: Tick, events: Vec<EventLine>) -> TickEvents {
        TickEvents { tick, events }
    }

    #[test]
    fn a_loss_and_its_takeover_are_lines_with_the_task() {
        let setup = default_setup(1);
        let mut news = RunNews::new(&setup);
        let tasks = &setup.catalog.tasks;
        let mut sets = setup.catalog.sets.iter();
        let set = sets.find(|set| tasks[set.task.index()].max_robots == 1);
        let (set, task) = (&set.unwrap().name, &tasks[set.unwrap().task.index()].name);
        assert_eq!(
            news.add(&at(10, vec![event(10, "activated", "gold", set)])),
            [""; 0]
        );
        let killed = EventLine {
            detail: "kill gold".to_owned(),
            ..event(20, "applied", "", "f1")
        };
        let gone = at(20, vec![event(20, "gone", "gold", ""), killed]);
        let expected = [
            "1.000 s: f1 applied kill gold".to_owned(),
            format!("1.000 s: gold dies, executing {task}"),
        ];
        assert_eq!(news.add(&gone), expected);
        assert_eq!(news.add(&gone), [""; 0], "repeated");
        assert!(news.needs_view(SimTime(61_000)) && !news.needs_view(SimTime(61_001)));
        assert_eq!(
            news.add(&at(90, vec![event(90, "activated", "green", set)])),
            [""; 0]
        );
        // A view shows the detection after the activation, and the takeover is not certain yet.
        let detected = EventLine {
            reason: "gold".to_owned(),
            ..event(91, "detected", "blue", task)
        };
        assert_eq!(news.takeovers_until(SimTime(4600), &[detected]), [""; 0]);
        assert_eq!(
            news.add(&at(100, vec![event(100, "done", "green", "")])),
            [""; 0]
        );
        let takeover =
            format!("4.500 s: green takes over {task} from gold, 3.50 s after its death");
        assert_eq!(news.takeovers_until(SimTime(5050), &[]), [takeover]);
        assert_eq!(news.finish(), None);
    }

    #[test]
    fn a_fault_names_its_place_or_the_reason_of_its_failure() {
        let mut news = RunNews::new(&default_setup(1));
        let of = |kind: &str, id: &str, reason: &str| EventLine {
            reason: reason.to_owned(),
            detail: "waste --x-m 2.5".to_owned(),
            ..event(20, kind, "", id)
        };
        let placed = vec![
            of("applied", "w", "at 1 s"),
            of("hit", "w", "item-24 4.1 2.5"),
            of("applied", "v", "at 1 s"),
            of("failed", "v", "no room"),
        ];
        assert_eq!(
            news.add(&at(20, placed)),
            [
                "1.000 s: w applied waste --x-m 2.5 (at 1 s): item-24 4.1 2.5",
                "1.000 s: v failed waste --x-m 2.5 (no room)"
            ]
        );
    }

    #[test]
    fn equal_events_of_a_tick_are_one_line_and_each_minute_has_a_bound() {
        let mut news = RunNews::new(&default_setup(1));
        let names: Vec<String> = (1..=300).map(|robot| format!("r{robot}")).collect();
        let gone = names.iter().map(|name| event(2, "gone", name, ""));
        assert_eq!(
            news.add(&at(2, gone.collect())),
            ["0.100 s: r1, r2, r3, r4 and 296 more die"]
        );
        let mut lines = 1;
        for tick in 3..1200 {
            lines += news
                .add(&at(tick, vec![event(tick, "back", "blue", "")]))
                .len();
        }
        assert_eq!(lines, LINES_PER_MINUTE);
        let next = news.add(&at(1200, vec![event(1200, "back", "blue", "")]));
        let expected = [
            "0 s to 60 s: 1178 more lines; at most 20 for each simulated minute are printed, `alliance watch` shows all",
            "60.000 s: blue answers again",
        ];
        assert_eq!(next, expected);
        assert_eq!(news.finish(), None);
    }
}
