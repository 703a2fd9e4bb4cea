//! The page as one HTML file, with all its files and its data inside, so that it needs neither a server nor a network.
//!
//! The modules of the page are in an import map. `launch/page/source/part.js` reads the parts of the data, each compressed
//! with zlib, as base64 in an element of its own.

use std::fmt::Write as _;
use std::io::Write;

use anyhow::Context;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde_json::{Value, json};

use super::assets;

/// The prefix of the page's modules in the import map.
const MODULES: &str = "alliance/";

/// Writes the page with the data that `write_data` adds.
///
/// # Errors
/// If the file cannot be written, or `write_data` fails.
pub fn write(
    file: &mut dyn Write,
    has_program: bool,
    write_data: impl FnOnce(&mut dyn Write) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let page = page(has_program)?;
    let (head, end) = page.split_once("</body>").context("the page has no end")?;
    file.write_all(head.as_bytes())?;
    write_data(file)?;
    writeln!(file, "</body>{end}")?;
    // A dropped writer hides the errors of its last bytes.
    file.flush()?;
    Ok(())
}

/// Writes an element with a JSON value.
pub fn write_index(file: &mut dyn Write, id: &str, index: &Value) -> anyhow::Result<()> {
    writeln!(
        file,
        r#"<script type="application/json" id="{id}">{index}</script>"#
    )?;
    Ok(())
}

/// Writes a part of the data.
pub fn write_part(file: &mut dyn Write, name: &str, content: &[u8]) -> anyhow::Result<()> {
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::best());
    packed.write_all(content)?;
    let text = STANDARD.encode(packed.finish()?);
    // The browser keeps the text of an unknown type and does not execute it.
    writeln!(
        file,
        r#"<script type="text/plain" data-part="{name}">{text}</script>"#
    )?;
    Ok(())
}

/// Returns the rules for the browser: the file contains everything, and no request leaves it.
fn policy(has_program: bool) -> String {
    let (scripts, workers) = match has_program {
        true => (" 'wasm-unsafe-eval'", " worker-src data:;"),
        false => ("", ""),
    };
    format!(
        "default-src 'none'; script-src 'unsafe-inline'{scripts} data:;{workers} style-src 'unsafe-inline'; \
         img-src data:; base-uri 'none'; form-action 'none'"
    )
}

/// Returns the page with all its files inside, without data.
fn page(has_program: bool) -> anyhow::Result<String> {
    let policy = policy(has_program);
    let mut page = String::new();
    for line in text("index.html")?.lines() {
        let path = line
            .split_once("\"/assets/")
            .and_then(|(_, rest)| rest.split_once('"'))
            .map(|(path, _)| path);
        match path {
            None if line.contains("<meta charset") => {
                // First, so that the rules apply to everything below.
                writeln!(page, "{line}")?;
                let meta = "http-equiv=\"Content-Security-Policy\"";
                writeln!(page, "  <meta {meta} content=\"{policy}\">")?;
            }
            None => writeln!(page, "{line}")?,
            Some("main.js") => {
                writeln!(page, r#"<script type="importmap">{}</script>"#, modules()?)?;
                let main = format!("import \"{MODULES}main.js\";");
                writeln!(page, r#"<script type="module">{main}</script>"#)?;
            }
            Some(path) => {
                let asset = text(path)?;
                match path.rsplit_once('.') {
                    Some((_, "css")) => writeln!(page, "<style>\n{asset}</style>")?,
                    Some((_, "js")) => writeln!(page, "<script>{asset}</script>")?,
                    _ => {
                        let url = data_url(path, asset.as_bytes())?;
                        let link = format!("/assets/{path}");
                        writeln!(page, "{}", line.replace(&link, &url))?;
                    }
                }
            }
        }
    }
    Ok(page)
}

fn text(path: &str) -> anyhow::Result<&'static str> {
    let asset = assets::find(path).with_context(|| format!("the page has no file {path}"))?;
    std::str::from_utf8(asset.bytes).with_context(|| path.to_owned())
}

fn data_url(path: &str, bytes: &[u8]) -> anyhow::Result<String> {
    let asset = assets::find(path).with_context(|| format!("the page has no file {path}"))?;
    let media_type = asset.media_type.replace(' ', "");
    Ok(format!(
        "data:{media_type};base64,{}",
        STANDARD.encode(bytes)
    ))
}

/// Returns the import map of the page's modules. A module inside a URL cannot import by a relative path, so each has a name.
fn modules() -> anyhow::Result<Value> {
    let mut urls = serde_json::Map::new();
    for path in assets::paths() {
        // Libraries are scripts, no modules.
        if path.ends_with(".js") && !path.starts_with("vendor/") {
            let source = with_names(path, text(path)?);
            urls.insert(
                format!("{MODULES}{path}"),
                data_url(path, source.as_bytes())?.into(),
            );
        }
    }
    Ok(json!({ "imports": urls }))
}

/// Replaces the relative paths of a module's imports by names of the import map.
fn with_names(path: &str, source: &str) -> String {
    let folder = path.rsplit_once('/').map_or("", |(folder, _)| folder);
    let mut result = String::new();
    let mut parts = source.split(" from \".");
    result.push_str(parts.next().unwrap_or_default());
    for part in parts {
        // One dot is the folder of the module, two are the one above. Folders of the page have no folders inside.
        let name = match (part.strip_prefix("./"), part.strip_prefix('/')) {
            (Some(above), _) => above.to_owned(),
            (None, Some(beside)) if folder.is_empty() => beside.to_owned(),
            (None, beside) => format!("{folder}/{}", beside.unwrap_or(part)),
        };
        result.push_str(" from \"");
        result.push_str(MODULES);
        result.push_str(&name);
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_import_has_a_name_in_the_import_map() {
        let map = modules().unwrap();
        let imports = map["imports"].as_object().unwrap();
        let mut count = 0;
        for path in assets::paths().filter(|path| path.ends_with(".js")) {
            if path.starts_with("vendor/") {
                continue;
            }
            let source = with_names(path, text(path).unwrap());
            for line in source.lines().filter(|line| line.contains("} from \"")) {
                let name = line.split('"').nth(1).unwrap();
                assert!(imports.contains_key(name), "{path}: {line}");
                count += 1;
            }
        }
        assert!(count > 60, "{count}");
    }

    #[test]
    fn the_page_has_no_link_to_another_file() {
        let page = page(true).unwrap();
        assert!(!page.contains("/assets/"));
        assert_eq!(page.matches("</body>").count(), 1);
        // A script ends at its first end tag, also within a text.
        assert_eq!(
            page.matches("<script").count(),
            page.matches("</script").count()
        );
    }
}
