//! The texts of the repository, and small made-up ones for planted faults.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// Folders that hold what is built or fetched, by path from the root.
const NOT_OURS: [&str; 4] = [".git", "target", "out", "book/book"];
/// What counts as text of ours.
const EXTENSIONS: [&str; 8] = ["rs", "wgsl", "md", "toml", "sh", "yml", "js", "mjs"];

/// One file.
pub(crate) struct File {
    /// From the root, with forward slashes.
    pub(crate) path: String,
    /// All of it.
    pub(crate) text: String,
}

impl File {
    /// True for files whose name ends so.
    pub(crate) fn is(&self, extension: &str) -> bool {
        self.path.ends_with(extension)
    }

    /// The lines with their numbers, counted from 1.
    pub(crate) fn lines(&self) -> impl Iterator<Item = (usize, &str)> {
        self.text.lines().enumerate().map(|(index, line)| (index + 1, line))
    }
}

/// All files, in the order of their paths.
pub(crate) struct Sources {
    /// Never empty for the repository.
    pub(crate) files: Vec<File>,
}

impl Sources {
    /// Reads the checkout that this test was compiled in.
    pub(crate) fn of_repository() -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the package lies in a folder of the workspace");
        let mut files = Vec::new();
        walk(root, root, &mut files);
        files.sort_by(|a, b| a.path.cmp(&b.path));
        Self { files }
    }

    /// Files that exist nowhere.
    pub(crate) fn planted(files: &[(&str, &str)]) -> Self {
        let file = |(path, text): &(&str, &str)| File { path: (*path).to_owned(), text: (*text).to_owned() };
        Self { files: files.iter().map(file).collect() }
    }

    /// The file at this very path, or an empty text.
    pub(crate) fn text_of(&self, path: &str) -> &str {
        self.files.iter().find(|file| file.path == path).map_or("", |file| &file.text)
    }
}

fn walk(root: &Path, folder: &Path, files: &mut Vec<File>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let name = relative(root, &path);
        if path.is_dir() {
            if !NOT_OURS.contains(&name.as_str()) {
                walk(root, &path, files);
            }
        } else if is_text(&path, &name) {
            let text = fs::read_to_string(&path).unwrap_or_else(|why| panic!("{name} is not readable as text: {why}"));
            files.push(File { path: name, text });
        }
    }
}

fn relative(root: &Path, path: &Path) -> String {
    let path: PathBuf = path.strip_prefix(root).unwrap_or(path).to_path_buf();
    path.to_string_lossy().replace('\\', "/")
}

fn is_text(path: &Path, name: &str) -> bool {
    name == ".ci/run" || path.extension().and_then(|extension| extension.to_str()).is_some_and(|extension| EXTENSIONS.contains(&extension))
}
