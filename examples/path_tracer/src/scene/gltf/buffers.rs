//! Bytes of a glTF file: buffers and the views into them.
//!
//! Key decision: all buffers are read up front and kept whole; accessors and images borrow from them.
//!
//! **Invariant:** a slice handed out here lies inside its buffer's declared length and inside the bytes that really exist.

use std::borrow::Cow;
use std::path::Path;

use super::json::Document;
use super::uri;
use crate::error::Fault;

/// The bytes of every buffer, and why some have none.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    /// `None` for a buffer without any source; whoever reads it gets the error.
    bytes: Vec<Option<Cow<'a, [u8]>>>,
}

/// What a buffer view shows.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub(super) bytes: &'a [u8],
    /// `None` when elements are packed.
    pub(super) stride: Option<usize>,
}

impl<'a> Buffers<'a> {
    pub(super) fn read(document: &'a Document, bin: Option<&'a [u8]>, scene: &Path) -> Result<Buffers<'a>, Fault> {
        let mut bytes = Vec::new();
        for (index, buffer) in document.buffers.iter().enumerate() {
            let source = match (&buffer.uri, bin) {
                (Some(uri), _) => Some(Cow::Owned(uri::resolve(uri, scene).map_err(|f| f.within(format_args!("buffer {index}")))?)),
                (None, Some(bin)) if index == 0 => Some(Cow::Borrowed(bin)),
                (None, _) => None,
            };
            if let Some(source) = &source
                && source.len() < buffer.byte_length
            {
                let what = format!("byteLength says {}, there are {} bytes", buffer.byte_length, source.len());
                return Err(Fault::invalid(format_args!("buffer {index}"), what));
            }
            bytes.push(source);
        }
        Ok(Buffers { document, bytes })
    }

    pub(super) fn view(&self, index: usize) -> Result<View<'_>, Fault> {
        let place = || format!("bufferView {index}");
        let view = self.document.buffer_views.get(index).ok_or_else(|| Fault::invalid(place(), "it does not exist"))?;
        let missing = |what: &str| Fault::invalid(place(), format_args!("buffer {} {what}", view.buffer));
        let buffer = self.document.buffers.get(view.buffer).ok_or_else(|| missing("does not exist"))?;
        let bytes = self.bytes.get(view.buffer).and_then(Option::as_deref).ok_or_else(|| missing("has no bytes"))?;
        let bytes = bytes.get(..buffer.byte_length).ok_or_else(|| missing("is too short"))?;
        let bytes = view
            .byte_offset
            .checked_add(view.byte_length)
            .and_then(|end| bytes.get(view.byte_offset..end))
            .ok_or_else(|| missing("is too short for offset and length"))?;
        Ok(View { bytes, stride: view.byte_stride })
    }
}
