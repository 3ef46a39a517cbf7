//! The listings of the book: every include must name a file that exists and an anchor in it that is opened, closed and not empty.
//!
//! Key decision: we check what mdBook only logs, by mdBook's own rules for includes and anchors, so that a renamed function cannot
//! leave a hole in a chapter. It needs no mdBook, and so it runs in every test.

use std::{fs, path::Path};

use crate::process::Failure;

/// Checks all chapters and returns the number of includes.
///
/// # Errors
/// One line per include that leads nowhere.
pub(crate) fn check_book(root: &Path) -> Result<usize, Failure> {
    let folder = root.join("book/src");
    let mut chapters = Vec::new();
    list_chapters(&folder, &mut chapters).map_err(|why| Failure::step(format!("cannot read book/src: {why}")))?;
    chapters.sort();
    let (mut count, mut complaints) = (0, Vec::new());
    for chapter in &chapters {
        let text = fs::read_to_string(chapter).map_err(|why| Failure::step(format!("{}: {why}", chapter.display())))?;
        let here = chapter.parent().unwrap_or(&folder);
        let name = chapter.strip_prefix(root).unwrap_or(chapter).display().to_string();
        for include in includes(&text) {
            count += 1;
            let target = fs::read_to_string(here.join(include.file));
            if let Err(why) = target.map_err(|why| why.to_string()).and_then(|target| check_target(&include, &target)) {
                complaints.push(format!("{name}:{}: {}: {why}", include.line, include.file));
            }
        }
    }
    if complaints.is_empty() {
        Ok(count)
    } else {
        Err(Failure::step(format!("listings that lead nowhere:\n  {}", complaints.join("\n  "))))
    }
}

fn list_chapters(folder: &Path, chapters: &mut Vec<std::path::PathBuf>) -> std::io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            list_chapters(&path, chapters)?;
        } else if path.extension().is_some_and(|extension| extension == "md") {
            chapters.push(path);
        }
    }
    Ok(())
}

/// One include of a chapter.
#[derive(Debug, PartialEq, Eq)]
struct Include<'a> {
    /// Counted from 1.
    line: usize,
    /// Relative to the chapter.
    file: &'a str,
    /// What follows the file: nothing, an anchor, or a range of lines.
    part: Option<&'a str>,
}

/// The includes of a chapter, without those that a backslash makes plain text.
fn includes(text: &str) -> Vec<Include<'_>> {
    let mut found = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let mut rest = line;
        while let Some(start) = rest.find("{{#") {
            let escaped = rest[..start].ends_with('\\');
            let after = &rest[start + 3..];
            let Some(end) = after.find("}}") else { break };
            let mut words = after[..end].split_whitespace();
            let verb = words.next().unwrap_or_default();
            if let (false, "include" | "rustdoc_include" | "playground", Some(argument)) = (escaped, verb, words.next()) {
                let (file, part) = argument.split_once(':').map_or((argument, None), |(file, part)| (file, Some(part)));
                found.push(Include { line: index + 1, file, part });
            }
            rest = &after[end + 2..];
        }
    }
    found
}

/// Checks one include against the text of the file it names.
fn check_target(include: &Include<'_>, target: &str) -> Result<(), String> {
    let Some(part) = include.part else { return Ok(()) };
    let is_range = part.split(':').all(|number| number.is_empty() || number.parse::<usize>().is_ok());
    if is_range {
        return Err("includes lines by number, which drift; name an anchor".into());
    }
    let position = |marker: &str| target.lines().position(|line| anchor(line, marker) == Some(part));
    match (position("ANCHOR:"), position("ANCHOR_END:")) {
        (None, _) => Err(format!("has no anchor `{part}`")),
        (_, None) => Err(format!("never closes its anchor `{part}`")),
        (Some(open), Some(close)) if close < open => Err(format!("closes its anchor `{part}` before opening it")),
        (Some(open), Some(close)) => {
            let mut between = target.lines().take(close).skip(open + 1);
            if between.any(|line| !line.trim().is_empty() && !line.contains("ANCHOR")) {
                Ok(())
            } else {
                Err(format!("has nothing in its anchor `{part}`"))
            }
        }
    }
}

/// The name after the marker, as mdBook reads it: letters, digits, `_` and `-`.
fn anchor<'a>(line: &'a str, marker: &str) -> Option<&'a str> {
    let name = line.split_once(marker)?.1.trim_start();
    let end = name.find(|c: char| !(c.is_alphanumeric() || matches!(c, '_' | '-'))).unwrap_or(name.len());
    (end > 0).then(|| &name[..end])
}

#[cfg(test)]
mod tests {
    use super::*;

    const CODE: &str = "//! x\n// ANCHOR: whole\n// ANCHOR: part-1\nfn f() {}\n// ANCHOR_END: part-1\n// ANCHOR_END: whole\n\
                        // ANCHOR: open\nfn g() {}\n// ANCHOR: empty\n\n// ANCHOR_END: empty\n";

    fn check(part: Option<&str>) -> Result<(), String> {
        check_target(&Include { line: 1, file: "f.rs", part }, CODE)
    }

    /// Kills: a missing, unclosed or empty anchor that passes, and an anchor found because another begins with its name.
    #[test]
    fn holes_are_found() {
        for good in [None, Some("whole"), Some("part-1")] {
            assert_eq!(check(good), Ok(()), "{good:?}");
        }
        for (bad, why) in
            [("part", "no anchor"), ("missing", "no anchor"), ("open", "never closes"), ("empty", "nothing"), ("2:5", "by number")]
        {
            assert!(check(Some(bad)).is_err_and(|text| text.contains(why)), "{bad}");
        }
    }

    /// Kills: a second include on a line overlooked, and an escaped one (text about includes) taken for real.
    #[test]
    fn includes_are_read_as_mdbook_reads_them() {
        let text = "a\n{{#include ../a.rs:one}} {{#rustdoc_include b.rs}}\n\\{{#include c.rs:two}}\n{{#title x}}\n";
        let expected = [Include { line: 2, file: "../a.rs", part: Some("one") }, Include { line: 2, file: "b.rs", part: None }];
        assert_eq!(includes(text), expected);
    }
}
