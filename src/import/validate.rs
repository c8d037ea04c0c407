//! What every imported scene owes the renderer, whatever its dialect: mended with a warning where that is possible, an error
//! where it isn't.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};

use crate::record::Warning;
use crate::scene::source::SourceMaterial;
use crate::scene::{Mesh, Named, Scene};

/// Why a scene that was read can't be rendered.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidScene {
    /// No instance has a triangle left.
    #[error("there is nothing to render: no mesh in the scene has a triangle that is not degenerate")]
    Empty,
    /// A triangle names a vertex that isn't there.
    #[error("mesh {mesh:?}: triangle {triangle} uses vertex {index}, but there are {vertices}")]
    VertexIndex {
        /// The mesh.
        mesh: String,
        /// The triangle, from 0.
        triangle: usize,
        /// The index it uses.
        index: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A vertex attribute has not one value a vertex.
    #[error("mesh {mesh:?} has {found} {attribute} for {vertices} vertices")]
    AttributeCount {
        /// The mesh.
        mesh: String,
        /// The attribute.
        attribute: &'static str,
        /// How many values it has.
        found: usize,
        /// How many vertices there are.
        vertices: usize,
    },
    /// An instance names a mesh or material that isn't there.
    #[error("instance {instance:?} uses {kind} {index}, but there are {count}")]
    Reference {
        /// The instance.
        instance: String,
        /// Mesh or material.
        kind: &'static str,
        /// The index.
        index: u32,
        /// How many there are.
        count: usize,
    },
    /// An instance's transform holds NaN or puts vertices beyond the range of floats.
    #[error(
        "instance {instance:?} lies outside the range of floats: its transform is too large or not finite"
    )]
    Transform {
        /// The instance.
        instance: String,
    },
}

/// Checks `scene` and mends what can be mended. `file` names the scene's file in the warnings.
pub(super) fn validate(
    scene: &mut Scene<SourceMaterial>,
    file: &str,
    warnings: &mut Vec<Warning>,
) -> Result<(), InvalidScene> {
    for mesh in &mut scene.meshes {
        let mesh = Arc::make_mut(mesh);
        check_lengths(mesh)?;
        let place = format!("{file}: mesh {:?}", mesh.name);
        let mut tell = |count: usize, what: &str| {
            if count > 0 {
                warnings.push(Warning::new(&place, format!("{count} {what}")));
            }
        };
        tell(drop_broken_triangles(mesh), "triangles with NaN or infinite positions left out");
        tell(drop_degenerate_triangles(mesh), "degenerate triangles (no area) left out");
        compact(mesh);
        mend_attributes(mesh, &mut tell);
    }
    check_instances(scene)?;
    make_unique(&mut scene.materials, "material", file, warnings);
    make_unique(&mut scene.cameras, "camera", file, warnings);
    make_unique(&mut scene.lights, "light", file, warnings);
    Ok(())
}

/// Removes the vertices that no triangle uses. Files often share one large vertex array among many small meshes.
pub(super) fn compact(mesh: &mut Mesh) {
    let mut used = vec![false; mesh.positions.len()];
    for &i in mesh.triangles.iter().flatten() {
        used[i as usize] = true;
    }
    if used.iter().all(|&u| u) {
        return;
    }
    let mut next = 0;
    let new_index: Vec<u32> = used
        .iter()
        .map(|&u| {
            let index = next;
            next += u32::from(u);
            index
        })
        .collect();
    for i in mesh.triangles.iter_mut().flatten() {
        *i = new_index[*i as usize];
    }
    keep(&mut mesh.positions, &used);
    keep(&mut mesh.normals, &used);
    keep(&mut mesh.tangents, &used);
    keep(&mut mesh.colors, &used);
    for set in &mut mesh.uvs {
        keep(set, &used);
    }
}

/// Keeps the values of the vertices that are `used`.
fn keep<T>(values: &mut Vec<T>, used: &[bool]) {
    let mut used = used.iter();
    values.retain(|_| used.next().is_some_and(|&u| u));
    values.shrink_to_fit();
}

