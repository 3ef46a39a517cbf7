//! OpenEXR panoramas: `R`, `G`, `B` or `Y` of the first part that has them, in scanlines or tiles, half or float.
//!
//! Key decision: blocks are decoded one by one by the `exr` crate and their lines copied by channel name, so that neither unusual
//! channel sets nor layers need a reader of their own. The panorama is the display window, because that is what spans the sphere; a
//! data window that is only a part of it lies where it says.
//!
//! **Invariant:** the size in the header is compared with the caps, and with what the file's bytes can decode to, before texels are
//! allocated.

#[cfg(test)]
mod tests;

use std::io::Cursor;

use exr::block::reader::ChunksReader;
use exr::compression::Compression;
use exr::meta::BlockDescription;
use exr::meta::attribute::{ChannelDescription, SampleType};
use exr::meta::header::Header;
use half::f16;

use super::Panorama;
use crate::error::Fault;
use crate::scene::guard::guarded;
use crate::scene::limits;

/// Reads all texels of the display window.
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
                let feature = what.trim_end_matches(" yet").trim_end_matches(" not supported").trim_end_matches(" are");
                Stop::Fault(Fault::unsupported("content", feature.trim_end_matches(" is")))
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
    let Choice { part, layer, roles } = choose(headers).ok_or_else(|| no_colors(headers))?;
    let header = &headers[part];
    if header.deep {
        return Err(Fault::unsupported("header", "deep data").into());
    }
    let mut warnings = Vec::new();
    if headers.len() > 1 {
        let name = header.own_attributes.layer_name.as_ref().map_or_else(String::new, |name| format!(" '{name}'"));
        warnings.push(format!("part {part}{name} of {} is shown", headers.len()));
    }
    if !layer.is_empty() {
        warnings.push(format!("the channels of the layer '{}' are shown", layer.trim_end_matches('.')));
    }
    let n_texels = check_size(header, bytes.len())?;
    headers.iter().try_for_each(|header| check_blocks(header, bytes.len()))?;
    let window = Window::of(header, &mut warnings);

    let mut texels = vec![[0.0f32; 3]; window.width * window.height];
    let mut chunks = reader.filter_chunks(false, |_, tile, block| block.layer == part && tile.is_largest_resolution_level())?;
    let meta = chunks.meta_data().clone();
    let channels = &meta.headers[part].channels;
    let mut n_copied = 0u64;
    while let Some(chunk) = chunks.read_next_chunk() {
        let block = exr::block::UncompressedBlock::decompress_chunk(chunk?, &meta, false)?;
        for line in block.lines(channels) {
            let at = line.location;
            let (Some(&role), Some(channel)) = (roles.get(at.channel), channels.list.get(at.channel)) else { continue };
            let Role::Color(first, last) = role else { continue };
            n_copied += at.sample_count as u64;
            let Some((start, skipped, count)) = window.place(at.position.0, at.position.1, at.sample_count) else { continue };
            let target = start.checked_add(count).and_then(|end| texels.get_mut(start..end));
            let target = target.ok_or_else(|| Fault::invalid("content", "a block lies outside of the picture"))?;
            for (texel, value) in target.iter_mut().zip(samples(channel, line.value).skip(skipped)) {
                texel[first..=last].fill(value);
            }
        }
    }
    let n_channels = roles.iter().filter(|role| matches!(role, Role::Color(..))).count() as u64;
    if n_copied != n_texels * n_channels {
        return Err(Fault::invalid("content", "blocks are missing").into());
    }
    // Both sides are below the cap.
    Ok(Panorama { width: window.width as u32, height: window.height as u32, texels, warnings })
}

/// The number of texels in the data window, after the check that so many may be there.
fn check_size(header: &Header, n_bytes: usize) -> Result<u64, Fault> {
    let (width, height) = (header.layer_size.0, header.layer_size.1);
    let ratio = most_bytes_per_byte(header.compression)?;
    let n_texels = (width as u64).checked_mul(height as u64).filter(|&n| n <= limits::ENVIRONMENT_TEXELS as u64);
    let n_texels = n_texels.ok_or_else(|| {
        Fault::invalid("header", format_args!("{width} x {height} texels are too many (at most {})", limits::ENVIRONMENT_TEXELS))
    })?;
    let needed = n_texels.saturating_mul(header.channels.bytes_per_pixel as u64) / ratio;
    if needed > n_bytes as u64 {
        let what = format!("{n_bytes} bytes cannot hold {width} x {height} texels, that takes {needed} at least");
        return Err(Fault::invalid("header", what));
    }
    Ok(n_texels)
}

