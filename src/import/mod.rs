//! Files into scenes: glTF, OBJ and Aris, each in a room of its own.
//!
//! An importer reads files through [`Files`], which keeps it inside the scene's folder and counts what it read, and returns an
//! [`Imported`]: the scene with its dialect's own materials, and what was noticed on the way. What all dialects owe the renderer
//! (finite positions, indices in range, unique names) is seen to here, once, after the dialect is done.

mod aris;
mod files;
mod gltf;
mod images;
mod obj;
mod validate;

use std::borrow::Cow;
use std::io::Read;
use std::path::{Path, PathBuf};

pub use aris::{ArisConfig, ArisError, ArisRun};
pub(crate) use aris::{is_scene as is_aris_scene, yaml};
pub use files::{FileDigest, FileError, Files};
pub use gltf::{GltfError, UriProblem};
pub use images::{EnvironmentError, Images, read_environment, read_image};
pub use obj::ObjError;
pub use validate::InvalidScene;

pub use crate::settings::{DecodedImages, ImportOptions, LightUnits, Reach};

use crate::record::Warning;
use crate::scene::Scene;
use crate::scene::source::SourceMaterial;

/// The most that a packed file may unpack to, in bytes.
const MAX_UNPACKED: u64 = 4 << 30;

/// What a packed file may unpack to, however small it is, in bytes; and what for each of its own beyond that. Meshes come to 2 to 10, text that
/// repeats itself to some 30.
const FREE_UNPACKED: u64 = 4 << 20;
const UNPACKED_PER_BYTE: u64 = 64;

/// A scene as its file describes it.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The scene with its dialect's materials.
    pub scene: Scene<SourceMaterial>,
    /// What was not as it should be.
    pub warnings: Vec<Warning>,
    /// Every file that was read, in order: the scene's identity.
    pub files: Vec<FileDigest>,
    /// The folder that the names of `files` count from.
    pub folder: PathBuf,
}

/// Why a scene could not be imported.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The file's name has an ending that no importer reads.
    #[error("{}: no importer for this kind of file; known are .gltf, .glb and .obj, each also with .gz or .zst, and .yaml and .yml", path.display())]
    UnknownExtension {
        /// The file.
        path: PathBuf,
    },
    /// The scene's name isn't text.
    #[error("{}: the file's name is not valid Unicode", path.display())]
    Name {
        /// The file.
        path: PathBuf,
    },
    /// The scene's file can't be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// A `.gz` or `.zst` that is damaged.
    #[error("{} cannot be unpacked: {cause}", path.display())]
    Unpack {
        /// The file.
        path: PathBuf,
        /// The decoder's reason.
        cause: std::io::Error,
    },
    /// A packed file that unpacks to more than any scene of its size.
    #[error("{} unpacks to more than {limit} bytes, more than any scene packed so small", path.display())]
    UnpackedTooLarge {
        /// The file.
        path: PathBuf,
        /// What it may unpack to.
        limit: u64,
    },
    /// A glTF file that can't be imported.
    #[error("{}: {cause}", path.display())]
    Gltf {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: Box<GltfError>,
    },
    /// An OBJ file that can't be imported.
    #[error(transparent)]
    Obj(#[from] ObjError),
    /// An Aris scene that can't be imported.
    #[error(transparent)]
    Aris(#[from] Box<ArisError>),
    /// A scene that was read but can't be rendered.
    #[error("{}: {cause}", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: InvalidScene,
    },
}

/// The scene in the file `path`, a `.gltf`, `.glb`, `.obj`, `.yaml` or `.yml`, or one of the first three packed as `.gz` or `.zst`.
///
/// Positions of the result are finite, indices in range, triangles not degenerate, normals of unit length and names unique;
/// what had to be mended is in the warnings. Every vertex belongs to a triangle, and every instance has triangles.
///
/// # Errors
/// If the file or one that it names can't be read, isn't what it claims to be, needs an extension that is not read, has values
/// out of range, or leaves nothing to render.
pub fn import(path: &Path, options: &ImportOptions) -> Result<Imported, ImportError> {
    let (name, dialect) = name_and_dialect(path)?;
    let mut files = Files::new(path.parent().unwrap_or(Path::new("")), options.reach)?;
    let bytes = files.read(name)?;
    import_with(files, path, name, dialect, &bytes, options)
}

