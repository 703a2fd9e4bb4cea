//! The Gantt figure: a lane for each robot and task, for each robot, or for several robots together. Lanes below show
//! the orphan time of tasks.

use std::ops::Range;

use plotters::element::PathElement;
use plotters::style::RGBColor;

use super::rows::{LEFT_PX, LEFT_SHARE, Rows, heat, shares, within};
use super::timeline::Timeline;
use super::{ABSENT, LOSSES, RunFigures, mark_of};
use crate::figures::canvas::{
    Area, Chart, DrawResult, FAINT, INK, Mark, TextLabel, X_AXIS_PX, curve, fill, hatch, line, px,
};
use crate::figures::legend::Sample;
use crate::figures::palette;
use crate::report::spans::Spans;
use observation::stints::Stint;

/// Height of a lane for a robot and a task, px.
const LANE_PX: f64 = 17.0;

/// The gap between robot lanes and task lanes, px.
const GAP_PX: f64 = 10.0;

/// The minimum distance between ticks on a bar, px.
const TICK_APART_PX: f64 = 4.0;

/// The minimum height of a lane with ticks, px.
const TICKED_PX: f64 = 11.0;

/// The vertical extent of a bar as shares of its lane.
const BAR: Range<f64> = 0.12..0.88;

/// The vertical extents in a lane of several robots: the active share above, the absent share below.
const BUSY: Range<f64> = 0.05..0.68;
const ABSENT_SHARE: Range<f64> = 0.68..0.95;

/// The maximum number of tasks in a legend.
const NAMED_TASKS: usize = 18;

/// The vertical positions of all lanes, px below the upper edge of the plot.
struct Lanes {
    /// `true` if each robot has a lane for each task. Otherwise a robot has one lane, and colors distinguish the tasks.
    by_task: bool,
    tasks: usize,
    robots: Rows,
    /// A lane for each task, or for several tasks together.
    orphans: Rows,
}

impl Lanes {
    /// Creates lanes with a total height of at most `most_px`. Tasks have lanes below the robots if their orphan time is
    /// known.
    fn fit(robots: usize, tasks: usize, knows_orphans: bool, most_px: f64) -> Self {
        let lanes = robots * tasks;
        let orphans = if knows_orphans { tasks } else { 0 };
        let by_task = (lanes + orphans) as f64 * LANE_PX <= most_px;
        let rows = match by_task {
            true => Rows::fit(lanes, most_px),
            // A few robots leave room for many tasks.
            false => Rows::fit(robots, most_px * 0.7),
        };
        let mut fitted = Self {
            by_task,
            tasks,
            robots: rows,
            orphans: Rows::fit(orphans, f64::INFINITY),
        };
        fitted.orphans = Rows::fit(orphans, most_px - fitted.orphans_px());
        fitted
    }

    fn of(&self, rank: usize, task: usize) -> Range<f64> {
        match self.by_task {
            true => self.robots.extent(rank * self.tasks + task),
            false => self.robots.extent(rank),
        }
    }

    fn of_robot(&self, rank: usize) -> Range<f64> {
        match self.by_task {
            true => {
                let lanes = self.tasks as f64 * self.robots.row_px;
                rank as f64 * lanes..(rank + 1) as f64 * lanes
            }
            false => self.robots.extent(rank),
        }
    }

    fn orphans_px(&self) -> f64 {
        self.robots.height_px() + if self.by_task { 0.0 } else { GAP_PX }
    }

    /// Returns the lane of a task below the robots.
    fn of_task(&self, task: usize) -> Range<f64> {
        let (lane, top) = (self.orphans.extent(task), self.orphans_px());
        top + lane.start..top + lane.end
    }

    fn height_px(&self) -> f64 {
        self.orphans_px() + self.orphans.height_px()
    }

    /// Returns whether several robots share a lane.
    fn is_crowd(&self) -> bool {
        self.robots.per_row > 1
    }
}

struct Gantt<'r> {
    run: &'r RunFigures<'r>,
    lanes: Lanes,
    timeline: Timeline<'r>,
}

