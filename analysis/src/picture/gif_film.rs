//! A film as a GIF. All frames share one palette, and pixels that do not change are transparent.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io::Write;

use gif::{DisposalMethod, Encoder, Frame, Repeat};
use plotters::style::RGBColor;

use super::region::{LAST_S, Region};
use crate::figures::pixels::Pixels;

/// The index of the transparent color. The other indices are for the colors of the pictures.
const TRANSPARENT: u8 = u8::MAX;

/// The unit of delays, per second.
const DELAYS_PER_S: u32 = 100;

type Rgb = [u8; 3];

pub struct GifFilm<W: Write> {
    encoder: Encoder<W>,
    colors: Colors,
    before: Option<Before>,
    width: usize,
    rate: u16,
    frames: u32,
}

/// The frame before the current one.
struct Before {
    rgb: Vec<u8>,
    indices: Vec<u8>,
}

impl<W: Write> GifFilm<W> {
    /// Begins a film with the size of the samples, so many frames per second, that repeats. Its colors are `certain` and
    /// the most frequent ones of the samples.
    pub fn new(
        file: W,
        samples: &[Pixels],
        certain: &[RGBColor],
        rate: u16,
    ) -> anyhow::Result<Self> {
        let size = samples
            .first()
            .map_or((0, 0), |image| (image.width, image.height));
        let colors = Colors::choose(samples, certain);
        let (width, height) = (u16::try_from(size.0)?, u16::try_from(size.1)?);
        let mut encoder = Encoder::new(file, width, height, &colors.palette())?;
        encoder.set_repeat(Repeat::Infinite)?;
        Ok(Self {
            encoder,
            colors,
            before: None,
            width: width.into(),
            rate,
            frames: 0,
        })
    }

    /// Adds a frame of the size of the samples.
    pub fn add_frame(&mut self, frame: &Pixels, is_last: bool) -> anyhow::Result<()> {
        let colors = &mut self.colors;
        let mut index = |color: &[u8]| colors.index([color[0], color[1], color[2]]);
        let pixels = frame.rgb.chunks_exact(3);
        let indices: Vec<u8> = match &self.before {
            None => pixels.map(index).collect(),
            // Most pixels keep their color, which saves the search for the nearest one.
            Some(before) => {
                let before = before.rgb.chunks_exact(3).zip(&before.indices);
                let pairs = pixels.zip(before);
                let each = pairs.map(|(color, (old, known))| match color == old {
                    true => *known,
                    false => index(color),
                });
                each.collect()
            }
        };
        let whole = Region {
            left: 0,
            top: 0,
            width: self.width,
            height: frame.height as usize,
        };
        let (region, buffer) = match &self.before {
            None => (whole, indices.clone()),
            Some(before) => {
                let region = Region::of_change(&before.indices, &indices, self.width);
                let pixels = region.pixels(self.width);
                let pixels = pixels.map(|at| match before.indices[at] == indices[at] {
                    true => TRANSPARENT,
                    false => indices[at],
                });
                (region, pixels.collect())
            }
        };
        let delay = if is_last {
            LAST_S * DELAYS_PER_S as u16
        } else {
            self.delay()
        };
        self.encoder.write_frame(&Frame {
            delay,
            dispose: DisposalMethod::Keep,
            transparent: Some(TRANSPARENT),
            left: u16::try_from(region.left)?,
            top: u16::try_from(region.top)?,
            width: u16::try_from(region.width)?,
            height: u16::try_from(region.height)?,
            buffer: Cow::Owned(buffer),
            ..Frame::default()
        })?;
        self.before = Some(Before {
            rgb: frame.rgb.clone(),
            indices,
        });
        self.frames += 1;
        Ok(())
    }

    /// Writes the end of the file.
    pub fn finish(self) -> anyhow::Result<()> {
        self.encoder.into_inner()?;
        Ok(())
    }

    /// Returns the delay of the next frame. The sum of all delays is exact, although one is a whole number.
    fn delay(&self) -> u16 {
        let until = |frame: u32| frame * DELAYS_PER_S / u32::from(self.rate);
        // A rate is at least 1, so a delay is at most 100.
        (until(self.frames + 1) - until(self.frames)) as u16
    }
}

/// The colors of a film.
struct Colors {
    chosen: Vec<Rgb>,
    /// The index of the nearest chosen color.
    nearest: HashMap<Rgb, u8>,
}

impl Colors {
    fn choose(samples: &[Pixels], certain: &[RGBColor]) -> Self {
        let mut counts: HashMap<Rgb, u64> = HashMap::new();
        for color in samples.iter().flat_map(|image| image.rgb.chunks_exact(3)) {
            *counts.entry([color[0], color[1], color[2]]).or_default() += 1;
        }
        for RGBColor(red, green, blue) in certain {
            counts.insert([*red, *green, *blue], u64::MAX);
        }
        let mut colors: Vec<(u64, Rgb)> = counts
            .into_iter()
            .map(|(color, count)| (count, color))
            .collect();
        colors.sort_unstable_by(|a, b| b.cmp(a));
        colors.truncate(TRANSPARENT.into());
        Self {
            chosen: colors.into_iter().map(|(_, color)| color).collect(),
            nearest: HashMap::new(),
        }
    }

    /// Returns the palette: all indices, with the transparent one.
    fn palette(&self) -> Vec<u8> {
        let mut palette = self.chosen.concat();
        palette.resize(3 * (usize::from(TRANSPARENT) + 1), 0);
        palette
    }

    fn index(&mut self, color: Rgb) -> u8 {
        let chosen = &self.chosen;
        *self.nearest.entry(color).or_insert_with(|| {
            let distance = |other: &Rgb| -> u32 {
                let parts = color.iter().zip(other);
                parts.map(|(a, b)| u32::from(a.abs_diff(*b)).pow(2)).sum()
            };
            let nearest = (0..TRANSPARENT).zip(chosen);
            let nearest = nearest.min_by_key(|(_, other)| distance(other));
            nearest.map_or(0, |(index, _)| index)
        })
    }
}
