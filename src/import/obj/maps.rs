//! Finding and loading the files that an OBJ or MTL names: beside it, as exporters of all systems write them.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::heights;
use crate::imagefile::ImageFileError;
use crate::import::{Files, Images, Reach};
use crate::record::Warning;
use crate::scene::material::TextureChannel;
use crate::scene::source::{MtlMap, MtlMaterial, MtlSlot};
use crate::scene::texture::{Encoding, TexelFilter, Wrap};
use crate::scene::{Image, ImageId, Texture, TextureId};

/// A file that was found.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Found {
    /// Its name inside the scene's folder.
    pub name: String,
    /// Whether the folders that were named had to be ignored.
    pub elsewhere: bool,
}

/// Why nothing was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum NotFound {
    /// There is no such file.
    #[error("is not there")]
    Missing,
    /// The name leads where the scene's may not.
    #[error("leads out of the scene's folder; hint: --allow-outside lets it")]
    Outside,
    /// Not the name of a file.
    #[error("is a URL; only files are read, nothing is fetched")]
    Url,
}

/// Looks for what a file in `folder` (below the scene's) calls `written`: quotes stripped, backslashes turned, case ignored
/// where there is no exact match, and at last, for paths of another machine, by the file's name alone.
pub(super) fn find(files: &Files, folder: &str, written: &str) -> Result<Found, NotFound> {
    let slashed = written.trim().trim_matches(['"', '\'']).replace('\\', "/");
    let parts: Vec<&str> = slashed.split('/').filter(|part| !part.is_empty() && *part != ".").collect();
    let &last = parts.last().ok_or(NotFound::Missing)?;
    let is_relative = !slashed.starts_with('/') && !parts[0].ends_with(':');
    let inside = is_relative.then(|| collapse(folder, &parts)).flatten();
    let named = match &inside {
        Some(parts) => exact_or_any_case(files, parts),
        None if files.reach() == Reach::Anywhere => exact(files, folder, &slashed),
        None => None,
    };
    if let Some(name) = named {
        return Ok(Found { name, elsewhere: false });
    }
    let beside = collapse(folder, &[last]).and_then(|parts| exact_or_any_case(files, &parts));
    beside.map(|name| Found { name, elsewhere: true }).ok_or_else(|| match inside {
        _ if slashed.contains("://") => NotFound::Url,
        None if files.reach() == Reach::Folder => NotFound::Outside,
        Some(parts) if files.leads_out(&parts.join("/")) => NotFound::Outside,
        _ => NotFound::Missing,
    })
}

/// The name of a file that lies outside the scene's folder.
fn exact(files: &Files, folder: &str, name: &str) -> Option<String> {
    let name = match folder {
        _ if name.starts_with('/') => name.to_owned(),
        "" => name.to_owned(),
        folder => format!("{folder}/{name}"),
    };
    files.exists(&name).then_some(name)
}

