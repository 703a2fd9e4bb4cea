//! Readers of instance files, one module per format, and the guess of a format.

mod cordeau;
mod csv;
mod json;
mod records;
mod sadcher;
mod solomon;
mod vehicles;
mod vrplib;
mod yaml;

use scenario::Problem;

use super::source::{Loaded, Source};
pub(super) use yaml::refused as yaml_error;

/// A format of instance files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// Vehicle routing: VRPLIB, Solomon or Cordeau
    Vrplib,
    /// Sadcher's JSON: skills, coalitions and precedence
    Sadcher,
    /// A table with a header row
    Csv,
    /// Tasks and robots as JSON, also from `alliance export --instance`
    Json,
    /// Tasks and robots as YAML
    Yaml,
}

impl Format {
    /// Returns the format that the name and the content suggest.
    ///
    /// # Errors
    /// Returns an error if they suggest none.
    pub fn guess(source: Source<'_>) -> Result<Self, Problem> {
        let (_, extension) = source.name.rsplit_once('.').unwrap_or_default();
        let start = source.text.trim_start_matches('\u{feff}').trim_start();
        let first = start.lines().next().unwrap_or_default();
        let is_json = start.starts_with(['{', '[']);
        let is_vrplib = [
            "NODE_COORD_SECTION",
            "EDGE_WEIGHT_TYPE",
            "VEHICLE\n",
            "VEHICLE\r",
        ]
        .iter()
        .any(|word| source.text.contains(word));
        match extension.to_ascii_lowercase().as_str() {
            "json" | "yaml" | "yml" if is_json && sadcher::has_matrices(source.text) => {
                Ok(Self::Sadcher)
            }
            "json" => Ok(Self::Json),
            "yaml" | "yml" => Ok(Self::Yaml),
            "csv" | "tsv" => Ok(Self::Csv),
            "vrp" => Ok(Self::Vrplib),
            _ if is_json && sadcher::has_matrices(source.text) => Ok(Self::Sadcher),
            _ if is_json => Ok(Self::Json),
            _ if is_vrplib || cordeau::is_cordeau(source.text) => Ok(Self::Vrplib),
            _ if first.contains("x_m") => Ok(Self::Csv),
            _ if start.starts_with("- ") || start.starts_with("tasks:") => Ok(Self::Yaml),
            _ => Err(Problem::with_source(
                source.name,
                "name and content suggest no format",
                "state it with --format",
            )),
        }
    }

    /// Reads an instance of this format. References between records are not checked.
    ///
    /// # Errors
    /// Returns the first line that does not fit the format.
    pub fn read(self, source: Source<'_>) -> Result<Loaded, Problem> {
        let source = Source {
            text: source.text.trim_start_matches('\u{feff}'),
            ..source
        };
        match self {
            Self::Vrplib => vrplib::read(source),
            Self::Sadcher => sadcher::read(source),
            Self::Csv => csv::read(source),
            Self::Json => json::read(source),
            Self::Yaml => yaml::read(source),
        }
    }
}
