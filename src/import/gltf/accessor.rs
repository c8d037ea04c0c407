//! Reading accessors: every component type, normalised integers, strides and sparse substitution. Nothing is allocated before the
//! bytes are known to be there.

use std::cell::Cell;

use gltf::json::Root;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::validation::Checked;

use super::buffers::{Buffers, lookup};
use super::error::GltfError;

/// The most elements that may be read from a file, all accessors and every reading of them together.
const MAX_ELEMENTS: u64 = 1 << 31;
/// As many however small the file is, and as many more for each byte in buffers: many primitives may share one large array of
/// vertices.
const FREE_ELEMENTS: u64 = 1 << 22;
const ELEMENTS_PER_BYTE: u64 = 128;
/// The most elements of an accessor that lies in no buffer (all zeros, apart from sparse values), however small the file is; and
/// how many more for each byte in buffers. What such an accessor goes with, such as positions, has its bytes there, compressed perhaps.
const FREE_ZEROS: u64 = 1 << 16;
const ZEROS_PER_BYTE: u64 = 16;

/// Reads a file's accessors.
pub(super) struct Accessors<'a> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    read: Cell<u64>,
}

/// Where the elements of an accessor lie, checked.
struct Layout<'a> {
    bytes: &'a [u8],
    stride: usize,
    component: ComponentType,
    count: usize,
}

impl<'a> Accessors<'a> {
    /// The accessors of `root`, whose bytes lie in `buffers`.
    pub(super) fn new(root: &'a Root, buffers: &'a Buffers<'a>) -> Self {
        Self { root, buffers, read: Cell::new(0) }
    }

    /// The number of components of `accessors[index]`, which `element` refers to.
    pub(super) fn components(&self, index: usize, element: &str) -> Result<usize, GltfError> {
        let accessor = lookup(&self.root.accessors, index, element, "accessors")?;
        Ok(type_of(accessor, index)?.multiplicity())
    }

    /// The number of elements that `accessors[index]` says it has; 0 if it isn't there.
    pub(super) fn count(&self, index: usize) -> usize {
        self.root.accessors.get(index).map_or(0, |a| usize::try_from(a.count.0).unwrap_or(usize::MAX))
    }

    /// `accessors[index]` as vectors of N floats, which `element` asks for. Normalised integers become [0, 1] or [-1, 1].
    pub(super) fn floats<const N: usize>(
        &self,
        index: usize,
        element: &str,
    ) -> Result<Vec<[f32; N]>, GltfError> {
        let (accessor, component) = self.open(index, element, N, "SCALAR or VECn of the attribute's size")?;
        if component == ComponentType::U32 {
            return Err(invalid(index, "componentType", "anything but 5125 (UNSIGNED_INT) in an attribute"));
        }
        let decode = |layout: &Layout, i: usize| {
            std::array::from_fn(|c| {
                let at = i * layout.stride + c * layout.component.size();
                decode(layout.component, accessor.normalized, &layout.bytes[at..])
            })
        };
        self.read_elements(accessor, index, component, N, [0.0; N], decode)
    }

    /// `accessors[index]` as unsigned integers, which `element` asks for.
    pub(super) fn indices(&self, index: usize, element: &str) -> Result<Vec<u32>, GltfError> {
        let (accessor, component) = self.open(index, element, 1, "SCALAR")?;
        check_index_type(component, &format!("accessors[{index}]"))?;
        let decode =
            |layout: &Layout, i: usize| unsigned(layout.component, &layout.bytes[i * layout.stride..]);
        self.read_elements(accessor, index, component, 1, 0, decode)
    }

    fn open(
        &self,
        index: usize,
        element: &str,
        components: usize,
        expected: &'static str,
    ) -> Result<(&'a Accessor, ComponentType), GltfError> {
        let accessor = lookup(&self.root.accessors, index, element, "accessors")?;
        if type_of(accessor, index)?.multiplicity() != components {
            return Err(invalid(index, "type", expected));
        }
        let Checked::Valid(component) = accessor.component_type else {
            return Err(invalid(index, "componentType", "5120, 5121, 5122, 5123, 5125 or 5126"));
        };
        Ok((accessor, component.0))
    }