/// Draws the Gantt figure of a run.
pub fn draw(run: &RunFigures<'_>) -> anyhow::Result<String> {
    let left_px = LEFT_PX.min(run.sheet.width_px * LEFT_SHARE);
    let (robots, tasks) = (run.history.robots.len(), run.history.catalog.tasks.len());
    let head = |lanes: &Lanes| Timeline::new(run, run.window.clone(), left_px, legend(run, lanes));
    // The legend depends on the lanes, and the room for the lanes depends on the legend.
    let knows_orphans = !run.history.is_summary;
    let mut lanes = Lanes::fit(robots, tasks, knows_orphans, run.sheet.max_height_px());
    for _ in 0..2 {
        let above_px = head(&lanes).head_px() + X_AXIS_PX + 4.0;
        let most_px = run.sheet.max_height_px() - above_px;
        lanes = Lanes::fit(robots, tasks, knows_orphans, most_px);
    }
    let timeline = head(&lanes);
    let gantt = Gantt {
        run,
        lanes,
        timeline,
    };
    gantt.draw()
}

fn legend<'r>(run: &RunFigures<'r>, lanes: &Lanes) -> Vec<(Sample, &'r str)> {
    let mut legend = vec![
        (Sample::Fill(FAINT, ABSENT), "dead or stopped"),
        (Sample::Mark(Mark::Diamond, INK), "took over"),
    ];
    if lanes.orphans.len() > 0 {
        legend.push((Sample::Hatch(INK, 2.5), "applicable, no robot productive"));
    }
    if lanes.by_task {
        let of_bars = [
            (Sample::Fill(INK, 1.0), "active"),
            (Sample::Hatch(INK, 4.0), "waiting"),
        ];
        legend.splice(0..0, of_bars);
        legend.insert(3, (Sample::Ticked(INK), "effect on the world"));
        return legend;
    }
    if !lanes.is_crowd() {
        legend.push((Sample::Hatch(INK, 4.0), "waiting"));
    }
    legend.extend(LOSSES);
    if lanes.is_crowd() {
        let shade = |opacity| Sample::Fill(palette::SHARED_ROW, opacity);
        let shares = [
            (shade(0.3), "some of the robots active"),
            (shade(1.0), "all active"),
        ];
        legend.splice(0..0, shares);
        return legend;
    }
    let tasks = &run.history.catalog.tasks;
    if tasks.len() <= NAMED_TASKS {
        let names = tasks.iter().enumerate();
        let names =
            names.map(|(task, spec)| (Sample::Fill(palette::task_color(task), 1.0), &*spec.name));
        legend.extend(names);
    } else {
        let text = "active, in the task's color (colors repeat)";
        legend.insert(0, (Sample::Fill(palette::task_color(0), 1.0), text));
    }
    legend
}

