//! The binary chunk: accessors and images in buffer views, each beginning at a multiple of 4 bytes.

use serde_json::{Value, json};

use super::json::numbers;
use crate::export::ExportError;

/// The length of a GLB is a number of 32 bits.
pub(super) const MAX_GLB: u64 = u32::MAX as u64;

const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// The bytes, and the JSON that says what lies where.
#[derive(Debug)]
pub(super) struct Buffer {
    pub(super) bytes: Vec<u8>,
    pub(super) views: Vec<Value>,
    pub(super) accessors: Vec<Value>,
    limit: u64,
}

impl Buffer {
    /// An empty one that holds at most `limit` bytes.
    pub(super) fn new(limit: u64) -> Self {
        Self { bytes: Vec::new(), views: Vec::new(), accessors: Vec::new(), limit }
    }

    /// The view of `data`, for what `target` says if it is a vertex or index buffer.
    fn view(&mut self, data: &[u8], target: Option<u32>) -> Result<usize, ExportError> {
        let offset = self.bytes.len().next_multiple_of(4);
        let needed = offset as u64 + data.len() as u64;
        if needed > self.limit {
            return Err(ExportError::GlbSize { needed, limit: self.limit });
        }
        self.bytes.resize(offset, 0);
        self.bytes.extend_from_slice(data);
        let mut view = json!({"buffer": 0, "byteOffset": offset, "byteLength": data.len()});
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.views.push(view);
        Ok(self.views.len() - 1)
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// The accessor of vectors of N floats, bit for bit.
    pub(super) fn vectors<const N: usize>(
        &mut self,
        values: impl Iterator<Item = [f32; N]>,
    ) -> Result<usize, ExportError> {
        let data: Vec<u8> = values.flatten().flat_map(f32::to_le_bytes).collect();
        let view = self.view(&data, Some(ARRAY_BUFFER))?;
        let count = data.len() / (4 * N);
        let kind = format!("VEC{N}");
        Ok(self.accessor(json!({"bufferView": view, "componentType": FLOAT, "count": count, "type": kind})))
    }

    /// The accessor of positions, with the box around them as the specification asks.
    pub(super) fn positions(&mut self, positions: &[glam::Vec3]) -> Result<usize, ExportError> {
        let index = self.vectors(positions.iter().map(|p| p.to_array()))?;
        let first = positions.first().copied().unwrap_or_default();
        let (low, high) = positions.iter().fold((first, first), |(l, h), &p| (l.min(p), h.max(p)));
        self.accessors[index]["min"] = numbers(&low.to_array());
        self.accessors[index]["max"] = numbers(&high.to_array());
        Ok(index)
    }

    /// The accessor of triangles' corners, of 16 bits where that is enough for `vertices`: the largest number is not an index.
    pub(super) fn triangles(
        &mut self,
        triangles: &[[u32; 3]],
        vertices: usize,
    ) -> Result<usize, ExportError> {
        let corners = triangles.iter().flatten();
        let (kind, data): (u32, Vec<u8>) = if vertices <= usize::from(u16::MAX) {
            (UNSIGNED_SHORT, corners.flat_map(|&i| (i as u16).to_le_bytes()).collect())
        } else {
            (UNSIGNED_INT, corners.flat_map(|i| i.to_le_bytes()).collect())
        };
        let view = self.view(&data, Some(ELEMENT_ARRAY_BUFFER))?;
        let count = triangles.len() * 3;
        Ok(self
            .accessor(json!({"bufferView": view, "componentType": kind, "count": count, "type": "SCALAR"})))
    }

    /// The accessor of `count` pairs of zeros, which takes no bytes.
    pub(super) fn zeros(&mut self, count: usize) -> usize {
        self.accessor(json!({"componentType": FLOAT, "count": count, "type": "VEC2"}))
    }

    /// The view of an image file.
    pub(super) fn image(&mut self, file: &[u8]) -> Result<usize, ExportError> {
        self.view(file, None)
    }
}

/// A GLB of these chunks.
///
/// # Errors
/// If it is longer than [`MAX_GLB`].
pub(super) fn glb(json: &Value, binary: &[u8]) -> Result<Vec<u8>, ExportError> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let padded = binary.len().next_multiple_of(4);
    let needed = 12 + 8 + text.len() as u64 + 8 + padded as u64;
    let length = u32::try_from(needed).map_err(|_| ExportError::GlbSize { needed, limit: MAX_GLB })?;
    let mut file = Vec::with_capacity(length as usize);
    file.extend_from_slice(b"glTF");
    file.extend_from_slice(&2u32.to_le_bytes());
    file.extend_from_slice(&length.to_le_bytes());
    // Both are parts of the length, which fits.
    file.extend_from_slice(&(text.len() as u32).to_le_bytes());
    file.extend_from_slice(b"JSON");
    file.extend_from_slice(&text);
    file.extend_from_slice(&(padded as u32).to_le_bytes());
    file.extend_from_slice(b"BIN\0");
    file.extend_from_slice(binary);
    file.resize(length as usize, 0);
    Ok(file)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn views_are_aligned_and_indices_are_as_wide_as_they_must_be() {
        let mut buffer = Buffer::new(MAX_GLB);
        buffer.image(&[7]).unwrap();
        buffer.positions(&[Vec3::new(0.1, -2.0, 3.0), Vec3::ZERO]).unwrap();
        for vertices in [65_535, 65_536] {
            buffer.triangles(&[[0, 1, 65_534]], vertices).unwrap();
        }
        let of = |list: &[Value], key: &str| list.iter().map(|v| v[key].clone()).collect::<Vec<_>>();
        assert_eq!(of(&buffer.views, "byteOffset"), [0, 4, 28, 36]);
        assert_eq!(of(&buffer.accessors, "componentType"), [5126, 5123, 5125]);
        assert_eq!(buffer.accessors[0]["min"].to_string(), "[0.0,-2.0,0.0]");
        assert_eq!(buffer.accessors[0]["max"].to_string(), "[0.1,0.0,3.0]");
    }

    #[test]
    fn what_does_not_fit_is_an_error_before_it_is_written() {
        let mut buffer = Buffer::new(30);
        buffer.positions(&[Vec3::ONE; 2]).unwrap();
        let error = buffer.positions(&[Vec3::ONE]).unwrap_err();
        assert!(matches!(error, ExportError::GlbSize { needed: 36, limit: 30 }), "{error}");
        assert_eq!((buffer.bytes.len(), buffer.views.len()), (24, 1));
    }

    #[test]
    fn a_glb_has_padded_chunks() {
        let file = glb(&json!({"a": 1}), &[1, 2, 3, 4, 5]).unwrap();
        assert_eq!(file.len(), 12 + 8 + 8 + 8 + 8);
        assert_eq!(&file[20..28], b"{\"a\":1} ");
        assert_eq!(&file[28..], [8, 0, 0, 0, b'B', b'I', b'N', 0, 1, 2, 3, 4, 5, 0, 0, 0]);
    }
}
