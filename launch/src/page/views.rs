//! The views of a finished run, within a bound for memory.

use proto::telemetry::BehaviorState;
use proto::view::{BehaviorView, LevelUnit, MESSAGES_MAX, Mark, MessageView, RobotView, View};
use run_log::LogLevel;
use scenario::ids::Tick;

/// The maximum size of all views in memory. A run that needs more keeps every second, fourth, … tick.
const BYTES_MAX: usize = 256 << 20;

/// The size of a group of views that the page requests at once, as JSON. A smaller group is shown sooner.
const CHUNK_BYTES: usize = 4 << 20;

/// The bytes of JSON for a byte in memory.
const JSON_PER_BYTE: usize = 3;

/// The views of every n-th tick from the first one, where n is a power of two.
pub struct Views {
    kept: Vec<View>,
    every: u64,
    bytes: usize,
    max: usize,
    /// The messages since the latest kept view.
    messages: Vec<MessageView>,
    messages_left_out: u64,
}

impl Views {
    #[must_use]
    pub fn new() -> Self {
        Self::with_max(BYTES_MAX)
    }

    fn with_max(max: usize) -> Self {
        Self {
            kept: Vec::new(),
            every: 1,
            bytes: 0,
            max,
            messages: Vec::new(),
            messages_left_out: 0,
        }
    }

    /// Returns whether the view of this tick is kept. Messages of other ticks belong to the next kept view.
    #[must_use]
    pub fn wants(&self, tick: Tick) -> bool {
        tick.is_multiple_of(self.every)
    }

    /// Adds the view of the next wanted tick.
    pub fn add(&mut self, mut view: View) {
        self.merge_messages(&mut view);
        self.bytes += size_of_view(&view);
        self.kept.push(view);
        while self.bytes > self.max && self.kept.len() > 2 {
            self.drop_every_second();
        }
    }

    /// Moves the messages of dropped views into the next kept one.
    fn merge_messages(&mut self, view: &mut View) {
        let mut messages = std::mem::take(&mut self.messages);
        messages.append(&mut view.messages);
        let surplus = messages.len().saturating_sub(MESSAGES_MAX);
        messages.drain(..surplus);
        view.messages = messages;
        view.messages_left_out += std::mem::take(&mut self.messages_left_out) + surplus as u64;
    }

    fn drop_every_second(&mut self) {
        self.every *= 2;
        self.bytes = 0;
        for mut view in std::mem::take(&mut self.kept) {
            if self.wants(view.tick) {
                self.merge_messages(&mut view);
                self.bytes += size_of_view(&view);
                self.kept.push(view);
            } else {
                self.merge_messages(&mut view);
                self.messages = view.messages;
                self.messages_left_out = view.messages_left_out;
            }
        }
    }

    /// Returns the number of ticks from one view to the next.
    #[must_use]
    pub fn every(&self) -> u64 {
        self.every
    }

    /// Returns the number of views in memory.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.kept.len() as u64
    }

    /// Returns the number of views for one request of the page.
    #[must_use]
    pub fn chunk(&self) -> usize {
        let mean = self.bytes / self.kept.len().max(1);
        (CHUNK_BYTES / (JSON_PER_BYTE * mean).max(1)).clamp(20, 400)
    }

    /// Returns the view of a tick, rounded down to a kept one.
    #[must_use]
    pub fn at(&self, tick: Tick) -> Option<&View> {
        self.kept.get(usize::try_from(tick / self.every).ok()?)
    }
}

/// Returns the approximate memory of a view.
fn size_of_view(view: &View) -> usize {
    // Strings, readings and the details of a fault.
    const MARK: usize = size_of::<Mark>() + 48;
    const ROBOT: usize = size_of::<RobotView>() + 200;
    const FAULT: usize = 500;
    let sets: usize = view.robots.iter().map(|robot| robot.sets.len()).sum();
    size_of::<View>()
        + view.robots.len() * ROBOT
        + sets * size_of::<BehaviorView>()
        + view.marks.len() * MARK
        + size_of_val(&view.items[..])
        + size_of_val(&view.obstacles[..])
        + size_of_val(&view.messages[..])
        + view.faults.len() * FAULT
}

/// Removes the utilities of tasks that a robot cannot do now from the view of a large team. The page shows 0 for them.
pub fn remove_idle_sets(view: &mut View) {
    let sets: usize = view.robots.iter().map(|robot| robot.sets.len()).sum();
    if sets <= LogLevel::COMPACT_LOG_SETS_MAX {
        return;
    }
    for robot in &mut view.robots {
        if robot.measure == LevelUnit::Utility {
            let is_shown = |set: &BehaviorView| {
                set.motivation.sensory_feedback
                    || set.motivation.state != BehaviorState::Hibernating
            };
            robot.sets.retain(is_shown);
            // A copy instead of `shrink_to_fit`: a block that shrinks in place leaves a gap into which no later list fits.
            robot.sets = robot.sets.to_vec();
        }
    }
}

/// Returns a copy with only the poses and states of the robots, for an overview of the run.
#[must_use]
pub fn in_brief(view: &View) -> View {
    let robots = view.robots.iter().map(|robot| RobotView {
        sets: Vec::new(),
        sensed: Vec::new(),
        ..robot.clone()
    });
    View {
        tick: view.tick,
        now: view.now,
        robots: robots.collect(),
        ..View::default()
    }
}

#[cfg(test)]
mod tests {
    use proto::telemetry::{Delivery, Reception};
    use scenario::ids::RobotId;
    use scenario::time::SimTime;

    use super::*;

    fn view(tick: Tick, messages: usize) -> View {
        let message = MessageView {
            receiver: RobotId(0),
            reception: Reception {
                at: SimTime(50 * tick),
                sender: RobotId(1),
                incarnation: 1,
                sent: SimTime(50 * tick),
                delivery: Delivery::Received,
                content: None,
            },
        };
        View {
            tick,
            now: SimTime(50 * tick),
            messages: vec![message; messages],
            ..View::default()
        }
    }

    #[test]
    fn views_are_thinned_evenly_within_the_bound() {
        let max = 100 * size_of_view(&view(0, 0));
        let mut views = Views::with_max(max);
        for tick in 0..10_000 {
            if views.wants(tick) {
                views.add(view(tick, 0));
            }
            assert!(views.bytes <= max);
        }
        let ticks: Vec<Tick> = views.kept.iter().map(|view| view.tick).collect();
        assert!(
            ticks
                .iter()
                .zip(0..)
                .all(|(tick, index)| *tick == index * views.every())
        );
        assert!((50..=100).contains(&ticks.len()), "{}", ticks.len());
        assert_eq!(
            views.at(views.every() + 1).map(|view| view.tick),
            Some(views.every())
        );
        assert!(views.at(20_000).is_none());
    }

    #[test]
    fn messages_of_dropped_views_belong_to_the_next_one() {
        let mut views = Views::with_max(usize::MAX);
        for tick in 0..5 {
            views.add(view(tick, 100));
        }
        views.drop_every_second();
        let counts = |views: &Views| -> Vec<(Tick, usize, u64)> {
            let kept = views.kept.iter();
            kept.map(|view| (view.tick, view.messages.len(), view.messages_left_out))
                .collect()
        };
        assert_eq!(counts(&views), [(0, 100, 0), (2, 200, 0), (4, 200, 0)]);
        views.drop_every_second();
        assert_eq!(counts(&views), [(0, 100, 0), (4, 256, 144)]);
        // The newest messages are kept.
        assert_eq!(views.kept[1].messages[0].reception.at, SimTime(50 * 2));
    }
}
