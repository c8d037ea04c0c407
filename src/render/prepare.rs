//! What a job needs beyond geometry: materials, lights and camera.

use std::sync::Arc;

use glam::Vec2;

use super::RenderError;
use super::adaptive;
use super::camera::FilmCamera;
use super::filter::FilterSampler;
use super::geometry::Geometry;
use super::light_path::LightPaths;
use super::material::PreparedMaterial;
use super::medium::Medium;
use super::pilot;
use super::range;
use super::reuse::BlockSize;
use super::splitting::BRANCHES;
use super::techniques::Techniques;
use crate::accel::Ray;
use crate::light::{EmissiveTriangle, EnvironmentLight, EnvironmentTables, Lights, Partner};
use crate::scene::environment::EnvironmentMap;
use crate::scene::{Camera, MaterialId, Named, Scene};
use crate::settings::{Integrator, RenderSettings, Use};

/// One light path for so many camera paths. Their noise is little, so few will do: in the Cornell boxes work is within 15% with an eighth
/// to a half of a light path for each camera path.
const PIXELS_PER_PATH: u32 = 4;
/// Sums of light paths over pixels and parts of their samples, of 24 bytes each.
const MOST_SUMS: u64 = 1 << 28;

/// The size of images where neither settings nor camera say one.
const DEFAULT_SIZE: (u32, u32) = (640, 480);

/// A scene ready to be rendered with given settings.
#[derive(Debug)]
pub struct Prepared {
    pub(super) scene: Arc<Scene>,
    pub(super) geometry: Arc<Geometry>,
    pub(super) materials: Vec<PreparedMaterial>,
    /// The material of each instance.
    material_of: Vec<MaterialId>,
    pub(super) lights: Lights,
    pub(super) camera: FilmCamera,
    pub(super) filter: FilterSampler,
    pub(super) settings: RenderSettings,
    pub(super) width: u32,
    pub(super) height: u32,
    /// What the camera is in: the inside of the first interface along its axis, if that is met from behind.
    pub(super) camera_medium: Medium,
    /// Some medium between surfaces absorbs light.
    has_media: bool,
    /// Paths start from lights too, or why not.
    pub(super) light_paths: Result<LightPaths, String>,
    /// No surface is partly there, so that a ray needs no look at materials.
    pub(super) all_covered: bool,
    /// No surface lets shadow rays pass, so that they need none either.
    pub(super) all_opaque: bool,
    pub(super) techniques: Techniques,
    /// Neighbouring pixels use each other's paths, or why not.
    pub(super) path_reuse: Result<BlockSize, String>,
    /// Samples branch at their first surface, or why they don't.
    pub(super) splitting: Result<(), String>,
    /// Noisy parts of the picture get more samples than others; or why not.
    pub(super) adaptive: Result<(), String>,
}

impl Prepared {
    /// Prepares `scene`, whose triangles `geometry` holds.
    ///
    /// # Errors
    /// [`RenderError`] for settings and textures out of range and missing or unusable cameras.
    pub fn new(
        scene: Arc<Scene>,
        geometry: Arc<Geometry>,
        settings: &RenderSettings,
    ) -> Result<Self, RenderError> {
        Self::sharing(scene, geometry, &EnvironmentTables::default(), settings)
    }