/// One value a vertex, and no index beyond the vertices.
fn check_lengths(mesh: &Mesh) -> Result<(), InvalidScene> {
    let vertices = mesh.positions.len();
    let optional =
        [("normals", mesh.normals.len()), ("tangents", mesh.tangents.len()), ("colors", mesh.colors.len())];
    let given = optional.into_iter().filter(|&(_, found)| found != 0);
    let sets = mesh.uvs.iter().map(|set| ("texture coordinates", set.len()));
    for (attribute, found) in given.chain(sets) {
        if found != vertices {
            return Err(InvalidScene::AttributeCount { mesh: mesh.name.clone(), attribute, found, vertices });
        }
    }
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        if let Some(&index) = corners.iter().find(|&&i| i as usize >= vertices) {
            return Err(InvalidScene::VertexIndex { mesh: mesh.name.clone(), triangle, index, vertices });
        }
    }
    Ok(())
}

/// Drops the triangles with a corner that is not finite, and says how many.
fn drop_broken_triangles(mesh: &mut Mesh) -> usize {
    let before = mesh.triangles.len();
    let positions = &mesh.positions;
    mesh.triangles.retain(|t| t.iter().all(|&i| positions[i as usize].is_finite()));
    before - mesh.triangles.len()
}

/// Drops the triangles whose area is exactly 0, and says how many. Slivers stay.
fn drop_degenerate_triangles(mesh: &mut Mesh) -> usize {
    let before = mesh.triangles.len();
    let positions = &mesh.positions;
    mesh.triangles.retain(|t| {
        // In f64 neither differences nor products of f32 positions vanish by underflow.
        let [a, b, c] = t.map(|i| positions[i as usize].as_dvec3());
        (b - a).cross(c - a).length_squared() > 0.0
    });
    before - mesh.triangles.len()
}

/// Makes normals and tangents unit vectors, and coordinates and colours finite. All positions are finite by now.
fn mend_attributes(mesh: &mut Mesh, tell: &mut impl FnMut(usize, &str)) {
    let (long, bad) = mend_normals(mesh);
    tell(long, "normals were not of unit length and are scaled to it");
    tell(bad, "normals without a direction replaced by the mean of the faces around the vertex");

    let bad_tangent =
        |t: &&Vec4| !t.is_finite() || t.w == 0.0 || t.truncate().as_dvec3().length_squared() == 0.0;
    let bad = mesh.tangents.iter().filter(bad_tangent).count();
    if bad > 0 {
        mesh.tangents.clear();
        tell(bad, "tangents without a direction or a sign; the mesh's tangents are ignored");
    }
    // Those that are unit vectors up to rounding stay as they are, so that what was written comes back.
    for t in
        mesh.tangents.iter_mut().filter(|t| !is_unit(t.truncate().as_dvec3().length()) || t.w.abs() != 1.0)
    {
        *t = t.truncate().as_dvec3().normalize().as_vec3().extend(t.w.signum());
    }

    let mut bad = 0;
    for uv in mesh.uvs.iter_mut().flatten().filter(|uv| !uv.is_finite()) {
        *uv = Vec2::ZERO;
        bad += 1;
    }
    tell(bad, "texture coordinates that are NaN or infinite set to (0, 0)");

    let mut bad = 0;
    for c in &mut mesh.colors {
        let mend = |v: f32| if v.is_nan() { 0.0 } else { v.clamp(0.0, 1.0) };
        let mended = Vec4::from_array(c.to_array().map(mend));
        bad += usize::from(mended != *c);
        *c = mended;
    }
    tell(bad, "vertex colours outside [0, 1] clamped");
}

/// Whether a length is 1 up to the rounding of floats.
fn is_unit(length: f64) -> bool {
    (length - 1.0).abs() <= 1e-6
}

