//! The node hierarchy: where meshes, cameras and lights stand.

use glam::{Affine3A, DAffine3, DMat4, DQuat, DVec3, Mat3A, Vec2, Vec3};
use gltf::json::camera::{Camera as JsonCamera, Type as CameraType};
use gltf::json::extensions::scene::khr_lights_punctual::{Light as JsonLight, Type as LightType};
use gltf::json::scene::Node;
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};

use super::animation::{NodePose, Pose};
use super::buffers::lookup;
use super::error::GltfError;
use crate::import::{ImportOptions, LightUnits};
use crate::record::Warning;
use crate::scene::camera::{FovAxis, Projection};
use crate::scene::light::LightKind;
use crate::scene::{Camera, Light};

/// Lumens per watt at 555 nm, by which Blender's importer divides.
const LUMENS_PER_WATT: f32 = 683.0;

/// A node and where it stands.
pub(super) struct Placed<'a> {
    /// The index in the file.
    pub(super) index: usize,
    /// The node.
    pub(super) node: &'a Node,
    /// Its own space to the world.
    pub(super) world_from_node: DAffine3,
    /// Whether its mesh and its light are there (KHR_node_visibility); cameras always are.
    pub(super) visible: bool,
}

impl Placed<'_> {
    /// The node's name, or one made of its index.
    pub(super) fn name(&self) -> String {
        self.node.name.clone().unwrap_or_else(|| format!("node_{}", self.index))
    }
}

/// All nodes of the default scene (the first if none is), parents before children, in the file's order. A file without scenes is
/// taken as one scene of all nodes without parents. An animation's `pose` moves them.
pub(super) fn place<'a>(
    root: &'a Root,
    pose: &Pose,
    file: &str,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<Placed<'a>>, GltfError> {
    let mut visited = vec![false; root.nodes.len()];
    // A stack of our own: the depth of the hierarchy is the file's choice.
    let mut waiting: Vec<(usize, DAffine3, bool, String)> = roots(root)?
        .into_iter()
        .rev()
        .map(|(index, element)| (index, DAffine3::IDENTITY, true, element))
        .collect();
    let mut placed = Vec::new();
    while let Some((index, world_from_parent, parent_visible, referrer)) = waiting.pop() {
        let node = lookup(&root.nodes, index, &referrer, "nodes")?;
        if std::mem::replace(&mut visited[index], true) {
            return Err(GltfError::Tree { node: index });
        }
        let world_from_node =
            world_from_parent * local_transform(node, index, pose.of(index), file, warnings)?;
        if !Affine3A::from_cols_array(&world_from_node.to_cols_array().map(|v| v as f32)).is_finite() {
            return Err(transform_error(index, "a world transform within the range of floats"));
        }
        let visible = parent_visible && is_visible(node);
        placed.push(Placed { index, node, world_from_node, visible });
        let children = node.children.iter().flatten().rev();
        waiting.extend(children.map(|c| (c.value(), world_from_node, visible, format!("nodes[{index}]"))));
    }
    Ok(placed)
}

/// Whether KHR_node_visibility leaves the node visible, its ancestors aside.
fn is_visible(node: &Node) -> bool {
    let extension = node.extensions.as_ref().and_then(|e| e.others.get("KHR_node_visibility"));
    extension.and_then(|e| e.get("visible")?.as_bool()).unwrap_or(true)
}

/// The scene's own nodes, each with what refers to it.
fn roots(root: &Root) -> Result<Vec<(usize, String)>, GltfError> {
    if root.scenes.is_empty() && root.scene.is_none() {
        let mut is_child = vec![false; root.nodes.len()];
        for child in root.nodes.iter().flat_map(|n| n.children.iter().flatten()) {
            if let Some(known) = is_child.get_mut(child.value()) {
                *known = true;
            }
        }
        let free = (0..root.nodes.len()).filter(|&i| !is_child[i]);
        return Ok(free.map(|i| (i, "nodes".to_owned())).collect());
    }
    let index = root.scene.map_or(0, |scene| scene.value());
    let scene = lookup(&root.scenes, index, "scene", "scenes")?;
    Ok(scene.nodes.iter().map(|n: &Index<Node>| (n.value(), format!("scenes[{index}]"))).collect())
}

