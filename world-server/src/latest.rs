//! `runs/latest` leads to the newest run, from its first moment on.

use std::os::unix::fs::symlink;
use std::path::Path;
use std::{fs, io};

/// Makes `latest` in the folder `runs` lead to a run's folder, wherever that is; there is always one or the other. What is no
/// link stays as it is.
///
/// # Errors
/// When it cannot be made.
pub fn link_latest(runs: &Path, folder: &Path) -> io::Result<()> {
    fs::create_dir_all(runs)?;
    let link = runs.join("latest");
    if fs::symlink_metadata(&link).is_ok_and(|found| !found.is_symlink()) {
        return Ok(());
    }
    let (runs_at, folder_at) = (runs.canonicalize()?, folder.canonicalize()?);
    // The runs may be moved together.
    let target = folder_at.strip_prefix(&runs_at).unwrap_or(&folder_at);
    let fresh = runs.join(format!(".latest-{}", std::process::id()));
    let _ = fs::remove_file(&fresh);
    symlink(target, &fresh)?;
    fs::rename(&fresh, &link).inspect_err(|_| {
        let _ = fs::remove_file(&fresh);
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_run_wherever_it_is() {
        let place = tempfile::TempDir::new().unwrap();
        let runs = place.path().join("runs");
        let leads_to = || fs::read_link(runs.join("latest")).unwrap();
        for name in ["one", "two"] {
            fs::create_dir_all(runs.join(name)).unwrap();
            link_latest(&runs, &runs.join(name)).unwrap();
            assert_eq!(leads_to(), Path::new(name));
        }
        let elsewhere = place.path().join("elsewhere");
        fs::create_dir(&elsewhere).unwrap();
        link_latest(&runs, &elsewhere).unwrap();
        assert_eq!(leads_to(), elsewhere.canonicalize().unwrap());
        assert_eq!(fs::read_dir(&runs).unwrap().count(), 3);
        // Somebody's own folder of that name is not touched.
        fs::remove_file(runs.join("latest")).unwrap();
        fs::create_dir(runs.join("latest")).unwrap();
        link_latest(&runs, &elsewhere).unwrap();
        assert!(fs::symlink_metadata(runs.join("latest")).unwrap().is_dir());
    }
}
