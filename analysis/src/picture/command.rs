//! The pictures and films of `alliance export`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::bail;
use clap::Args;
use run_log::RunLog;
use scenario::Problem;
use scenario::ids::Tick;
use scenario::time::{SimTime, seconds};
use terminal::stderr_line;

use super::camera::take_scenes;
use super::drawing::Drawing;
use super::film::{self, FilmFormat};
use crate::figures::canvas::WHITE;
use crate::figures::palette::{FLOOR, ITEM, PROGRESS, TROUBLE, WALL};
use crate::figures::pixels::{PRINT_PIXELS, Pixels};
use crate::figures::size::SizeOptions;
use crate::new_file::{NewFile, make_folder, write_atomically};
use crate::replay::end_of;

/// The default duration of a film is at most this, s.
const FILM_S: f64 = 20.0;

/// The largest number of frames, because all of them are in memory.
const FRAMES_MAX: usize = 3000;

const DEFAULT_RATE: u16 = 20;

/// Options for pictures and films.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Pictures and films")]
pub struct PictureOptions {
    /// Folder of the pictures [default: RUN]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// The film begins at this simulated time [default: the start]
    #[arg(long, value_name = "TIME", value_parser = seconds, requires = "video")]
    from: Option<f64>,
    /// The film ends at this simulated time [default: the end]
    #[arg(long, value_name = "TIME", value_parser = seconds, requires = "video")]
    to: Option<f64>,
    /// Speed of the film relative to real time, such as 10x [default: a film of at most 20 s]
    #[arg(long, value_name = "FACTORx", value_parser = factor, requires = "video")]
    speed: Option<f64>,
    /// Frames of the film per second
    #[arg(long, value_name = "N", default_value_t = DEFAULT_RATE, value_parser = clap::value_parser!(u16).range(1..=50))]
    fps: u16,
    #[command(flatten)]
    size: SizeOptions,
}

/// The simulated times of pictures, as a comma-separated list.
#[derive(Clone, Debug, PartialEq)]
pub struct Moments(Vec<Moment>);

/// A moment of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Moment {
    /// The simulated time, s.
    At(f64),
    /// The end of the run.
    End,
}

impl FromStr for Moments {
    type Err = Problem;

    fn from_str(text: &str) -> Result<Self, Problem> {
        let moments = text.split(',').map(|text| match text.trim() {
            "end" => Ok(Moment::End),
            time => seconds(time).map(Moment::At),
        });
        let moments: Result<_, Problem> = moments.collect();
        // The folder of the run after the option is read as a time.
        let moments = moments.map_err(|times| {
            Problem::of_value(format!("{times}, or name the run before the option"), "")
        });
        Ok(Self(moments?))
    }
}

/// The wanted pictures and films.
pub struct Wanted<'w> {
    pub svg: Option<&'w Moments>,
    pub png: Option<&'w Moments>,
    pub video: Option<&'w Path>,
}

impl Wanted<'_> {
    fn is_empty(&self) -> bool {
        self.svg.is_none() && self.png.is_none() && self.video.is_none()
    }
}

/// The duration of a run.
#[derive(Clone, Copy)]
struct Length {
    ticks: u64,
    step: SimTime,
}

impl Length {
    fn of(log: &RunLog) -> anyhow::Result<Self> {
        let (ticks, _) = end_of(log)?;
        let step = SimTime(log.run.setup.scenario.step_ms);
        Ok(Self { ticks, step })
    }

    fn end(self) -> SimTime {
        SimTime(self.ticks * self.step.0)
    }

    /// Returns the last tick that begins at a time, s, or before.
    fn tick_at(self, option: &str, at_s: f64) -> anyhow::Result<Tick> {
        let at = SimTime::from_secs_f64(at_s);
        if at > self.end() {
            bail!("--{option} {at_s}: the run ended at {}", self.end());
        }
        Ok(at.0 / self.step.0)
    }

    fn ticks_of(self, option: &str, moments: Option<&Moments>) -> anyhow::Result<BTreeSet<Tick>> {
        let moments = moments.iter().flat_map(|moments| &moments.0);
        moments
            .map(|moment| match moment {
                Moment::At(at_s) => self.tick_at(option, *at_s),
                Moment::End => Ok(self.ticks),
            })
            .collect()
    }
}

/// A film before its replay.
struct Film<'w> {
    path: &'w Path,
    format: FilmFormat,
    rate: u16,
    speed: f64,
    /// The tick of each frame.
    frames: Vec<Tick>,
}

impl PictureOptions {
    /// Checks the options that need no run.
    ///
    /// # Errors
    /// Returns an error for a size or a format that cannot be made, and for options without a picture.
    pub fn check(&self, wanted: &Wanted<'_>) -> anyhow::Result<()> {
        self.size.sheet()?;
        if let Some(path) = wanted.video {
            FilmFormat::of(path)?;
        }
        let given = [
            (
                "out",
                self.out.is_some() && wanted.svg.is_none() && wanted.png.is_none(),
            ),
            ("width", self.size.width.is_some() && wanted.is_empty()),
            (
                "font-size",
                self.size.font_size.is_some() && wanted.is_empty(),
            ),
            ("fps", self.fps != DEFAULT_RATE && wanted.video.is_none()),
        ];
        if let Some((option, _)) = given.iter().find(|(_, is_idle)| *is_idle) {
            let (problem, remedy) = match *option {
                "fps" => ("there is no film", "add --video FILE"),
                _ => ("there is no picture", "add --svg or --png"),
            };
            bail!(Problem::with_source(format!("--{option}"), problem, remedy));
        }
        Ok(())
    }

