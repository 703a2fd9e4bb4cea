//! The `console` blocks of the README and the book: each command runs in a shell, and its output is compared, numbers
//! included.
//!
//! A line that begins with "$ " is a command. The lines up to the next command are its output. "…" stands for any
//! text in a line, or alone for any lines. A command without lines below it may print anything.
//!
//! A command must end with status 0, or with N if it contains `# exit status N`. All blocks of a document are one
//! session in its own folder.
//!
//! The comment `<!-- file: NAME -->` before a block writes the block to that file. The comment `<!-- run: COMMANDS
//! -->` runs commands silently. Commands that need a person, a browser or other machines are in `sh` blocks, which do
//! not run.

use std::fmt::Write as _;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use alliance_tests::harness::Lab;
use alliance_tests::runs::allocators;
use alliance_tests::testkit::in_repository;

/// The marker before and after the output of each command. No command prints it.
const MARK: &str = "\u{1}mark";

/// A command of a document with its expected output.
struct Typed {
    line: usize,
    command: String,
    shown: Vec<String>,
}

/// Returns the commands of a document in order. Files in the document become commands that write them.
fn typed(text: &str) -> Vec<Typed> {
    let mut all: Vec<Typed> = Vec::new();
    let mut lines = text.lines().enumerate();
    let mut file = None;
    while let Some((number, line)) = lines.next() {
        let hidden = |command: String| Typed {
            line: number + 1,
            command,
            shown: Vec::new(),
        };
        if let Some(commands) = comment(line, "run") {
            all.push(hidden(commands.to_owned()));
        } else if let Some(name) = comment(line, "file") {
            file = Some(name.to_owned());
        } else if let Some(language) = line.trim_start().strip_prefix("```") {
            let body = lines.by_ref().take_while(|(_, line)| line.trim() != "```");
            if let Some(name) = file.take() {
                let body: Vec<&str> = body.map(|(_, line)| line).collect();
                let body = body.join("\n");
                all.push(hidden(format!(
                    "cat > {name} <<'END OF FILE'\n{body}\nEND OF FILE"
                )));
            } else if language == "console" {
                for (number, line) in body {
                    match line.strip_prefix("$ ") {
                        Some(command) => all.push(Typed {
                            line: number + 1,
                            command: command.to_owned(),
                            shown: Vec::new(),
                        }),
                        None => all.last_mut().unwrap().shown.push(line.to_owned()),
                    }
                }
            } else {
                body.for_each(drop);
            }
        }
    }
    all
}

fn comment<'a>(line: &'a str, kind: &str) -> Option<&'a str> {
    let content = line.strip_prefix("<!-- ")?.strip_suffix(" -->")?;
    content.strip_prefix(kind)?.strip_prefix(": ")
}

/// Runs the commands in a shell and returns the output and exit status of each.
fn session(lab: &Lab, commands: &[Typed]) -> Vec<(String, i32)> {
    let [programs, runtime, folder] = ["bin", "runtime", "session"].map(|name| lab.path(name));
    for folder in [&programs, &runtime, &folder] {
        fs::create_dir(folder).unwrap();
    }
    let program = env!("CARGO_BIN_EXE_alliance-under-test");
    symlink(program, programs.join("alliance")).unwrap();
    // In the README, cargo runs the same program. `cargo test` is not repeated here.
    let mut script = String::from(
        "set -m\ncargo() { if [[ $1 == test ]]; then true; else shift 3; alliance \"$@\"; fi; }\n\
         trap 'kill -9 $(jobs -p) 2>/dev/null' EXIT\n",
    );
    for typed in commands {
        // Writing to a String cannot fail.
        let _ = write!(
            script,
            "printf '%s\\n' '{MARK}'\n{}\nprintf '%s %d\\n' '{MARK}' $?\n",
            typed.command
        );
    }
    lab.write("session.sh", script);
    // The documents use plans and clients from these folders.
    for name in ["analysis", "campaigns", "tests"] {
        symlink(in_repository(name), folder.join(name)).unwrap();
    }
    let bash = "exec timeout --kill-after=5 600 bash ../session.sh 2>&1";
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap());
    let output = Command::new("bash")
        .args(["-c", bash])
        .current_dir(&folder)
        .env("XDG_RUNTIME_DIR", runtime)
        .env("RUST_BACKTRACE", "0")
        .env_remove("RUST_LOG")
        .env("PATH", path)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let printed = String::from_utf8(output.stdout).unwrap();
    let mut parts = printed.split(MARK).skip(1);
    let results = commands.iter().map(|typed| {
        let output = parts.next().unwrap_or_else(|| panic!("{printed}"));
        let status = parts.next().and_then(|after| after.trim().parse().ok());
        let status = status.unwrap_or_else(|| panic!("{}: {output}", typed.command));
        (output.trim_start_matches('\n').to_owned(), status)
    });
    results.collect()
}