/// The scene in `bytes`, the content of a file that would be `path`: its ending chooses the importer, and the files that it names
/// are read from the folder it would lie in.
///
/// # Errors
/// As for [`import`].
pub fn import_bytes(path: &Path, bytes: &[u8], options: &ImportOptions) -> Result<Imported, ImportError> {
    let (name, dialect) = name_and_dialect(path)?;
    let mut files = Files::new(path.parent().unwrap_or(Path::new("")), options.reach)?;
    files.note(name, bytes);
    import_with(files, path, name, dialect, bytes, options)
}

/// The scene of a composed configuration of Aris, and how to render it.
///
/// # Errors
/// As for [`import`]: the messages name file and key, or the override.
pub fn import_configured(config: &ArisConfig) -> Result<ArisRun, ImportError> {
    let mut run = config.import().map_err(Box::new)?;
    let Imported { scene, warnings, .. } = &mut run.imported;
    validate::validate(scene, config.name(), warnings)
        .map_err(|cause| ImportError::Invalid { path: config.name().into(), cause })?;
    Ok(run)
}

fn name_and_dialect(path: &Path) -> Result<(&str, Dialect), ImportError> {
    let name = path.file_name().unwrap_or_default();
    let name = name.to_str().ok_or_else(|| ImportError::Name { path: path.to_owned() })?;
    let dialect = Dialect::of(name);
    dialect.map(|d| (name, d)).ok_or_else(|| ImportError::UnknownExtension { path: path.to_owned() })
}

/// Imports the content of the scene's own file, which `files` has counted, and sees to what all dialects owe.
fn import_with(
    mut files: Files,
    path: &Path,
    name: &str,
    dialect: Dialect,
    bytes: &[u8],
    options: &ImportOptions,
) -> Result<Imported, ImportError> {
    let (_, packing) = Packing::of(name);
    let bytes = match packing {
        Some(packing) => {
            let limit = FREE_UNPACKED + UNPACKED_PER_BYTE.saturating_mul(bytes.len() as u64);
            Cow::Owned(packing.unpack(bytes, path, limit.min(MAX_UNPACKED))?)
        }
        None => Cow::Borrowed(bytes),
    };
    let mut of_config = None;
    let (mut scene, mut warnings) = match dialect {
        Dialect::Gltf => gltf::import(&mut files, name, &bytes, options)
            .map_err(|cause| ImportError::Gltf { path: path.to_owned(), cause: Box::new(cause) })?,
        Dialect::Obj => obj::import(&mut files, name, &bytes)?,
        Dialect::Aris => {
            // Its folder is the one that holds `config/`, above the scene's own, and so are its files.
            let imported = aris::import(path, options.reach).map_err(Box::new)?;
            of_config = Some((imported.folder, imported.files));
            (imported.scene, imported.warnings)
        }
    };
    let gltf_alone = options.variant.is_some() || options.animation.is_some() || options.time.is_some();
    if dialect != Dialect::Gltf && gltf_alone {
        let message = "variants and animations are glTF's: those asked for are of no effect";
        warnings.push(Warning::new(name, message));
    }
    validate::validate(&mut scene, name, &mut warnings)
        .map_err(|cause| ImportError::Invalid { path: path.to_owned(), cause })?;
    let (folder, files) = of_config.unwrap_or_else(|| (files.root().to_owned(), files.into_digests()));
    Ok(Imported { scene, warnings, files, folder })
}

/// The kinds of files that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Dialect {
    Gltf,
    Obj,
    Aris,
}

impl Dialect {
    /// The kind of the file called `name`, by its ending.
    fn of(name: &str) -> Option<Self> {
        let (unpacked, packing) = Packing::of(name);
        match unpacked.to_ascii_lowercase().rsplit_once('.')?.1 {
            "gltf" | "glb" => Some(Self::Gltf),
            "obj" => Some(Self::Obj),
            "yaml" | "yml" if packing.is_none() => Some(Self::Aris),
            _ => None,
        }
    }
}