impl Gantt<'_> {
    fn draw(&self) -> anyhow::Result<String> {
        let (run, timeline) = (self.run, &self.timeline);
        let head_px = timeline.head_px();
        let height = self.lanes.height_px();
        let bottom_px = head_px + height;
        let height_px = bottom_px + X_AXIS_PX + 4.0;
        run.sheet.svg("Activity of the robots", height_px, |area| {
            timeline.draw_head(area, std::slice::from_ref(&(head_px..bottom_px)))?;
            let y = (height..0.0, "", 0);
            let chart = timeline.chart(area, head_px..bottom_px, y, true)?;
            if self.lanes.is_crowd() {
                self.crowds(&chart)?;
            } else {
                self.bars(area, &chart)?;
            }
            self.orphans(area, &chart)?;
            self.marks(area, &chart)?;
            match self.lanes.by_task {
                true => self.names_by_task(area, &chart),
                false => self.names(area, &chart),
            }
        })
    }

    fn shown(&self, spans: &Spans) -> Vec<Range<f64>> {
        let cut = |span| self.timeline.cut(span);
        spans.iter().filter_map(cut).collect()
    }

    /// Draws the active, waiting and absent times.
    fn bars(&self, area: &Area<'_>, chart: &Chart<'_>) -> DrawResult {
        for (rank, robot) in self.run.history.robots.iter().enumerate() {
            for span in self.shown(&self.run.history.absent(rank)) {
                fill(chart, span, self.lanes.of_robot(rank), FAINT, ABSENT)?;
            }
            for set in &robot.sets {
                let task = set.task.index();
                let color = match self.lanes.by_task {
                    true => self.run.colors[rank],
                    false => palette::task_color(task),
                };
                let bar = within(&self.lanes.of(rank, task), &BAR);
                for span in self.shown(&set.active) {
                    self.bar(area, chart, (span, bar.clone()), (task, color))?;
                }
                for span in self.shown(&set.waiting) {
                    hatch(area, chart, span, bar.clone(), (color, 4.0))?;
                }
            }
        }
        Ok(())
    }

    /// Draws a bar, with the task's name if nothing else shows the task and there is room.
    fn bar(
        &self,
        area: &Area<'_>,
        chart: &Chart<'_>,
        (span, bar): (Range<f64>, Range<f64>),
        (task, color): (usize, RGBColor),
    ) -> DrawResult {
        let (from, to) = (span.start, span.end);
        let middle = (bar.start + bar.end) / 2.0;
        fill(chart, span, bar, color, 1.0)?;
        if self.lanes.by_task || self.lanes.robots.row_px < LANE_PX {
            return Ok(());
        }
        let color = palette::text_color_on(color);
        let letters = TextLabel::LEFT.sized(10.0).colored(color);
        let name = &self.run.history.catalog.tasks[task].name;
        let plot = chart.plotting_area();
        let (left, y) = plot.map_coordinate(&(from, middle));
        let (right, _) = plot.map_coordinate(&(to, middle));
        if right - left > px(letters.width_px(name) + 10.0) {
            area.draw_text(name, &letters.style(), (left + px(5.0), y))?;
        }
        Ok(())
    }

    /// Draws the shares of active and absent robots in each lane.
    fn crowds(&self, chart: &Chart<'_>) -> DrawResult {
        let (history, window) = (self.run.history, &self.timeline.window);
        let parts = self.timeline.cells();
        for row in 0..self.lanes.robots.len() {
            let ranks = self.lanes.robots.members(row);
            let lane = self.lanes.of_robot(ranks.start);
            let active = ranks.clone().map(|rank| history.robots[rank].active());
            let active: Vec<Spans> = active.collect();
            let absent: Vec<Spans> = ranks.map(|rank| history.absent(rank)).collect();
            let busy = within(&lane, &BUSY);
            let values = shares(window, parts, &active);
            heat(chart, window, busy, palette::SHARED_ROW, &values)?;
            let values = shares(window, parts, &absent);
            heat(chart, window, within(&lane, &ABSENT_SHARE), INK, &values)?;
        }
        Ok(())
    }

    fn has_orphans(&self) -> bool {
        self.lanes.orphans.len() > 0
    }

    fn orphans(&self, area: &Area<'_>, chart: &Chart<'_>) -> DrawResult {
        let tasks = &self.run.metrics.tasks;
        let window = &self.timeline.window;
        for row in 0..self.lanes.orphans.len() {
            let members = self.lanes.orphans.members(row);
            let bar = within(&self.lanes.of_task(members.start), &BAR);
            if let [task] = &tasks[members.clone()] {
                for span in self.shown(&task.orphan) {
                    hatch(area, chart, span, bar.clone(), (INK, 2.5))?;
                }
            } else {
                let orphans = tasks[members].iter().map(|task| &task.orphan);
                let values = shares(window, self.timeline.cells(), orphans);
                heat(chart, window, bar, INK, &values)?;
            }
        }
        Ok(())
    }

    /// Draws effects and takeovers. In figures with one lane per robot, it also draws losses.
    fn marks(&self, area: &Area<'_>, chart: &Chart<'_>) -> DrawResult {
        let plot = chart.plotting_area();
        if self.lanes.robots.row_px >= TICKED_PX {
            for stint in &self.run.metrics.stints {
                self.ticks(area, chart, stint)?;
            }
        }
        let middle = |lane: Range<f64>| (lane.start + lane.end) / 2.0;
        let radius_px = (self.lanes.robots.row_px * 0.5).clamp(2.5, 4.5);
        for takeover in &self.run.metrics.takeovers {
            if self.timeline.shows(takeover.at) {
                let y = middle(self.lanes.of(takeover.robot, takeover.task.index()));
                let at = plot.map_coordinate(&(takeover.at.as_secs_f64(), y));
                Mark::Diamond.draw_sized(area, at, INK, radius_px)?;
            }
        }
        if self.lanes.by_task {
            return Ok(());
        }
        for failure in &self.run.metrics.failures {
            if self.timeline.shows(failure.at) {
                let y = middle(self.lanes.of_robot(failure.robot));
                let at = plot.map_coordinate(&(failure.at.as_secs_f64(), y));
                let (mark, color) = mark_of(failure.loss);
                mark.draw_sized(area, at, color, radius_px + 1.0)?;
            }
        }
        Ok(())
    }

    fn ticks(&self, area: &Area<'_>, chart: &Chart<'_>, stint: &Stint) -> DrawResult {
        let lane = self.lanes.of(stint.robot, stint.task.index());
        let top = within(&lane, &BAR).start;
        let mut last = i32::MIN;
        for effect in &stint.effects {
            if !self.timeline.shows(*effect) {
                continue;
            }
            let plot = chart.plotting_area();
            let (x, y) = plot.map_coordinate(&(effect.as_secs_f64(), top));
            // Overlapping ticks would hide the bar.
            if x < last.saturating_add(px(TICK_APART_PX)) {
                continue;
            }
            last = x;
            let ends = [(x, y - px(2.0)), (x, y + px(2.5))];
            area.draw(&PathElement::new(ends, line(INK, 1.0)))?;
        }
        Ok(())
    }

    /// Writes the names of robots beside their lanes, and of tasks below.
    fn names(&self, area: &Area<'_>, chart: &Chart<'_>) -> DrawResult {
        let (history, window) = (self.run.history, &self.timeline.window);
        let title = TextLabel::BOLD;
        let top_px = self.lanes.orphans_px();
        let orphan = ("orphan", top_px);
        let heads = [Some(("robots", 0.0)), self.has_orphans().then_some(orphan)];
        for (text, top) in heads.into_iter().flatten() {
            let at = chart.plotting_area().map_coordinate(&(0.0, top + 8.0));
            area.draw_text(text, &title.style(), (px(6.0), at.1))?;
        }
        let room = title.width_px("orphan") + 14.0..self.timeline.edges.start - 10.0;
        let failures = &self.run.metrics.failures;
        let lost = |rank| failures.iter().any(|failure| failure.robot == rank);
        let robot = |rank: usize| (history.robots[rank].name.as_str(), INK);
        let (robots, orphans) = (&self.lanes.robots, &self.lanes.orphans);
        robots.write_names(area, chart, (room.clone(), 0.0), robot, lost)?;
        let task = |task: usize| (history.catalog.tasks[task].name.as_str(), INK);
        orphans.write_names(area, chart, (room, top_px), task, |_| false)?;
        let edge = top_px - GAP_PX / 2.0;
        let ends = vec![(window.start, edge), (window.end, edge)];
        curve(chart, ends, line(FAINT, 0.75))
    }

    /// Writes the names of robots and tasks beside their lanes, with lines between robots.
    fn names_by_task(&self, area: &Area<'_>, chart: &Chart<'_>) -> DrawResult {
        let (history, window) = (self.run.history, &self.timeline.window);
        let left_px = self.timeline.edges.start;
        let robots = history.robots.iter().map(|robot| robot.name.as_str());
        let robots = robots.zip(self.run.colors.iter().copied());
        let orphan = self.has_orphans().then_some(("orphan", INK));
        for (rank, (name, color)) in robots.chain(orphan).enumerate() {
            let lanes = self.lanes.of_robot(rank);
            let ends = vec![(window.start, lanes.start), (window.end, lanes.start)];
            curve(chart, ends, line(FAINT, 0.75))?;
            let robot = TextLabel::BOLD.colored(color);
            let task = TextLabel::RIGHT;
            let y = |place: usize| {
                let middle = lanes.start + (place as f64 + 0.5) * self.lanes.robots.row_px;
                let plot = chart.plotting_area();
                plot.map_coordinate(&(window.start, middle)).1
            };
            area.draw_text(name, &robot.style(), (px(6.0), y(0)))?;
            for (place, spec) in history.catalog.tasks.iter().enumerate() {
                // The first task stands beside the robot's name.
                let beside_px = if place == 0 {
                    robot.width_px(name) + 12.0
                } else {
                    6.0
                };
                let text = task.cut(&spec.name, left_px - 10.0 - beside_px);
                area.draw_text(&text, &task.style(), (px(left_px - 10.0), y(place)))?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::figures::palette;
    use crate::report::figures::{FigureSelection, figures};
    use crate::report::metrics::Metrics;
    use crate::report::tests::run_of;
    use crate::testkit;

    /// The bounding box, px, and the color of a drawn element.
    struct Painted {
        x: (f64, f64),
        y: (f64, f64),
        color: String,
    }

    /// Returns the filled rectangles and lines of an SVG in drawing order.
    fn painted(svg: &str) -> Vec<Painted> {
        let value = |element: &str, name: &str| {
            let from = element.find(&format!(" {name}=\""))? + name.len() + 3;
            let to = from + element[from..].find('"')?;
            Some(element[from..to].to_owned())
        };
        let number =
            |text: &str| text.parse::<f64>().unwrap() / crate::figures::canvas::px(1.0) as f64;
        let mut all = Vec::new();
        for element in svg.split('<') {
            if element.starts_with("rect") && value(element, "opacity").as_deref() == Some("1") {
                let of = |name| number(&value(element, name).unwrap());
                let (x, y) = (of("x"), of("y"));
                let color = value(element, "fill").unwrap();
                all.push(Painted {
                    x: (x, x + of("width")),
                    y: (y, y + of("height")),
                    color,
                });
            } else if element.starts_with("polyline") {
                let points = value(element, "points").unwrap();
                let points: Vec<(f64, f64)> = points
                    .split_whitespace()
                    .map(|point| point.split_once(',').unwrap())
                    .map(|(x, y)| (number(x), number(y)))
                    .collect();
                let half = number(&value(element, "stroke-width").unwrap()) / 2.0;
                let xs = points.iter().map(|point| point.0);
                let ys = points.iter().map(|point| point.1);
                let least = |all: &mut dyn Iterator<Item = f64>| all.fold(f64::MAX, f64::min);
                let most = |all: &mut dyn Iterator<Item = f64>| all.fold(f64::MIN, f64::max);
                all.push(Painted {
                    x: (least(&mut xs.clone()) - half, most(&mut xs.clone()) + half),
                    y: (least(&mut ys.clone()), most(&mut ys.clone())),
                    color: value(element, "stroke").unwrap(),
                });
            } else if element.starts_with("path") {
                let half = number(&value(element, "stroke-width").unwrap()) / 2.0;
                for line in value(element, "d").unwrap().split('M').skip(1) {
                    let (x, y) = line.split_once(',').unwrap();
                    let (top, bottom) = y.split_once('V').unwrap();
                    let (x, ends) = (number(x), [top, bottom].map(number));
                    all.push(Painted {
                        x: (x - half, x + half),
                        y: (ends[0].min(ends[1]), ends[0].max(ends[1])),
                        color: value(element, "stroke").unwrap(),
                    });
                }
            }
        }
        all
    }

    /// Gold and green search for two minutes with an effect every few steps. Their bars remain visible.
    #[test]
    fn effects_do_not_hide_the_bars_on_which_they_are_marked() {
        let scenario = testkit::shipped("thesis-trapped-robot");
        let (history, run) = run_of(testkit::setup(scenario));
        let metrics = Metrics::compute(&history, &run);
        let figures = figures(&history, &metrics, &FigureSelection::default())
            .unwrap()
            .figures;
        let all = painted(&figures[0].svg);
        let names = history.robots.iter().map(|robot| robot.name.as_str());
        let colors = palette::colors(names);
        let task = history.task_named("find-locations").unwrap();
        let mut seen = 0;
        for stint in metrics.stints.iter().filter(|stint| stint.task == task) {
            let color = &colors[stint.robot];
            let color = format!("#{:02X}{:02X}{:02X}", color.0, color.1, color.2);
            let long = stint.span.length().as_secs_f64() > 20.0;
            let bars: Vec<&Painted> = all
                .iter()
                .filter(|bar| bar.color == color && bar.y.1 - bar.y.0 > 8.0)
                .collect();
            if !long || stint.effects.len() < 50 {
                continue;
            }
            seen += 1;
            // The widest bar of the robot belongs to such a search.
            let bar = bars
                .iter()
                .max_by(|a, b| (a.x.1 - a.x.0).total_cmp(&(b.x.1 - b.x.0)))
                .unwrap();
            for share in [0.25, 0.5, 0.75] {
                let y = bar.y.0 + share * (bar.y.1 - bar.y.0);
                let places = 400;
                let place = |index: i32| {
                    bar.x.0 + (bar.x.1 - bar.x.0) * (f64::from(index) + 0.5) / f64::from(places)
                };
                let hidden = (0..places).filter(|index| {
                    let x = place(*index);
                    let inside = |element: &&Painted| {
                        element.x.0 <= x && x <= element.x.1 && element.y.0 <= y && y <= element.y.1
                    };
                    all.iter().rfind(inside).unwrap().color != color
                });
                let hidden = hidden.count();
                assert!(
                    hidden * 10 < places as usize * 3,
                    "{hidden} of {places} at {share}"
                );
            }
        }
        assert!(seen >= 2, "{seen} long searches");
    }
}
