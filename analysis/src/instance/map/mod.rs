//! Occupancy maps in the form of ROS's map_server: a YAML file with the image, the resolution, the origin and the
//! thresholds, and a PGM file with one pixel per cell.

mod rectangles;

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use image::{ImageFormat, ImageReader};
use scenario::limits::{FARTHEST_M, NumberRange, above_zero, closed};
use scenario::{Obstacle, Problem, decode_text};
use serde::Deserialize;
use serde_saphyr::Spanned;

use super::formats::yaml_error;
use super::model::{Floor, Instance};
use super::source::Source;
pub use rectangles::{Cells, rectangles};

/// The YAML file of a map.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct MapFile {
    image: Spanned<PathBuf>,
    /// The size of a cell, m.
    resolution: Spanned<f64>,
    /// The pose of the lower left corner: x and y, m, and the rotation, rad.
    origin: Spanned<[f64; 3]>,
    /// 0 if dark pixels are occupied, and 1 if light ones are.
    negate: Spanned<u8>,
    occupied_thresh: Spanned<f64>,
    free_thresh: Spanned<f64>,
    mode: Option<Spanned<String>>,
}

/// A map: the cells that robots cannot enter.
#[derive(Clone, Debug, PartialEq)]
pub struct OccupancyMap {
    pub solid: Cells,
    /// The number of cells whose state the map does not state. They are solid.
    pub unknown: usize,
    /// The size of a cell, m.
    pub resolution_m: f64,
    /// The place of the lower left corner in the frame of the map, m.
    pub origin: [f64; 2],
}

/// Reads a map from its YAML file and the image that the file names.
///
/// # Errors
/// Returns the first line that does not fit, or an image that cannot be read.
pub fn read(path: &Path) -> anyhow::Result<OccupancyMap> {
    let name = path.display().to_string();
    let text = decode_text(&name, std::fs::read(path).with_context(|| name.clone())?)?;
    let source = Source {
        name: &name,
        text: &text,
    };
    let file: MapFile =
        serde_saphyr::from_str(&text).map_err(|error| yaml_error(source, &error))?;
    check(&file, source)?;
    let image = path
        .parent()
        .unwrap_or(Path::new(""))
        .join(&file.image.value);
    let image_name = image.display().to_string();
    let bytes = std::fs::read(&image).map_err(|error| {
        refused(
            source,
            &file.image,
            format!("{image_name}: {error}"),
            "name a PGM file",
        )
    })?;
    let mut reader = ImageReader::new(std::io::Cursor::new(bytes));
    reader.set_format(ImageFormat::Pnm);
    let pixels = reader.decode().map_err(|error| {
        Problem::with_source(&image_name, error.to_string(), "save the map as a PGM file")
    })?;
    let pixels = pixels.into_luma8();
    let (width, height) = (pixels.width() as usize, pixels.height() as usize);
    let mut unknown = 0;
    let mut solid = Cells::new(width, height);
    for (column, row, pixel) in pixels.enumerate_pixels() {
        let lightness = f64::from(pixel.0[0]) / 255.0;
        let occupied = if file.negate.value == 0 {
            1.0 - lightness
        } else {
            lightness
        };
        let is_free = occupied < file.free_thresh.value;
        let is_occupied = occupied > file.occupied_thresh.value;
        unknown += usize::from(!is_free && !is_occupied);
        // The first row of an image is its top.
        solid.set(
            column as usize,
            height - 1 - row as usize,
            !is_free || is_occupied,
        );
    }
    let [x, y, _] = file.origin.value;
    Ok(OccupancyMap {
        solid,
        unknown,
        resolution_m: file.resolution.value,
        origin: [x, y],
    })
}

fn refused<T>(source: Source<'_>, at: &Spanned<T>, what: String, remedy: &str) -> Problem {
    let line = usize::try_from(at.referenced.line()).unwrap_or(1);
    source.error(line.max(1), what, remedy)
}

