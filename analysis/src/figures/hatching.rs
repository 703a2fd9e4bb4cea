//! Shorter SVGs: the lines of a hatched bar become one element. A figure of 300 robots has 20,000 of them.

use std::fmt::Write;

/// Joins vertical lines of one style that follow each other.
#[must_use]
pub fn join_lines(svg: &str) -> String {
    let mut joined = String::with_capacity(svg.len());
    let mut lines = svg.split_inclusive('\n').peekable();
    while let Some(line) = lines.next() {
        let Some((style, path)) = vertical(line) else {
            joined += line;
            continue;
        };
        let mut path = path;
        let mut count = 1;
        while let Some((_, more)) = lines
            .peek()
            .and_then(|next| vertical(next))
            .filter(|(other, _)| *other == style)
        {
            path += &more;
            count += 1;
            lines.next();
        }
        if count == 1 {
            joined += line;
        } else {
            // Writing to a String cannot fail.
            let _ = writeln!(joined, "<path {style} d=\"{path}\"/>");
        }
    }
    joined
}

/// Returns the style and the path of an element that is one vertical line.
fn vertical(line: &str) -> Option<(&str, String)> {
    let (style, points) = line
        .strip_prefix("<polyline ")?
        .trim_end()
        .strip_suffix(" \"/>")?
        .split_once(" points=\"")?;
    let (from, to) = points.split_once(' ')?;
    let ((x, top), (end, bottom)) = (from.split_once(',')?, to.split_once(',')?);
    let is_vertical = x == end && !bottom.contains(' ');
    is_vertical.then(|| (style, format!("M{x},{top}V{bottom}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighboring_vertical_lines_of_a_style_become_one_path() {
        let line = |style: &str, points: &str| {
            format!("<polyline fill=\"none\" stroke=\"{style}\" points=\"{points} \"/>\n")
        };
        let text = [
            "<svg>\n".to_owned(),
            line("red", "1,2 1,9"),
            line("red", "4,2 4,9"),
            line("blue", "5,2 5,9"),
            line("red", "4,2 5,9"),
            line("red", "4,2 4,9 4,12"),
            "</svg>\n".to_owned(),
        ]
        .concat();
        let expected = [
            "<svg>\n<path fill=\"none\" stroke=\"red\" d=\"M1,2V9M4,2V9\"/>\n".to_owned(),
            line("blue", "5,2 5,9"),
            line("red", "4,2 5,9"),
            line("red", "4,2 4,9 4,12"),
            "</svg>\n".to_owned(),
        ]
        .concat();
        assert_eq!(join_lines(&text), expected);
    }
}
