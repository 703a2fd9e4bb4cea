//! The files of the page, embedded in the program, so that the page needs no network and no other file.

pub struct Asset {
    pub bytes: &'static [u8],
    /// The value of the HTTP header `Content-Type`.
    pub media_type: &'static str,
}

/// Lists files of the page's folder with their contents.
macro_rules! files {
    ($($path:literal)*) => {
        &[$(($path, include_bytes!(concat!("../../page/", $path)))),*]
    };
}

const FILES: &[(&str, &[u8])] = files! {
    "compare.css"
    "editor/drawing.js"
    "editor/editor.css"
    "editor/editor.js"
    "editor/files.js"
    "editor/source.js"
    "icon.svg"
    "index.html"
    "layout.css"
    "main.js"
    "model/between.js"
    "model/branch.js"
    "model/channel.js"
    "model/choice.js"
    "model/compare.js"
    "model/curves.js"
    "model/devices.js"
    "model/draft.js"
    "model/events.js"
    "model/faults.js"
    "model/history.js"
    "model/levels.js"
    "model/marks.js"
    "model/mission.js"
    "model/model.js"
    "model/own_faults.js"
    "model/signs.js"
    "model/skills.js"
    "model/state.js"
    "model/traffic.js"
    "model/trail.js"
    "panels.css"
    "panels/beside.js"
    "panels/branch.js"
    "panels/charts.js"
    "panels/clock.js"
    "panels/devices.js"
    "panels/events.js"
    "panels/faults.js"
    "panels/gallery.js"
    "panels/links.js"
    "panels/matrix.js"
    "panels/messages.js"
    "panels/mission.js"
    "panels/new_fault.js"
    "panels/playground.js"
    "panels/robots.js"
    "panels/tasks.js"
    "panels/timeline.js"
    "room/body.js"
    "room/fault_tools.js"
    "room/geometry.js"
    "room/labels.js"
    "room/obstacle_menu.js"
    "room/paint.js"
    "room/room.js"
    "room/tools.js"
    "source/api.js"
    "source/delta.js"
    "source/embedded.js"
    "source/engine.js"
    "source/live.js"
    "source/live_clock.js"
    "source/log.js"
    "source/orders.js"
    "source/part.js"
    "source/player.js"
    "source/worker.js"
    "theme.css"
    "ui/bars.js"
    "ui/choices.js"
    "ui/colors.js"
    "ui/dom.js"
    "ui/keys.js"
    "ui/listing.js"
    "ui/loop.js"
    "ui/menu.js"
    "ui/notices.js"
    "ui/tabs.js"
    "ui/theme.js"
    "ui/words.js"
    "vendor/uplot/uPlot.iife.min.js"
    "vendor/uplot/uPlot.min.css"
};

/// Returns the paths of all files below the page's folder.
pub fn paths() -> impl Iterator<Item = &'static str> {
    FILES.iter().map(|(path, _)| *path)
}

/// Returns the file with this path below the page's folder.
#[must_use]
pub fn find(path: &str) -> Option<Asset> {
    let (_, bytes) = FILES.iter().find(|(name, _)| *name == path)?;
    let media_type = match path.rsplit_once('.')?.1 {
        "html" => "text/html; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "svg" => "image/svg+xml",
        _ => return None,
    };
    Some(Asset { bytes, media_type })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// Collects the files below the page's folder that a browser requests.
    fn find_on_disk(folder: &Path, found: &mut Vec<String>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                find_on_disk(&path, found);
            } else if let Some("html" | "css" | "js" | "svg") =
                path.extension().and_then(|extension| extension.to_str())
            {
                let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("page");
                let path = path.strip_prefix(root).unwrap();
                found.push(path.to_str().unwrap().to_owned());
            }
        }
    }

    #[test]
    fn every_file_of_the_page_is_embedded() {
        let mut found = Vec::new();
        find_on_disk(
            &Path::new(env!("CARGO_MANIFEST_DIR")).join("page"),
            &mut found,
        );
        found.sort();
        let mut embedded: Vec<_> = FILES.iter().map(|(name, _)| (*name).to_owned()).collect();
        embedded.sort();
        assert_eq!(embedded, found);
        for path in &found {
            assert!(find(path).is_some(), "{path} has no media type");
        }
    }
}
