//! The pictures in the README and the book are those that the program draws and its pages show.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

use alliance_tests::harness::{Lab, alliance};
use alliance_tests::needs::cannot_run;
use alliance_tests::python::python;
use alliance_tests::testkit::in_repository;

use crate::playground::page::page;

/// The side of the squares in which screenshots are compared, px.
const SQUARE_PX: usize = 16;
/// The least difference of a red, green or blue value that counts, of 255. Edges of letters differ less.
const LEAST_DIFFERENCE: u8 = 48;
/// The largest share of different pixels of an equal square. Digits of times and the ends of trails may differ.
const SHARE_MAX: f64 = 0.4;

/// A screenshot. `rows` contains red, green and blue of each pixel.
struct Screenshot {
    width: usize,
    rows: Vec<Vec<u8>>,
}

impl Screenshot {
    fn read(path: &Path) -> Self {
        let file = File::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size()];
        let frame = reader.next_frame(&mut bytes).unwrap();
        assert_eq!(frame.color_type, png::ColorType::Rgb);
        let rows = bytes.chunks(frame.line_size).map(<[u8]>::to_vec);
        Self {
            width: frame.width as usize,
            rows: rows.collect(),
        }
    }

    /// Returns the corners of the squares that differ, px.
    fn differences(&self, other: &Self) -> Vec<(usize, usize)> {
        let differs = |x: usize, y: usize| {
            let pixel = 3 * x..3 * x + 3;
            let pairs = self.rows[y][pixel.clone()]
                .iter()
                .zip(&other.rows[y][pixel]);
            pairs
                .into_iter()
                .any(|(a, b)| a.abs_diff(*b) > LEAST_DIFFERENCE)
        };
        let mut found = Vec::new();
        for top in (0..self.rows.len()).step_by(SQUARE_PX) {
            for left in (0..self.width).step_by(SQUARE_PX) {
                let rows = top..self.rows.len().min(top + SQUARE_PX);
                let columns = left..self.width.min(left + SQUARE_PX);
                let count = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
                let count = count.filter(|(x, y)| differs(*x, *y)).count();
                if count as f64 > SHARE_MAX * (SQUARE_PX * SQUARE_PX) as f64 {
                    found.push((left, top));
                }
            }
        }
        found
    }
}

/// Writes a configuration with the fonts of figures only, so that letters have the same size on every machine.
fn fonts(lab: &Lab) -> PathBuf {
    let folder = lab.path("fonts");
    fs::create_dir(&folder).unwrap();
    for (name, font) in [
        ("regular", dejavu::sans::regular()),
        ("bold", dejavu::sans::bold()),
        ("mono", dejavu::sans_mono::regular()),
    ] {
        fs::write(folder.join(format!("{name}.ttf")), font).unwrap();
    }
    let text = format!(
        "<?xml version=\"1.0\"?><!DOCTYPE fontconfig SYSTEM \"fonts.dtd\">
<fontconfig><dir>{}</dir><cachedir>{}</cachedir>
<alias binding=\"same\"><family>monospace</family><prefer><family>DejaVu Sans Mono</family></prefer></alias>
<match><edit name=\"family\" mode=\"append_last\"><string>DejaVu Sans</string></edit>
<edit name=\"hintstyle\"><const>hintslight</const></edit></match>
</fontconfig>",
        folder.display(),
        folder.join("cache").display(),
    );
    let path = lab.path("fonts.conf");
    fs::write(&path, text).unwrap();
    path
}

#[test]
fn the_screenshots_of_the_documents_show_the_pages() {
    for program in ["node", "chromium"] {
        if Command::new(program).arg("--version").output().is_err() {
            cannot_run(&format!("no {program}: run `.ci/run`, or install it"));
            return;
        }
    }
    let lab = Lab::new();
    if page(&lab).is_none() {
        return;
    }
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("screenshots");
    fs::create_dir_all(&folder).unwrap();
    let output = Command::new("node")
        .arg("--experimental-websocket")
        .arg(in_repository("docs/img/screenshots.mjs"))
        .args([alliance(), lab.path("index.html"), folder.clone()])
        .env("XDG_RUNTIME_DIR", lab.path("runtime"))
        .env("FONTCONFIG_FILE", fonts(&lab))
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    let made = String::from_utf8(output.stdout).unwrap();
    assert_eq!(made.lines().count(), 7, "{made}");
    for line in made.lines() {
        let (name, _) = line.split_once(':').unwrap();
        let paths = [folder.join(name), in_repository("docs/img").join(name)];
        let [now, stored] = paths.each_ref().map(|path| Screenshot::read(path));
        let sizes = [&now, &stored].map(|picture| (picture.width, picture.rows.len()));
        assert_eq!(sizes[0], sizes[1], "{name}");
        let found = now.differences(&stored);
        assert!(
            found.is_empty(),
            "docs/img/{name} differs at {found:?}; look at {} and copy it",
            paths[0].display()
        );
    }
}

#[test]
fn the_pictures_of_the_documents_are_those_of_the_program() {
    if python(&["csv"]).is_none() {
        return;
    }
    let lab = Lab::new();
    let made = lab.path("img");
    fs::create_dir(&made).unwrap();
    let output = Command::new("sh")
        .arg(in_repository("docs/img/make.sh"))
        .arg(env!("CARGO_BIN_EXE_alliance-under-test"))
        .arg(&made)
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    let mut names = Vec::new();
    for file in fs::read_dir(&made).unwrap() {
        let name = file.unwrap().file_name().into_string().unwrap();
        let [now, stored] = [made.join(&name), in_repository("docs/img").join(&name)]
            .map(|path| fs::read(path).unwrap_or_default());
        assert!(
            now == stored,
            "docs/img/{name} differs; run docs/img/make.sh PROGRAM and look at the difference"
        );
        names.push(name);
    }
    names.sort();
    let pictures = [
        "gold-dies.gif",
        "parker-box.svg",
        "report-gantt.svg",
        "room.svg",
    ];
    assert_eq!(names, pictures);
}
