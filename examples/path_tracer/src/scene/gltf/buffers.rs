//! Bytes of a glTF file: buffers and the views into them.
//!
//! Key decision: all buffers are read up front and kept whole; accessors and images borrow from them. A compressed view is decoded at
//! its first use and kept.
//!
//! **Invariant:** a slice handed out here lies inside its buffer's declared length and inside the bytes that really exist.

use std::borrow::Cow;
use std::cell::{Cell, OnceCell};
use std::path::Path;

use super::json::Document;
use super::meshopt::{self, Source};
use super::uri;
use crate::error::Fault;

/// The bytes of every buffer, and why some have none.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    /// `None` for a buffer without any source; whoever reads it gets the error.
    bytes: Vec<Option<Cow<'a, [u8]>>>,
    /// What compressed views hold, for each view of the document.
    decoded: Vec<OnceCell<Result<Vec<u8>, Fault>>>,
    /// Bytes that may still be decoded.
    left_to_decode: Cell<usize>,
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
        let decoded = vec![OnceCell::new(); document.buffer_views.len()];
        Ok(Buffers { document, bytes, decoded, left_to_decode: Cell::new(meshopt::DECODED_BYTES) })
    }

    pub(super) fn view(&self, index: usize) -> Result<View<'_>, Fault> {
        let place = || format!("bufferView {index}");
        let missing = || Fault::invalid(place(), "it does not exist");
        let view = self.document.buffer_views.get(index).ok_or_else(missing)?;
        let bytes = match meshopt::source(view).map_err(|f| f.within(place()))? {
            None => self.slice(view.buffer, view.byte_offset, view.byte_length).map_err(|what| Fault::invalid(place(), what))?,
            Some(source) => match self.decoded.get(index).ok_or_else(missing)?.get_or_init(|| self.decode(&source)) {
                Ok(bytes) => bytes,
                Err(fault) => return Err(fault.clone().within(place())),
            },
        };
        Ok(View { bytes, stride: view.byte_stride })
    }

    fn decode(&self, source: &Source) -> Result<Vec<u8>, Fault> {
        let too_many = || Fault::unsupported("meshopt", "a file with so many compressed bytes");
        let left = source.n_bytes().and_then(|n_bytes| self.left_to_decode.get().checked_sub(n_bytes)).ok_or_else(too_many)?;
        let bytes = self.slice(source.buffer, source.byte_offset, source.byte_length).map_err(|what| Fault::invalid("meshopt", what))?;
        let decoded = source.decode(bytes)?;
        self.left_to_decode.set(left);
        Ok(decoded)
    }

    /// A part of a buffer, or why it does not exist.
    fn slice(&self, index: usize, offset: usize, length: usize) -> Result<&[u8], String> {
        let missing = |what: &str| format!("buffer {index} {what}");
        let buffer = self.document.buffers.get(index).ok_or_else(|| missing("does not exist"))?;
        let bytes = self.bytes.get(index).and_then(Option::as_deref).ok_or_else(|| missing("has no bytes"))?;
        let bytes = bytes.get(..buffer.byte_length).ok_or_else(|| missing("is too short"))?;
        let part = offset.checked_add(length).and_then(|end| bytes.get(offset..end));
        part.ok_or_else(|| missing("is too short for offset and length"))
    }
}
