//! Whether a mind that is a program of its own tells what the links do to its messages. The world does not touch them: a robot's own radio
//! does. So a program that leaves that out would be spared all link faults, and nobody would see it. Seed and states of the links are
//! known here: what must come of them is worked out with the code of the agent in Rust, and compared with what the report says.
//!
//! That is against mistakes, and not against malice: what has arrived may be heard whatever the report says.

use std::collections::BTreeMap;
use std::sync::Arc;

use alliance_proto::ids::{Incarnation, RobotId, Tick};
use alliance_proto::links::{Heard, Links};
use alliance_proto::scenario::Setup;
use alliance_proto::team::Broadcast;
use alliance_proto::telemetry::{Delivery, Reception};
use alliance_proto::tick::{ManifestEntry, Report, TickMessage};

/// Ticks for which broadcasts are kept: manifests list those of the tick at hand and of the one before.
const TICKS: Tick = 4;

/// Most broadcasts that are kept of a team; what comes beyond is no team's.
const CAPACITY: usize = 65_536;

/// Identity of a broadcast.
type Key = (Tick, RobotId, Incarnation, u16);

/// The links to foreign minds.
#[derive(Default)]
pub(super) struct Fates {
    /// In what incarnation, and what is on its way there; `None`: nobody can tell any more.
    links: BTreeMap<RobotId, (Incarnation, Option<Links>)>,
    said: BTreeMap<Key, Arc<Broadcast>>,
}

/// A report that has been looked at: how its links are after it, if it counts; `None`: nobody can tell.
pub(super) struct Checked(Option<Links>);

impl Fates {
    /// Something that was said in the team. Of two of the same number the first one is it.
    pub fn hear(&mut self, broadcast: Broadcast) {
        let now = broadcast.tick;
        while let Some(first) = self.said.first_entry()
            && (first.key().0 + TICKS < now || self.said.len() >= CAPACITY)
        {
            self.said.pop_first();
        }
        let key = (
            broadcast.tick,
            broadcast.sender,
            broadcast.incarnation,
            broadcast.index,
        );
        self.said.entry(key).or_insert_with(|| Arc::new(broadcast));
    }

    /// Looks at a report that answers that tick.
    ///
    /// # Errors
    /// The first message of which it says something else than its link does.
    pub fn check(
        &self,
        told: &TickMessage,
        report: &Report,
        setup: &Setup,
    ) -> Result<Checked, String> {
        let known = self.links.get(&report.robot);
        let known = known.filter(|(incarnation, _)| *incarnation == report.incarnation);
        let mut links = match known {
            Some((_, Some(links))) => links.clone(),
            Some((_, None)) => return Ok(Checked(None)),
            None => Links::new(report.robot, setup),
        };
        if (told.tick, told.incarnation) != (report.tick, report.incarnation) {
            // It will not count.
            return Ok(Checked(Some(links)));
        }
        // A real loss is believed: who says that a message never came has not heard it.
        let mut reported = report.receptions.iter();
        let mut arrived: Vec<Option<Arc<Broadcast>>> = Vec::new();
        for key in told.manifest.iter().flat_map(keys) {
            let is_lost = reported
                .next()
                .is_some_and(|it| it.delivery == Delivery::Lost);
            let said = self.said.get(&key).filter(|_| !is_lost);
            if said.is_none() && !is_lost {
                // It never came here: nothing can be said of it, or of what follows from it.
                return Ok(Checked(None));
            }
            arrived.push(said.cloned());
        }
        let mut heard = Heard::default();
        links.hear(told, &mut arrived, &mut heard);
        // Whoever has no radio reports nothing at all.
        if !report.receptions.is_empty() {
            compare(&report.receptions, &heard.receptions, setup)?;
        }
        Ok(Checked(Some(links)))
    }

    /// That report counts.
    pub fn settle(&mut self, report: &Report, checked: Checked) {
        self.links
            .insert(report.robot, (report.incarnation, checked.0));
    }
}

fn keys(entry: &ManifestEntry) -> impl Iterator<Item = Key> {
    let (tick, sender, incarnation) = (entry.tick, entry.sender, entry.incarnation);
    (0..entry.count).map(move |index| (tick, sender, incarnation, index))
}

fn compare(reported: &[Reception], expected: &[Reception], setup: &Setup) -> Result<(), String> {
    for place in 0..reported.len().max(expected.len()) {
        let (said, due) = (reported.get(place), expected.get(place));
        if said == due {
            continue;
        }
        let of = said.or(due).map_or(RobotId(0), |it| it.sender);
        let sender = setup.scenario.robots.get(of.index());
        let sender = sender.map_or("nobody", |robot| &robot.name);
        let delivery = |it: Option<&Reception>| it.map_or("nothing", |it| it.delivery.as_str());
        let (said, due) = (delivery(said), delivery(due));
        return Err(if said == due {
            format!("reception {place}, of {sender}: '{said}', with another message than was sent")
        } else {
            format!("reception {place}, of {sender}: '{said}', and the link says '{due}'")
        });
    }
    Ok(())
}
