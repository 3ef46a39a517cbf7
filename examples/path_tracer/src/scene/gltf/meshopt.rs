//! EXT_meshopt_compression and KHR_meshopt_compression: buffer views that are compressed on their own.
//!
//! Key decision: a view is decoded when something that is shown looks into it, and kept. The decoder is the `meshoptimizer-rs` crate, a
//! port in Rust; what it makes has the layout that the view declares, so accessors do not know of the compression.
//!
//! **Invariant:** the size of the result is compared with what is left of a budget before the decoder is called, and the decoder compares
//! it with the compressed bytes before it allocates.

use meshoptimizer_rs::Workspace;
use meshoptimizer_rs::codec::{
    decode_filter_color, decode_filter_exp, decode_filter_oct, decode_filter_quat, decode_index_buffer, decode_index_sequence,
    decode_vertex_buffer,
};
use serde::Deserialize;

use super::super::guard::guarded;
use super::json::{BufferView, extension};
use crate::error::Fault;

/// Bytes of all decoded views of a file together.
pub(super) const DECODED_BYTES: usize = 1 << 30;

/// What a compressed view says about itself.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Source {
    pub(super) buffer: usize,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) byte_length: usize,
    byte_stride: usize,
    count: usize,
    mode: String,
    filter: Option<String>,
}

/// `None` for a view that is not compressed.
pub(super) fn source(view: &BufferView) -> Result<Option<Source>, Fault> {
    for name in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        if let Some(source) = extension(&view.extensions, name)? {
            return Ok(Some(source));
        }
    }
    Ok(None)
}

impl Source {
    /// Bytes of the result; `None` when no computer could hold them.
    pub(super) fn n_bytes(&self) -> Option<usize> {
        self.count.checked_mul(self.byte_stride)
    }

    /// Decodes `bytes`, the part of the buffer that the source names.
    pub(super) fn decode(&self, bytes: &[u8]) -> Result<Vec<u8>, Fault> {
        let (count, stride) = (self.count, self.byte_stride);
        let filter = match self.filter.as_deref() {
            None | Some("NONE") => None,
            Some(name @ ("OCTAHEDRAL" | "QUATERNION" | "EXPONENTIAL" | "COLOR")) if self.mode == "ATTRIBUTES" => Some(name),
            Some(name) => return Err(Fault::invalid("filter", format_args!("'{name}' does not fit the mode '{}'", self.mode))),
        };
        if !matches!(self.mode.as_str(), "ATTRIBUTES" | "TRIANGLES" | "INDICES") {
            return Err(Fault::invalid("mode", format_args!("'{}' is unknown", self.mode)));
        }
        guarded(|| {
            let mut workspace = Workspace::default();
            let mut decoded = match self.mode.as_str() {
                "TRIANGLES" => decode_index_buffer(count, stride, bytes, &mut workspace),
                "INDICES" => decode_index_sequence(count, stride, bytes, &mut workspace),
                _ => decode_vertex_buffer(count, stride, bytes, &mut workspace),
            }
            .map_err(|e| e.to_string())?;
            match filter {
                Some("OCTAHEDRAL") => decode_filter_oct(&mut decoded, count, stride, &mut workspace),
                Some("QUATERNION") => decode_filter_quat(&mut decoded, count, stride, &mut workspace),
                Some("EXPONENTIAL") => decode_filter_exp(&mut decoded, count, stride, &mut workspace),
                Some(_) => decode_filter_color(&mut decoded, count, stride, &mut workspace),
                None => Ok(()),
            }
            .map_err(|e| e.to_string())?;
            Ok(decoded)
        })
        .map_err(|what| Fault::invalid("meshopt", what))
    }
}

#[cfg(test)]
mod tests {
    use meshoptimizer_rs::codec::{
        ExpMode, VertexEncoding, encode_filter_color, encode_filter_exp, encode_filter_quat, encode_vertex_buffer,
    };

    use super::*;

    fn decoded(filtered: &[u8], stride: usize, filter: &str) -> Vec<u8> {
        let count = filtered.len() / stride;
        let bytes = encode_vertex_buffer(filtered, count, stride, VertexEncoding::DEFAULT, &mut Workspace::default()).unwrap();
        let (mode, filter) = (String::from("ATTRIBUTES"), Some(String::from(filter)));
        let source = Source { buffer: 0, byte_offset: 0, byte_length: bytes.len(), byte_stride: stride, count, mode, filter };
        source.decode(&bytes).unwrap()
    }

    // Kills: one filter taken for another; octahedral normals are tested with whole files.
    #[test]
    fn every_filter_is_undone_by_its_own_decoder() {
        let mut workspace = Workspace::default();
        let vectors = [1.5f32, -0.25, 1000.0, 0.0, 3.0e-3, -7.0];
        let bytes = decoded(&encode_filter_exp(2, 12, 15, &vectors, ExpMode::Separate, &mut workspace).unwrap(), 12, "EXPONENTIAL");
        let (numbers, _) = bytes.as_chunks::<4>();
        for (number, expected) in numbers.iter().map(|number| f32::from_le_bytes(*number)).zip(vectors) {
            assert!((number - expected).abs() <= expected.abs() * 1e-3, "{number} {expected}");
        }
        let turn = [0.5f32, -0.5, 0.5, 0.5];
        let bytes = decoded(&encode_filter_quat(1, 8, 16, &turn, &mut workspace).unwrap(), 8, "QUATERNION");
        let (numbers, _) = bytes.as_chunks::<2>();
        let found: Vec<f32> = numbers.iter().map(|number| f32::from(i16::from_le_bytes(*number)) / 32767.0).collect();
        let dot: f32 = found.iter().zip(turn).map(|(a, b)| a * b).sum();
        assert!((dot.abs() - 1.0).abs() < 1e-3, "{found:?}");
        let colors = [1.0f32, 0.0, 0.25, 1.0, 0.5, 0.75, 0.0, 0.5];
        let bytes = decoded(&encode_filter_color(2, 4, 8, &colors, &mut workspace).unwrap(), 4, "COLOR");
        for (byte, expected) in bytes.iter().zip(colors) {
            assert!((f32::from(*byte) / 255.0 - expected).abs() < 0.02, "{byte} {expected}");
        }
    }

    // Kills: a filter of vertices applied to indices, and a name that is passed over.
    #[test]
    fn filters_fit_their_modes() {
        for (mode, filter) in [("TRIANGLES", "OCTAHEDRAL"), ("ATTRIBUTES", "CUBIC"), ("INDICES", "EXPONENTIAL")] {
            let (mode, filter) = (String::from(mode), Some(String::from(filter)));
            let source = Source { buffer: 0, byte_offset: 0, byte_length: 0, byte_stride: 4, count: 3, mode, filter };
            assert!(source.decode(&[]).unwrap_err().in_named("x").to_string().contains("does not fit the mode"));
        }
    }
}
