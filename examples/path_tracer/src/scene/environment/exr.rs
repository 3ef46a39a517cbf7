//! OpenEXR panoramas: `R`, `G`, `B` or `Y` of the first part that has them, in scanlines or tiles, half or float.
//!
//! Key decision: blocks are decoded one by one by the `exr` crate and their lines copied by channel name, so that neither unusual
//! channel sets nor layers need a reader of their own.
//!
//! **Invariant:** the size in the header is compared with the caps and with the file's own size before texels are allocated.

use std::io::Cursor;

use exr::block::reader::ChunksReader;
use exr::meta::attribute::{ChannelDescription, SampleType};
use exr::meta::header::Header;
use half::f16;

use super::Panorama;
use crate::error::Fault;
use crate::scene::guard::guarded;
use crate::scene::limits;

/// No lossless or lossy method of the format makes more texels out of a byte in real pictures; only crafted files do.
const TEXELS_PER_BYTE: u64 = 4096;

/// Reads all texels of the data window.
pub(super) fn read(bytes: &[u8]) -> Result<Panorama, Fault> {
    guarded(|| match read_guarded(bytes) {
        Ok(panorama) => Ok(Ok(panorama)),
        Err(Stop::Fault(fault)) => Ok(Err(fault)),
        Err(Stop::Decoder(what)) => Err(what),
    })
    .unwrap_or_else(|what| Err(Fault::invalid("content", what)))
}

enum Stop {
    Decoder(String),
    Fault(Fault),
}

impl From<exr::error::Error> for Stop {
    fn from(error: exr::error::Error) -> Stop {
        match error {
            // Our own message ends with the words that some of theirs end with.
            exr::error::Error::NotSupported(what) => {
                let feature = what.trim_end_matches(" not supported").trim_end_matches(" are").trim_end_matches(" is");
                Stop::Fault(Fault::unsupported("content", feature))
            }
            other => Stop::Decoder(other.to_string()),
        }
    }
}

impl From<Fault> for Stop {
    fn from(fault: Fault) -> Stop {
        Stop::Fault(fault)
    }
}

fn read_guarded(bytes: &[u8]) -> Result<Panorama, Stop> {
    let reader = exr::block::read(Cursor::new(bytes), false)?;
    let headers = reader.headers();
    let (layer, roles) = choose(headers).ok_or_else(|| no_colors(headers))?;
    let header = &headers[layer];
    if header.deep {
        return Err(Fault::unsupported("header", "deep data").into());
    }
    let (width, height) = (header.layer_size.0, header.layer_size.1);
    let n_texels = width as u64 * height as u64;
    if n_texels > limits::ENVIRONMENT_TEXELS as u64 || n_texels / TEXELS_PER_BYTE > bytes.len() as u64 {
        return Err(Fault::invalid("header", format_args!("{width} x {height} texels are too many")).into());
    }
    let mut warnings = Vec::new();
    if headers.len() > 1 {
        warnings.push(format!("part {layer} of {} is shown", headers.len()));
    }
    if header.shared_attributes.display_window.size != header.layer_size {
        warnings.push(String::from("the data window differs from the display window, the data window is shown"));
    }

    let mut texels = vec![[0.0f32; 3]; n_texels as usize];
    let mut chunks = reader.filter_chunks(false, |_, tile, block| block.layer == layer && tile.is_largest_resolution_level())?;
    let meta = chunks.meta_data().clone();
    let channels = &meta.headers[layer].channels;
    let mut n_copied = 0u64;
    while let Some(chunk) = chunks.read_next_chunk() {
        let block = exr::block::UncompressedBlock::decompress_chunk(chunk?, &meta, false)?;
        for line in block.lines(channels) {
            let at = line.location;
            let (Some(&role), Some(channel)) = (roles.get(at.channel), channels.list.get(at.channel)) else { continue };
            let Role::Color(first, last) = role else { continue };
            let start = at.position.1.checked_mul(width).and_then(|row| row.checked_add(at.position.0));
            let target = start.and_then(|start| texels.get_mut(start..)?.get_mut(..at.sample_count));
            let target = target.ok_or_else(|| Fault::invalid("content", "a block lies outside of the picture"))?;
            n_copied += at.sample_count as u64;
            for (texel, value) in target.iter_mut().zip(samples(channel, line.value)) {
                texel[first..=last].fill(value);
            }
        }
    }
    let n_channels = roles.iter().filter(|role| matches!(role, Role::Color(..))).count() as u64;
    if n_copied != n_texels * n_channels {
        return Err(Fault::invalid("content", "blocks are missing").into());
    }
    Ok(Panorama { width: width as u32, height: height as u32, texels, warnings })
}