    /// As [`Self::new`]; what is to be known of the environment is taken from `tables`, or put there for the next.
    ///
    /// # Errors
    /// As above.
    pub fn sharing(
        scene: Arc<Scene>,
        geometry: Arc<Geometry>,
        tables: &EnvironmentTables,
        settings: &RenderSettings,
    ) -> Result<Self, RenderError> {
        let camera = choose_camera(&scene, settings)?;
        let (width, height) = size_for(&camera.item, settings);
        check(settings, width, height)?;
        range::check(&scene)?;
        let film_camera = FilmCamera::new(&camera.name, &camera.item, geometry.origin(), width, height)?;
        let materials: Vec<_> = scene.materials.iter().map(|m| PreparedMaterial::new(&m.item)).collect();
        if let Some(light) = scene.lights.iter().find(|l| !(l.item.color * l.item.intensity).is_finite()) {
            return Err(RenderError::LightEmission { light: light.name.clone() });
        }
        for (material, prepared) in scene.materials.iter().zip(&materials) {
            if prepared.mean_emission(&scene).is_some_and(|(radiance, _)| !radiance.is_finite()) {
                return Err(RenderError::Emission { material: material.name.clone() });
            }
        }
        let lights = collect_lights(&scene, &geometry, &materials, light_partner(settings), tables);
        let all = |is: fn(&PreparedMaterial) -> bool| {
            scene.instances.iter().all(|i| is(&materials[i.material.0 as usize]))
        };
        let all_covered = all(PreparedMaterial::covers_all);
        let all_opaque = all(PreparedMaterial::blocks_shadow_rays);
        let filter = FilterSampler::new(settings.filter, settings.filter_radius);
        let light_paths = light_paths(settings, &film_camera, &filter, &lights, width * height);
        let mut prepared = Self {
            camera: film_camera,
            filter,
            light_paths,
            has_media: materials.iter().any(|m| m.absorption.is_some()),
            settings: settings.clone(),
            material_of: scene.instances.iter().map(|i| i.material).collect(),
            materials,
            lights,
            width,
            height,
            camera_medium: None,
            all_covered,
            all_opaque,
            techniques: Techniques::default(),
            path_reuse: Err(String::new()),
            splitting: Err(String::new()),
            adaptive: adaptive(settings),
            scene,
            geometry,
        };
        prepared.camera_medium = prepared.medium_around(&prepared.camera.axis_ray());
        let path_reuse = path_reuse(settings, all_opaque);
        let splitting = splitting(settings);
        let choice = pilot::choose(&prepared, path_reuse.is_ok(), splitting.is_ok());
        prepared.light_paths = prepared.light_paths.and_then(|plan| choice.light_paths.map(|()| plan));
        prepared.path_reuse = path_reuse.and(choice.path_reuse);
        prepared.splitting = splitting.and(choice.splitting);
        prepared.adaptive = prepared.adaptive.and(choice.adaptive);
        Ok(prepared)
    }

    /// The same with these techniques alone, for measuring what the others are worth.
    #[must_use]
    pub fn with(mut self, techniques: Techniques) -> Self {
        if !techniques.constants {
            self.materials =
                self.scene.materials.iter().map(|m| PreparedMaterial::varying(&m.item)).collect();
        }
        if !techniques.lobes_by_albedo {
            self.materials = self.materials.into_iter().map(PreparedMaterial::with_equal_lobes).collect();
        }
        leave_out(&mut self.light_paths, !techniques.light_paths);
        leave_out(&mut self.path_reuse, !techniques.path_reuse);
        leave_out(&mut self.adaptive, !techniques.adaptive);
        leave_out(&mut self.splitting, !techniques.splitting);
        self.all_covered &= techniques.coverage;
        self.all_opaque &= techniques.coverage;
        self.techniques = techniques;
        self
    }

    /// Paths start from lights too: those of the camera are but a part of the picture.
    pub fn has_light_paths(&self) -> bool {
        self.light_paths.is_ok()
    }

    /// Neighbouring pixels use each other's paths.
    pub fn has_path_reuse(&self) -> bool {
        self.path_reuse.is_ok()
    }

    /// Columns and rows of the blocks whose pixels use each other's paths, if they do.
    pub fn reuse_block(&self) -> Option<(u32, u32)> {
        self.path_reuse.as_ref().ok().map(|block| block.sides())
    }

    /// No pixel has more samples than this.
    pub fn most_samples(&self) -> u32 {
        if self.is_adaptive() { adaptive::most_samples(self.settings.spp) } else { self.settings.spp }
    }

    /// Noisy parts of the picture get more samples than others.
    pub fn is_adaptive(&self) -> bool {
        self.adaptive.is_ok()
    }

    /// Samples branch at their first surface.
    pub fn has_splitting(&self) -> bool {
        self.splitting.is_ok()
    }

    /// How many times as good camera paths are as light paths take them to be: each is used by all pixels of its block, and each sample has
    /// as many as it has branches.
    #[inline]
    pub(super) fn camera_weight(&self) -> f32 {
        let branches = if self.splitting.is_ok() { BRANCHES.len() as f32 } else { 1.0 };
        self.path_reuse.as_ref().map_or(branches, |block| block.pixels() as f32 * branches)
    }

    /// Columns and rows of the image.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// The position is within the filter of a pixel of the picture.
    pub(super) fn is_on_film(&self, film: Vec2) -> bool {
        let beyond = self.filter.radius() - 0.5;
        let inside = |x: f32, length: u32| x > -beyond && x < length as f32 + beyond;
        inside(film.x, self.width) && inside(film.y, self.height)
    }

