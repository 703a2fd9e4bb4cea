//! Interruption handlers that are triggered by time or by a user.

use std::sync::{Arc, Mutex, PoisonError};

use scenario::Obstacle;
use scenario::time::SimTime;

use super::InterruptionHandler;
use crate::world::{ComponentId, World};
use run_log::recorder::{Event, EventKind, FaultEvent};

/// A handler that calls a function once or periodically.
#[derive(Clone, Debug)]
pub struct Timed<F> {
    due: Option<SimTime>,
    period: Option<SimTime>,
    change: F,
}

impl<F: FnMut(SimTime, &mut World) -> Vec<Event> + Send> Timed<F> {
    /// Creates a handler that acts once, in the first tick at or after `at`.
    pub fn once(at: SimTime, change: F) -> Self {
        Self {
            due: Some(at),
            period: None,
            change,
        }
    }

    /// Creates a handler that acts periodically from `first` on. If several times fall between two ticks, it acts once.
    ///
    /// # Panics
    /// If the period is 0.
    pub fn periodic(first: SimTime, period: SimTime, change: F) -> Self {
        assert!(period > SimTime::ZERO, "the period must be longer than 0");
        Self {
            due: Some(first),
            period: Some(period),
            change,
        }
    }
}

impl<F> InterruptionHandler for Timed<F>
where
    F: FnMut(SimTime, &mut World) -> Vec<Event> + Send + Clone + 'static,
{
    fn trigger_event(&mut self, now: SimTime, world: &mut World) -> Vec<Event> {
        let Some(due) = self.due.filter(|due| *due <= now) else {
            return Vec::new();
        };
        self.due = self.period.map(|period| {
            let passed = now.since(due).0 / period.0 + 1;
            due + SimTime(passed * period.0)
        });
        (self.change)(now, world)
    }
}

/// A handler that places obstacles for a user (thesis Fig. 4.7). Clones share one list: register one clone and keep another.
///
/// The inputs of the run do not contain these obstacles. For repeatable runs, order a fault instead.
#[derive(Clone, Debug, Default)]
pub struct ObstacleHandler {
    wanted: Arc<Mutex<Vec<Obstacle>>>,
}

impl ObstacleHandler {
    /// Places an obstacle on the floor at the next call of [`InterruptionHandler::trigger_event`].
    pub fn set_trigger(&self, obstacle: Obstacle) {
        let mut wanted = self.wanted.lock().unwrap_or_else(PoisonError::into_inner);
        wanted.push(obstacle);
    }
}

impl InterruptionHandler for ObstacleHandler {
    fn trigger_event(&mut self, _now: SimTime, world: &mut World) -> Vec<Event> {
        let mut wanted = self.wanted.lock().unwrap_or_else(PoisonError::into_inner);
        let set = wanted.drain(..).map(|obstacle| {
            let id = world.add_obstacle(&obstacle);
            let Obstacle {
                x_m,
                y_m,
                width_m,
                height_m,
                ..
            } = obstacle;
            Event {
                subject: ComponentId::Obstacle(id).to_string(),
                detail: format!("{x_m} {y_m} {width_m} {height_m}"),
                ..Event::new(EventKind::Fault(FaultEvent::Applied), None)
            }
        });
        set.collect()
    }
}

#[cfg(test)]
mod tests {

    use scenario::testkit::default_setup;

    use super::*;
    use crate::drill::DRILL;

    fn world() -> World {
        World::new(&default_setup(1), DRILL)
    }

    const SQUARE: Obstacle = Obstacle {
        x_m: 5.0,
        y_m: 4.0,
        width_m: 1.0,
        height_m: 1.0,
        penetrability: 0.0,
    };

    fn acts(
        mut handler: impl InterruptionHandler,
        times: impl IntoIterator<Item = u64>,
    ) -> Vec<u64> {
        let mut world = world();
        let times = times.into_iter();
        let acts = |time: &u64| !handler.trigger_event(SimTime(*time), &mut world).is_empty();
        times.filter(acts).collect()
    }

    fn note(_: SimTime, _: &mut World) -> Vec<Event> {
        vec![Event::new(EventKind::Fault(FaultEvent::Applied), None)]
    }

    #[test]
    fn a_single_trigger_acts_once() {
        let ticks = (0..20).map(|tick| tick * 50);
        assert_eq!(acts(Timed::once(SimTime(120), note), ticks), [150]);
        assert_eq!(acts(Timed::once(SimTime(0), note), [0, 0, 50]), [0]);
    }

    #[test]
    fn a_periodic_trigger_keeps_its_schedule() {
        let ticks = (0..10).map(|tick| tick * 50);
        let handler = Timed::periodic(SimTime(100), SimTime(120), note);
        // The handler is due at 100, 220, 340 and 460.
        assert_eq!(acts(handler, ticks), [100, 250, 350]);
        let handler = Timed::periodic(SimTime(0), SimTime(10), note);
        assert_eq!(acts(handler, [0, 0, 50, 50, 100]), [0, 50, 100]);
    }

    #[test]
    fn user_obstacles_appear_once_at_the_next_call() {
        let mut world = world();
        let user = ObstacleHandler::default();
        let mut registered: Box<dyn InterruptionHandler> = Box::new(user.clone());
        assert!(registered.trigger_event(SimTime(0), &mut world).is_empty());
        user.set_trigger(SQUARE);
        user.set_trigger(Obstacle { x_m: 7.0, ..SQUARE });
        // The clock does not have to advance.
        let events = registered.trigger_event(SimTime(0), &mut world);
        let rows: Vec<_> = events
            .iter()
            .map(|event| (event.subject.as_str(), event.detail.as_str()))
            .collect();
        assert_eq!(rows, [("obstacle-0", "5 4 1 1"), ("obstacle-1", "7 4 1 1")]);
        assert!(registered.trigger_event(SimTime(50), &mut world).is_empty());
        assert_eq!(world.obstacles().len(), 2);
    }
}
