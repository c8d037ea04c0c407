//! Reading files of a scene: never outside its folder, never more than a limit, each one counted.

use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// The largest file that is read, in bytes.
const MAX_FILE: u64 = 4 << 30;

/// A file that was read and the hash of its bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileDigest {
    /// The name as the scene gives it, relative to the scene's folder.
    pub name: String,
    /// BLAKE3 of the content.
    pub digest: blake3::Hash,
}

/// Why a file of a scene could not be read.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// It isn't there, or can't be opened or read.
    #[error("cannot read {}: {cause}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        cause: std::io::Error,
    },
    /// The name leads out of the scene's folder.
    #[error("{name:?} leads out of the scene's folder {}", root.display())]
    Outside {
        /// The name as the scene gives it.
        name: String,
        /// The folder.
        root: PathBuf,
    },
    /// It is larger than any file should be.
    #[error("{} has {size} bytes; at most {MAX_FILE} are read", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its size.
        size: u64,
    },
}

/// The folder of a scene, and what was read from it.
#[derive(Debug)]
pub struct Files {
    root: PathBuf,
    read: Vec<FileDigest>,
}

impl Files {
    /// Reading from `root`, the scene's folder.
    ///
    /// # Errors
    /// If the folder does not exist.
    pub fn new(root: &Path) -> Result<Self, FileError> {
        let root = if root.as_os_str().is_empty() { Path::new(".") } else { root };
        let canonical = root.canonicalize().map_err(|cause| FileError::Read { path: root.into(), cause })?;
        Ok(Self { root: canonical, read: Vec::new() })
    }

    /// The content of the file that the scene calls `name`: a relative path inside the scene's folder. A link is followed as
    /// long as it stays inside.
    ///
    /// # Errors
    /// If the name leads outside, or the file is missing, too large or unreadable.
    pub fn read(&mut self, name: &str) -> Result<Vec<u8>, FileError> {
        let path = self.locate(name)?;
        let failed = |cause| FileError::Read { path: path.clone(), cause };
        let file = File::open(&path).map_err(failed)?;
        let size = file.metadata().map_err(failed)?.len();
        if size > MAX_FILE {
            return Err(FileError::TooLarge { path, size });
        }
        let mut bytes = Vec::with_capacity(size as usize);
        // A file may grow while it is read.
        file.take(MAX_FILE).read_to_end(&mut bytes).map_err(failed)?;
        self.note(name, &bytes);
        Ok(bytes)
    }

    /// Counts `bytes`, the content of the file that the scene calls `name`, as read.
    pub(super) fn note(&mut self, name: &str, bytes: &[u8]) {
        self.read.push(FileDigest { name: name.to_owned(), digest: blake3::hash(bytes) });
    }

    /// Whether `name` is a file inside the folder.
    pub fn exists(&self, name: &str) -> bool {
        self.locate(name).is_ok_and(|path| path.is_file())
    }

    /// Whether `name` is a folder inside the folder.
    pub fn is_folder(&self, name: &str) -> bool {
        self.locate(name).is_ok_and(|path| path.is_dir())
    }

    /// The names in the folder `name`, in order; none if it can't be read.
    pub fn names_in(&self, name: &str) -> Vec<String> {
        let entries = self.locate(name).ok().and_then(|path| path.read_dir().ok());
        let mut names: Vec<String> =
            entries.into_iter().flatten().filter_map(|e| e.ok()?.file_name().into_string().ok()).collect();
        names.sort_unstable();
        names
    }

    /// The scene's folder, absolute.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// What was read so far, in order.
    pub fn into_digests(self) -> Vec<FileDigest> {
        self.read
    }

    fn locate(&self, name: &str) -> Result<PathBuf, FileError> {
        let outside = || FileError::Outside { name: name.to_owned(), root: self.root.clone() };
        let relative = Path::new(name);
        let stays = relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        if !stays || name.is_empty() {
            return Err(outside());
        }
        let joined = self.root.join(relative);
        let path = joined.canonicalize().map_err(|cause| FileError::Read { path: joined, cause })?;
        if path.starts_with(&self.root) { Ok(path) } else { Err(outside()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_lead_out_are_refused() {
        let outer = tempfile::tempdir().unwrap();
        let root = outer.path().join("scene");
        std::fs::create_dir(&root).unwrap();
        std::fs::write(outer.path().join("secret"), "x").unwrap();
        std::fs::write(root.join("mesh.bin"), "abc").unwrap();
        #[cfg(unix)]
        std::os::unix::fs::symlink(outer.path().join("secret"), root.join("link")).unwrap();
        let mut files = Files::new(&root).unwrap();
        for name in ["../secret", "/etc/passwd", "a/../../secret", "link", ""] {
            assert!(matches!(files.read(name), Err(FileError::Outside { .. })), "{name}");
        }
        assert_eq!(files.read("./mesh.bin").unwrap(), b"abc");
        assert!(matches!(files.read("none"), Err(FileError::Read { .. })));
        assert_eq!(files.into_digests().len(), 1);
    }
}
