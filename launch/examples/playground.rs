//! Writes the folder of the playground: `playground MODULE FOLDER`. `playground/build` calls it with the module that it has
//! compiled.

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::PathBuf;

use anyhow::{Context, bail};

fn main() -> anyhow::Result<()> {
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [module, folder] = arguments.as_slice() else {
        bail!("use: playground MODULE FOLDER");
    };
    let bytes = fs::read(module).with_context(|| module.display().to_string())?;
    let page = folder.join("index.html");
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let file = File::create(&page).with_context(|| page.display().to_string())?;
    launch::page::playground::write(&bytes, &mut BufWriter::new(file))
}
