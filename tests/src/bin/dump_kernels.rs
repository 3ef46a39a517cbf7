//! Writes every kernel of the repository into a folder, one file each: what a second WGSL compiler is to read. Needs no adapter.

use std::{fs, path::PathBuf};

use wavepool_tests::kernels;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args_os().nth(1).ok_or("usage: dump_kernels FOLDER")?);
    fs::create_dir_all(&folder)?;
    let kernels = kernels::all();
    for kernel in &kernels {
        fs::write(folder.join(format!("{}.wgsl", kernel.name)), &kernel.text)?;
    }
    println!("{} kernels in {}", kernels.len(), folder.display());
    Ok(())
}