fn transform_error(index: usize, expected: &'static str) -> GltfError {
    GltfError::Invalid { element: format!("nodes[{index}]"), property: "transform", expected }
}

/// The transform of a node in its parent: its matrix, or T·R·S, each as the pose says or else the node.
fn local_transform(
    node: &Node,
    index: usize,
    pose: Option<&NodePose>,
    file: &str,
    warnings: &mut Vec<Warning>,
) -> Result<DAffine3, GltfError> {
    if let Some(matrix) = node.matrix {
        let matrix = DMat4::from_cols_array(&matrix.map(f64::from));
        if !matrix.is_finite() {
            return Err(transform_error(index, "a matrix of finite numbers"));
        }
        let last_row = matrix.row(3) - glam::DVec4::W;
        if last_row.abs().max_element() > 1e-5 {
            return Err(transform_error(index, "an affine matrix, whose last row is 0, 0, 0, 1"));
        }
        return Ok(DAffine3::from_mat4(matrix));
    }
    let vector = |v: Option<[f32; 3]>, default| v.map_or(default, |v| Vec3::from(v).as_dvec3());
    let scale = vector(pose.and_then(|p| p.scale).or(node.scale), DVec3::ONE);
    let translation = vector(pose.and_then(|p| p.translation).or(node.translation), DVec3::ZERO);
    let rotation = match pose.and_then(|p| p.rotation).or(node.rotation.map(|q| q.0)) {
        None => DQuat::IDENTITY,
        Some(q) => {
            let q = DQuat::from_array(q.map(f64::from));
            let length = q.length();
            if !length.is_finite() || length == 0.0 {
                return Err(transform_error(index, "a rotation that is a unit quaternion"));
            }
            if (length - 1.0).abs() > 1e-2 {
                let message = format!("its rotation is a quaternion of length {length}, scaled to 1");
                warnings.push(Warning::new(format!("{file}: nodes[{index}]"), message));
            }
            q.normalize()
        }
    };
    if !scale.is_finite() || !translation.is_finite() {
        return Err(transform_error(index, "finite scale and translation"));
    }
    Ok(DAffine3::from_scale_rotation_translation(scale, rotation, translation))
}

/// The camera `cameras[index]` where its node stands. Scale and shear of the node don't count; a mirroring one mirrors the picture.
pub(super) fn camera(json: &JsonCamera, index: usize, placed: &Placed) -> Result<Camera, GltfError> {
    let element = format!("cameras[{index}]");
    let positive = |property, value: f32| match value.is_finite() && value > 0.0 {
        true => Ok(value),
        false => {
            let expected = "positive and finite";
            Err(GltfError::Range { element: element.clone(), property, value, expected })
        }
    };
    let missing = |property| GltfError::Missing { element: element.clone(), property };
    let (projection, aspect) = match json.type_ {
        Checked::Valid(CameraType::Perspective) => {
            let p = json.perspective.as_ref().ok_or_else(|| missing("perspective"))?;
            let fov = positive("yfov", p.yfov)?;
            if fov >= std::f32::consts::PI {
                let expected = "less than π";
                return Err(GltfError::Range { element, property: "yfov", value: fov, expected });
            }
            let aspect = p.aspect_ratio.map(|a| positive("aspectRatio", a)).transpose()?;
            (Projection::Perspective { fov, axis: FovAxis::Y }, aspect)
        }
        Checked::Valid(CameraType::Orthographic) => {
            let o = json.orthographic.as_ref().ok_or_else(|| missing("orthographic"))?;
            let (half_width, half_height) = (positive("xmag", o.xmag)?, positive("ymag", o.ymag)?);
            let aspect = positive("xmag/ymag", half_width / half_height)?;
            (Projection::Orthographic { half_height }, Some(aspect))
        }
        Checked::Invalid => {
            let expected = "perspective or orthographic";
            return Err(GltfError::Invalid { element, property: "type", expected });
        }
    };
    Ok(Camera {
        world_from_camera: rigid(placed)?,
        projection,
        lens: None,
        pixel_offset: Vec2::ZERO,
        size: None,
        aspect,
    })
}