    /// All elements by `decode`, zeros where there is no buffer view, sparse values in their places.
    fn read_elements<T: Copy>(
        &self,
        accessor: &Accessor,
        index: usize,
        component: ComponentType,
        components: usize,
        zero: T,
        decode: impl Fn(&Layout, usize) -> T,
    ) -> Result<Vec<T>, GltfError> {
        let name = format!("accessors[{index}]");
        let count = accessor.count.0;
        if count > MAX_ELEMENTS {
            return Err(GltfError::TooMany { what: "elements of accessors", limit: MAX_ELEMENTS });
        }
        let size = component.size() * components;
        let mut elements = match accessor.buffer_view {
            Some(view) => {
                let offset = accessor.byte_offset.unwrap_or_default().0;
                let layout = self.layout(&name, view.value(), offset, count, component, size)?;
                self.charge(count)?;
                (0..layout.count).map(|i| decode(&layout, i)).collect()
            }
            None if count > self.max_zeros() => {
                let what = "elements in an accessor without a bufferView";
                return Err(GltfError::TooMany { what, limit: self.max_zeros() });
            }
            None => {
                self.charge(count)?;
                vec![zero; count as usize]
            }
        };
        if let Some(sparse) = &accessor.sparse {
            let name = format!("{name}.sparse");
            if sparse.count.0 > count {
                return Err(GltfError::Invalid {
                    element: name,
                    property: "count",
                    expected: "at most the accessor's own",
                });
            }
            let Checked::Valid(kind) = sparse.indices.component_type else {
                let expected = "5121, 5123 or 5125";
                return Err(GltfError::Invalid {
                    element: name,
                    property: "indices.componentType",
                    expected,
                });
            };
            check_index_type(kind.0, &name)?;
            let at = &sparse.indices;
            let indices = self.layout(
                &name,
                at.buffer_view.value(),
                at.byte_offset.0,
                sparse.count.0,
                kind.0,
                kind.0.size(),
            )?;
            let at = &sparse.values;
            let values = self.layout(
                &name,
                at.buffer_view.value(),
                at.byte_offset.0,
                sparse.count.0,
                component,
                size,
            )?;
            for i in 0..indices.count {
                let target = unsigned(indices.component, &indices.bytes[i * indices.stride..]);
                let place = elements.get_mut(target as usize);
                let place = place.ok_or_else(|| GltfError::VertexIndex {
                    element: name.clone(),
                    index: target,
                    count,
                })?;
                *place = decode(&values, i);
            }
        }
        Ok(elements)
    }

    /// Where `count` elements of `size` bytes lie that begin `offset` bytes into `bufferViews[view]`.
    fn layout(
        &self,
        name: &str,
        view: usize,
        offset: u64,
        count: u64,
        component: ComponentType,
        size: usize,
    ) -> Result<Layout<'a>, GltfError> {
        let (bytes, json) = self.buffers.view(self.root, view, name)?;
        let stride = json.byte_stride.map_or(size, |stride| stride.0);
        if stride < size {
            return Err(GltfError::Invalid {
                element: format!("bufferViews[{view}]"),
                property: "byteStride",
                expected: "at least the size of an element",
            });
        }
        let needed = match count {
            0 => 0,
            _ => u128::from(offset) + u128::from(count - 1) * stride as u128 + size as u128,
        };
        if needed > bytes.len() as u128 {
            return Err(GltfError::Bytes {
                element: name.to_owned(),
                container: format!("bufferViews[{view}]"),
                needed,
                available: bytes.len() as u64,
            });
        }
        let bytes = if count == 0 { &[][..] } else { &bytes[offset as usize..] };
        Ok(Layout { bytes, stride, component, count: count as usize })
    }

    /// The most elements of an accessor that lies in no buffer.
    fn max_zeros(&self) -> u64 {
        FREE_ZEROS.saturating_add(ZEROS_PER_BYTE.saturating_mul(self.buffers.stored()))
    }

    /// Counts what is read: a small file may ask for the same elements again and again.
    fn charge(&self, elements: u64) -> Result<(), GltfError> {
        self.read.set(self.read.get().saturating_add(elements));
        let limit = FREE_ELEMENTS.saturating_add(ELEMENTS_PER_BYTE.saturating_mul(self.buffers.stored()));
        let limit = limit.min(MAX_ELEMENTS);
        if self.read.get() > limit {
            return Err(GltfError::TooMany { what: "elements of accessors", limit });
        }
        Ok(())
    }
}

