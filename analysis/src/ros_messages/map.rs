//! The border and the obstacles as a grid.

use proto::view::View;
use ros::Qos;
use ros::messages::{MapMetaData, OccupancyGrid};
use scenario::{Obstacle, Room, Setup};

use super::convert::{MAP_FRAME, header, point, pose, stamp};
use super::destination::{Destination, Topic};

/// The edge of a cell, m, as long as the grid has few cells.
const CELL_M: f32 = 0.05;
/// The largest number of cells in a row or column. In a larger room, the cells are larger.
const CELLS_MAX: f32 = 1000.0;

const OCCUPIED: i8 = 100;

/// The topic `/map`, with its latest map.
pub struct MapTopic {
    topic: Topic<OccupancyGrid>,
    room: Room,
    /// The obstacles on the latest map.
    shown: Option<Vec<Obstacle>>,
}

impl MapTopic {
    pub fn new(to: &mut dyn Destination, setup: &Setup) -> anyhow::Result<Self> {
        Ok(Self {
            topic: to.topic("/map", Qos::Latched)?,
            room: setup.scenario.room,
            shown: None,
        })
    }

    /// Writes a map if the obstacles have changed.
    pub fn write(&mut self, to: &mut dyn Destination, view: &View) -> anyhow::Result<()> {
        if self.shown.as_ref() == Some(&view.obstacles) {
            return Ok(());
        }
        let mut map = grid(self.room, &view.obstacles);
        map.header = header(view.now, MAP_FRAME);
        map.info.map_load_time = stamp(view.now);
        self.shown = Some(view.obstacles.clone());
        to.write(&self.topic, view.now, &map)
    }
}

/// Returns the grid of a room, without times. The outermost cells are the border. A solid obstacle is 100; ground that
/// slows robots down is between 0 and 100, and higher for slower ground. A cell belongs to the obstacle at its center.
fn grid(room: Room, obstacles: &[Obstacle]) -> OccupancyGrid {
    let longest = room.width_m.max(room.height_m);
    let cell_m = CELL_M.max(longest / CELLS_MAX);
    let cells = |length_m: f32| (length_m / cell_m).ceil() as u32 + 2;
    let (width, height) = (cells(room.width_m), cells(room.height_m));
    let mut data = Vec::with_capacity(width as usize * height as usize);
    for row in 0..height {
        for column in 0..width {
            let is_border = row == 0 || row == height - 1 || column == 0 || column == width - 1;
            let center = |from: f32, index: u32| from + (index as f32 - 0.5) * cell_m;
            data.push(match is_border {
                true => OCCUPIED,
                false => occupancy(obstacles, center(room.x_m, column), center(room.y_m, row)),
            });
        }
    }
    OccupancyGrid {
        info: MapMetaData {
            resolution: cell_m,
            width,
            height,
            origin: pose(point(room.x_m - cell_m, room.y_m - cell_m, 0.0), 0.0),
            ..MapMetaData::default()
        },
        data,
        ..OccupancyGrid::default()
    }
}

/// Returns the occupancy of a place: that of the slowest obstacle there.
fn occupancy(obstacles: &[Obstacle], x_m: f32, y_m: f32) -> i8 {
    let there = obstacles
        .iter()
        .filter(|obstacle| obstacle.contains(x_m, y_m));
    let of = |obstacle: &Obstacle| match obstacle {
        solid if solid.is_solid() => OCCUPIED,
        ground => ((1.0 - ground.penetrability.min(1.0)) * f32::from(OCCUPIED)).round() as i8,
    };
    there.map(of).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn obstacle(x_m: f32, penetrability: f32) -> Obstacle {
        Obstacle {
            x_m,
            y_m: 0.0,
            width_m: 0.05,
            height_m: 0.05,
            penetrability,
        }
    }

    #[test]
    fn solid_obstacles_and_the_border_are_occupied() {
        let room = Room::of_size(0.2, 0.1);
        let obstacles = [0.0, 0.5, 1.0, 2.0].into_iter().zip(0_u8..);
        let obstacles = obstacles.map(|(value, index)| obstacle(f32::from(index) * 0.05, value));
        let map = grid(room, &obstacles.collect::<Vec<_>>());
        assert_eq!((map.info.width, map.info.height), (6, 4));
        let rows: Vec<&[i8]> = map.data.chunks(6).collect();
        assert_eq!(rows[0], [100; 6]);
        assert_eq!(rows[1], [100, 100, 50, 0, 0, 100]);
        assert_eq!(rows[2], [100, 0, 0, 0, 0, 100]);
        assert_eq!(rows[3], [100; 6]);
    }

    #[test]
    fn a_large_room_has_large_cells() {
        let map = grid(Room::of_size(1000.0, 10.0), &[]);
        assert_eq!((map.info.width, map.info.height), (1002, 12));
        assert!((map.info.resolution - 1.0).abs() < 1e-6);
    }

    #[test]
    fn the_map_of_a_frame_with_an_origin_lies_there() {
        let room = Room {
            x_m: -2.0,
            y_m: 1.0,
            ..Room::of_size(0.2, 0.1)
        };
        let block = Obstacle {
            y_m: 1.0,
            ..obstacle(-1.95, 0.0)
        };
        let map = grid(room, &[block]);
        assert_eq!(
            map.data.chunks(6).nth(1),
            Some(&[100, 0, 100, 0, 0, 100][..])
        );
        let at = &map.info.origin.position;
        assert!((at.x + 2.05).abs() < 1e-6 && (at.y - 0.95).abs() < 1e-6);
    }
}
