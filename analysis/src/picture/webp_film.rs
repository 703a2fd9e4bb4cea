//! A film as an animated WebP, without loss. The encoder stores the part of each frame that changes.

use std::io::Write;

use webp_animation::{ColorMode, Encoder, EncoderOptions, EncodingConfig};

use super::region::LAST_S;
use crate::figures::pixels::Pixels;

/// The effort of the encoder, from 0 to 100. More than this takes longer and saves 2 % at most.
const EFFORT: f32 = 30.0;

const MS_PER_S: i32 = 1000;

pub struct WebpFilm<W: Write> {
    file: W,
    encoder: Encoder,
    rate: u16,
    frames: u16,
}

impl<W: Write> WebpFilm<W> {
    /// Begins a film with the size of `first`, so many frames per second, that repeats.
    pub fn new(file: W, first: &Pixels, rate: u16) -> anyhow::Result<Self> {
        let options = EncoderOptions {
            color_mode: ColorMode::Rgb,
            encoding_config: Some(EncodingConfig {
                quality: EFFORT,
                ..EncodingConfig::default()
            }),
            ..EncoderOptions::default()
        };
        Ok(Self {
            file,
            encoder: Encoder::new_with_options((first.width, first.height), options)?,
            rate,
            frames: 0,
        })
    }

    /// Adds a frame of the size of the first one.
    pub fn add_frame(&mut self, frame: &Pixels) -> anyhow::Result<()> {
        let begins_ms = self.begin_ms(self.frames);
        self.encoder.add_frame(&frame.rgb, begins_ms)?;
        self.frames += 1;
        Ok(())
    }

    /// Writes the file. At least one frame was added.
    pub fn finish(mut self) -> anyhow::Result<()> {
        let last_ms = self.begin_ms(self.frames - 1);
        let ends_ms = last_ms + i32::from(LAST_S) * MS_PER_S;
        let film = self.encoder.finalize(ends_ms)?;
        Ok(self.file.write_all(&film)?)
    }

    fn begin_ms(&self, frame: u16) -> i32 {
        i32::from(frame) * MS_PER_S / i32::from(self.rate)
    }
}
