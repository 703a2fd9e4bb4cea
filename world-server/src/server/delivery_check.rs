//! A check of the receptions that external controllers report.
//!
//! Link faults are applied by the receiving robot's radio, not by the world. A controller that does not apply them would
//! silently be exempt from all link faults. The world has the seed and the state of the links, so it computes the expected
//! deliveries with the code of the Rust agent and compares them with the report.
//!
//! The check finds mistakes, not malice: a controller can use a received message despite a correct report.

use std::collections::BTreeMap;

use proto::link::{IncomingMessages, StepMessages};
use proto::telemetry::Reception;
use proto::tick::{Report, TickMessage};
use scenario::Setup;
use scenario::ids::{Incarnation, RobotId};

use super::broadcasts::Broadcasts;

#[derive(Default)]
pub(super) struct DeliveryCheck {
    /// The incarnation and the links of each receiver, with messages in flight.
    links: BTreeMap<RobotId, (Incarnation, IncomingMessages)>,
}

/// The state of the receiver's links after a checked report, if the report counts.
pub(super) struct Checked(IncomingMessages);

impl DeliveryCheck {
    /// Checks a report that answers a tick.
    ///
    /// # Errors
    /// Returns the first message whose reported delivery differs from the link's.
    pub fn check(
        &self,
        message: &TickMessage,
        broadcasts: &Broadcasts,
        report: &Report,
        setup: &Setup,
    ) -> Result<Checked, String> {
        let known = self.links.get(&report.robot);
        let known = known.filter(|(incarnation, _)| *incarnation == report.incarnation);
        let mut links = match known {
            Some((_, links)) => links.clone(),
            None => IncomingMessages::new(report.robot, setup),
        };
        if (message.tick, message.incarnation) != (report.tick, report.incarnation) {
            // The report will not count.
            return Ok(Checked(links));
        }
        let arrived = broadcasts.listed(&message.manifest);
        let mut arrived = Vec::from_iter(arrived.map(|listed| listed.cloned()));
        let mut received = StepMessages::default();
        links.receive(message, &mut arrived, &mut received);
        // A controller without a radio reports no receptions.
        if !report.receptions.is_empty() {
            compare(&report.receptions, &received.receptions, setup)?;
        }
        Ok(Checked(links))
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
