//! The link `runs/latest` to the newest run, which exists from the beginning of that run.

use std::os::unix::fs::symlink;
use std::path::Path;
use std::{fs, io};

/// Makes `latest` in the folder `runs` a link to a run's folder. The link is replaced atomically. A file or folder with this
/// name that is not a link stays as it is.
pub fn link_latest(runs: &Path, folder: &Path) -> io::Result<()> {
    fs::create_dir_all(runs)?;
    let link = runs.join("latest");
    if fs::symlink_metadata(&link).is_ok_and(|found| !found.is_symlink()) {
        return Ok(());
    }
    let (runs_at, folder_at) = (runs.canonicalize()?, folder.canonicalize()?);
    // A relative target survives a move of the whole `runs` folder.
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
    fn the_link_leads_to_the_newest_run_in_any_folder() {
        let folder = tempfile::TempDir::new().unwrap();
        let runs = folder.path().join("runs");
        let leads_to = || fs::read_link(runs.join("latest")).unwrap();
        for name in ["one", "two"] {
            fs::create_dir_all(runs.join(name)).unwrap();
            link_latest(&runs, &runs.join(name)).unwrap();
            assert_eq!(leads_to(), Path::new(name));
        }
        let elsewhere = folder.path().join("elsewhere");
        fs::create_dir(&elsewhere).unwrap();
        link_latest(&runs, &elsewhere).unwrap();
        assert_eq!(leads_to(), elsewhere.canonicalize().unwrap());
        assert_eq!(fs::read_dir(&runs).unwrap().count(), 3);
        // A real folder with this name is not touched.
        fs::remove_file(runs.join("latest")).unwrap();
        fs::create_dir(runs.join("latest")).unwrap();
        link_latest(&runs, &elsewhere).unwrap();
        assert!(fs::symlink_metadata(runs.join("latest")).unwrap().is_dir());
    }
}