/// Makes the normals unit vectors. How many were visibly off, and how many had no direction.
fn mend_normals(mesh: &mut Mesh) -> (usize, usize) {
    let (mut long, mut bad) = (0, Vec::new());
    for (i, n) in mesh.normals.iter_mut().enumerate() {
        let length = n.as_dvec3().length();
        if !length.is_finite() || length == 0.0 {
            bad.push(i);
        } else if !is_unit(length) {
            // Normals of 8 bits are off by half a percent.
            long += usize::from((length - 1.0).abs() > 0.02);
            *n = (n.as_dvec3() / length).as_vec3();
        }
    }
    if bad.is_empty() {
        return (long, 0);
    }
    let mut sums = vec![glam::DVec3::ZERO; mesh.positions.len()];
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize].as_dvec3());
        let area_vector = (b - a).cross(c - a);
        for &i in t {
            let sum = &mut sums[i as usize];
            // Faces that cancel leave the last one's normal.
            *sum = if (*sum + area_vector).length_squared() > 0.0 { *sum + area_vector } else { area_vector };
        }
    }
    for &i in &bad {
        mesh.normals[i] = sums[i].try_normalize().map_or(Vec3::Z, |n| n.as_vec3());
    }
    (long, bad.len())
}

/// Every instance names what is there, lies within the range of floats and has triangles; at least one is left.
fn check_instances(scene: &mut Scene<SourceMaterial>) -> Result<(), InvalidScene> {
    let boxes: Vec<Option<(Vec3, Vec3)>> = scene.meshes.iter().map(|mesh| bounds(mesh)).collect();
    for i in &scene.instances {
        let reference =
            |kind, index, count| InvalidScene::Reference { instance: i.name.clone(), kind, index, count };
        let Some(bounds) = boxes.get(i.mesh.0 as usize) else {
            return Err(reference("mesh", i.mesh.0, scene.meshes.len()));
        };
        if i.material.0 as usize >= scene.materials.len() {
            return Err(reference("material", i.material.0, scene.materials.len()));
        }
        let finite = bounds.is_none_or(|(low, high)| {
            (0..8).all(|corner| {
                let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
                let p = i.world_from_object.transform_point3(Vec3::new(pick(0), pick(1), pick(2)));
                p.is_finite()
            })
        });
        if !finite || !i.world_from_object.is_finite() {
            return Err(InvalidScene::Transform { instance: i.name.clone() });
        }
    }
    scene.instances.retain(|i| boxes[i.mesh.0 as usize].is_some());
    if scene.instances.is_empty() { Err(InvalidScene::Empty) } else { Ok(()) }
}

/// The box around a mesh's vertices, none for a mesh without any.
fn bounds(mesh: &Mesh) -> Option<(Vec3, Vec3)> {
    let first = *mesh.positions.first()?;
    Some(mesh.positions.iter().fold((first, first), |(low, high), &p| (low.min(p), high.max(p))))
}

/// Gives every name that has been used before a suffix, `.001` and so on, since paths and messages go by name.
fn make_unique<T>(items: &mut [Named<T>], kind: &str, file: &str, warnings: &mut Vec<Warning>) {
    let mut taken: BTreeSet<String> = BTreeSet::new();
    let all: BTreeSet<String> = items.iter().map(|item| item.name.clone()).collect();
    // Where to go on looking, by name: a thousand equal names must not take a million steps.
    let mut next = std::collections::BTreeMap::<String, usize>::new();
    for item in items {
        if !taken.contains(&item.name) {
            taken.insert(item.name.clone());
            continue;
        }
        let number = next.entry(item.name.clone()).or_insert(1);
        let unique = loop {
            let candidate = format!("{}.{number:03}", item.name);
            *number += 1;
            if !taken.contains(&candidate) && !all.contains(&candidate) {
                break candidate;
            }
        };
        let message = format!("the name is taken; this one is called {unique:?}");
        warnings.push(Warning::new(format!("{file}: {kind} {:?}", item.name), message));
        taken.insert(unique.clone());
        item.name = unique;
    }
}

#[cfg(test)]
mod tests {
    use glam::Affine3A;

    use super::*;
    use crate::scene::source::GltfMaterial;
    use crate::scene::{Instance, MaterialId, MeshId};

    fn scene_of(mesh: Mesh) -> Scene<SourceMaterial> {
        let mut scene = Scene::empty();
        scene.materials.push(Named::new("m", SourceMaterial::Gltf(GltfMaterial::default())));
        scene.meshes.push(Arc::new(mesh));
        scene.instances.push(Instance {
            name: "i".into(),
            mesh: MeshId(0),
            material: MaterialId(0),
            world_from_object: Affine3A::IDENTITY,
        });
        scene
    }