fn is_like(line: &str, shown: &str) -> bool {
    let mut parts = shown.split('…');
    let Some(mut rest) = line.strip_prefix(parts.next().unwrap_or_default()) else {
        return false;
    };
    let parts: Vec<&str> = parts.collect();
    let Some((last, between)) = parts.split_last() else {
        return rest.is_empty();
    };
    for part in between {
        let Some(at) = rest.find(part) else {
            return false;
        };
        rest = &rest[at + part.len()..];
    }
    rest.ends_with(last)
}

/// Returns whether all lines match the expected lines.
fn are_like(lines: &[&str], shown: &[&str]) -> bool {
    match shown.split_first() {
        None => lines.is_empty(),
        Some((&"…", rest)) => (0..=lines.len()).any(|skipped| are_like(&lines[skipped..], rest)),
        Some((first, rest)) => lines
            .split_first()
            .is_some_and(|(line, lines)| is_like(line, first) && are_like(lines, rest)),
    }
}

/// Returns whether a line shows the progress of a sweep or of a replay. A slow machine prints more of those.
fn is_progress(line: &str) -> bool {
    if line.starts_with("replaying the run (about ") {
        return true;
    }
    let is_count = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    line.split_once(" runs  ")
        .and_then(|(count, rest)| Some((count.split_once('/')?, rest)))
        .is_some_and(|((done, of), rest)| is_count(done) && is_count(of) && rest.contains(" left"))
}

/// Returns a report of all commands whose output differs from the document.
fn differences(document: &Path) -> String {
    let text = fs::read_to_string(document).unwrap();
    let commands = typed(&text);
    if commands.is_empty() {
        return String::new();
    }
    let lab = Lab::new();
    let printed = session(&lab, &commands);
    let mut wrong = String::new();
    for (typed, (output, status)) in commands.iter().zip(&printed) {
        let expected = typed.command.rsplit_once("# exit status ");
        let expected = expected.map_or(0, |(_, number)| number.trim().parse().unwrap());
        let lines = output.trim_end().lines().map(str::trim_end);
        let lines: Vec<&str> = lines.filter(|line| !is_progress(line)).collect();
        let shown: Vec<&str> = typed.shown.iter().map(|line| line.trim_end()).collect();
        if *status != expected || !(shown.is_empty() || are_like(&lines, &shown)) {
            let _ = writeln!(
                wrong,
                "{}:{}: $ {}\nexit status {status}, and it printed:\n{output}",
                document.display(),
                typed.line,
                typed.command
            );
        }
    }
    wrong
}

#[test]
fn the_console_blocks_of_the_readme_are_real_output() {
    assert_eq!(differences(&in_repository("README.md")), "");
}

#[test]
fn the_console_blocks_of_the_book_are_real_output() {
    let chapters = documents(&in_repository("docs/book"));
    let wrong = chapters.iter().map(|chapter| differences(chapter));
    assert_eq!(wrong.collect::<String>(), "");
}

/// Each allocator has a row with a link to its page, and each page is in the table of contents.
#[test]
fn every_allocator_has_a_row_and_a_page() {
    let table = fs::read_to_string(in_repository("docs/ALLOCATORS.md")).unwrap();
    let contents = fs::read_to_string(in_repository("docs/SUMMARY.md")).unwrap();
    for name in allocators() {
        let mut rows = table.lines().filter(|line| line.starts_with("| ["));
        let of_table = |row: &&str| row.contains(&format!("[`{name}`](allocators/"));
        // The page of the default allocator is the specification.
        let is_listed = name == "alliance" || rows.any(|row| of_table(&row));
        assert!(
            is_listed,
            "docs/ALLOCATORS.md: no row [`{name}`](allocators/…)"
        );
    }
    for page in documents(&in_repository("docs/allocators")) {
        let name = page.file_name().unwrap().to_string_lossy().into_owned();
        let is_listed = contents.contains(&format!("(allocators/{name})"));
        assert!(is_listed, "docs/SUMMARY.md: no line for allocators/{name}");
    }
}

/// Each page has a section on slots, windows, values and loads. ALLIANCE's page is its specification.
#[test]
fn every_allocator_states_its_use_of_the_properties_of_points() {
    let mut pages = documents(&in_repository("docs/allocators"));
    pages.push(in_repository("docs/ALLIANCE.md"));
    for page in pages {
        let text = fs::read_to_string(&page).unwrap();
        let mut headings = text.lines().filter(|line| line.starts_with("## "));
        assert!(
            headings.any(|heading| heading.ends_with("Slots, windows, values and loads")),
            "{}: no section on slots, windows, values and loads",
            page.display()
        );
    }
}

