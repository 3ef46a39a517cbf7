//! The outer shell of a glTF file: text, or the binary container with its chunks.
//!
//! Key decision: the first bytes decide, not the ending of the name, because renamed files are common.

use serde::Deserialize;
use serde_json::Value;

use super::json::Document;
use crate::error::Fault;

const MAGIC: &[u8] = b"glTF";
const CHUNK_JSON: u32 = 0x4E4F_534A;
const CHUNK_BIN: u32 = 0x004E_4942;

/// The JSON text, and the binary chunk if there is one.
pub(super) fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Fault> {
    if !bytes.starts_with(MAGIC) {
        return Ok((bytes, None));
    }
    let word = |at: usize| read_u32(bytes, at);
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(Fault::invalid("header", "the file ends inside"));
    };
    if version != 2 {
        return Err(Fault::unsupported("header", format_args!("container version {version}")));
    }
    // What follows the declared length is no part of the container.
    let body = bytes
        .get(..length as usize)
        .ok_or_else(|| Fault::invalid("header", format_args!("the length says {length} bytes, the file has {}", bytes.len())))?;
    let (mut json, mut bin) = (None, None);
    let mut at = 12;
    let mut index = 0;
    while at < body.len() {
        let place = format!("chunk {index}");
        let (Some(size), Some(kind)) = (read_u32(body, at), read_u32(body, at.saturating_add(4))) else {
            return Err(Fault::invalid(place, "the file ends inside its header"));
        };
        let start = at.saturating_add(8);
        let end = start.saturating_add(size as usize);
        let content = body.get(start..end).ok_or_else(|| {
            Fault::invalid(&place, format_args!("the length says {size} bytes, {} remain", body.len().saturating_sub(start)))
        })?;
        match (index, kind) {
            (0, CHUNK_JSON) => json = Some(content),
            (0, _) => return Err(Fault::invalid(place, "the first chunk is not JSON")),
            (1, CHUNK_BIN) => bin = Some(content),
            _ => {}
        }
        at = end;
        index += 1;
    }
    let json = json.ok_or_else(|| Fault::invalid("file", "there is no JSON chunk"))?;
    Ok((json, bin))
}

fn read_u32(bytes: &[u8], at: usize) -> Option<u32> {
    let word = bytes.get(at..)?.first_chunk::<4>()?;
    Some(u32::from_le_bytes(*word))
}

/// Understands the JSON text and checks that it is glTF 2.
pub(super) fn parse(json: &[u8]) -> Result<Document, Fault> {
    let json = json.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(json);
    let document: Document = serde_json::from_slice(json).or_else(|e| lenient(json).ok_or_else(|| Fault::invalid("JSON", e)))?;
    let version = &document.asset.version;
    if version.is_empty() {
        return Err(Fault::invalid("asset", "there is no version"));
    }
    if version.split('.').next() != Some("2") {
        return Err(Fault::unsupported("asset", format_args!("version '{version}'")));
    }
    if let Some(least) = document.asset.min_version.as_deref().filter(|least| *least != "2.0") {
        return Err(Fault::unsupported("asset", format_args!("version '{least}', which the file asks for at least,")));
    }
    Ok(document)
}

/// The second attempt: the format allows to write an integer as `1.0`, and a few exporters do.
fn lenient(json: &[u8]) -> Option<Document> {
    let mut value: Value = serde_json::from_slice(json).ok()?;
    let mut open = vec![&mut value];
    while let Some(value) = open.pop() {
        match value {
            Value::Array(values) => open.extend(values),
            Value::Object(members) => open.extend(members.values_mut()),
            Value::Number(number) => {
                let float = number.as_f64().filter(|x| !number.is_u64() && x.fract() == 0.0 && (0.0..1e15).contains(x));
                if let Some(float) = float {
                    *value = Value::from(float as u64);
                }
            }
            Value::Null | Value::Bool(_) | Value::String(_) => {}
        }
    }
    Document::deserialize(value).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(json: &[u8], declared: u32) -> Vec<u8> {
        let mut bytes = Vec::from(*b"glTF\x02\0\0\0");
        bytes.extend(declared.to_le_bytes());
        bytes.extend((json.len() as u32).to_le_bytes());
        bytes.extend(CHUNK_JSON.to_le_bytes());
        bytes.extend(json);
        bytes
    }

    // Kills: a slice from a declared length without a check, at every place where a file can be cut.
    #[test]
    fn a_container_cut_anywhere_is_refused() {
        let whole = glb(b"{}  ", 24);
        assert_eq!(split(&whole), Ok((b"{}  ".as_slice(), None)));
        for length in 4..whole.len() {
            assert!(split(&whole[..length]).is_err(), "{length}");
        }
        assert!(split(&glb(b"{}  ", 12)).is_err(), "no chunk at all");
        assert!(split(&glb(b"{}  ", 16)).is_err(), "half a chunk header");
        assert!(split(&glb(b"{}  ", u32::MAX)).is_err(), "longer than the file");
    }

    // Kills: refusing integers that are written as floats, and reading other floats as integers.
    #[test]
    fn integers_may_be_written_as_floats() {
        let scene = |number: &str| parse(format!(r#"{{"asset":{{"version":"2.0"}},"scene":{number}}}"#).as_bytes()).map(|d| d.scene);
        assert_eq!(scene("1.0"), Ok(Some(1)));
        assert_eq!(scene("2e1"), Ok(Some(20)));
        assert!(scene("1.5").is_err() && scene("-1.0").is_err() && scene("1e300").is_err());
    }

    // Kills: accepting glTF 1 or files that ask for a later version.
    #[test]
    fn only_version_2_is_read() {
        let refused = |text: &str| parse(text.as_bytes()).err().is_some();
        assert!(!refused(r#"{"asset":{"version":"2.1"}}"#));
        assert!(refused(r#"{"asset":{"version":"1.0"}}"#));
        assert!(refused(r#"{"asset":{"version":"2.1","minVersion":"2.1"}}"#));
        assert!(refused("{}"));
    }
}