    /// The pixels whose filter a position on the film is in, with their filter's density there.
    #[inline]
    pub(super) fn pixels_at(&self, film: Vec2, mut each: impl FnMut(u32, u32, f32)) {
        let radius = self.filter.radius();
        let reach = |x: f32, length: u32| {
            let first = (x - radius - 0.5).ceil().max(0.0) as u32;
            first..((x + radius - 0.5).floor() + 1.0).clamp(0.0, length as f32) as u32
        };
        for y in reach(film.y, self.height) {
            for x in reach(film.x, self.width) {
                let offset = film - Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                each(x, y, self.filter.density(offset.x) * self.filter.density(offset.y));
            }
        }
    }

    /// What a ray that starts anywhere is in: the inside of the first interface on its way, if that is met from behind.
    pub(super) fn medium_around(&self, ray: &Ray) -> Medium {
        if !self.has_media {
            return None;
        }
        let hit = self.geometry.bvh.closest_where(ray, |hit| self.material_of(hit.triangle).is_interface)?;
        let normal = self.geometry.at(&hit).geometric_normal();
        let is_behind = normal.is_some_and(|n| n.dot(ray.direction) > 0.0);
        self.material_of(hit.triangle).absorption.filter(|_| is_behind)
    }

    #[inline]
    pub(super) fn material_of(&self, triangle: u32) -> &PreparedMaterial {
        &self.materials[self.material_index(triangle)]
    }

    #[inline]
    pub(super) fn material_index(&self, triangle: u32) -> usize {
        self.material_of[self.geometry.instance_of(triangle)].0 as usize
    }
}

fn choose_camera<'a>(scene: &'a Scene, settings: &RenderSettings) -> Result<&'a Named<Camera>, RenderError> {
    match &settings.camera {
        None => scene.cameras.first().ok_or(RenderError::NoCamera),
        Some(name) => {
            scene.cameras.iter().find(|c| c.name == *name).ok_or_else(|| RenderError::UnknownCamera {
                name: name.clone(),
                known: scene.cameras.iter().map(|c| c.name.clone()).collect(),
            })
        }
    }
}

/// Columns and rows of the image: the settings decide; a size that is missing comes from the camera, keeping its aspect.
///
/// # Errors
/// If the camera is missing.
pub fn image_size(scene: &Scene, settings: &RenderSettings) -> Result<(u32, u32), RenderError> {
    Ok(size_for(&choose_camera(scene, settings)?.item, settings))
}

fn size_for(camera: &Camera, settings: &RenderSettings) -> (u32, u32) {
    let (default_width, default_height) = camera.size.unwrap_or(DEFAULT_SIZE);
    let aspect = match (camera.size, camera.aspect) {
        (None, Some(aspect)) if aspect.is_finite() && aspect > 0.0 => f64::from(aspect),
        _ => f64::from(default_width) / f64::from(default_height),
    };
    let round = |x: f64| x.round().clamp(1.0, f64::from(u32::MAX)) as u32;
    match (settings.width, settings.height) {
        (Some(width), Some(height)) => (width, height),
        (Some(width), None) => (width, round(f64::from(width) / aspect)),
        (None, height) => {
            let height = height.unwrap_or(default_height);
            (round(f64::from(height) * aspect), height)
        }
    }
}

fn check(settings: &RenderSettings, width: u32, height: u32) -> Result<(), RenderError> {
    let positive = |setting, value: u32, max: u32, expected| {
        if (1..=max).contains(&value) {
            Ok(())
        } else {
            Err(RenderError::Setting { setting, value: value.to_string(), expected })
        }
    };
    positive("width", width, 65_536, "between 1 and 65536")?;
    positive("height", height, 65_536, "between 1 and 65536")?;
    positive("spp", settings.spp, 1 << 24, "between 1 and 16777216")?;
    positive("replicates", settings.replicates, 64, "between 1 and 64")?;
    positive("max_depth", settings.max_depth.saturating_add(1), 65_536, "between 0 and 65535")?;
    if u64::from(width) * u64::from(height) > 1 << 26 {
        let value = format!("{width} × {height}");
        return Err(RenderError::Setting {
            setting: "width × height",
            value,
            expected: "at most 2^26 pixels",
        });
    }
    if let Some(error) = settings.error {
        let value = error.to_string();
        if !(error > 0.0 && error <= 1.0) {
            return Err(RenderError::Setting { setting: "error", value, expected: "above 0 and at most 1" });
        }
        if settings.parts() < 2 {
            let expected = "left out with a single sample, which has no spread to tell an error from";
            return Err(RenderError::Setting { setting: "error", value, expected });
        }
    }
    match settings.filter_radius {
        Some(radius) if !(0.1..=8.0).contains(&radius) => Err(RenderError::Setting {
            setting: "filter_radius",
            value: radius.to_string(),
            expected: "between 0.1 and 8 pixels",
        }),
        _ => Ok(()),
    }
}