/// A node's transform without scale and shear: the direction of -z is kept, then as much as possible that of y, then handedness.
fn rigid(placed: &Placed) -> Result<Affine3A, GltfError> {
    let m = placed.world_from_node.matrix3;
    let frame = m.z_axis.try_normalize().and_then(|back| {
        let up = (m.y_axis - back * back.dot(m.y_axis)).try_normalize()?;
        let right = up.cross(back);
        Some((if right.dot(m.x_axis) < 0.0 { -right } else { right }, up, back))
    });
    let (right, up, back) =
        frame.ok_or_else(|| transform_error(placed.index, "axes y and z that span a plane, for a camera"))?;
    Ok(Affine3A {
        matrix3: Mat3A::from_cols(right.as_vec3().into(), up.as_vec3().into(), back.as_vec3().into()),
        translation: placed.world_from_node.translation.as_vec3().into(),
    })
}

/// The KHR_lights_punctual light `lights[index]` where its node stands; it shines along -z.
pub(super) fn light(
    json: &JsonLight,
    index: usize,
    placed: &Placed,
    options: &ImportOptions,
) -> Result<Light, GltfError> {
    let element = format!("lights[{index}]");
    let check = |property, value: f32, fits: bool, expected| match fits {
        true => Ok(value),
        false => Err(GltfError::Range { element: element.clone(), property, value, expected }),
    };
    let not_negative =
        |property, v: f32| check(property, v, v.is_finite() && v >= 0.0, "finite and not negative");
    for channel in json.color {
        not_negative("color", channel)?;
    }
    let intensity = not_negative("intensity", json.intensity)?;
    let range = match json.range {
        Some(r) => Some(check("range", r, r.is_finite() && r > 0.0, "positive and finite")?),
        None => None,
    };
    let position = placed.world_from_node.translation.as_vec3();
    let direction = || {
        let axis = (-placed.world_from_node.matrix3.z_axis).try_normalize();
        let expected = "a z axis that is not 0, for a light with a direction";
        axis.map(|d| d.as_vec3()).ok_or_else(|| transform_error(placed.index, expected))
    };
    let kind = match json.type_ {
        Checked::Valid(LightType::Point) => LightKind::Point { position, range },
        Checked::Valid(LightType::Directional) => LightKind::Directional { direction: direction()? },
        Checked::Valid(LightType::Spot) => {
            let spot = json.spot.as_ref();
            let spot =
                spot.ok_or_else(|| GltfError::Missing { element: element.clone(), property: "spot" })?;
            let (inner, outer) = (spot.inner_cone_angle, spot.outer_cone_angle);
            check(
                "outerConeAngle",
                outer,
                outer > 0.0 && outer <= std::f32::consts::FRAC_PI_2,
                "in (0, π/2]",
            )?;
            check("innerConeAngle", inner, (0.0..outer).contains(&inner), "in [0, outerConeAngle)")?;
            LightKind::Spot { position, direction: direction()?, inner, outer, range }
        }
        Checked::Invalid => {
            let expected = "directional, point or spot";
            return Err(GltfError::Invalid { element, property: "type", expected });
        }
    };
    let unit = match options.light_units {
        LightUnits::Photometric => 1.0,
        LightUnits::Blender => LUMENS_PER_WATT,
    };
    Ok(Light { kind, color: json.color.into(), intensity: intensity / unit })
}
