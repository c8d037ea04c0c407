//! Morph targets and skins: vertices moved before the mesh is placed (glTF 2.0, 3.7.2.2 and 3.7.3).

use glam::{DAffine3, DMat3, DMat4, DVec3, Vec3};
use gltf::json::Root;
use gltf::json::mesh::{MorphTarget, Primitive, Semantic};

use super::accessor::Accessors;
use super::buffers::lookup;
use super::error::GltfError;
use super::geometry::{attribute, vectors};
use crate::scene::Mesh;

/// The most sets of joints and weights, four each, that a vertex may have.
const MAX_SETS: u32 = 16;

/// How the vertices of a mesh are moved where a node shows it.
#[derive(Default)]
pub(super) struct Deformation {
    /// The weights of the morph targets; what is missing is 0.
    pub(super) weights: Vec<f32>,
    /// World from the mesh as it was bound, for each joint of the skin.
    pub(super) joints: Option<Vec<DAffine3>>,
}

/// World from the mesh as it was bound for each joint of `skins[index]`, which `element` asks for. `worlds` holds where the
/// scene's nodes stand.
pub(super) fn joints(
    root: &Root,
    index: usize,
    element: &str,
    worlds: &[Option<DAffine3>],
    accessors: &Accessors,
) -> Result<Vec<DAffine3>, GltfError> {
    let skin = lookup(&root.skins, index, element, "skins")?;
    let name = format!("skins[{index}]");
    let invalid = |property, expected| GltfError::Invalid { element: name.clone(), property, expected };
    let inverse_bind = match skin.inverse_bind_matrices {
        Some(accessor) => Some(accessors.floats::<16>(accessor.value(), &name)?),
        None => None,
    };
    if skin.joints.is_empty() || inverse_bind.as_ref().is_some_and(|m| m.len() < skin.joints.len()) {
        return Err(invalid("joints", "at least one, each with an inverse bind matrix"));
    }
    let world_from_bind = |(i, joint): (usize, &gltf::json::Index<_>)| {
        let world = *lookup(worlds, joint.value(), &name, "nodes")?;
        let world = world.ok_or_else(|| invalid("joints", "nodes of the scene that is shown"))?;
        let bind =
            inverse_bind.as_ref().map_or(DMat4::IDENTITY, |m| DMat4::from_cols_array(&m[i].map(f64::from)));
        if !bind.is_finite() {
            return Err(invalid("inverseBindMatrices", "finite numbers"));
        }
        // The last row is 0, 0, 0, 1 (3.7.3.1), up to rounding.
        Ok(world * DAffine3::from_mat4(bind))
    };
    skin.joints.iter().enumerate().map(world_from_bind).collect()
}

impl Deformation {
    /// Adds the morph targets of `primitive`, by their weights, to the vertices of `mesh`.
    pub(super) fn morph(
        &self,
        primitive: &Primitive,
        element: &str,
        accessors: &Accessors,
        mesh: &mut Mesh,
    ) -> Result<(), GltfError> {
        let targets: &[MorphTarget] = primitive.targets.as_deref().unwrap_or_default();
        let mut moved = false;
        for (i, (target, &weight)) in targets.iter().zip(&self.weights).enumerate() {
            let element = format!("{element}.targets[{i}]");
            if !weight.is_finite() {
                let (property, value, expected) = ("weight", weight, "finite");
                return Err(GltfError::Range { element, property, value, expected });
            }
            if weight == 0.0 {
                continue;
            }
            let offsets = |index: Option<gltf::json::Index<_>>, name: &str, vertices: usize| {
                let Some(index) = index else { return Ok(Vec::new()) };
                let offsets = vectors(accessors, index.value(), &element)?;
                match offsets.len() == vertices {
                    true => Ok(offsets),
                    false => Err(GltfError::AttributeCount {
                        element: element.clone(),
                        attribute: name.to_owned(),
                        found: offsets.len(),
                        vertices,
                    }),
                }
            };
            let vertices = mesh.positions.len();
            for (p, d) in mesh.positions.iter_mut().zip(offsets(target.positions, "POSITION", vertices)?) {
                *p += d * weight;
            }
            for (n, d) in mesh.normals.iter_mut().zip(offsets(target.normals, "NORMAL", vertices)?) {
                *n += d * weight;
            }
            for (t, d) in mesh.tangents.iter_mut().zip(offsets(target.tangents, "TANGENT", vertices)?) {
                *t += (d * weight).extend(0.0);
            }
            moved = true;
        }
        if moved {
            mesh.normals.iter_mut().for_each(|n| *n = unit(n.as_dvec3()));
        }
        Ok(())
    }

