//! KHR_draco_mesh_compression: primitives that are decoded before anything reads them, by the `draco-core` crate.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

use draco_core::{DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder, PointAttribute, PointIndex};
use gltf::json::accessor::{Accessor, ComponentType, GenericComponentType};
use gltf::json::mesh::{Mode, Primitive};
use gltf::json::validation::{Checked, USize64};
use gltf::json::{Index, Root};
use serde::Deserialize;

use super::buffers::{Buffers, lookup};
use super::error::GltfError;
use super::geometry::MAX_TRIANGLES;

const EXTENSION: &str = "KHR_draco_mesh_compression";

/// The points and faces that data may hold, however short it is; and how many for each of its bytes. A triangle takes one to two bits in earnest
/// (Rossignac, "Edgebreaker", 1999).
const FREE_ELEMENTS: u64 = 1 << 16;
const ELEMENTS_PER_BYTE: u64 = 64;
/// The bytes of a point's attributes: position, normal, tangent, colour and two coordinates as floats take 72.
const BYTES_PER_POINT: u64 = 128;

/// The extension's object in a primitive.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Compressed {
    buffer_view: usize,
    /// The compressed attribute's id, by the name that the primitive has an accessor under.
    attributes: BTreeMap<String, u32>,
}

/// Decodes every compressed primitive of `root`: its accessors then lie in buffer views of their own.
pub(super) fn decompress(root: &mut Root, buffers: &mut Buffers) -> Result<(), GltfError> {
    for mesh in 0..root.meshes.len() {
        for primitive in 0..root.meshes[mesh].primitives.len() {
            let json = &root.meshes[mesh].primitives[primitive];
            let extension = json.extensions.as_ref().and_then(|e| e.others.get(EXTENSION));
            let Some(extension) = extension else { continue };
            let compressed: Compressed = gltf::json::deserialize::from_value(extension.clone())?;
            let element = format!("meshes[{mesh}].primitives[{primitive}]");
            let (bytes, _) = buffers.view(root, compressed.buffer_view, &element)?;
            let decoded = decode(bytes).ok_or_else(|| damaged(&element))?;
            let accessors = accessors(json, &compressed, &decoded, &element)?;
            let indices = json.indices;
            for (accessor, attribute) in accessors {
                let values = values(attribute, decoded.num_points()).ok_or_else(|| damaged(&element))?;
                replace(root, buffers, accessor, decoded.num_points(), values, &element)?;
            }
            let corners: Vec<u8> =
                decoded.faces().iter().flatten().flat_map(|corner| corner.0.to_le_bytes()).collect();
            if let Some(indices) = indices {
                let count = decoded.num_faces() * 3;
                let values = Values { component: ComponentType::U32, components: 1, bytes: corners };
                replace(root, buffers, indices.value(), count, values, &element)?;
            }
            // Strips are decoded to triangles too.
            root.meshes[mesh].primitives[primitive].mode = Checked::Valid(Mode::Triangles);
        }
    }
    Ok(())
}

fn damaged(element: &str) -> GltfError {
    GltfError::Invalid {
        element: element.to_owned(),
        property: EXTENSION,
        expected: "undamaged Draco data of a mesh",
    }
}

/// The mesh in `bytes`; none if they are damaged or it is larger than any that is read.
fn decode(bytes: &[u8]) -> Option<Mesh> {
    let most = FREE_ELEMENTS.saturating_add(ELEMENTS_PER_BYTE.saturating_mul(bytes.len() as u64));
    let most = most.min(MAX_TRIANGLES);
    let limits = DecodeLimits::default().with_max_points(most).with_max_faces(most);
    let limits = limits.with_max_decoded_bytes(most.saturating_mul(BYTES_PER_POINT));
    // The decoder is made for hostile input; should it still panic, it has no state beyond this call.
    catch_unwind(AssertUnwindSafe(|| {
        let mut mesh = Mesh::new();
        let mut buffer = DecoderBuffer::new(bytes).with_limits(limits);
        MeshDecoder::new().decode(&mut buffer, &mut mesh).ok().map(|()| mesh)
    }))
    .unwrap_or(None)
}

/// The accessors whose values `decoded` holds.
fn accessors<'d>(
    primitive: &Primitive,
    compressed: &Compressed,
    decoded: &'d Mesh,
    element: &str,
) -> Result<Vec<(usize, &'d PointAttribute)>, GltfError> {
    let mut found = Vec::new();
    for (semantic, accessor) in &primitive.attributes {
        let Checked::Valid(semantic) = semantic else { continue };
        let Some(&id) = compressed.attributes.get(&semantic.to_string()) else { continue };
        let attribute = decoded.attribute_by_unique_id(id).ok_or_else(|| damaged(element))?;
        found.push((accessor.value(), attribute));
    }
    Ok(found)
}

/// Values of an accessor without gaps.
struct Values {
    component: ComponentType,
    components: usize,
    bytes: Vec<u8>,
}

/// One value of `attribute` for each of the `points`.
fn values(attribute: &PointAttribute, points: usize) -> Option<Values> {
    let component = match attribute.data_type() {
        DataType::Int8 => ComponentType::I8,
        DataType::Uint8 => ComponentType::U8,
        DataType::Int16 => ComponentType::I16,
        DataType::Uint16 => ComponentType::U16,
        DataType::Uint32 => ComponentType::U32,
        DataType::Float32 => ComponentType::F32,
        _ => return None,
    };
    let components = usize::from(attribute.num_components());
    let (size, stride) = (component.size() * components, usize::try_from(attribute.byte_stride()).ok()?);
    let data = attribute.buffer().data();
    let mut bytes = Vec::new();
    for point in 0..u32::try_from(points).ok()? {
        let at = (attribute.mapped_index(PointIndex(point)).0 as usize).checked_mul(stride)?;
        bytes.extend_from_slice(data.get(at..at.checked_add(size)?)?);
    }
    Some(Values { component, components, bytes })
}

/// Makes `values` what `accessors[index]` of `root` holds, `count` of them.
fn replace(
    root: &mut Root,
    buffers: &mut Buffers,
    index: usize,
    count: usize,
    values: Values,
    element: &str,
) -> Result<(), GltfError> {
    let accessor = lookup(&root.accessors, index, element, "accessors")?;
    let fits = matches!(accessor.type_, Checked::Valid(kind) if kind.multiplicity() == values.components);
    if !fits || accessor.count.0 != count as u64 {
        let (element, property) = (format!("accessors[{index}]"), "type or count");
        return Err(GltfError::Invalid { element, property, expected: "those of its Draco data" });
    }
    let replaced = Accessor {
        buffer_view: Some(Index::new(buffers.add_view(root, values.bytes)?)),
        byte_offset: Some(USize64(0)),
        component_type: Checked::Valid(GenericComponentType(values.component)),
        sparse: None,
        ..root.accessors[index].clone()
    };
    root.accessors[index] = replaced;
    Ok(())
}
