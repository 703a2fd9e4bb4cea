//! Computes the identity of the build: a hash of the sources of all crates of the programs and of Cargo.lock.
//!
//! Equal sources and dependencies give an equal identity on every machine. It is not a hash of the executable, because
//! `alliance`, `world-server` and `robot-agent` of the same sources must have the same identity.

mod link;

use std::fs;
use std::path::{Path, PathBuf};

use xxhash_rust::xxh3::Xxh3;

const CRATES: [&str; 11] = [
    "terminal",
    "scenario",
    "proto",
    "run-log",
    "cluster",
    "world-server",
    "robot-agent",
    "missions",
    "in-process",
    "analysis",
    "launch",
];

fn main() {
    link::at_fixed_address();
    let mut files = vec![PathBuf::from("../Cargo.lock")];
    for name in CRATES {
        let folder = Path::new("..").join(name);
        files.push(folder.join("Cargo.toml"));
        println!("cargo::rerun-if-changed={}", folder.join("src").display());
        collect(&folder.join("src"), &mut files);
    }
    files.sort();
    let mut hash = Xxh3::new();
    for file in files {
        println!("cargo::rerun-if-changed={}", file.display());
        let bytes = fs::read(&file).unwrap_or_default();
        hash.update(file.to_string_lossy().as_bytes());
        hash.update(&bytes.len().to_le_bytes());
        hash.update(&bytes);
    }
    println!("cargo::rustc-env=ALLIANCE_BUILD={:016x}", hash.digest());
}

/// Appends all files below a folder.
fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, files);
        } else {
            files.push(path);
        }
    }
}
