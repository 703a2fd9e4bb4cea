//! The pictures of runs in the README and the book are those that the program draws.

use std::fs;
use std::process::Command;

use alliance_tests::harness::Lab;
use alliance_tests::python::python;
use alliance_tests::testkit::in_repository;

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