/// The parts of a path below the scene's folder, `..` resolved; none if it leads outside.
fn collapse<'a>(folder: &'a str, parts: &[&'a str]) -> Option<Vec<&'a str>> {
    let mut path = Vec::new();
    for part in folder.split('/').filter(|part| !part.is_empty() && *part != ".").chain(parts.iter().copied())
    {
        if part == ".." {
            path.pop()?;
        } else {
            path.push(part);
        }
    }
    Some(path)
}

fn exact_or_any_case(files: &Files, parts: &[&str]) -> Option<String> {
    let exact = parts.join("/");
    if files.exists(&exact) {
        return Some(exact);
    }
    let mut found = String::new();
    for part in parts {
        let names = files.names_in(if found.is_empty() { "." } else { &found });
        let name = names.iter().find(|name| name.to_lowercase() == part.to_lowercase())?;
        if !found.is_empty() {
            found.push('/');
        }
        found.push_str(name);
    }
    files.exists(&found).then_some(found)
}

/// The images and textures of a scene, each loaded once.
#[derive(Debug, Default)]
pub(super) struct Maps {
    pub images: Vec<Arc<Image>>,
    pub textures: Vec<Texture>,
    by_file: BTreeMap<String, Option<ImageId>>,
    /// The normals of heights, by image, channel and what is beyond its edge.
    of_heights: BTreeMap<(ImageId, &'static str, &'static str), ImageId>,
    decoder: Images,
}

impl Maps {
    /// Loads the maps of a material that the conversion reads. One that is missing or unreadable is told and left out.
    pub(super) fn load(
        &mut self,
        files: &mut Files,
        folder: &str,
        material: &mut MtlMaterial,
        warnings: &mut Vec<Warning>,
    ) {
        let library = material.library.clone();
        for (slot, map) in material.maps.iter_mut().filter(|(slot, _)| slot.is_read()) {
            let place = format!("{library}:{}", map.line);
            let mut warn = |message: String| warnings.push(Warning::new(place.clone(), message));
            let found = match find(files, folder, &map.file) {
                Ok(found) => found,
                Err(why) => {
                    warn(format!("{} {:?} {why}; left out", slot.statement(), map.file));
                    continue;
                }
            };
            if found.elsewhere {
                warn(format!("{:?} is not there; {:?} is taken", map.file, found.name));
            }
            let Some(image) = self.image(files, &found.name, &mut warn) else { continue };
            map.has_alpha = matches!(self.images[image.0 as usize].channels, 2 | 4);
            let image = match slot {
                MtlSlot::Bump => match self.normals(image, map) {
                    Ok(normals) => normals,
                    Err(error) => {
                        warn(format!("{error}; the map is left out"));
                        continue;
                    }
                },
                _ => image,
            };
            map.texture = Some(self.texture(image, encoding(*slot), map.wrap));
        }
    }

    fn image(&mut self, files: &mut Files, name: &str, warn: &mut impl FnMut(String)) -> Option<ImageId> {
        if let Some(&known) = self.by_file.get(name) {
            return known;
        }
        let next = ImageId(self.images.len() as u32);
        let loaded = match files.read(name) {
            Ok(bytes) => match self.decoder.decode(&bytes, name) {
                Ok((image, replaced)) => {
                    replaced.into_iter().for_each(|w| warn(w.message));
                    Some(image)
                }
                Err(error) => {
                    warn(format!("{error}; the map is left out"));
                    None
                }
            },
            Err(error) => {
                warn(format!("{error}; the map is left out"));
                None
            }
        };
        let id = loaded.map(|image| {
            self.images.push(Arc::new(image));
            next
        });
        self.by_file.insert(name.to_owned(), id);
        id
    }

    /// The normals of a bump map's image: its own, or those of the heights that it holds.
    fn normals(&mut self, image: ImageId, map: &mut MtlMap) -> Result<ImageId, ImageFileError> {
        let source = &self.images[image.0 as usize];
        map.holds_normals = map.channel.is_none() && heights::are_normals(source);
        if map.holds_normals {
            return Ok(image);
        }
        let channel = map.channel.unwrap_or(TextureChannel::Y);
        let key = (image, channel.name(), map.wrap.name());
        if let Some(&known) = self.of_heights.get(&key) {
            return Ok(known);
        }
        self.decoder.count(heights::normals_bytes(source), &source.name)?;
        let normals = heights::normals(source, channel, map.wrap);
        let next = ImageId(self.images.len() as u32);
        self.images.push(Arc::new(normals));
        self.of_heights.insert(key, next);
        Ok(next)
    }

    fn texture(&mut self, image: ImageId, encoding: Encoding, wrap: Wrap) -> TextureId {
        let texture = Texture { image, encoding, wrap: [wrap; 2], filter: TexelFilter::Bilinear };
        let at = self.textures.iter().position(|t| *t == texture).unwrap_or_else(|| {
            self.textures.push(texture);
            self.textures.len() - 1
        });
        TextureId(at as u32)
    }
}

/// Colours are encoded as displays want them, everything else holds numbers.
const fn encoding(slot: MtlSlot) -> Encoding {
    match slot {
        MtlSlot::Kd | MtlSlot::Ks | MtlSlot::Ke => Encoding::Srgb,
        _ => Encoding::Linear,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_as_other_systems_write_them() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir_all(folder.path().join("models/Tex")).unwrap();
        std::fs::write(folder.path().join("models/Tex/Wood A.PNG"), "x").unwrap();
        std::fs::write(folder.path().join("models/stone.png"), "x").unwrap();
        let files = Files::new(folder.path(), Reach::Folder).unwrap();
        let name = |written: &str| find(&files, "models", written).ok().map(|f| (f.name, f.elsewhere));
        let wood = Some(("models/Tex/Wood A.PNG".to_owned(), false));
        for written in ["Tex/Wood A.PNG", "\"tex\\wood a.png\"", "./TEX//wood a.png", "tex/../Tex/Wood A.PNG"]
        {
            assert_eq!(name(written), wood, "{written}");
        }
        let stone = Some(("models/stone.png".to_owned(), true));
        for written in ["C:\\art\\STONE.png", "/textures/stone.png", "../../../stone.png", "gone/stone.png"] {
            assert_eq!(name(written), stone, "{written}");
        }
        assert_eq!(name("none.png"), None);
        assert_eq!(name(""), None);
    }
}
