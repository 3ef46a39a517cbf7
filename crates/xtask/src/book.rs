//! `cargo xtask book`: builds the tutorial.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use crate::{
    anchors,
    process::{self, Failure, cargo},
};

/// The version the book's configuration is written for.
const MDBOOK_VERSION: &str = "0.5.4";

/// Checks every include, then builds `book/book`, installing mdBook into `target/tools` when the machine has none.
///
/// # Errors
/// A missing anchor, an installation that fails, or whatever mdBook complains about.
pub(crate) fn build(root: &Path) -> Result<(), Failure> {
    let includes = anchors::check_book(root)?;
    println!("{includes} includes, each with its anchor");
    let mdbook = find_or_install(root)?;
    process::run(Command::new(mdbook).current_dir(root).args(["build", "book"]))?;
    println!("book: {}", root.join("book/book/index.html").display());
    Ok(())
}

fn find_or_install(root: &Path) -> Result<PathBuf, Failure> {
    let tools = root.join("target/tools");
    let ours = tools.join("bin").join(if cfg!(windows) { "mdbook.exe" } else { "mdbook" });
    let candidates = [ours.clone(), PathBuf::from("mdbook")];
    if let Some(found) = candidates.into_iter().find(|program| process::succeeds(Command::new(program).arg("--version"))) {
        return Ok(found);
    }
    println!("mdBook is not installed: building version {MDBOOK_VERSION} into target/tools");
    process::run(cargo(root, &["install", "mdbook", "--version", MDBOOK_VERSION, "--locked", "--root"]).arg(&tools))?;
    Ok(ours)
}
