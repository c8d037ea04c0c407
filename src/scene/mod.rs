//! A resolved scene: meshes, instances, materials, textures, cameras, lights and environment, without any file I/O.
//!
//! Heavy data sits behind [`Arc`], so that the jobs of a sweep clone a scene for the price of its materials.

mod anisotropy;
pub mod camera;
mod dump;
pub mod environment;
pub mod framing;
pub mod light;
pub mod material;
pub mod mesh;
pub mod source;
pub mod studio;
pub mod texture;

use std::sync::Arc;

use crate::color::Rgb;
use glam::{Affine3A, Vec3};

pub use anisotropy::{AnisotropyMap, DisneyAnisotropy};
pub use camera::Camera;
pub use environment::Environment;
pub use light::Light;
pub use material::Material;
pub use mesh::Mesh;
pub use texture::{Image, Texture};

/// An index into [`Scene::meshes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MeshId(pub u32);
/// An index into [`Scene::materials`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MaterialId(pub u32);
/// An index into [`Scene::textures`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TextureId(pub u32);
/// An index into [`Scene::images`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ImageId(pub u32);

/// Something with the name that paths and messages use. Names are unique among their kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Named<T> {
    /// The name.
    pub name: String,
    /// The thing.
    pub item: T,
}

impl<T> Named<T> {
    /// `item` called `name`.
    pub fn new(name: impl Into<String>, item: T) -> Self {
        Self { name: name.into(), item }
    }
}

/// A scene whose materials are of type `M`: a dialect's own after import, [`Material`] after conversion.
#[derive(Clone, Debug)]
pub struct Scene<M = Material> {
    /// Triangle meshes in object space.
    pub meshes: Vec<Arc<Mesh>>,
    /// Where meshes stand and what they are made of.
    pub instances: Vec<Instance>,
    /// The materials.
    pub materials: Vec<Named<M>>,
    /// Images with their samplers and encodings.
    pub textures: Vec<Texture>,
    /// Pixels.
    pub images: Vec<Arc<Image>>,
    /// The cameras; the first is used unless another is asked for.
    pub cameras: Vec<Named<Camera>>,
    /// Point, spot and directional lights. Area lights are instances whose material emits.
    pub lights: Vec<Named<Light>>,
    /// Light from infinitely far away.
    pub environment: Option<Environment>,
}

/// A mesh placed in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// For messages; need not be unique.
    pub name: String,
    /// The mesh.
    pub mesh: MeshId,
    /// The material of all its triangles.
    pub material: MaterialId,
    /// May mirror and scale.
    pub world_from_object: Affine3A,
}

impl<M> Scene<M> {
    /// The mean of all texels of a texture, decoded; a little above 0 wherever any texel is.
    pub fn mean_texel(&self, map: &material::TextureMap) -> texture::Texel {
        let texture = &self.textures[map.texture.0 as usize];
        let image = &self.images[texture.image.0 as usize];
        let (mut color, mut alpha) = (Rgb::<f64>::BLACK, 0.0);
        for y in 0..image.height {
            for x in 0..image.width {
                let texel = image.texel(x, y, texture.encoding);
                color += texel.color.cast();
                alpha += f64::from(texel.alpha);
            }
        }
        let texels = (f64::from(image.width) * f64::from(image.height)).max(1.0);
        texture::Texel { color: (color / texels).cast(), alpha: (alpha / texels) as f32 }
    }

    /// A scalar parameter's value, or its value at its texture's mean.
    pub fn mean_scalar(&self, param: &material::Param<f32>) -> f32 {
        match param {
            material::Param::Constant(value) => *value,
            material::Param::Texture { map, factor } => map.scalar(&self.mean_texel(map), *factor),
        }
    }

    /// A scene with nothing in it.
    pub fn empty() -> Self {
        Self {
            meshes: Vec::new(),
            instances: Vec::new(),
            materials: Vec::new(),
            textures: Vec::new(),
            images: Vec::new(),
            cameras: Vec::new(),
            lights: Vec::new(),
            environment: None,
        }
    }

    /// The same scene with other materials.
    pub fn map_materials<N>(self, mut convert: impl FnMut(Named<M>) -> Named<N>) -> Scene<N> {
        Scene {
            meshes: self.meshes,
            instances: self.instances,
            materials: self.materials.into_iter().map(&mut convert).collect(),
            textures: self.textures,
            images: self.images,
            cameras: self.cameras,
            lights: self.lights,
            environment: self.environment,
        }
    }

    /// The mesh of an instance.
    pub fn mesh_of(&self, instance: &Instance) -> &Mesh {
        &self.meshes[instance.mesh.0 as usize]
    }

    /// The number of triangles, instances counted.
    pub fn triangle_count(&self) -> usize {
        self.instances.iter().map(|i| self.mesh_of(i).triangles.len()).sum()
    }

    /// The smallest axis-aligned box around every instance's vertices, as (min, max); none for a scene without vertices.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let mut bounds: Option<(Vec3, Vec3)> = None;
        for instance in &self.instances {
            for &p in &self.mesh_of(instance).positions {
                let p = instance.world_from_object.transform_point3(p);
                let (low, high) = bounds.get_or_insert((p, p));
                *low = low.min(p);
                *high = high.max(p);
            }
        }
        bounds
    }
}