/// How a file is packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Packing {
    Gzip,
    Zstandard,
}

impl Packing {
    /// The name without the packing's ending, and the packing.
    fn of(name: &str) -> (&str, Option<Self>) {
        let stem = |ending: &str| {
            let at = name.len().checked_sub(ending.len())?;
            name.get(at..)?.eq_ignore_ascii_case(ending).then(|| &name[..at])
        };
        match (stem(".gz"), stem(".zst")) {
            (Some(stem), _) => (stem, Some(Self::Gzip)),
            (_, Some(stem)) => (stem, Some(Self::Zstandard)),
            _ => (name, None),
        }
    }

    /// `packed` unpacked, at most `limit` bytes.
    fn unpack(self, packed: &[u8], path: &Path, limit: u64) -> Result<Vec<u8>, ImportError> {
        let failed = |cause| ImportError::Unpack { path: path.to_owned(), cause };
        let most = limit.saturating_add(1);
        let mut bytes = Vec::new();
        match self {
            Self::Gzip => flate2::read::MultiGzDecoder::new(packed).take(most).read_to_end(&mut bytes),
            Self::Zstandard => ruzstd::StreamingDecoder::new(packed)
                .map_err(|cause| failed(std::io::Error::other(cause)))?
                .take(most)
                .read_to_end(&mut bytes),
        }
        .map_err(failed)?;
        if bytes.len() as u64 > limit {
            return Err(ImportError::UnpackedTooLarge { path: path.to_owned(), limit });
        }
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn the_ending_chooses_the_importer() {
        for (name, dialect) in [
            ("a.glb", Some(Dialect::Gltf)),
            ("a.GLTF", Some(Dialect::Gltf)),
            ("a.b.obj.gz", Some(Dialect::Obj)),
            ("kitchen.OBJ.ZST", Some(Dialect::Obj)),
            ("cbox.yml", Some(Dialect::Aris)),
            ("a.gz", None),
            ("cbox.yaml.gz", None),
            ("glb", None),
            ("a.fbx", None),
        ] {
            assert_eq!(Dialect::of(name), dialect, "{name}");
        }
        let error = import(Path::new("some/where.fbx"), &ImportOptions::default()).unwrap_err();
        assert!(error.to_string().contains(".glb"), "{error}");
    }

    #[test]
    fn unpacking_is_bounded_and_damage_is_told() {
        let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
        packer.write_all(&[0; 100_000]).unwrap();
        let packed = packer.finish().unwrap();
        let path = Path::new("x.glb.gz");
        let gunzip = |packed: &[u8], limit| Packing::Gzip.unpack(packed, path, limit);
        assert_eq!(gunzip(&packed, 100_000).unwrap().len(), 100_000);
        assert!(matches!(gunzip(&packed, 99_999), Err(ImportError::UnpackedTooLarge { .. })));
        let half = &packed[..packed.len() / 2];
        assert!(matches!(gunzip(half, 100_000), Err(ImportError::Unpack { .. })));
        // A frame of one block that repeats a zero 100,000 times: RFC 8878, section 3.1.1.2.
        let repeated = [0x28, 0xb5, 0x2f, 0xfd, 0xa0, 0xa0, 0x86, 0x01, 0x00, 0x03, 0x35, 0x0c, 0x00];
        let unzstd = |packed: &[u8], limit| Packing::Zstandard.unpack(packed, Path::new("x.obj.zst"), limit);
        assert_eq!(unzstd(&repeated, 100_000).unwrap(), vec![0; 100_000]);
        assert!(matches!(unzstd(&repeated, 99_999), Err(ImportError::UnpackedTooLarge { .. })));
        for damaged in [&repeated[..8], &packed, b""] {
            assert!(matches!(unzstd(damaged, 100_000), Err(ImportError::Unpack { .. })));
        }
    }

    #[test]
    fn a_missing_file_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let error = import(&folder.path().join("none.glb"), &ImportOptions::default()).unwrap_err();
        assert!(matches!(&error, ImportError::File(FileError::Read { .. })), "{error}");
        assert!(error.to_string().contains("none.glb"));
    }
}
