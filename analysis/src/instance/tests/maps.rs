//! Files of occupancy maps.

use std::fs;
use std::path::Path;

use crate::instance::map::read;

const YAML: &str = "\
image: hall.pgm
resolution: 0.5
origin: [-1.0, -2.0, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
";

/// Four by three cells: a wall on the left, an unknown cell on top, otherwise free.
const PLAIN: &str = "P2\n# by hand\n4 3\n255\n0 254 205 254\n0 254 254 254\n0 254 254 254\n";

fn write(folder: &Path, yaml: &str, image: &[u8]) {
    fs::write(folder.join("hall.yaml"), yaml).unwrap();
    fs::write(folder.join("hall.pgm"), image).unwrap();
}

/// Returns the cells as text, the top row first.
fn picture(folder: &Path) -> (Vec<String>, usize) {
    let map = read(&folder.join("hall.yaml")).unwrap();
    let rows = (0..map.solid.height()).rev().map(|row| {
        let cells = (0..map.solid.width()).map(|column| map.solid.is_set(column, row));
        cells.map(|is_set| if is_set { '#' } else { '.' }).collect()
    });
    (rows.collect(), map.unknown)
}

#[test]
fn plain_and_binary_images_have_the_same_cells() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let expected = (
        vec!["#.#.".to_owned(), "#...".to_owned(), "#...".to_owned()],
        1,
    );
    write(folder, YAML, PLAIN.as_bytes());
    assert_eq!(picture(folder), expected);
    let pixels = [0, 254, 205, 254, 0, 254, 254, 254, 0, 254, 254, 254];
    let binary = [b"P5\n# CREATOR: by hand\n4 3\n255\n".as_slice(), &pixels].concat();
    write(folder, YAML, &binary);
    assert_eq!(picture(folder), expected);
    // In a negated map, light pixels are walls.
    let negated = YAML.replace("negate: 0", "negate: 1");
    write(folder, &negated, &binary);
    let (rows, unknown) = picture(folder);
    assert_eq!(
        (rows, unknown),
        (
            vec![".###".to_owned(), ".###".to_owned(), ".###".to_owned()],
            0
        )
    );
    let map = read(&folder.join("hall.yaml")).unwrap();
    assert_eq!((map.resolution_m, map.origin), (0.5, [-1.0, -2.0]));
}

#[test]
fn bad_maps_are_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut lines = String::new();
    for (old, new) in [
        ("hall.pgm", "no.pgm"),
        ("resolution: 0.5", "resolution: 0"),
        ("resolution: 0.5", "resolution: half"),
        ("resolution: 0.5\n", ""),
        ("-2.0, 0.0]", "-2.0, 0.5]"),
        ("-2.0, 0.0]", "-2.0]"),
        ("negate: 0", "negate: 2"),
        ("free_thresh: 0.196", "free_thresh: 0.7"),
        ("free_thresh: 0.196", "free_thresh: 0.1\nmode: raw"),
        ("free_thresh: 0.196", "free_thresh: 0.1\ncolour: red"),
    ] {
        write(folder, &YAML.replace(old, new), PLAIN.as_bytes());
        lines += &refusal(folder, &format!("{old:?} -> {new:?}"));
    }
    for image in ["", "P2\n4 3\n255\n0 254\n", "P7\n", "text"] {
        write(folder, YAML, image.as_bytes());
        lines += &refusal(folder, &format!("{image:?}"));
    }
    insta::assert_snapshot!(lines);
}

fn refusal(folder: &Path, change: &str) -> String {
    let refused = read(&folder.join("hall.yaml")).unwrap_err();
    let refused = format!("{refused:#}");
    assert_eq!(refused.lines().count(), 1, "{refused}");
    let shown = refused.replace(&format!("{}/", folder.display()), "");
    format!("{change}\n    {shown}\n")
}
