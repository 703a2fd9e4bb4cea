//! A check of the receptions that external controllers report.
//!
//! Link faults are applied by the receiving robot's radio, not by the world. A controller that does not apply them would
//! silently be exempt from all link faults. The world has the seed and the state of the links, so it computes the expected
//! deliveries with the code of the Rust agent and compares them with the report.
//!
//! The check finds mistakes, not malice: a controller can use a received message despite a correct report.

use std::collections::BTreeMap;
use std::sync::Arc;

use proto::link::{IncomingMessages, StepMessages};
use proto::team::{Broadcast, BroadcastKey};
use proto::telemetry::{Delivery, Reception};
use proto::tick::{ManifestEntry, Report, TickMessage};
use scenario::Setup;
use scenario::ids::{Incarnation, RobotId, Tick};

/// The number of ticks for which broadcasts are stored. Manifests list broadcasts of the current and the previous tick.
const TICKS: Tick = 4;

/// The maximum number of stored broadcasts. A team does not send more.
const CAPACITY: usize = 65_536;

#[derive(Default)]
pub(super) struct DeliveryCheck {
    /// The incarnation and the links of each receiver, with messages in flight; `None` if the state is no longer known.
    links: BTreeMap<RobotId, (Incarnation, Option<IncomingMessages>)>,
    broadcasts: BTreeMap<BroadcastKey, Arc<Broadcast>>,
}

/// The state of the receiver's links after a checked report, if the report counts; `None` if the state is unknown.
pub(super) struct Checked(Option<IncomingMessages>);

impl DeliveryCheck {
    /// Stores a broadcast. The first of several broadcasts with the same identity is used.
    pub fn store_broadcast(&mut self, broadcast: Broadcast) {
        let now = broadcast.tick;
        while let Some(first) = self.broadcasts.first_entry()
            && (first.key().0 + TICKS < now || self.broadcasts.len() >= CAPACITY)
        {
            self.broadcasts.pop_first();
        }
        self.broadcasts
            .entry(broadcast.key())
            .or_insert_with(|| Arc::new(broadcast));
    }

    /// Checks a report that answers a tick.
    ///
    /// # Errors
    /// Returns the first message whose reported delivery differs from the link's.
    pub fn check(
        &self,
        message: &TickMessage,
        report: &Report,
        setup: &Setup,
    ) -> Result<Checked, String> {
        let known = self.links.get(&report.robot);
        let known = known.filter(|(incarnation, _)| *incarnation == report.incarnation);
        let mut links = match known {
            Some((_, Some(links))) => links.clone(),
            Some((_, None)) => return Ok(Checked(None)),
            None => IncomingMessages::new(report.robot, setup),
        };
        if (message.tick, message.incarnation) != (report.tick, report.incarnation) {
            // The report will not count.
            return Ok(Checked(Some(links)));
        }
        // A reported real loss is accepted, because the controller cannot have received the message.
        let mut reported = report.receptions.iter();
        let mut arrived: Vec<Option<Arc<Broadcast>>> = Vec::new();
        for key in message.manifest.iter().flat_map(ManifestEntry::keys) {
            let is_lost = reported
                .next()
                .is_some_and(|reception| reception.delivery == Delivery::Lost);
            let broadcast = self.broadcasts.get(&key).filter(|_| !is_lost);
            if broadcast.is_none() && !is_lost {
                // The world has not received the broadcast either, so later deliveries are unknown.
                return Ok(Checked(None));
            }
            arrived.push(broadcast.cloned());
        }
        let mut received = StepMessages::default();
        links.receive(message, &mut arrived, &mut received);
        // A controller without a radio reports no receptions.
        if !report.receptions.is_empty() {
            compare(&report.receptions, &received.receptions, setup)?;
        }
        Ok(Checked(Some(links)))
    }

    pub fn store_links(&mut self, report: &Report, checked: Checked) {
        self.links
            .insert(report.robot, (report.incarnation, checked.0));
    }
}

fn compare(reported: &[Reception], expected: &[Reception], setup: &Setup) -> Result<(), String> {
    for place in 0..reported.len().max(expected.len()) {
        let (actual, correct) = (reported.get(place), expected.get(place));
        if actual == correct {
            continue;
        }
        let sender_id = actual
            .or(correct)
            .map_or(RobotId(0), |reception| reception.sender);
        let sender = setup.scenario.robots.get(sender_id.index());
        let sender = sender.map_or("an unknown robot", |robot| &robot.name);
        let delivery = |reception: Option<&Reception>| {
            reception.map_or("nothing", |reception| reception.delivery.as_str())
        };
        let (actual, correct) = (delivery(actual), delivery(correct));
        return Err(if actual == correct {
            format!(
                "reception {place} from {sender}: '{actual}', but the message differs from the one that was sent"
            )
        } else {
            format!(
                "reception {place} from {sender}: '{actual}', but the link's result is '{correct}'"
            )
        });
    }
    Ok(())
}
