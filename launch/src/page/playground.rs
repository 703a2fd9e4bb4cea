//! The playground: the page with the simulator as a WebAssembly module inside, in one HTML file.
//!
//! `launch/page/source/engine.js` starts a thread of the browser, which runs the part `engine`.

use std::io::Write;

use serde_json::json;

use super::single_file;

/// Writes the page with `module`, the crate `playground` compiled to WebAssembly.
///
/// # Errors
/// If the file cannot be written.
pub fn write(module: &[u8], file: &mut dyn Write) -> anyhow::Result<()> {
    single_file::write(file, true, |file| {
        let version = json!({"version": env!("CARGO_PKG_VERSION")});
        single_file::write_index(file, "embedded-engine", &version)?;
        single_file::write_part(file, "engine", module)
    })
}
