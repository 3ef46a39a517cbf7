//! Typed reading of numbers: accessors, packed or strided, sparse or not, of any component type.
//!
//! Key decision: one generic reader that widens everything to `f32` (or `u32` for indices). Quantized meshes, normalized colours and
//! sparse accessors then need no code of their own.
//!
//! **Invariant:** nothing is allocated before the bytes that fill it were found; accessors without bytes are capped.

use super::super::limits;
use super::buffers::{Buffers, View};
use super::json::{Accessor, Document};
use crate::error::Fault;

/// The numbers of an accessor, one element after the other.
pub(super) struct Table {
    /// Numbers in an element.
    pub(super) width: usize,
    pub(super) values: Vec<f32>,
}

impl Table {
    pub(super) fn len(&self) -> usize {
        self.values.len() / self.width
    }

    /// One element as an array; numbers that it lacks, or all when it does not exist, are taken from `fill`.
    pub(super) fn row<const N: usize>(&self, index: usize, fill: [f32; N]) -> [f32; N] {
        let element = self.values.chunks_exact(self.width).nth(index).unwrap_or_default();
        let mut row = fill;
        for (to, from) in row.iter_mut().zip(element) {
            *to = *from;
        }
        row
    }

    /// The elements as arrays; numbers that an element lacks are taken from `fill`.
    pub(super) fn rows<const N: usize>(&self, fill: [f32; N]) -> impl Iterator<Item = [f32; N]> + '_ {
        (0..self.len()).map(move |index| self.row(index, fill))
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u32) -> Result<Component, Fault> {
        Ok(match code {
            5120 => Component::I8,
            5121 => Component::U8,
            5122 => Component::I16,
            5123 => Component::U16,
            5125 => Component::U32,
            5126 => Component::F32,
            _ => return Err(Fault::invalid("componentType", format_args!("{code} is unknown"))),
        })
    }

    fn size(self) -> usize {
        match self {
            Component::I8 | Component::U8 => 1,
            Component::I16 | Component::U16 => 2,
            Component::U32 | Component::F32 => 4,
        }
    }

    /// The number at the start of `bytes`, or zero where there are too few.
    fn read(self, bytes: &[u8], normalized: bool) -> f32 {
        let two = || bytes.first_chunk().copied().unwrap_or_default();
        let four = || bytes.first_chunk().copied().unwrap_or_default();
        let one = || bytes.first().copied().unwrap_or_default();
        let (value, largest) = match self {
            Component::I8 => (f32::from(one().cast_signed()), 127.0),
            Component::U8 => (f32::from(one()), 255.0),
            Component::I16 => (f32::from(i16::from_le_bytes(two())), 32767.0),
            Component::U16 => (f32::from(u16::from_le_bytes(two())), 65535.0),
            Component::U32 => (u32::from_le_bytes(four()) as f32, u32::MAX as f32),
            Component::F32 => return f32::from_le_bytes(four()),
        };
        // The most negative integer has no positive twin; the format maps both it and the next one to -1.
        if normalized { (value / largest).max(-1.0) } else { value }
    }

    fn read_index(self, bytes: &[u8]) -> u32 {
        match self {
            Component::U8 | Component::I8 => bytes.first().copied().unwrap_or_default().into(),
            Component::U16 | Component::I16 => u16::from_le_bytes(bytes.first_chunk().copied().unwrap_or_default()).into(),
            Component::U32 | Component::F32 => u32::from_le_bytes(bytes.first_chunk().copied().unwrap_or_default()),
        }
    }
}

/// The accessors of a document.
pub(super) struct Accessors<'a> {
    pub(super) document: &'a Document,
    pub(super) buffers: &'a Buffers<'a>,
}

