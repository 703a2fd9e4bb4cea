//! Joins pictures to a film.

use std::io::Write;
use std::num::NonZeroUsize;
use std::path::Path;
use std::thread;

use plotters::style::RGBColor;
use scenario::Problem;

use super::gif_film::GifFilm;
use super::webp_film::WebpFilm;
use crate::figures::pixels::Pixels;
use crate::progress::Progress;

/// The number of frames from which the colors of a GIF are chosen.
const SAMPLES: usize = 16;

/// The formats of films.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilmFormat {
    /// Animated WebP: all colors. Browsers, chats and image libraries read it.
    Webp,
    /// GIF: 255 colors. Slides show it, and converters of films read it.
    Gif,
}

impl FilmFormat {
    /// Returns the format that belongs to the ending of a file name.
    ///
    /// # Errors
    /// Returns an error for any other ending.
    pub fn of(path: &Path) -> Result<Self, Problem> {
        let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
        match ending.as_ref().and_then(|ending| ending.to_str()) {
            Some("webp") => Ok(Self::Webp),
            Some("gif") => Ok(Self::Gif),
            _ => Err(Problem::with_source(
                format!("--video {}", path.display()),
                "no known format of a film",
                "end the name with .webp or .gif",
            )),
        }
    }
}

/// A film in the making.
trait FilmWriter {
    /// Adds a frame, which is shown for a whole period or, as the last one, for [`LAST_S`](super::region::LAST_S).
    fn add(&mut self, frame: &Pixels, is_last: bool) -> anyhow::Result<()>;
    fn finish(self: Box<Self>) -> anyhow::Result<()>;
}

impl<W: Write> FilmWriter for GifFilm<W> {
    fn add(&mut self, frame: &Pixels, is_last: bool) -> anyhow::Result<()> {
        self.add_frame(frame, is_last)
    }

    fn finish(self: Box<Self>) -> anyhow::Result<()> {
        (*self).finish()
    }
}

impl<W: Write> FilmWriter for WebpFilm<W> {
    fn add(&mut self, frame: &Pixels, _is_last: bool) -> anyhow::Result<()> {
        self.add_frame(frame)
    }

    fn finish(self: Box<Self>) -> anyhow::Result<()> {
        (*self).finish()
    }
}

/// Draws SVGs of the same size and joins them to a film with so many frames per second. `certain` are colors that a
/// film with few colors must keep.
///
/// # Errors
/// Returns an error if a frame cannot be drawn or the film cannot be written.
pub fn write(
    svgs: &[String],
    rate: u16,
    format: FilmFormat,
    certain: &[RGBColor],
    file: impl Write,
) -> anyhow::Result<()> {
    let Some(last) = svgs.len().checked_sub(1) else {
        return Ok(());
    };
    let mut film: Box<dyn FilmWriter> = match format {
        FilmFormat::Webp => Box::new(WebpFilm::new(file, &draw(&svgs[0])?, rate)?),
        FilmFormat::Gif => {
            let samples = sample(svgs).map(|svg| draw(svg));
            let samples = samples.collect::<anyhow::Result<Vec<Pixels>>>()?;
            Box::new(GifFilm::new(file, &samples, certain, rate)?)
        }
    };
    let mut progress = Progress::new("drawing the film", "frames", svgs.len() as u64);
    let threads = thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let mut added = 0;
    for some in svgs.chunks(threads) {
        for frame in draw_all(some) {
            film.add(&frame?, added == last)?;
            added += 1;
            progress.step();
        }
    }
    film.finish()
}

/// Returns evenly spaced SVGs, with the first and the last one.
fn sample(svgs: &[String]) -> impl Iterator<Item = &String> {
    let last = svgs.len() - 1;
    let count = SAMPLES.min(svgs.len());
    (0..count).map(move |index| &svgs[index * last / (count - 1).max(1)])
}

fn draw(svg: &str) -> anyhow::Result<Pixels> {
    Pixels::draw(svg, 1.0)
}

/// Draws each SVG on a thread of its own, and returns the images in order.
fn draw_all(svgs: &[String]) -> Vec<anyhow::Result<Pixels>> {
    thread::scope(|scope| {
        let threads = svgs.iter().map(|svg| scope.spawn(move || draw(svg)));
        let threads: Vec<_> = threads.collect();
        let drawn = threads.into_iter().map(|thread| match thread.join() {
            Ok(drawn) => drawn,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        drawn.collect()
    })
}
