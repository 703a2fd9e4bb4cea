//! Conversion of figures to PDF with embedded fonts, so that they look the same everywhere.

use super::pixels::tree;

/// Converts an SVG to a PDF of the same size, with text that can be selected. The order of the fonts in the file varies.
pub fn from_svg(svg: &str) -> anyhow::Result<Vec<u8>> {
    convert(svg, true)
}

/// Converts an SVG to a PDF of the same size, with the outlines of its letters. The same SVG gives the same bytes.
pub fn outlined(svg: &str) -> anyhow::Result<Vec<u8>> {
    convert(svg, false)
}

fn convert(svg: &str, embed_text: bool) -> anyhow::Result<Vec<u8>> {
    // An inch has 96 SVG px.
    let page = svg2pdf::PageOptions { dpi: 96.0 };
    let options = svg2pdf::ConversionOptions {
        embed_text,
        ..svg2pdf::ConversionOptions::default()
    };
    svg2pdf::to_pdf(&tree(svg)?, options, page).map_err(|error| anyhow::anyhow!("{error}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figures::canvas::{TextLabel, svg};

    #[test]
    fn a_pdf_page_has_the_size_and_the_fonts_of_the_figure() {
        let figure = svg("title", 100.0, |area| {
            TextLabel::LEFT.write(area, "green→all, θ = 1 × δ", (10.0, 20.0))?;
            TextLabel::BOLD.write(area, "gold", (10.0, 50.0))
        });
        let pdf = from_svg(&figure.unwrap()).unwrap();
        assert!(pdf.starts_with(b"%PDF-"));
        let text = String::from_utf8_lossy(&pdf);
        // 960 px are 10 inches of 72 points.
        assert!(text.contains("/MediaBox [0 0 720 75]"), "{text}");
        for font in ["DejaVuSans", "DejaVuSans-Bold"] {
            assert!(text.contains(font), "{font}");
        }
        assert_eq!(text.matches("/FontFile").count(), 2);
    }

    #[test]
    fn outlines_have_the_same_bytes_each_time() {
        let figure = svg("title", 100.0, |area| {
            TextLabel::LEFT.write(area, "blue", (10.0, 20.0))?;
            TextLabel::BOLD.write(area, "gold", (10.0, 50.0))
        });
        let figure = figure.unwrap();
        let first = outlined(&figure).unwrap();
        assert!(first.starts_with(b"%PDF-"));
        for _ in 0..8 {
            assert!(outlined(&figure).unwrap() == first);
        }
    }
}