    /// Two triangles of a unit square; the second uses vertex 3.
    fn square() -> Mesh {
        Mesh {
            name: "square".into(),
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y],
            normals: vec![Vec3::Z; 4],
            uvs: vec![vec![Vec2::ZERO; 4]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        }
    }

    fn run(mesh: Mesh) -> (Result<Mesh, InvalidScene>, Vec<String>) {
        let mut scene = scene_of(mesh);
        let mut warnings = Vec::new();
        let result = validate(&mut scene, "f.glb", &mut warnings).map(|()| (*scene.meshes[0]).clone());
        (result, warnings.iter().map(ToString::to_string).collect())
    }

    #[test]
    fn a_sound_mesh_stays_as_it_is() {
        assert_eq!(run(square()), (Ok(square()), vec![]));
    }

    #[test]
    fn triangles_with_nan_go_and_take_their_vertices_along() {
        let mut mesh = square();
        mesh.positions[1].x = f32::NAN;
        let (mesh, warnings) = run(mesh);
        let mesh = mesh.unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X + Vec3::Y, Vec3::Y]);
        assert_eq!((mesh.normals.len(), mesh.uvs[0].len()), (3, 3));
        let told = "f.glb: mesh \"square\": 1 triangles with NaN or infinite positions left out";
        assert_eq!(warnings, [told]);
    }

    #[test]
    fn degenerate_triangles_go_and_slivers_stay() {
        let mut mesh = square();
        mesh.triangles.extend([[0, 0, 1], [1, 1, 1]]);
        mesh.positions.extend([
            Vec3::new(0.0, 0.0, 5.0),
            Vec3::new(1e-30, 0.0, 5.0),
            Vec3::new(0.0, 1e-30, 5.0),
        ]);
        mesh.normals.extend([Vec3::Z; 3]);
        mesh.uvs[0].extend([Vec2::ZERO; 3]);
        mesh.triangles.push([4, 5, 6]);
        let (mesh, warnings) = run(mesh);
        assert_eq!(mesh.unwrap().triangles.len(), 3);
        assert_eq!(warnings.len(), 1);
        assert!(warnings[0].contains("2 degenerate"));
    }

    #[test]
    fn nothing_left_is_an_error() {
        let mut mesh = square();
        mesh.triangles = vec![[0, 0, 1]];
        assert_eq!(run(mesh).0, Err(InvalidScene::Empty));
    }

    #[test]
    fn indices_and_lengths_are_checked() {
        let mut mesh = square();
        mesh.triangles[1][2] = 4;
        let expected =
            InvalidScene::VertexIndex { mesh: "square".into(), triangle: 1, index: 4, vertices: 4 };
        assert_eq!(run(mesh).0, Err(expected));
        let mut mesh = square();
        mesh.uvs[0].pop();
        assert!(matches!(run(mesh).0, Err(InvalidScene::AttributeCount { found: 3, .. })));
    }

    #[test]
    fn normals_become_unit_vectors() {
        let mut mesh = square();
        mesh.normals = vec![Vec3::Z * 2.0, Vec3::ZERO, Vec3::splat(f32::NAN), Vec3::Z];
        let (mesh, warnings) = run(mesh);
        assert_eq!(mesh.unwrap().normals, [Vec3::Z; 4]);
        assert_eq!(warnings.len(), 2);
    }

    #[test]
    fn equal_names_get_numbers_that_are_free() {
        let mut names: Vec<Named<()>> =
            ["a", "a", "a.001", "a", "b"].into_iter().map(|n| Named::new(n, ())).collect();
        let mut warnings = Vec::new();
        make_unique(&mut names, "light", "f", &mut warnings);
        let names: Vec<&str> = names.iter().map(|n| n.name.as_str()).collect();
        assert_eq!(names, ["a", "a.002", "a.001", "a.003", "b"]);
        assert_eq!(warnings.len(), 2);
    }

    #[test]
    fn a_transform_beyond_floats_is_an_error() {
        let mut scene = scene_of(square());
        scene.instances[0].world_from_object = Affine3A::from_scale(Vec3::splat(f32::INFINITY));
        let error = validate(&mut scene, "f", &mut Vec::new()).unwrap_err();
        assert_eq!(error, InvalidScene::Transform { instance: "i".into() });
    }
}
