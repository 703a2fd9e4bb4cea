//! A figure as PDF, with its fonts in it, so that it looks the same wherever it is opened.

use crate::optional;

/// Whether this program can make PDF files.
///
/// # Errors
/// How to get one that can.
pub fn is_there() -> anyhow::Result<()> {
    optional::check("pdf", cfg!(feature = "pdf"))
}

/// An SVG as PDF of the same size.
///
/// # Errors
/// When this program is built without the feature, or the converter does not know what is in the SVG.
#[cfg(not(feature = "pdf"))]
pub fn of(_svg: &str) -> anyhow::Result<Vec<u8>> {
    is_there().map(|()| Vec::new())
}

/// An SVG as PDF of the same size.
///
/// # Errors
/// When the converter does not know what is in the SVG.
#[cfg(feature = "pdf")]
pub fn of(svg: &str) -> anyhow::Result<Vec<u8>> {
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
    // SVG has 96 px to the inch.
    let page = svg2pdf::PageOptions { dpi: 96.0 };
    svg2pdf::to_pdf(&tree, svg2pdf::ConversionOptions::default(), page)
        .map_err(|error| anyhow::anyhow!("{error}"))
}

#[cfg(all(test, feature = "pdf"))]
mod tests {
    use super::*;
    use crate::report::figures::canvas::{Lettering, svg};

    #[test]
    fn a_page_as_large_as_the_figure_with_its_fonts_in_it() {
        let figure = svg("title", 100.0, |area| {
            Lettering::default().write(area, "green→all, θ = 1 × δ", (10.0, 20.0))?;
            let bold = Lettering {
                bold: true,
                ..Lettering::default()
            };
            bold.write(area, "gold", (10.0, 50.0))
        });
        let pdf = of(&figure.unwrap()).unwrap();
        assert!(pdf.starts_with(b"%PDF-"));
        let text = String::from_utf8_lossy(&pdf);
        // 960 px are ten inches, and an inch has 72 points.
        assert!(text.contains("/MediaBox [0 0 720 75]"), "{text}");
        for font in ["DejaVuSans", "DejaVuSans-Bold"] {
            assert!(text.contains(font), "{font}");
        }
        assert_eq!(text.matches("/FontFile").count(), 2);
    }
}