/// Refuses blocks that nothing in the file can fill, in any part: the decoder makes room for one before it knows its size.
fn check_blocks(header: &Header, n_bytes: usize) -> Result<(), Fault> {
    /// Honest tiles may be larger than their picture.
    const ANY_FILE: u64 = 16 << 20;
    let (width, height) = match &header.blocks {
        BlockDescription::Tiles(tiles) => (tiles.tile_size.0, tiles.tile_size.1),
        BlockDescription::ScanLines => (header.layer_size.0, header.compression.scan_lines_per_block().min(header.layer_size.1)),
    };
    let size = (width as u64).saturating_mul(height as u64).saturating_mul(header.channels.bytes_per_pixel as u64);
    let most = most_bytes_per_byte(header.compression)?.saturating_mul(n_bytes as u64).max(ANY_FILE);
    if size > most {
        return Err(Fault::invalid("header", format_args!("blocks of {width} x {height} texels are too large for {n_bytes} bytes")));
    }
    Ok(())
}

/// The most bytes that one byte of a file can decode to.
fn most_bytes_per_byte(compression: Compression) -> Result<u64, Fault> {
    Ok(match compression {
        Compression::Uncompressed => 1,
        // Two bytes are a run of 128.
        Compression::RLE => 64,
        // Four bytes out of three, on top of what deflate can do; the Huffman runs of PIZ are shorter.
        Compression::ZIP1 | Compression::ZIP16 | Compression::PXR24 | Compression::PIZ => 1376,
        // Sixteen samples in three bytes, or in fourteen.
        Compression::B44 | Compression::B44A => 11,
        // A block of 64 samples is one word, and words are deflated.
        Compression::DWAA(_) | Compression::DWAB(_) => 1 << 15,
        other => return Err(Fault::unsupported("header", format_args!("the compression {other:?}"))),
    })
}

/// Where the data window lies in the panorama.
#[derive(Debug, PartialEq)]
struct Window {
    width: usize,
    height: usize,
    /// Of the first texel of the data window.
    left: i64,
    top: i64,
}

impl Window {
    /// A display window that is mostly empty is not believed.
    const LARGEST_RATIO: u64 = 16;

    fn of(header: &Header, warnings: &mut Vec<String>) -> Window {
        let (data, display) = (header.layer_size, header.shared_attributes.display_window);
        let area = |width: usize, height: usize| (width as u64).saturating_mul(height as u64);
        let difference = |data: i32, display: i32| i64::from(data) - i64::from(display);
        let position = header.own_attributes.layer_position;
        let whole = Window { width: data.0, height: data.1, left: 0, top: 0 };
        let placed = Window {
            width: display.size.0,
            height: display.size.1,
            left: difference(position.0, display.position.0),
            top: difference(position.1, display.position.1),
        };
        if placed == whole {
            return whole;
        }
        let overlaps = |start: i64, length: usize, total: usize| start < total as i64 && start.saturating_add(length as i64) > 0;
        let seen = overlaps(placed.left, data.0, placed.width) && overlaps(placed.top, data.1, placed.height);
        let texels = area(placed.width, placed.height);
        let believable = texels <= area(data.0, data.1).saturating_mul(Self::LARGEST_RATIO) && texels <= limits::ENVIRONMENT_TEXELS as u64;
        let sizes = format!("{} x {} texels of the display window {} x {}", data.0, data.1, placed.width, placed.height);
        if seen && believable {
            warnings.push(format!("the file has {sizes}, at {}, {}; outside of them it is black", placed.left, placed.top));
            placed
        } else {
            warnings.push(format!("the file has {sizes}, at {}, {}; they are shown as the whole", placed.left, placed.top));
            whole
        }
    }

    /// Where a line of the data window starts in the panorama, how many of its texels lie to the left, and how many inside.
    fn place(&self, x: usize, y: usize, count: usize) -> Option<(usize, usize, usize)> {
        let row = usize::try_from((y as i64).checked_add(self.top)?).ok().filter(|&row| row < self.height)?;
        let column = (x as i64).checked_add(self.left)?;
        let skipped = usize::try_from(column.min(0).unsigned_abs()).ok()?;
        let column = usize::try_from(column.max(0)).ok().filter(|&column| column < self.width)?;
        let count = count.checked_sub(skipped)?.min(self.width - column);
        Some((row.checked_mul(self.width)?.checked_add(column)?, skipped, count)).filter(|_| count > 0)
    }
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

/// Every layer is looked for among all channels, and pictures have a few hundred.
const MOST_CHANNELS: usize = 1000;

/// What is shown of a file.
struct Choice {
    part: usize,
    /// In front of the names of the channels, with its dot; empty when there is none.
    layer: String,
    roles: Vec<Role>,
}

/// The first part with colours and the roles of its channels; names without a layer win over names with one.
fn choose(headers: &[Header]) -> Option<Choice> {
    let mut few_enough = headers.iter().enumerate().filter(|(_, header)| header.channels.list.len() <= MOST_CHANNELS);
    few_enough.find_map(|(part, header)| {
        let names: Vec<String> = header.channels.list.iter().map(|channel| channel.name.to_string()).collect();
        let layers = names.iter().filter_map(|name| name.rfind('.').map(|dot| &name[..=dot]));
        std::iter::once("").chain(layers).find_map(|layer| {
            let roles = roles(&names, layer)?;
            Some(Choice { part, layer: layer.to_owned(), roles })
        })
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