fn invalid(index: usize, property: &'static str, expected: &'static str) -> GltfError {
    GltfError::Invalid { element: format!("accessors[{index}]"), property, expected }
}

fn type_of(accessor: &Accessor, index: usize) -> Result<Type, GltfError> {
    match accessor.type_ {
        Checked::Valid(kind) => Ok(kind),
        Checked::Invalid => Err(invalid(index, "type", "SCALAR, VEC2, VEC3, VEC4, MAT2, MAT3 or MAT4")),
    }
}

fn check_index_type(component: ComponentType, element: &str) -> Result<(), GltfError> {
    match component {
        ComponentType::U8 | ComponentType::U16 | ComponentType::U32 => Ok(()),
        ComponentType::I8 | ComponentType::I16 | ComponentType::F32 => Err(GltfError::Invalid {
            element: element.to_owned(),
            property: "componentType",
            expected: "5121, 5123 or 5125 for indices",
        }),
    }
}

/// The first N of `bytes`; the layout was checked, so they are there.
fn first<const N: usize>(bytes: &[u8]) -> [u8; N] {
    std::array::from_fn(|i| bytes[i])
}

/// The float at the beginning of `bytes`. Normalised integers by glTF 2.0, 3.6.2.2: c/max, and max(c/max, -1) for signed ones.
fn decode(component: ComponentType, normalized: bool, bytes: &[u8]) -> f32 {
    let (value, max) = match component {
        ComponentType::F32 => return f32::from_le_bytes(first(bytes)),
        ComponentType::U8 => (f32::from(bytes[0]), 255.0),
        ComponentType::I8 => (f32::from(bytes[0] as i8), 127.0),
        ComponentType::U16 => (f32::from(u16::from_le_bytes(first(bytes))), 65535.0),
        ComponentType::I16 => (f32::from(i16::from_le_bytes(first(bytes))), 32767.0),
        ComponentType::U32 => return u32::from_le_bytes(first(bytes)) as f32,
    };
    if normalized { (value / max).max(-1.0) } else { value }
}