    /// Writes the wanted pictures and films. `folder` is the folder of the run.
    ///
    /// # Errors
    /// Returns an error for a time outside the run, a run that cannot be replayed, and a file that cannot be written.
    pub fn write(&self, log: &RunLog, folder: &Path, wanted: &Wanted<'_>) -> anyhow::Result<()> {
        if wanted.is_empty() {
            return Ok(());
        }
        let length = Length::of(log)?;
        let svgs = length.ticks_of("svg", wanted.svg)?;
        let pngs = length.ticks_of("png", wanted.png)?;
        let film = wanted
            .video
            .map(|path| self.film(path, length))
            .transpose()?;
        let frames = film.as_ref().map_or(&[][..], |film| &film.frames);
        let mut ticks: Vec<Tick> = svgs.iter().chain(&pngs).chain(frames).copied().collect();
        ticks.sort_unstable();
        ticks.dedup();

        let out = self.out.as_deref().unwrap_or(folder);
        if wanted.svg.is_some() || wanted.png.is_some() {
            make_folder(out)?;
        }
        // A file that cannot be written is refused before the replay.
        let file = wanted.video.map(NewFile::create).transpose()?;
        let drawing = Drawing::new(&log.run.setup, length.end(), self.size.sheet()?);
        let mut drawn = Vec::new();
        let differs = take_scenes(log, &ticks, |scene| {
            let svg = drawing.svg(&scene);
            let tick = scene.view.tick;
            let name = format!("room-at-{}s", scene.view.now.as_secs_f64());
            if svgs.contains(&tick) {
                let path = out.join(format!("{name}.svg"));
                write_atomically(&path, svg.as_bytes())?;
                stderr_line!("svg     {}", path.display());
            }
            if pngs.contains(&tick) {
                let path = out.join(format!("{name}.png"));
                write_atomically(&path, &Pixels::draw(&svg, PRINT_PIXELS)?.png()?)?;
                stderr_line!("png     {}", path.display());
            }
            let repeated = frames.iter().filter(|frame| **frame == tick).count();
            drawn.extend(vec![svg; repeated]);
            Ok(())
        })?;
        if let Some(difference) = differs {
            stderr_line!("note: {difference}");
        }
        match film.zip(file) {
            Some((film, file)) => film.write(&drawn, &drawing, file),
            None => Ok(()),
        }
    }

    fn film<'w>(&self, path: &'w Path, length: Length) -> anyhow::Result<Film<'w>> {
        let end_s = length.end().as_secs_f64();
        let (from_s, to_s) = (self.from.unwrap_or(0.0), self.to.unwrap_or(end_s));
        length.tick_at("from", from_s)?;
        length.tick_at("to", to_s)?;
        if from_s >= to_s {
            bail!("--to {to_s}: must be later than --from, {from_s} s");
        }
        let default = || round_up((to_s - from_s) / FILM_S);
        let speed = self.speed.unwrap_or_else(default);
        let period_s = speed / f64::from(self.fps);
        let count = ((to_s - from_s) / period_s).ceil();
        if count >= FRAMES_MAX as f64 {
            bail!(Problem::with_source(
                "--video",
                format!("the film has {count} frames, more than {FRAMES_MAX}"),
                "raise --speed, lower --fps, or choose a part with --from and --to"
            ));
        }
        let times = (0..count as u32).map(|frame| from_s + f64::from(frame) * period_s);
        let frames = times
            .chain([to_s])
            .map(|at_s| length.tick_at("to", at_s.min(to_s)));
        Ok(Film {
            path,
            format: FilmFormat::of(path)?,
            rate: self.fps,
            speed,
            frames: frames.collect::<anyhow::Result<_>>()?,
        })
    }
}

impl Film<'_> {
    fn write(
        &self,
        svgs: &[String],
        drawing: &Drawing<'_>,
        mut file: NewFile,
    ) -> anyhow::Result<()> {
        let certain = [WHITE, FLOOR, WALL, ITEM, TROUBLE, PROGRESS];
        let certain = [&certain[..], drawing.colors()].concat();
        file.write(|output| film::write(svgs, self.rate, self.format, &certain, output))?;
        file.put_in_place()?;
        let frames = svgs.len();
        let seconds = frames as f64 / f64::from(self.rate);
        stderr_line!(
            "video   {} ({frames} frames, {seconds:.1} s at {}x)",
            self.path.display(),
            self.speed
        );
        Ok(())
    }
}

/// Parses a multiple of real time, such as `10x`.
fn factor(text: &str) -> Result<f64, String> {
    let factor = text.strip_suffix('x').unwrap_or(text).parse::<f64>().ok();
    let factor = factor.filter(|factor| (0.001..=1e6).contains(factor));
    factor.ok_or_else(|| format!("'{text}' is not the speed of a film; use a factor such as 10x"))
}

/// Returns the least of 1, 2 or 5 times a power of ten that is not below a positive number; 1 for less than 1.
fn round_up(number: f64) -> f64 {
    let powers = (0..7).map(|power| 10_f64.powi(power));
    let mut rounds = powers.flat_map(|power| [1.0, 2.0, 5.0].map(|factor| factor * power));
    rounds.find(|round| *round >= number).unwrap_or(1e7)
}
