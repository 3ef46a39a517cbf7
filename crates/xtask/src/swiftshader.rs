//! SwiftShader, the second Vulkan driver: an independent implementation that shares no code with Mesa.
//!
//! Results that must agree across drivers are worth little if one driver is all there is. On build machines it is mandatory; a stranger
//! who does not have it sees one line that says so.

use std::{
    env,
    ffi::OsString,
    path::{Path, PathBuf},
};

use crate::process::Failure;

/// The tests find the driver's description through this variable.
pub(crate) const VARIABLE: &str = "WAVEPOOL_SWIFTSHADER";
const FILE: &str = "vk_swiftshader_icd.json";
/// Where distributions put chromium, which carries the driver.
const FOLDERS: [&str; 4] = ["/usr/lib/chromium", "/usr/lib/chromium-browser", "/usr/lib64/chromium-browser", "/opt/google/chrome"];

/// The path of the driver's description, or `None` when it is not installed.
///
/// # Errors
/// When the variable names a file that does not exist: then somebody wanted this very driver.
pub(crate) fn find() -> Result<Option<PathBuf>, Failure> {
    search(env::var_os(VARIABLE), &FOLDERS, Path::is_file)
}

fn search(wish: Option<OsString>, folders: &[&str], is_file: impl Fn(&Path) -> bool) -> Result<Option<PathBuf>, Failure> {
    if let Some(wish) = wish.filter(|wish| !wish.is_empty()) {
        let wish = PathBuf::from(wish);
        return match [wish.join(FILE), wish.clone()].into_iter().find(|path| is_file(path)) {
            Some(path) => Ok(Some(path)),
            None => Err(Failure::step(format!("{VARIABLE} names `{}`, which is neither a file nor a folder with {FILE}", wish.display()))),
        };
    }
    Ok(folders.iter().map(|folder| Path::new(folder).join(FILE)).find(|path| is_file(path)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn search_for(wish: Option<&str>, existing: &str) -> Result<Option<PathBuf>, Failure> {
        search(wish.map(OsString::from), &["/a", "/b"], |path| path == Path::new(existing))
    }

    /// Kills: a wish that is silently replaced by the driver of chromium, and folders after the first never looked at.
    #[test]
    fn a_wish_is_binding() {
        assert_eq!(search_for(None, "/b/vk_swiftshader_icd.json"), Ok(Some("/b/vk_swiftshader_icd.json".into())));
        assert_eq!(search_for(None, "/c"), Ok(None));
        assert_eq!(search_for(Some("/c/icd.json"), "/c/icd.json"), Ok(Some("/c/icd.json".into())));
        assert_eq!(search_for(Some("/c"), "/c/vk_swiftshader_icd.json"), Ok(Some("/c/vk_swiftshader_icd.json".into())));
        assert!(search_for(Some("/c"), "/a/vk_swiftshader_icd.json").is_err());
    }
}
