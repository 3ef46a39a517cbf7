//! Texts, for reading.

use std::{io::Write as _, path::Path};

use super::atomic;
use crate::error::Error;

/// Writes one text.
///
/// # Errors
/// When the operating system refuses.
pub fn write(path: &Path, text: &str) -> Result<(), Error> {
    atomic::write(path, |writer| writer.write_all(text.as_bytes())).map_err(|e| Error::write(path, e))
}

/// Writes each text into a file of its name in `folder`, which is made when it does not exist. Files of other names are left alone.
///
/// # Errors
/// When the operating system refuses.
pub fn write_all(folder: &Path, texts: &[(String, String)]) -> Result<(), Error> {
    if folder.exists() && !folder.is_dir() {
        return Err(Error::write(folder, "this is not a folder"));
    }
    std::fs::create_dir_all(folder).map_err(|e| Error::write(folder, e))?;
    for (name, text) in texts {
        write(&folder.join(name), text)?;
    }
    Ok(())
}
