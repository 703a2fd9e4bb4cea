//! A film as an animated PNG. After the first frame, pixels that do not change are transparent.

use std::io::Write;

use png::{BitDepth, BlendOp, ColorType, Compression, DisposeOp, Encoder, FilterType, Writer};

use super::region::{LAST_S, Region};
use crate::figures::pixels::Pixels;

/// The bytes of a pixel in an image without transparency.
const DEPTH: usize = 3;

pub struct PngFilm<W: Write> {
    writer: Writer<W>,
    before: Option<Vec<u8>>,
    width: usize,
    rate: u16,
}

impl<W: Write> PngFilm<W> {
    /// Begins a film of `frames` frames with the size of `first`, so many per second, that repeats.
    pub fn new(file: W, first: &Pixels, frames: usize, rate: u16) -> anyhow::Result<Self> {
        let mut encoder = Encoder::new(file, first.width, first.height);
        encoder.set_color(ColorType::Rgba);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_filter(FilterType::NoFilter);
        encoder.set_compression(Compression::Default);
        encoder.set_animated(u32::try_from(frames)?, 0)?;
        encoder.set_blend_op(BlendOp::Over)?;
        encoder.set_dispose_op(DisposeOp::None)?;
        encoder.set_frame_delay(1, rate)?;
        Ok(Self {
            writer: encoder.write_header()?,
            before: None,
            width: first.width as usize,
            rate,
        })
    }

    /// Adds a frame of the size of the first one.
    pub fn add_frame(&mut self, frame: &Pixels, is_last: bool) -> anyhow::Result<()> {
        let (numerator, denominator) = if is_last { (LAST_S, 1) } else { (1, self.rate) };
        self.writer.set_frame_delay(numerator, denominator)?;
        let rgb = &frame.rgb;
        let rgba: Vec<u8> = match &self.before {
            None => rgb.chunks_exact(DEPTH).flat_map(opaque).collect(),
            Some(before) => {
                let region = Region::of_change(before, rgb, self.width, DEPTH);
                self.writer.reset_frame_position()?;
                let (width, height) = (region.width as u32, region.height as u32);
                self.writer.set_frame_dimension(width, height)?;
                self.writer
                    .set_frame_position(region.left as u32, region.top as u32)?;
                let pixels = region
                    .pixels(self.width)
                    .map(|at| at * DEPTH..(at + 1) * DEPTH);
                pixels
                    .flat_map(|at| match before[at.clone()] == rgb[at.clone()] {
                        true => [0; 4],
                        false => opaque(&rgb[at]),
                    })
                    .collect()
            }
        };
        self.writer.write_image_data(&rgba)?;
        self.before = Some(rgb.clone());
        Ok(())
    }
}

fn opaque(rgb: &[u8]) -> [u8; 4] {
    [rgb[0], rgb[1], rgb[2], u8::MAX]
}
