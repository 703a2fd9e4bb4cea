//! Output of the clean-up: mission.csv, run.json and the view of the floor.

use crate::waste::data::WasteSection;
use crate::waste::data::{
    ITEMS_DELIVERED, ITEMS_PER_HOUR, LATENESS_MAX_MS, LATENESS_MEAN_MS, REPORTS_MADE,
};
use proto::mission::items::Zone;

use proto::view::{ItemView, Mark, MarkOutline, MarkRole, View, Work};
use scenario::time::SimTime;

use super::{Item, Waste};
use world_server::mission::{FigureValue, TeamFigures};
use world_server::world::Outline;

#[derive(Clone, Debug)]
pub(super) struct Reports {
    made: u32,
    last: Option<SimTime>,
    period: SimTime,
    /// The time for which the site shows its changed color.
    color: SimTime,
    lateness_total_ms: u64,
    lateness_max_ms: Option<u64>,
}

impl Reports {
    pub fn new(waste: &WasteSection) -> Self {
        Self {
            made: 0,
            last: None,
            period: SimTime::from_secs_f64(waste.report_period_s),
            color: SimTime::from_secs_f64(waste.report_site.color_s),
            lateness_total_ms: 0,
            lateness_max_ms: None,
        }
    }

    pub fn add(&mut self, now: SimTime) {
        let late_ms = now.since(self.last.unwrap_or_default() + self.period).0;
        self.made += 1;
        self.last = Some(now);
        self.lateness_total_ms += late_ms;
        self.lateness_max_ms = self.lateness_max_ms.max(Some(late_ms));
    }

    /// Checks whether the report period has passed since the last report.
    pub fn is_due(&self, now: SimTime) -> bool {
        now.since(self.last.unwrap_or_default()) >= self.period
    }

    pub fn last(&self) -> Option<SimTime> {
        self.last
    }

    pub fn site_is_colored(&self, now: SimTime) -> bool {
        self.last
            .is_some_and(|report| now.since(report) < self.color)
    }
}

impl Waste {
    pub(super) fn write_row(&self, row: &mut Vec<FigureValue>) {
        let counts = self.floor.counts_with_all_deliveries();
        row.extend(
            [
                counts.in_spills,
                counts.carried,
                counts.on_floor,
                counts.delivered,
            ]
            .map(FigureValue::from),
        );
        row.push(self.reports.last().map(|time| time.0).into());
    }

    pub(super) fn write_figures(&self, figures: &mut TeamFigures) {
        let (counts, reports) = (self.floor.counts_with_all_deliveries(), &self.reports);
        let mission = &mut figures.mission;
        mission.add("items.in_spills", counts.in_spills);
        mission.add("items.carried", counts.carried);
        mission.add("items.on_floor", counts.on_floor);
        mission.add("items.delivered", counts.delivered);
        mission.add(REPORTS_MADE, reports.made);
        let mean = reports.lateness_total_ms as f64 / f64::from(reports.made);
        mission.add(LATENESS_MEAN_MS, (reports.made > 0).then_some(mean));
        mission.add(LATENESS_MAX_MS, reports.lateness_max_ms);
        if let Some(foraging) = &self.floor.foraging {
            let hours = foraging.elapsed.as_secs_f64() / 3600.0;
            let per_hour = f64::from(foraging.deliveries) / hours;
            mission.add(ITEMS_PER_HOUR, (hours > 0.0).then_some(per_hour));
        }
        for (figures, robot) in figures.robots.iter_mut().zip(&self.robots) {
            figures.add(ITEMS_DELIVERED, robot.delivered);
            figures.add(REPORTS_MADE, robot.reports_made);
        }
    }

    pub(super) fn write_view(&self, now: SimTime, view: &mut View) {
        let radius_m = self.floor.item_radius_m;
        let items = self.floor.items();
        view.items.extend(items.iter().map(|item| ItemView {
            position: item.position,
            carrier: item.carrier,
            radius_m,
        }));
        for robot in &mut view.robots {
            let waste = robot.readings.mission.items().items.iter();
            robot.sensed.extend(waste.flatten());
        }
        // A report is work only while it is due, and done while the site shows it.
        let report = if self.reports.site_is_colored(now) {
            Work::left_or_done(false)
        } else if self.reports.is_due(now) {
            Work::left_or_done(true)
        } else {
            None
        };
        view.mark(Mark {
            id: "report-site".to_owned(),
            outline: outlined(self.floor.report_site()),
            role: MarkRole::Target,
            work: report,
            label: "report site".to_owned(),
        });
        for (index, (place, zone, outline)) in self.floor.zones().enumerate() {
            let (role, left, all) = match zone {
                // The items that are left are elsewhere.
                Zone::Target => (MarkRole::Goal, 0, 0),
                _ => {
                    let initial = &items[place.items.clone()];
                    let is_inside =
                        |item: &&Item| item.carrier.is_none() && outline.contains(item.position);
                    (
                        MarkRole::Zone,
                        initial.iter().filter(is_inside).count(),
                        initial.len(),
                    )
                }
            };
            view.mark(Mark {
                id: format!("zone-{index}"),
                outline: outlined(outline),
                role,
                work: Work::new(left as f32, all as f32, "items"),
                label: place.name.clone(),
            });
        }
    }
}

fn outlined(outline: Outline) -> MarkOutline {
    match outline {
        Outline::Disc { center, radius_m } => MarkOutline::Disc { center, radius_m },
        Outline::Rectangle { min, max } => MarkOutline::Rectangle { min, max },
        // A wall is infinite, and no zone is a wall.
        Outline::Wall { normal, offset_m } => {
            let from = normal * offset_m;
            MarkOutline::Line { from, to: from }
        }
        Outline::Bar(bar) => bar.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lateness_is_measured_from_the_previous_report() {
        let mut reports = Reports::new(&WasteSection::default());
        let period_ms = 120_000;
        let first_ms = period_ms + 3_000;
        let early_ms = first_ms + 60_000;
        let last_ms = early_ms + period_ms + 1_500;
        for ms in [first_ms, early_ms, last_ms] {
            reports.add(SimTime(ms));
        }
        assert_eq!(reports.made, 3);
        assert_eq!(reports.lateness_max_ms, Some(3_000));
        assert_eq!(reports.lateness_total_ms, 4_500);
    }
}
