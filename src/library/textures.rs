//! The images that a written text names, each in a file of its own beside it.

use std::path::Path;
use std::sync::Arc;

use super::TakenNames;
use crate::imagefile::{ImageFileError, Interleaved, encode_texture, write_whole};
use crate::manifest::names::plain_name;
use crate::scene::texture::{Image, Pixels};
use crate::scene::{ImageId, Scene};

/// The folder beside the text that holds them.
const FOLDER: &str = "textures";

/// The images of a scene with files for those that are used.
#[derive(Clone, Debug)]
pub struct TextureFiles<'a> {
    images: &'a [Arc<Image>],
    /// By image, relative to the text.
    files: Vec<Option<String>>,
    taken: TakenNames,
}

impl<'a> TextureFiles<'a> {
    /// Of a scene, none of them used.
    pub fn new<M>(scene: &'a Scene<M>) -> Self {
        Self { images: &scene.images, files: vec![None; scene.images.len()], taken: TakenNames::default() }
    }

    /// The file of an image, named after it: PNG for integers, EXR for floats. It will be written.
    pub fn of(&mut self, image: ImageId) -> String {
        let index = image.0 as usize;
        if let Some(file) = &self.files[index] {
            return file.clone();
        }
        let image = &self.images[index];
        let stem = Path::new(&image.name).file_stem().map_or("image".into(), |s| s.to_string_lossy());
        let stem = plain_name(&stem);
        let extension = if matches!(image.pixels, Pixels::F32(_)) { "exr" } else { "png" };
        let file = self.taken.take(format!("{FOLDER}/{stem}.{extension}"), |number| {
            format!("{FOLDER}/{stem}-{number}.{extension}")
        });
        self.files[index] = Some(file.clone());
        file
    }

    /// The files of those that are used, relative to the text.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.files.iter().flatten().map(String::as_str)
    }

    /// How many are used.
    pub fn count(&self) -> usize {
        self.names().count()
    }

    /// Writes those that are used into the folder of the text, `folder`; their own folder is made where it is missing.
    ///
    /// # Errors
    /// If an image can't be encoded or a file not written.
    pub fn save(&self, folder: &Path) -> Result<(), ImageFileError> {
        if self.count() > 0 {
            let own = folder.join(FOLDER);
            std::fs::create_dir_all(&own)
                .map_err(|cause| ImageFileError::Write { path: own.clone(), cause })?;
        }
        for (file, image) in self.files.iter().zip(self.images).filter_map(|(f, i)| Some((f.as_ref()?, i))) {
            let pixels = match &image.pixels {
                Pixels::U8(values) => Interleaved::U8(values),
                Pixels::U16(values) => Interleaved::U16(values),
                Pixels::F32(values) => Interleaved::F32(values),
                // Which the encoder refuses: an import for writing decodes all.
                Pixels::Undecoded => Interleaved::U8(&[]),
            };
            let bytes = encode_texture(image.width, image.height, image.channels, pixels)?;
            write_whole(&folder.join(file), &bytes)?;
        }
        Ok(())
    }
}