#[test]
fn all_documents_state_the_same_duration_of_the_small_comparison() {
    let plan = "campaigns/allocators-small.toml";
    let text = fs::read_to_string(in_repository(plan)).unwrap();
    let stated = text
        .split("runs in ")
        .nth(1)
        .and_then(|rest| rest.split('.').next());
    let stated = stated.unwrap();
    let mut others = 0;
    for document in documents(&in_repository("")) {
        let text = fs::read_to_string(&document).unwrap();
        let lines = text
            .lines()
            .filter(|line| line.contains(&format!("compare {plan}")));
        for line in lines.filter(|line| line.contains("minute")) {
            assert!(line.contains(stated), "{}: {line}", document.display());
            others += 1;
        }
    }
    assert!(others >= 2, "{others} documents state the duration");
}

/// No rule is exactly as published. Its page states its source, and apart from it what this project decided. The rule
/// `learned` has no publication, and ALLIANCE's page is its specification.
#[test]
fn every_rule_separates_its_publication_from_the_decisions_of_this_project() {
    for page in documents(&in_repository("docs/allocators")) {
        if page.ends_with("learned.md") {
            continue;
        }
        let text = fs::read_to_string(&page).unwrap();
        for heading in ["Published", "Decisions of this project"] {
            let section = text.split(&format!("\n## {heading}\n")).nth(1);
            let section = section.and_then(|rest| rest.split("\n## ").next());
            let is_stated = section.is_some_and(|section| section.trim().len() > 50);
            assert!(is_stated, "{}: {heading}", page.display());
        }
    }
    let alliance = fs::read_to_string(in_repository("docs/ALLIANCE.md")).unwrap();
    assert!(alliance.contains("Decisions that the formulas leave open"));
    for document in ["README.md", "CHANGELOG.md", "docs/ALLOCATORS.md"] {
        let text = fs::read_to_string(in_repository(document)).unwrap();
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(!text.contains("as published"), "{document}");
    }
}

#[test]
fn relative_links_lead_to_existing_files() {
    let mut wrong = String::new();
    for document in documents(&in_repository("")) {
        let text = fs::read_to_string(&document).unwrap();
        let folder = document.parent().unwrap();
        for link in text.split("](").skip(1) {
            let target = link.split(')').next().unwrap_or_default();
            let path = target.split('#').next().unwrap_or_default();
            let is_elsewhere =
                path.is_empty() || path.contains("://") || path.contains(char::is_whitespace);
            if !is_elsewhere && !folder.join(path).exists() {
                let _ = writeln!(wrong, "{}: {target}", document.display());
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

fn documents(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        let (path, name) = (entry.path(), entry.file_name());
        let name = name.to_string_lossy();
        if entry.file_type().unwrap().is_dir() {
            if !(name.starts_with('.') || name == "target" || name == "node_modules") {
                found.extend(documents(&path));
            }
        } else if name.ends_with(".md") {
            found.push(path);
        }
    }
    found
}

#[test]
fn the_comparison_of_output_handles_ellipses_progress_and_files() {
    assert!(is_progress("57/60 runs  11.2/s, 0 seconds left"));
    assert!(!is_progress(
        "60 runs: 60 complete, 0 not complete, 0 failed"
    ));
    assert!(is_like("hash    cf2fc051", "hash    cf2fc051"));
    assert!(!is_like("hash    cf2fc051", "hash    cf2fc05"));
    assert!(is_like(
        "run waste-cleanup-17, in one process",
        "run waste-cleanup-…, in one process"
    ));
    assert!(!is_like(
        "run waste-cleanup-17",
        "run waste-cleanup-…, in one process"
    ));
    assert!(are_like(&["a", "b", "c"], &["a", "…", "c"]));
    assert!(are_like(&["a", "c"], &["a", "…", "c"]));
    assert!(!are_like(&["a", "b", "d"], &["a", "…", "c"]));
    let document = "<!-- file: x.toml -->\n```toml\na = 1\n```\n```console\n$ false # exit status 1\n$ echo b\nb\n```\n";
    let commands = typed(document);
    assert_eq!(commands.len(), 3);
    assert_eq!(
        commands[0].command,
        "cat > x.toml <<'END OF FILE'\na = 1\nEND OF FILE"
    );
    assert_eq!(commands[2].shown, ["b"]);
    let printed = session(&Lab::new(), &commands);
    assert_eq!(printed[1..], [(String::new(), 1), ("b\n".to_owned(), 0)]);
}
