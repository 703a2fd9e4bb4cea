//! A finished run as one HTML file: the page with its data, which needs neither a server nor a network.
//!
//! The page is the one of the server, with all its files inside. Its modules are in an import map. `launch/page/source/embedded.js`
//! reads the data, whose parts are JSON, compressed with zlib, as base64:
//!
//! | part | content |
//! |---|---|
//! | `run`, `overview`, `events`, `corners/RANK` | the answers of the server |
//! | `views/N` | the views of a chunk, one per line: the first one, then the changes to the next ones |

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

use anyhow::Context;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde::Serialize;
use serde_json::{Value, json};

use super::assets;
use super::delta::change;
use super::logged::Logged;

/// The rules for the browser: the file contains everything, and no request leaves it.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline' data:; style-src 'unsafe-inline'; \
                      img-src data:; base-uri 'none'; form-action 'none'";

/// The prefix of the page's modules in the import map.
const MODULES: &str = "alliance/";

/// Writes the finished run in `folder` as an HTML file.
///
/// # Errors
/// [`analysis::export::Differs`] if this program does not reproduce the run exactly. Other errors if the folder contains no run with
/// a complete tick, or the file cannot be written.
pub fn write(folder: &Path, file: &mut dyn Write) -> anyhow::Result<()> {
    let logged = Logged::open(folder)?;
    if let Some(warning) = &logged.warning {
        return Err(analysis::export::Differs(warning.clone()).into());
    }
    let page = page()?;
    let (head, end) = page.split_once("</body>").context("the page has no end")?;
    file.write_all(head.as_bytes())?;
    write_data(&logged, file)?;
    writeln!(file, "</body>{end}")?;
    // A dropped writer hides the errors of its last bytes.
    file.flush()?;
    Ok(())
}

fn write_data(logged: &Logged, file: &mut dyn Write) -> anyhow::Result<()> {
    let about = logged.about();
    let number = |name: &str| about["log"][name].as_u64().unwrap_or_default();
    let (every, chunk) = (number("every").max(1), number("chunk").max(1));
    let views = number("ticks") / every + 1;
    let chunks = views.div_ceil(chunk);
    let robots = about["scenario"]["robots"].as_array().map_or(0, Vec::len);
    let index = json!({
        "parts": 3 + robots as u64 + chunks,
        "every": every,
        "views": views,
        "chunk": chunk,
    });
    writeln!(
        file,
        r#"<script type="application/json" id="embedded-run">{index}</script>"#
    )?;
    let mut about = about.clone();
    // The path on the author's machine is of no use elsewhere.
    about["folder"] = about["run"].clone();
    about["log"]["is_file"] = true.into();
    write_part(file, "run", &about)?;
    write_part(file, "overview", &logged.overview())?;
    write_part(file, "events", &logged.events())?;
    for rank in 0..robots {
        write_part(file, &format!("corners/{rank}"), &logged.corners(rank))?;
    }
    for number in 0..chunks {
        let views = logged.views(number * chunk * every, chunk, every);
        let mut lines = String::new();
        let mut before = Value::Null;
        for view in views {
            // Through the text, because a number of 32 bits as a `Value` has more digits than the server sends.
            let view: Value = serde_json::from_str(&serde_json::to_string(view)?)?;
            let line = match before {
                Value::Null => view.to_string(),
                _ => format!("\n{}", change(&before, &view)),
            };
            lines.push_str(&line);
            before = view;
        }
        write_packed(file, &format!("views/{number}"), lines.as_bytes())?;
    }
    Ok(())
}

fn write_part(file: &mut dyn Write, name: &str, content: &impl Serialize) -> anyhow::Result<()> {
    write_packed(file, name, &serde_json::to_vec(content)?)
}

fn write_packed(file: &mut dyn Write, name: &str, content: &[u8]) -> anyhow::Result<()> {
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

/// Returns the page with all its files inside, without data.
fn page() -> anyhow::Result<String> {
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
                let policy = "http-equiv=\"Content-Security-Policy\"";
                writeln!(page, "  <meta {policy} content=\"{POLICY}\">")?;
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
    use std::process::Command;

    use in_process::Team;
    use missions::waste::data::default_scenario;
    use run_log::LogLevel;
    use run_log::recorder::Folder;
    use scenario::Setup;
    use tempfile::TempDir;

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
        let page = page().unwrap();
        assert!(!page.contains("/assets/"));
        assert_eq!(page.matches("</body>").count(), 1);
        // A script ends at its first end tag, also within a text.
        assert_eq!(
            page.matches("<script").count(),
            page.matches("</script").count()
        );
    }

    /// The page reads the views, curves and events from the file as the server sends them.
    #[test]
    fn the_file_contains_the_answers_of_the_server() {
        let folder = TempDir::new().unwrap();
        let mut scenario = default_scenario();
        scenario.limit_s = 30.0;
        let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
        let sink = Folder::create(folder.path()).unwrap();
        Team::new(setup, LogLevel::Full, sink)
            .unwrap()
            .run()
            .unwrap();
        let file = folder.path().join("run.html");
        let mut html = Vec::new();
        write(folder.path(), &mut html).unwrap();
        std::fs::write(&file, html).unwrap();
        let logged = Logged::open(folder.path()).unwrap();
        let answers = folder.path().join("answers.json");
        let ranks = 0..logged.about()["scenario"]["robots"]
            .as_array()
            .unwrap()
            .len();
        let expected = json!({
            "views": serde_json::from_str::<Value>(&serde_json::to_string(&logged.views(0, 1000, 1)).unwrap()).unwrap(),
            "overview": serde_json::from_str::<Value>(&serde_json::to_string(&logged.overview()).unwrap()).unwrap(),
            "corners": ranks.map(|rank| logged.corners(rank)).collect::<Vec<_>>(),
            "events": logged.events(),
            "hash": logged.about()["log"]["hash"],
        });
        std::fs::write(&answers, expected.to_string()).unwrap();
        crate::page::node(
            Command::new("node")
                .env("ALLIANCE_FILE", &file)
                .env("ALLIANCE_ANSWERS", &answers),
            "embedded.test.js",
        );
    }
}