impl<'a> Accessors<'a> {
    fn get(&self, index: usize) -> Result<&'a Accessor, Fault> {
        let missing = || Fault::invalid(format_args!("accessor {index}"), "it does not exist");
        self.document.accessors.get(index).ok_or_else(missing)
    }

    /// False when all elements are zero because no data is there.
    pub(super) fn has_bytes(&self, index: usize) -> Result<bool, Fault> {
        self.get(index).map(|accessor| accessor.buffer_view.is_some() || accessor.sparse.is_some())
    }

    /// How many elements the accessor says it has.
    pub(super) fn count(&self, index: usize) -> Result<usize, Fault> {
        self.get(index).map(|accessor| accessor.count)
    }

    /// Reads vectors, or matrices column by column, whose width is one of `widths`.
    pub(super) fn table(&self, index: usize, widths: &[usize]) -> Result<Table, Fault> {
        let accessor = self.get(index)?;
        self.read_table(accessor, widths).map_err(|f| f.within(format_args!("accessor {index}")))
    }

    fn read_table(&self, accessor: &Accessor, widths: &[usize]) -> Result<Table, Fault> {
        let width = match accessor.shape.as_str() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            _ => 0,
        };
        if !widths.contains(&width) {
            return Err(Fault::invalid("type", format_args!("'{}' does not fit here", accessor.shape)));
        }
        let component = Component::of(accessor.component_type)?;
        if component == Component::U32 {
            return Err(Fault::invalid("componentType", "32-bit integers do not fit here"));
        }
        let element = width * component.size();
        let mut values = match accessor.buffer_view {
            Some(view) => {
                let elements = elements(self.buffers.view(view)?, accessor.byte_offset, element, accessor.count)?;
                let number = |bytes: &[u8]| component.read(bytes, accessor.normalized);
                elements.flat_map(|bytes| bytes.chunks_exact(component.size())).map(number).collect()
            }
            None => vec![0.0; implied(accessor)? * width],
        };
        self.replace(accessor, element, &mut values, width, |row, bytes| {
            for (to, from) in row.iter_mut().zip(bytes.chunks_exact(component.size())) {
                *to = component.read(from, accessor.normalized);
            }
        })?;
        Ok(Table { width, values })
    }

    /// Replaces the elements that the sparse part of an accessor names: `read` fills one of `width` values from `size` bytes.
    fn replace<T>(
        &self,
        accessor: &Accessor,
        size: usize,
        values: &mut [T],
        width: usize,
        read: impl Fn(&mut [T], &[u8]),
    ) -> Result<(), Fault> {
        let Some(sparse) = &accessor.sparse else { return Ok(()) };
        let place = |f: Fault| f.within("sparse");
        let indices = self.buffers.view(sparse.indices.buffer_view).map_err(place)?;
        let new_values = self.buffers.view(sparse.values.buffer_view).map_err(place)?;
        let index_type = Component::of(sparse.indices.component_type).map_err(place)?;
        let indices = elements(indices, sparse.indices.byte_offset, index_type.size(), sparse.count).map_err(place)?;
        let new_values = elements(new_values, sparse.values.byte_offset, size, sparse.count).map_err(place)?;
        for (index, bytes) in indices.map(|bytes| index_type.read_index(bytes)).zip(new_values) {
            let row = (index as usize).checked_mul(width).and_then(|at| values.get_mut(at..)?.get_mut(..width));
            read(row.ok_or_else(|| Fault::invalid("sparse", format_args!("index {index} is out of range")))?, bytes);
        }
        Ok(())
    }

    /// Reads vertex indices. They are not compared with the number of vertices here.
    pub(super) fn indices(&self, index: usize) -> Result<Vec<u32>, Fault> {
        let accessor = self.get(index)?;
        let read = || {
            if accessor.shape != "SCALAR" {
                return Err(Fault::invalid("type", format_args!("'{}' does not fit here", accessor.shape)));
            }
            let component = Component::of(accessor.component_type)?;
            if !matches!(component, Component::U8 | Component::U16 | Component::U32) {
                return Err(Fault::invalid("componentType", "indices are unsigned integers"));
            }
            let mut values: Vec<u32> = match accessor.buffer_view {
                Some(view) => {
                    let elements = elements(self.buffers.view(view)?, accessor.byte_offset, component.size(), accessor.count)?;
                    elements.map(|bytes| component.read_index(bytes)).collect()
                }
                None => vec![0; implied(accessor)?],
            };
            self.replace(accessor, component.size(), &mut values, 1, |row, bytes| {
                row.iter_mut().for_each(|value| *value = component.read_index(bytes));
            })?;
            Ok(values)
        };
        read().map_err(|f: Fault| f.within(format_args!("accessor {index}")))
    }
}

