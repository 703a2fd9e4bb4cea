//! Conversion of figures to pixels, with the same fonts on every machine.

use std::sync::LazyLock;

use anyhow::Context;
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::fontdb::Database;
use resvg::usvg::{Options, Tree};

static OPTIONS: LazyLock<Options<'static>> = LazyLock::new(|| {
    let mut fonts = Database::new();
    for font in [dejavu::sans::regular(), dejavu::sans::bold()] {
        fonts.load_font_data(font.to_vec());
    }
    fonts.set_sans_serif_family("DejaVu Sans");
    Options {
        fontdb: fonts.into(),
        ..Options::default()
    }
});

/// The pixels for each px of a figure in a PNG, for print and sharp screens.
pub const PRINT_PIXELS: f32 = 2.0;

/// Reads an SVG with the fonts of this program.
pub fn tree(svg: &str) -> anyhow::Result<Tree> {
    Ok(Tree::from_str(svg, &OPTIONS)?)
}

/// An image without transparent pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pixels {
    pub width: u32,
    pub height: u32,
    /// Red, green and blue of each pixel, row by row.
    pub rgb: Vec<u8>,
}

impl Pixels {
    /// Draws an SVG with a background, with so many pixels for each px.
    ///
    /// # Errors
    /// Returns an error for an invalid SVG.
    pub fn draw(svg: &str, pixels_per_px: f32) -> anyhow::Result<Self> {
        let tree = tree(svg)?;
        let size = tree.size().to_int_size().scale_by(pixels_per_px);
        let size = size.context("an image without pixels")?;
        let image = Pixmap::new(size.width(), size.height());
        let mut image = image.context("an image without pixels")?;
        let scale = Transform::from_scale(pixels_per_px, pixels_per_px);
        resvg::render(&tree, scale, &mut image.as_mut());
        let pixels = image.pixels().iter();
        Ok(Self {
            width: size.width(),
            height: size.height(),
            rgb: pixels
                .flat_map(|pixel| [pixel.red(), pixel.green(), pixel.blue()])
                .collect(),
        })
    }

    /// Returns the image as a PNG.
    ///
    /// # Errors
    /// Returns the errors of the encoder.
    pub fn png(&self) -> anyhow::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        // Figures have areas of one color, which filters for photographs only enlarge.
        encoder.set_filter(png::FilterType::NoFilter);
        encoder.set_compression(png::Compression::Best);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.rgb)?;
        writer.finish()?;
        Ok(bytes)
    }
}
