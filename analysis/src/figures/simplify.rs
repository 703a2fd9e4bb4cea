//! Line simplification for figures.

use std::ops::Range;

/// Removes points of a line that are invisible at a resolution of `width` by `height`; x must not decrease. Spikes
/// remain: each column of `width` keeps its first, last, lowest and highest point. Of these, points within `height` of
/// the straight line between their remaining neighbors are removed.
#[must_use]
pub fn thin(points: &[(f64, f64)], width: f64, height: f64) -> Vec<(f64, f64)> {
    straighten(&columns(points, width), height, off)
}

/// Removes points of a path that lie within `distance` of the straight lines between the remaining points.
#[must_use]
pub fn thin_way(points: &[(f64, f64)], distance: f64) -> Vec<(f64, f64)> {
    straighten(points, distance, beside)
}

/// Returns the part of a line with x in a window, with a point at each crossed edge; x must not decrease.
#[must_use]
pub fn within(points: &[(f64, f64)], window: &Range<f64>) -> Vec<(f64, f64)> {
    let mut part = Vec::new();
    for (place, &(x, y)) in points.iter().enumerate() {
        if let Some(&(before, from)) = place.checked_sub(1).and_then(|index| points.get(index)) {
            for edge in [window.start, window.end] {
                if before < edge && edge < x {
                    part.push((edge, from + (y - from) * (edge - before) / (x - before)));
                }
            }
        }
        if (window.start..=window.end).contains(&x) {
            part.push((x, y));
        }
    }
    part
}

fn columns(points: &[(f64, f64)], width: f64) -> Vec<(f64, f64)> {
    let column = |x: f64| (x / width).floor();
    let groups = points.chunk_by(|a, b| column(a.0) == column(b.0));
    groups.flat_map(first_last_and_extremes).collect()
}

/// Returns the first, last, lowest and highest point of a group, each once and in order.
pub fn first_last_and_extremes<T: Copy>(group: &[(T, f64)]) -> Vec<(T, f64)> {
    let level = |a: &usize, b: &usize| group[*a].1.total_cmp(&group[*b].1);
    let (lowest, highest) = (
        (0..group.len()).min_by(level),
        (0..group.len()).max_by(level),
    );
    let ends = [0, group.len() - 1];
    let mut places: Vec<usize> = ends.into_iter().chain(lowest).chain(highest).collect();
    places.sort_unstable();
    places.dedup();
    places.into_iter().map(|place| group[place]).collect()
}

type Point = (f64, f64);

/// Simplifies a line (Douglas and Peucker). `distance` is the distance of the first point from the line between the
/// others.
fn straighten(
    points: &[Point],
    least: f64,
    distance: impl Fn(Point, Point, Point) -> f64,
) -> Vec<Point> {
    let Some(last) = points.len().checked_sub(1) else {
        return Vec::new();
    };
    let mut keep = vec![false; points.len()];
    keep[0] = true;
    keep[last] = true;
    let mut parts = vec![(0, last)];
    while let Some((from, to)) = parts.pop() {
        let farthest = (from + 1..to)
            .map(|place| (place, distance(points[place], points[from], points[to])))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((place, distance)) = farthest
            && distance >= least
        {
            keep[place] = true;
            parts.push((from, place));
            parts.push((place, to));
        }
    }
    let kept = points.iter().zip(keep).filter(|(_, keep)| *keep);
    kept.map(|(point, _)| *point).collect()
}

/// Returns the vertical distance of a point from the line between a and b.
fn off((x, y): Point, a: Point, b: Point) -> f64 {
    if a.0 == b.0 {
        // A vertical line: a point between its ends lies on it.
        return (y - y.clamp(a.1.min(b.1), a.1.max(b.1))).abs();
    }
    let share = (x - a.0) / (b.0 - a.0);
    (y - (a.1 + share * (b.1 - a.1))).abs()
}

/// Returns the distance of a point from the segment between a and b.
fn beside((x, y): Point, a: Point, b: Point) -> f64 {
    let (width, height) = (b.0 - a.0, b.1 - a.1);
    let square = width * width + height * height;
    let share = if square > 0.0 {
        ((x - a.0) * width + (y - a.1) * height) / square
    } else {
        0.0
    };
    let share = share.clamp(0.0, 1.0);
    (x - (a.0 + share * width)).hypot(y - (a.1 + share * height))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_saw_keeps_its_teeth_and_nothing_else() {
        // Three times up from 0 to 9 and back to 0.
        let saw: Vec<(f64, f64)> = (0..30).map(|x| (f64::from(x), f64::from(x % 10))).collect();
        let teeth = [0, 9, 10, 19, 20, 29].map(|x| (f64::from(x), f64::from(x % 10)));
        assert_eq!(thin(&saw, 0.5, 0.1), teeth);
    }

    #[test]
    fn a_spike_of_one_sample_among_thousands_stays() {
        let mut line: Vec<(f64, f64)> = (0..10_000).map(|x| (f64::from(x), 1.0)).collect();
        line[7_777].1 = 5.0;
        line[3_333].1 = -5.0;
        let thinned = thin(&line, 100.0, 0.1);
        assert!(thinned.contains(&(7_777.0, 5.0)), "{thinned:?}");
        assert!(thinned.contains(&(3_333.0, -5.0)), "{thinned:?}");
        assert!(thinned.len() <= 10, "{} points", thinned.len());
    }

    #[test]
    fn noise_leaves_at_most_four_points_for_each_width() {
        let noise: Vec<(f64, f64)> = (0..100_000)
            .map(|x| (f64::from(x), f64::from(x * 7_919 % 101)))
            .collect();
        assert!(thin(&noise, 1_000.0, 0.1).len() <= 400);
    }

    #[test]
    fn a_way_keeps_its_corners_and_turning_points() {
        // There and back along x, then up.
        let mut way: Vec<Point> = (0..=10).map(|x| (f64::from(x), 0.0)).collect();
        way.extend((0..10).rev().map(|x| (f64::from(x), 0.001)));
        way.extend((1..=5).map(|y| (0.0, f64::from(y))));
        let corners = [(0.0, 0.0), (10.0, 0.0), (0.0, 0.001), (0.0, 5.0)];
        assert_eq!(thin_way(&way, 0.01), corners);
        // A robot that does not move.
        assert_eq!(thin_way(&[(1.0, 1.0); 100], 0.01), [(1.0, 1.0); 2]);
    }

    #[test]
    fn a_part_of_a_line_ends_where_it_crosses_the_edges() {
        let line = [(0.0, 0.0), (10.0, 10.0), (10.0, 0.0), (20.0, 20.0)];
        assert_eq!(within(&line, &(0.0..20.0)), line);
        let part = [(5.0, 5.0), (10.0, 10.0), (10.0, 0.0), (15.0, 10.0)];
        assert_eq!(within(&line, &(5.0..15.0)), part);
        assert_eq!(within(&line, &(2.0..4.0)), [(2.0, 2.0), (4.0, 4.0)]);
        assert_eq!(within(&line, &(21.0..30.0)), []);
        assert_eq!(within(&line, &(10.0..10.0)), [(10.0, 10.0), (10.0, 0.0)]);
    }

    #[test]
    fn few_points() {
        assert_eq!(thin(&[], 1.0, 1.0), []);
        assert_eq!(thin(&[(1.0, 2.0)], 1.0, 1.0), [(1.0, 2.0)]);
        let upright = [(1.0, 0.0), (1.0, 3.0), (1.0, 9.0)];
        assert_eq!(thin(&upright, 0.1, 0.5), [(1.0, 0.0), (1.0, 9.0)]);
    }
}