    /// Moves the vertices of `mesh` into the world by the joints they hang on, if there is a skin. `source` says which vertices of
    /// the file they are, if they are not the same; what was amiss with how many of them is told to `warn`.
    pub(super) fn skin(
        &self,
        primitive: &Primitive,
        element: &str,
        accessors: &Accessors,
        source: Option<&[u32]>,
        mesh: &mut Mesh,
        warn: &mut impl FnMut(String),
    ) -> Result<(), GltfError> {
        let Some(joints) = &self.joints else { return Ok(()) };
        let position = attribute(primitive, Semantic::Positions);
        let mut influences = Vec::new();
        let mut set = 0;
        while set < MAX_SETS
            && let (Some(j), Some(w)) =
                (attribute(primitive, Semantic::Joints(set)), attribute(primitive, Semantic::Weights(set)))
        {
            let pair = (accessors.floats::<4>(j, element)?, accessors.floats::<4>(w, element)?);
            let vertices = position.map_or(0, |p| accessors.count(p));
            for (name, found) in [("JOINTS", pair.0.len()), ("WEIGHTS", pair.1.len())] {
                if found != vertices {
                    let (element, attribute) = (element.to_owned(), format!("{name}_{set}"));
                    return Err(GltfError::AttributeCount { element, attribute, found, vertices });
                }
            }
            influences.push(pair);
            set += 1;
        }
        if attribute(primitive, Semantic::Joints(MAX_SETS)).is_some() {
            warn(format!("JOINTS_{MAX_SETS} and what follows are ignored: at most {MAX_SETS} sets are read"));
        }
        if influences.is_empty() {
            warn(
                "its node has a skin, but it has no JOINTS_0 and WEIGHTS_0: it hangs on the first joint"
                    .into(),
            );
        }

        let (mut unbound, mut mirrored) = (0, 0);
        for v in 0..mesh.positions.len() {
            let vertex = source.map_or(v, |source| source[v] as usize);
            let mut total = 0.0;
            let mut blend = [DVec3::ZERO; 4];
            for (set_joints, set_weights) in &influences {
                for (&joint, &weight) in set_joints[vertex].iter().zip(&set_weights[vertex]) {
                    // Exporters leave rubbish where the weight is 0.
                    if !(weight > 0.0 && weight.is_finite()) {
                        continue;
                    }
                    let m = joints.get(joint as usize).ok_or_else(|| GltfError::VertexIndex {
                        element: format!("{element}.attributes.JOINTS"),
                        index: joint as u32,
                        count: joints.len() as u64,
                    })?;
                    let weight = f64::from(weight);
                    total += weight;
                    let m = m.to_cols_array_2d().map(DVec3::from_array);
                    blend = std::array::from_fn(|c| blend[c] + m[c] * weight);
                }
            }
            let (linear, translation) = if total > 0.0 {
                let [x, y, z, t] = blend.map(|c| c / total);
                (DMat3::from_cols(x, y, z), t)
            } else {
                unbound += 1;
                (joints[0].matrix3, joints[0].translation)
            };
            let determinant = linear.determinant();
            mirrored += usize::from(determinant < 0.0);
            let p = &mut mesh.positions[v];
            *p = (linear * p.as_dvec3() + translation).as_vec3();
            if let Some(n) = mesh.normals.get_mut(v) {
                // The cofactors are the inverse's transpose, up to the determinant.
                let (x, y, z) = (linear.x_axis, linear.y_axis, linear.z_axis);
                let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
                *n = unit(cofactors * n.as_dvec3() * determinant.signum());
            }
            if let Some(t) = mesh.tangents.get_mut(v) {
                *t = unit(linear * t.truncate().as_dvec3()).extend(t.w * determinant.signum() as f32);
            }
        }
        if unbound > 0 && !influences.is_empty() {
            warn(format!("{unbound} vertices have no positive weight and hang on the first joint"));
        }
        if mirrored * 2 > mesh.positions.len() {
            for t in &mut mesh.triangles {
                t.swap(1, 2);
            }
        }
        Ok(())
    }
}

/// `v` with length 1; what has no direction is 0, which validation mends.
fn unit(v: DVec3) -> Vec3 {
    v.normalize_or_zero().as_vec3()
}