/// The unsigned integer at the beginning of `bytes`; the type was checked to be one.
fn unsigned(component: ComponentType, bytes: &[u8]) -> u32 {
    match component.size() {
        1 => u32::from(bytes[0]),
        2 => u32::from(u16::from_le_bytes(first(bytes))),
        _ => u32::from_le_bytes(first(bytes)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::gltf::container;
    use crate::import::{Files, Reach};

    /// Reads with an accessor `json` over `data`: view 0 is all of it, view 1 all of it with a stride of 8.
    fn with<R>(data: &[u8], json: &str, read: impl FnOnce(&Accessors) -> R) -> R {
        let n = data.len();
        let hex: String = data.iter().map(|b| format!("%{b:02x}")).collect();
        let text = format!(
            r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{"byteLength": {n}, "uri": "data:,{hex}"}}],
            "bufferViews": [{{"buffer": 0, "byteLength": {n}}}, {{"buffer": 0, "byteLength": {n}, "byteStride": 8}}],
            "accessors": [{json}]}}"#
        );
        let document = container::open(text.as_bytes()).unwrap();
        let buffers =
            Buffers::load(&document, &mut Files::new(std::path::Path::new(""), Reach::Folder).unwrap())
                .unwrap();
        read(&Accessors::new(&document.root, &buffers))
    }

    #[test]
    fn every_component_type_is_decoded() {
        let json = |kind: u32, normalized: bool| {
            format!(
                r#"{{"bufferView": 0, "count": 1, "componentType": {kind}, "normalized": {normalized}, "type": "VEC2"}}"#
            )
        };
        let data = [0xff, 0x80, 0x00, 0x80, 0, 0, 0x80, 0x3f];
        for (kind, normalized, expected) in [
            (5120, false, [-1.0, -128.0]),
            (5120, true, [-1.0 / 127.0, -1.0]),
            (5121, true, [1.0, 128.0 / 255.0]),
            (5122, true, [-32513.0 / 32767.0, -1.0]),
            (5123, false, [33023.0, 32768.0]),
            (5126, false, [f32::from_bits(0x8000_80ff), 1.0]),
        ] {
            let read = with(&data, &json(kind, normalized), |a| a.floats::<2>(0, "test")).unwrap();
            assert_eq!(read, [expected], "{kind} {normalized}");
        }
        assert!(with(&data, &json(5125, false), |a| a.floats::<2>(0, "test")).is_err());
        assert!(with(&data, &json(9, false), |a| a.floats::<2>(0, "test")).is_err());
    }

    #[test]
    fn strides_and_offsets_are_followed() {
        let data: Vec<u8> = (0..16).collect();
        let json =
            r#"{"bufferView": 1, "byteOffset": 4, "count": 2, "componentType": 5123, "type": "SCALAR"}"#;
        assert_eq!(with(&data, json, |a| a.indices(0, "test")).unwrap(), [0x0504, 0x0d0c]);
        // The last element ends at the view's end, though its stride reaches beyond.
        let json = json.replace("\"byteOffset\": 4", "\"byteOffset\": 6");
        assert_eq!(with(&data, &json, |a| a.indices(0, "test")).unwrap(), [0x0706, 0x0f0e]);
        let json = json.replace("\"byteOffset\": 6", "\"byteOffset\": 7");
        assert!(matches!(
            with(&data, &json, |a| a.indices(0, "test")),
            Err(GltfError::Bytes { needed: 17, available: 16, .. })
        ));
    }

    #[test]
    fn sparse_values_replace_zeros() {
        let sparse = |index: u8| {
            let json = r#"{"count": 3, "componentType": 5121, "type": "SCALAR", "sparse": {"count": 1,
                "indices": {"bufferView": 0, "componentType": 5121}, "values": {"bufferView": 0, "byteOffset": 1}}}"#;
            with(&[index, 42], json, |a| a.indices(0, "test"))
        };
        assert_eq!(sparse(1).unwrap(), [0, 42, 0]);
        assert!(matches!(sparse(3), Err(GltfError::VertexIndex { index: 3, count: 3, .. })));
    }

    #[test]
    fn absurd_counts_fail_before_anything_is_allocated() {
        for (count, offset) in [(1_000_000_000u64, 0u64), (u64::MAX, 0), (1, u64::MAX), (u64::MAX, u64::MAX)]
        {
            for view in ["\"bufferView\": 0,", ""] {
                let json = format!(
                    r#"{{{view} "byteOffset": {offset}, "count": {count}, "componentType": 5126, "type": "VEC3"}}"#
                );
                let result = with(&[0; 10], &json, |a| a.floats::<3>(0, "test"));
                assert!(result.is_err() || (count == 1 && view.is_empty()), "{json}");
            }
        }
    }

    #[test]
    fn reading_the_same_elements_again_and_again_ends() {
        let json = format!(r#"{{"count": {FREE_ZEROS}, "componentType": 5121, "type": "SCALAR"}}"#);
        with(&[0], &json, |accessors| {
            accessors.read.set(FREE_ELEMENTS + ELEMENTS_PER_BYTE - FREE_ZEROS + 1);
            assert!(matches!(accessors.indices(0, "test"), Err(GltfError::TooMany { .. })));
        });
    }
}
