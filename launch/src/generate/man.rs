//! Manual pages: clap's sections, then EXAMPLES, EXIT STATUS and SEE ALSO.

use std::fs;
use std::path::Path;

use anyhow::Context;
use clap::Command;
use clap_mangen::Man;
use clap_mangen::roff::{Roff, bold, roman};

use crate::commands::{self, HEADINGS};

/// Writes the pages of the complete `command` into a folder, which is created if it is missing.
pub fn write(command: Command, folder: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let mut command = command.disable_help_subcommand(true);
    command.build();
    write_page(&command, "", folder)
}

fn write_page(command: &Command, words: &str, folder: &Path) -> anyhow::Result<()> {
    for part in command.get_subcommands().filter(|part| !part.is_hide_set()) {
        let words = format!("{words} {}", part.get_name());
        write_page(part, words.trim_start(), folder)?;
    }
    let path = folder.join(format!("{}.1", page_name(words)));
    let page = page(command, words).context("manual page")?;
    fs::write(&path, page).with_context(|| path.display().to_string())
}

fn page(command: &Command, words: &str) -> std::io::Result<Vec<u8>> {
    let usage = command.clone().render_usage().to_string();
    let usage = usage.trim_start_matches("Usage: ").to_owned();
    // Without it the synopsis lists all options without their values.
    let man = Man::new(command.clone().override_usage(usage));
    let mut page = Vec::new();
    man.render_title(&mut page)?;
    man.render_name_section(&mut page)?;
    man.render_synopsis_section(&mut page)?;
    man.render_description_section(&mut page)?;
    man.render_options_section(&mut page)?;
    if command.get_subcommands().any(|part| !part.is_hide_set()) {
        man.render_subcommands_section(&mut page)?;
    }
    let mut roff = Roff::default();
    let examples = commands::examples_of(words);
    if !examples.is_empty() {
        roff.control("SH", ["EXAMPLES"]);
        for (line, purpose) in examples {
            roff.control("TP", []);
            roff.text([bold(line)]);
            roff.text([roman(purpose)]);
        }
    }
    roff.control("SH", ["EXIT STATUS"]);
    for (status, meaning) in commands::exit_statuses(words) {
        roff.control("TP", []);
        roff.text([bold(status)]);
        roff.text([roman(meaning)]);
    }
    roff.control("SH", ["SEE ALSO"]);
    let related: Vec<String> = related(words)
        .iter()
        .map(|words| format!("{}(1)", page_name(words)))
        .collect();
    roff.text([roman(related.join(", "))]);
    roff.to_writer(&mut page)?;
    Ok(page)
}

/// Returns the commands to name on the page of a command: its parent and the commands below the same heading.
fn related(words: &str) -> Vec<&str> {
    if let Some((parent, _)) = words.rsplit_once(' ') {
        return vec![parent];
    }
    let mates = HEADINGS
        .iter()
        .filter(|(_, names)| names.contains(&words) || words.is_empty());
    let mates = mates
        .flat_map(|(_, names)| *names)
        .copied()
        .filter(|name| *name != words);
    let parent = (!words.is_empty()).then_some("");
    parent.into_iter().chain(mates).collect()
}

fn page_name(words: &str) -> String {
    format!("alliance {words}").trim_end().replace(' ', "-")
}
