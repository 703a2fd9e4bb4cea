//! A picture of a run in progress, without a log.

use proto::view::View;
use scenario::Setup;
use scenario::time::SimTime;

use super::drawing::Drawing;
use super::scene::Scene;
use crate::figures::canvas::{Sheet, TEXT_PX};
use crate::figures::pixels::Pixels;

/// The width of the layout, px, which a picture of any width scales.
const LAYOUT_PX: f64 = 640.0;

/// Draws the room at the time of a view. The picture has neither paths nor messages, because a view has no past.
///
/// # Errors
/// Returns an error for a width without pixels.
pub fn draw_view(setup: &Setup, view: View, width_px: u32) -> anyhow::Result<Pixels> {
    let width = f64::from(width_px);
    let end = SimTime::from_secs_f64(setup.scenario.limit_s);
    let sheet = Sheet::new(width, TEXT_PX * width / LAYOUT_PX);
    let drawing = Drawing::new(setup, end, sheet);
    let scene = Scene {
        trails: vec![Vec::new(); view.robots.len()],
        view,
        transmissions: Vec::new(),
    };
    Pixels::draw(&drawing.svg(&scene), 1.0)
}

#[cfg(test)]
mod tests {
    use in_process::{Team, joins_of};
    use missions::waste::data::default_setup;
    use run_log::{LogLevel, MemoryLog};

    use super::*;

    #[test]
    fn a_picture_has_the_width_and_shows_the_time_of_the_view() {
        let setup = default_setup(1);
        let joins = joins_of(&setup);
        let mut team =
            Team::with_inputs(setup.clone(), joins, LogLevel::Off, MemoryLog::default()).unwrap();
        team.tick().unwrap();
        let first = draw_view(&setup, team.view(), 480).unwrap();
        assert_eq!(first.width, 480);
        assert_eq!(first.rgb.len(), 3 * 480 * first.height as usize);
        assert_eq!(first, draw_view(&setup, team.view(), 480).unwrap());
        for _ in 0..200 {
            team.tick().unwrap();
        }
        assert_ne!(first, draw_view(&setup, team.view(), 480).unwrap());
    }
}
