//! `alliance import`: an instance file of another program as a scenario of the mission *service*.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use scenario::limits::positive;
use scenario::{Problem, decode_text};
use terminal::stderr_line;
use world_server::mission_args::Known;

use super::convert::{Options, convert};
use super::formats::Format;
use super::map;
use super::source::Source;
use super::write::Written;
use crate::exit_status;
use crate::new_file::write_atomically;

/// Convert an instance of other programs into a scenario
#[derive(Args, Clone, Debug)]
pub struct ImportCommand {
    /// Instance file: VRPLIB, Sadcher's JSON, CSV, JSON or YAML
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Format: vrplib, sadcher, csv, json or yaml [default: from name and content]
    #[arg(long, value_enum, value_name = "FORMAT", hide_possible_values = true)]
    format: Option<Format>,
    /// Number of robots, if the file contains none or only their number
    #[arg(long, value_name = "N")]
    robots: Option<usize>,
    /// Metres per unit of length of the file [default: a power of ten]
    #[arg(long, value_name = "METRES", value_parser = scale, allow_negative_numbers = true)]
    scale: Option<f64>,
    /// Occupancy map of ROS (.yaml with .pgm) whose walls become obstacles
    #[arg(long, value_name = "MAP")]
    map: Option<PathBuf>,
    /// Scenario file to write [default: stdout]
    #[arg(long, value_name = "SCENARIO")]
    out: Option<PathBuf>,
}

fn scale(text: &str) -> Result<f64, Problem> {
    let scale = text
        .parse()
        .map_err(|_| Problem::of_value("not a number", "write one above 0"))?;
    positive("").check((), scale).map(|()| scale)
}

impl ImportCommand {
    /// Runs the command. Exit status: 0 if the scenario is written, 2 for invalid input, 3 if stdout cannot be written.
    #[must_use]
    pub fn run(&self, known: &Known) -> ExitCode {
        exit_status("import", self.import(known), 2)
    }

    fn import(&self, known: &Known) -> anyhow::Result<ExitCode> {
        let Written { text, notes } = self.scenario(known)?;
        for note in &notes {
            stderr_line!("{note}");
        }
        let Some(out) = &self.out else {
            return Ok(terminal::print_result(
                "alliance import",
                text,
                ExitCode::SUCCESS,
            ));
        };
        write_atomically(out, text.as_bytes())?;
        stderr_line!("scenario {}", out.display());
        Ok(ExitCode::SUCCESS)
    }

    /// Returns the scenario, which is checked like a scenario file.
    fn scenario(&self, known: &Known) -> anyhow::Result<Written> {
        let name = self.file.display().to_string();
        let bytes = terminal::read_file(&self.file)?;
        let text = decode_text(&name, bytes)?;
        let source = Source {
            name: &name,
            text: &text,
        };
        let options = Options {
            format: self.format,
            robots: self.robots,
            scale: self.scale,
            map: self.map.as_deref().map(map::read).transpose()?,
        };
        let converted = convert(source, &options, &known.vocabulary)?;
        let scenario = &converted.scenario;
        let starts = known.worlds.find(scenario)?.start_poses(scenario);
        starts.map_err(|error| Problem::with_source(&name, error.describe(scenario), ""))?;
        Ok(converted.written)
    }
}