/// How many light paths there are to be, or why none.
fn light_paths(
    settings: &RenderSettings,
    camera: &FilmCamera,
    filter: &FilterSampler,
    lights: &Lights,
    pixels: u32,
) -> Result<LightPaths, String> {
    let sums = u64::from(pixels) * u64::from(settings.parts());
    let needed = [
        (settings.light_paths != Use::Never, "the settings ask for none"),
        (light_partner(settings) == Partner::Bsdf, "they are weighed against both other ways to find light"),
        (settings.max_depth > 0, "no light is scattered"),
        (lights.can_emit(), "no surface emits light, nor does the environment from few directions"),
        (camera.can_see_points(), "the camera's rays are parallel"),
        (filter.radius() > 0.0, "the filter is a point"),
        (sums <= MOST_SUMS, "there are too many replicates for so many pixels"),
    ];
    all_given(needed).map(|()| LightPaths { per_sample: pixels.div_ceil(PIXELS_PER_PATH) })
}

/// Everything that is needed is given, or why the first of the rest is missed.
fn all_given<const N: usize>(needed: [(bool, &str); N]) -> Result<(), String> {
    match needed.into_iter().find(|(is_given, _)| !is_given) {
        Some((_, why)) => Err(why.to_owned()),
        None => Ok(()),
    }
}

/// That noisy parts of a picture may get more samples than others, or why not.
fn adaptive(settings: &RenderSettings) -> Result<(), String> {
    let needed = [
        (settings.adaptive != Use::Never, "the settings ask for none"),
        (settings.integrator == Integrator::Path, "no paths are traced"),
        (settings.error.is_none(), "samples go on until the error is small enough"),
        (settings.spp >= adaptive::FEWEST_SAMPLES, "with so few samples the first of them tell nothing"),
    ];
    all_given(needed)
}

/// That samples may branch, or why not.
fn splitting(settings: &RenderSettings) -> Result<(), String> {
    let needed = [
        (settings.splitting != Use::Never, "the settings ask for none"),
        (settings.integrator == Integrator::Path, "no paths go on from the first surface"),
        (settings.max_depth > 0, "no light is scattered"),
    ];
    all_given(needed)
}

/// That neighbouring pixels may use each other's paths, or why not.
fn path_reuse(settings: &RenderSettings, all_opaque: bool) -> Result<(), String> {
    let needed = [
        (settings.path_reuse != Use::Never, "the settings ask for none"),
        (light_partner(settings) == Partner::Bsdf, "both ways to find light are needed to weigh it"),
        (settings.max_depth > 1, "no light is scattered twice"),
        (all_opaque, "some surface lets light go straight through"),
    ];
    all_given(needed)
}

/// What else finds the light that is sampled.
fn light_partner(settings: &RenderSettings) -> Partner {
    let weighs_both = settings.nee && settings.mis && settings.integrator == Integrator::Path;
    if weighs_both { Partner::Bsdf } else { Partner::None }
}

fn leave_out<T>(technique: &mut Result<T, String>, is_left_out: bool) {
    if is_left_out {
        *technique = Err("left out".to_owned());
    }
}

fn collect_lights(
    scene: &Scene,
    geometry: &Geometry,
    materials: &[PreparedMaterial],
    partner: Partner,
    tables: &EnvironmentTables,
) -> Lights {
    let emission: Vec<_> = materials.iter().map(|m| m.mean_emission(scene)).collect();
    let triangles: Vec<EmissiveTriangle> = geometry
        .materials(scene)
        .filter_map(|(triangle, material)| {
            let (mean_radiance, sides) = emission[material.0 as usize]?;
            Some(EmissiveTriangle {
                triangle,
                vertices: geometry.vertices(triangle),
                mean_radiance,
                sides,
                is_mirrored: geometry.handedness(triangle) < 0.0,
            })
        })
        .collect();
    let punctual: Vec<_> = scene.lights.iter().map(|l| l.item.relative_to(geometry.origin())).collect();
    let environment = scene.environment.as_ref().map(|e| {
        let image = match e.map {
            EnvironmentMap::Image { image, .. } => Some(&scene.images[image.0 as usize]),
            EnvironmentMap::Constant => None,
        };
        EnvironmentLight::new(e, image, partner, tables)
    });
    Lights::new(&triangles, &punctual, environment, geometry.sphere)
}