/// The number of elements of an accessor without bytes, which are all zero.
fn implied(accessor: &Accessor) -> Result<usize, Fault> {
    match accessor.count > limits::IMPLIED_ELEMENTS {
        true => Err(Fault::invalid("count", format_args!("{} elements without data are too many", accessor.count))),
        false => Ok(accessor.count),
    }
}

/// `count` slices of `size` bytes, after the check that the last of them still lies inside the view.
fn elements(view: View<'_>, offset: usize, size: usize, count: usize) -> Result<impl Iterator<Item = &[u8]>, Fault> {
    let stride = view.stride.unwrap_or(size);
    if stride < size {
        return Err(Fault::invalid("byteStride", format_args!("{stride} is less than the {size} bytes of an element")));
    }
    let needed = match count {
        0 => Some(0),
        _ => (count - 1).checked_mul(stride).and_then(|bytes| bytes.checked_add(size)),
    };
    let bytes = needed.and_then(|needed| view.bytes.get(offset..)?.get(..needed)).ok_or_else(|| {
        Fault::invalid("count", format_args!("{count} elements do not fit into the {} bytes of the bufferView", view.bytes.len()))
    })?;
    // The last element may be shorter than the stride, so the chunks are cut to the size afterwards.
    Ok(bytes.chunks(stride).map(move |chunk| chunk.get(..size).unwrap_or(chunk)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(bytes: &[u8], stride: Option<usize>) -> View<'_> {
        View { bytes, stride }
    }

    // Kills: requiring a whole stride for the last element, and reading one element too many.
    #[test]
    fn the_last_element_may_be_shorter_than_the_stride() {
        let bytes: Vec<u8> = (0..10).collect();
        let found: Vec<&[u8]> = elements(view(&bytes, Some(4)), 0, 2, 3).unwrap().collect();
        assert_eq!(found, [&bytes[0..2], &bytes[4..6], &bytes[8..10]]);
        assert!(elements(view(&bytes, Some(4)), 1, 2, 3).is_err());
        assert!(elements(view(&bytes, Some(1)), 0, 2, 3).is_err(), "a stride that makes elements overlap");
    }

    // Kills: overflow in the product of count and stride, which would panic or wrap to a small number.
    #[test]
    fn huge_counts_are_refused() {
        for count in [11, usize::MAX / 4, usize::MAX / 2 + 2, usize::MAX] {
            assert!(elements(view(&[0; 10], None), 0, 1, count).is_err(), "{count}");
            assert!(elements(view(&[0; 10], Some(4)), 0, 4, count).is_err(), "{count}");
        }
        assert!(elements(view(&[0; 10], None), usize::MAX, 1, 1).is_err());
        assert_eq!(elements(view(&[0; 10], None), 10, 4, 0).unwrap().count(), 0);
    }

    // Kills: -128 that becomes less than -1, a division by 256, and big-endian reading.
    #[test]
    fn integers_are_normalized_as_the_format_says() {
        assert_eq!(Component::I8.read(&[0x80], true), -1.0);
        assert_eq!(Component::I8.read(&[0x81], true), -1.0);
        assert_eq!(Component::U8.read(&[255], true), 1.0);
        assert_eq!(Component::U16.read(&[0xFF, 0xFF], true), 1.0);
        assert_eq!(Component::I16.read(&[0xFE, 0xFF], false), -2.0);
    }
}
