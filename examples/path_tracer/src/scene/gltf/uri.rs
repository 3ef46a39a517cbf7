//! Where the bytes behind a URI come from: the URI itself or a file next to the scene.
//!
//! Key decision: a scene reads files of its own folder and below, nothing else, whatever the spelling: absolute paths, other schemes,
//! parent steps and links that lead out are refused, so that opening a downloaded scene reveals nothing of the machine.

use std::path::{Component, Path, PathBuf};

use super::super::limits;
use crate::error::Fault;

/// Reads what `uri` stands for; `scene` is the path of the scene's own file.
pub(super) fn resolve(uri: &str, scene: &Path) -> Result<Vec<u8>, Fault> {
    if let Some(rest) = strip_scheme(uri, "data") {
        return data_uri(rest);
    }
    let place = || format!("uri '{}'", shortened(uri));
    let decoded = percent_decode(uri).ok_or_else(|| Fault::invalid(place(), "the percent encoding is broken"))?;
    beside(&decoded, scene).map_err(|what| Fault::invalid(place(), what))
}

/// Reads the file that `relative` names in the folder of the scene's own file, or says why not.
pub(in crate::scene) fn beside(relative: &str, scene: &Path) -> Result<Vec<u8>, String> {
    limits::read_file(&inside(folder(scene), relative)?).map_err(|e| match e {
        crate::error::Error::Read { reason, .. } => reason,
        other => other.to_string(),
    })
}

/// The file that [`beside`] would read, which exists, or why not.
pub(super) fn find_beside(relative: &str, scene: &Path) -> Result<PathBuf, String> {
    let path = inside(folder(scene), relative)?;
    if path.is_file() { Ok(path) } else { Err(String::from("this is not a file")) }
}

fn folder(scene: &Path) -> &Path {
    match scene.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}

/// The path in the folder that `relative` names, or why it may not be read.
fn inside(folder: &Path, relative: &str) -> Result<PathBuf, String> {
    let outside = || String::from("this leads out of the folder of the scene");
    if relative.contains(':') && relative.split(':').next().is_some_and(is_scheme) {
        return Err(String::from("only data and relative files are read"));
    }
    let mut depth = 0usize;
    for component in Path::new(relative).components() {
        match component {
            Component::Normal(_) => depth += 1,
            Component::CurDir => {}
            Component::ParentDir => depth = depth.checked_sub(1).ok_or_else(outside)?,
            Component::RootDir | Component::Prefix(_) => return Err(outside()),
        }
    }
    // The spelling is harmless, but a link on the way may still lead out.
    let folder = folder.canonicalize().map_err(|e| e.to_string())?;
    let path = folder.join(relative).canonicalize().map_err(|e| e.to_string())?;
    if path.starts_with(&folder) { Ok(path) } else { Err(outside()) }
}

fn is_scheme(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic()) && text.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
}

fn strip_scheme<'a>(uri: &'a str, scheme: &str) -> Option<&'a str> {
    let (head, rest) = uri.split_once(':')?;
    head.eq_ignore_ascii_case(scheme).then_some(rest)
}

fn shortened(uri: &str) -> String {
    uri.chars().take(80).collect()
}

/// What follows `data:`, with or without base64.
fn data_uri(rest: &str) -> Result<Vec<u8>, Fault> {
    let fault = |what: &str| Fault::invalid("data uri", what);
    let (header, body) = rest.split_once(',').ok_or_else(|| fault("there is no comma before the data"))?;
    if header.to_ascii_lowercase().ends_with(";base64") {
        base64(body.as_bytes()).ok_or_else(|| fault("the base64 text is broken"))
    } else {
        percent_bytes(body).ok_or_else(|| fault("the percent encoding is broken"))
    }
}

fn percent_decode(text: &str) -> Option<String> {
    String::from_utf8(percent_bytes(text)?).ok()
}

fn percent_bytes(text: &str) -> Option<Vec<u8>> {
    let mut decoded = Vec::with_capacity(text.len());
    let mut bytes = text.bytes();
    while let Some(byte) = bytes.next() {
        if byte == b'%' {
            let mut digit = || char::from(bytes.next()?).to_digit(16);
            let value = digit()? * 16 + digit()?;
            decoded.push(u8::try_from(value).ok()?);
        } else {
            decoded.push(byte);
        }
    }
    Some(decoded)
}

/// Decodes both alphabets, with or without padding; anything else inside is an error.
fn base64(text: &[u8]) -> Option<Vec<u8>> {
    let end = text.iter().rposition(|&c| c != b'=').map_or(0, |last| last + 1);
    if text.len() - end > 2 || end % 4 == 1 {
        return None;
    }
    let mut decoded = Vec::with_capacity(end / 4 * 3 + 2);
    for group in text[..end].chunks(4) {
        let mut bits = 0u32;
        for &c in group {
            let digit = match c {
                b'A'..=b'Z' => c - b'A',
                b'a'..=b'z' => c - b'a' + 26,
                b'0'..=b'9' => c - b'0' + 52,
                b'+' | b'-' => 62,
                b'/' | b'_' => 63,
                _ => return None,
            };
            bits = bits << 6 | u32::from(digit);
        }
        // A short last group holds one byte for two digits and two for three.
        let n_digits = group.len();
        bits <<= 6 * (4 - n_digits);
        decoded.extend_from_slice(&bits.to_be_bytes()[1..n_digits]);
    }
    Some(decoded)
}

#[cfg(test)]
mod tests {
    use super::*;

    // Kills: dropping the last one or two bytes, and accepting letters outside of the alphabet.
    #[test]
    fn base64_known_answers() {
        for (text, bytes) in [("", ""), ("Zg==", "f"), ("Zg", "f"), ("Zm8=", "fo"), ("Zm9v", "foo"), ("Zm9vYmFy", "foobar")] {
            assert_eq!(base64(text.as_bytes()).as_deref(), Some(bytes.as_bytes()), "{text}");
        }
        assert_eq!(base64(b"-_+/"), Some(vec![0xFB, 0xFF, 0xBF]));
        for text in ["Z", "Zm9v=Zm9", "Zm 9", "====", "Zm9vY"] {
            assert_eq!(base64(text.as_bytes()), None, "{text}");
        }
    }

    // Kills: a path check before the percent decoding, one that only looks at the start, and one that forgets other schemes.
    #[test]
    fn only_files_below_the_scene_are_read() {
        let scene = Path::new("some/folder/scene.gltf");
        for uri in ["../x", "%2e%2e/x", "a/../../x", "/etc/hostname", "file:///etc/hostname", "http://example.org/x", "a/%2E%2e/../x"] {
            let fault = resolve(uri, scene).unwrap_err().in_file(scene).to_string();
            assert!(fault.contains("leads out") || fault.contains("only data"), "{uri}: {fault}");
        }
        assert!(resolve("%zz", scene).is_err() && resolve("%4", scene).is_err());
    }

    // Kills: treating every data URI as base64.
    #[test]
    fn data_uris_of_both_kinds() {
        let scene = Path::new("scene.gltf");
        assert_eq!(resolve("data:application/octet-stream;base64,AAE=", scene).unwrap(), [0, 1]);
        assert_eq!(resolve("data:,a%00b", scene).unwrap(), [b'a', 0, b'b']);
        assert!(resolve("data:application/octet-stream;base64", scene).is_err());
    }
}
