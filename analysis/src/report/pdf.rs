//! Conversion of figures to PDF with embedded fonts, so that they look the same everywhere.

use crate::optional;

/// Checks that this program can write PDF files.
pub fn check_built_in() -> anyhow::Result<()> {
    optional::check("pdf", cfg!(feature = "pdf"))
}

/// Returns an error, because this program has no PDF support.
#[cfg(not(feature = "pdf"))]
pub fn from_svg(_svg: &str) -> anyhow::Result<Vec<u8>> {
    check_built_in().map(|()| Vec::new())
}

/// Converts an SVG to a PDF of the same size.
#[cfg(feature = "pdf")]
pub fn from_svg(svg: &str) -> anyhow::Result<Vec<u8>> {
    use svg2pdf::usvg::{Options, Tree, fontdb::Database};

    let mut fonts = Database::new();
    for font in [dejavu::sans::regular(), dejavu::sans::bold()] {
        fonts.load_font_data(font.to_vec());
    }
    fonts.set_sans_serif_family("DejaVu Sans");
    let options = Options {
        fontdb: fonts.into(),
        ..Options::default()
    };
    let tree = Tree::from_str(svg, &options)?;
    // An inch has 96 SVG px.
    let page = svg2pdf::PageOptions { dpi: 96.0 };
    svg2pdf::to_pdf(&tree, svg2pdf::ConversionOptions::default(), page)
        .map_err(|error| anyhow::anyhow!("{error}"))
}

#[cfg(all(test, feature = "pdf"))]
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
}