fn samples<'a>(channel: &ChannelDescription, bytes: &'a [u8]) -> Box<dyn Iterator<Item = f32> + 'a> {
    // The crate hands blocks over in the byte order of this machine.
    match channel.sample_type {
        SampleType::F16 => Box::new(bytes.as_chunks::<2>().0.iter().map(|&b| f16::from_ne_bytes(b).to_f32())),
        SampleType::F32 => Box::new(bytes.as_chunks::<4>().0.iter().map(|&b| f32::from_ne_bytes(b))),
        SampleType::U32 => Box::new(bytes.as_chunks::<4>().0.iter().map(|&b| u32::from_ne_bytes(b) as f32)),
    }
}

/// What a channel of the file means here.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    /// Fills the colours from the first to the last, both included.
    Color(usize, usize),
    Unused,
}

/// The first part with colours and the roles of its channels; names without a layer win over names with one.
fn choose(headers: &[Header]) -> Option<(usize, Vec<Role>)> {
    headers.iter().enumerate().find_map(|(index, header)| {
        let names: Vec<String> = header.channels.list.iter().map(|channel| channel.name.to_string()).collect();
        let layers = names.iter().filter_map(|name| name.rfind('.').map(|dot| &name[..=dot]));
        std::iter::once("").chain(layers).find_map(|layer| roles(&names, layer)).map(|roles| (index, roles))
    })
}

fn roles(names: &[String], layer: &str) -> Option<Vec<Role>> {
    let find = |channel: &str| names.iter().position(|name| name.strip_prefix(layer) == Some(channel));
    let mut roles = vec![Role::Unused; names.len()];
    if let (Some(r), Some(g), Some(b)) = (find("R"), find("G"), find("B")) {
        for (color, at) in [r, g, b].into_iter().enumerate() {
            roles[at] = Role::Color(color, color);
        }
    } else if find("RY").is_none() && find("BY").is_none() {
        roles[find("Y")?] = Role::Color(0, 2);
    } else {
        return None;
    }
    Some(roles)
}

fn no_colors(headers: &[Header]) -> Stop {
    let names = headers.iter().flat_map(|header| &header.channels.list).map(|channel| channel.name.to_string());
    let names: Vec<String> = names.take(16).collect();
    Stop::Fault(Fault::unsupported("channels", format_args!("a picture of {} (R, G, B or Y are read)", names.join(", "))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(names: &[&str], layer: &str) -> Option<Vec<Role>> {
        roles(&names.iter().map(|&name| String::from(name)).collect::<Vec<_>>(), layer)
    }

    // Kills: colours by position instead of name (files sort them B, G, R), and grey from a chroma file.
    #[test]
    fn channels_are_found_by_name() {
        let (r, g, b, none) = (Role::Color(0, 0), Role::Color(1, 1), Role::Color(2, 2), Role::Unused);
        assert!(named(&["A", "B", "G", "R"], "") == Some(vec![none, b, g, r]));
        assert!(named(&["L.B", "L.G", "L.R"], "L.") == Some(vec![b, g, r]));
        assert!(named(&["Y"], "") == Some(vec![Role::Color(0, 2)]));
        assert!(named(&["BY", "RY", "Y"], "").is_none());
        assert!(named(&["R", "G"], "").is_none());
    }
}