fn check(file: &MapFile, source: Source<'_>) -> Result<(), Problem> {
    const RESOLUTION: NumberRange = above_zero(100.0, "m");
    const ORIGIN: NumberRange = closed(-1e9, 1e9, "m");
    const SHARE: NumberRange = closed(0.0, 1.0, "");
    let range = |range: NumberRange, key: &str, at: &Spanned<f64>| {
        let checked = range.check([key], at.value);
        checked.map_err(|problem| refused(source, at, problem.to_string(), ""))
    };
    range(RESOLUTION, "resolution", &file.resolution)?;
    range(SHARE, "occupied_thresh", &file.occupied_thresh)?;
    range(SHARE, "free_thresh", &file.free_thresh)?;
    let [x, y, yaw] = file.origin.value;
    for at in [x, y] {
        let checked = ORIGIN.check(["origin"], at);
        checked.map_err(|problem| refused(source, &file.origin, problem.to_string(), ""))?;
    }
    if yaw != 0.0 {
        let what = format!("origin: the map is rotated by {yaw} rad");
        return Err(refused(
            source,
            &file.origin,
            what,
            "rotate the image, and write 0",
        ));
    }
    if file.free_thresh.value > file.occupied_thresh.value {
        let what = "free_thresh is above occupied_thresh".to_owned();
        return Err(refused(source, &file.free_thresh, what, "exchange them"));
    }
    if file.negate.value > 1 {
        let what = format!("negate: {} is neither 0 nor 1", file.negate.value);
        return Err(refused(source, &file.negate, what, "write one of them"));
    }
    match &file.mode {
        Some(mode) if !["trinary", "scale"].contains(&mode.value.as_str()) => {
            let what = format!("mode: '{}' has no thresholds", mode.value);
            Err(refused(source, mode, what, "use trinary or scale"))
        }
        _ => Ok(()),
    }
}

impl OccupancyMap {
    /// Places the map under an instance: its walls become obstacles, and the room is the map. Places of the instance are
    /// in the frame of the map. Returns a note with the conversion.
    pub fn put_under(&self, instance: &mut Instance) -> String {
        let size = |cells: usize| cells as f64 * self.resolution_m;
        let found = rectangles(&self.solid);
        let mut note = format!(
            "map: {} solid cells of {} m, {} of them unknown, are {} rectangles",
            self.solid.count(),
            self.resolution_m,
            self.unknown,
            found.len(),
        );
        let sizes = [self.solid.width(), self.solid.height()].map(size);
        let is_near = |(from, size): (f64, f64)| from >= -FARTHEST_M && from + size <= FARTHEST_M;
        let is_near = self.origin.into_iter().zip(sizes).all(is_near);
        // A scenario has no coordinates beyond the limit.
        let [x, y] = if is_near { [0.0; 2] } else { self.origin };
        if !is_near {
            note += &format!("; places are shifted by ({}, {}) m", 0.0 - x, 0.0 - y);
        }
        let [left, bottom] = [self.origin[0] - x, self.origin[1] - y];
        instance.room = Some(Floor {
            x_m: left,
            y_m: bottom,
            width_m: sizes[0],
            height_m: sizes[1],
        });
        instance
            .obstacles
            .extend(found.into_iter().map(|each| Obstacle {
                x_m: (left + size(each.column)) as f32,
                y_m: (bottom + size(each.row)) as f32,
                width_m: size(each.columns) as f32,
                height_m: size(each.rows) as f32,
                penetrability: 0.0,
            }));
        for task in &mut instance.tasks {
            (task.x_m, task.y_m) = (task.x_m - x, task.y_m - y);
            task.deliver_to = task.deliver_to.map(|[to_x, to_y]| [to_x - x, to_y - y]);
        }
        for robot in &mut instance.robots {
            robot.x_m = robot.x_m.map(|at| at - x);
            robot.y_m = robot.y_m.map(|at| at - y);
        }
        note
    }
}
