//! The frames of a film: the part of a frame that changes, and the duration of the last one.

/// The duration of the last frame, s. Players then start again.
pub const LAST_S: u16 = 2;

/// The part of an image that differs from the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    pub left: usize,
    pub top: usize,
    pub width: usize,
    pub height: usize,
}

impl Region {
    /// Returns the smallest region with all pixels that differ. If none does, one pixel remains, because a frame has at
    /// least one. Both images have `width` pixels in a row and one byte per pixel.
    #[must_use]
    pub fn of_change(before: &[u8], after: &[u8], width: usize) -> Self {
        let pairs = before.iter().zip(after);
        let differing = pairs.enumerate().filter(|(_, (a, b))| a != b);
        let mut found: Option<[usize; 4]> = None;
        for (index, _) in differing {
            let (x, y) = (index % width, index / width);
            let [left, top, right, _] = found.unwrap_or([x, y, x, y]);
            found = Some([left.min(x), top, right.max(x), y]);
        }
        let [left, top, right, bottom] = found.unwrap_or_default();
        Self {
            left,
            top,
            width: right - left + 1,
            height: bottom - top + 1,
        }
    }

    /// Returns the indices of the pixels of the region, row by row, in an image with `width` pixels in a row.
    pub fn pixels(self, width: usize) -> impl Iterator<Item = usize> {
        let rows = self.top..self.top + self.height;
        rows.flat_map(move |y| (self.left..self.left + self.width).map(move |x| y * width + x))
    }
}
