//! Reading files of a scene: never outside its folder unless that is allowed, never more than a limit, each one counted.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use crate::settings::Reach;

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
    /// The name leads out of the scene's folder, which was not allowed.
    #[error("{name:?} leads out of the scene's folder {}; hint: --allow-outside lets it", root.display())]
    Outside {
        /// The name as the scene gives it.
        name: String,
        /// The folder.
        root: PathBuf,
    },
    /// The name is that of something on a network.
    #[error("{name:?} is a URL; only files are read, nothing is fetched")]
    Url {
        /// The name as the scene gives it.
        name: String,
    },
    /// It is a folder, a device or a pipe.
    #[error("{} is not a file with content of its own", path.display())]
    NotAFile {
        /// What it is the path of.
        path: PathBuf,
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
    reach: Reach,
    read: Vec<FileDigest>,
    /// The names in folders that were looked into: a scene may look for thousands of files.
    listed: RefCell<BTreeMap<String, Arc<[String]>>>,
}

impl Files {
    /// Reading from `root`, the scene's folder, and from elsewhere as far as `reach` says.
    ///
    /// # Errors
    /// If the folder does not exist.
    pub fn new(root: &Path, reach: Reach) -> Result<Self, FileError> {
        let root = if root.as_os_str().is_empty() { Path::new(".") } else { root };
        let canonical = root.canonicalize().map_err(|cause| FileError::Read { path: root.into(), cause })?;
        Ok(Self { root: canonical, reach, read: Vec::new(), listed: RefCell::default() })
    }

    /// The content of the file that the scene calls `name`: a path relative to the scene's folder. A link is followed as long as
    /// it stays within reach.
    ///
    /// # Errors
    /// If the name leads beyond reach, or the file is missing, too large, unreadable, or no regular one.
    pub fn read(&mut self, name: &str) -> Result<Vec<u8>, FileError> {
        let path = self.locate(name)?;
        let failed = |cause| FileError::Read { path: path.clone(), cause };
        // Opening a pipe waits for its writer, and a device never ends.
        let about = path.metadata().map_err(failed)?;
        if !about.is_file() {
            return Err(FileError::NotAFile { path });
        }
        let size = about.len();
        if size > MAX_FILE {
            return Err(FileError::TooLarge { path, size });
        }
        let file = File::open(&path).map_err(failed)?;
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

    /// Whether `name` is a file within reach.
    pub fn exists(&self, name: &str) -> bool {
        self.locate(name).is_ok_and(|path| path.is_file())
    }

    /// Whether `name` is the name of something, but out of reach.
    pub(super) fn leads_out(&self, name: &str) -> bool {
        matches!(self.locate(name), Err(FileError::Outside { .. }))
    }

    /// Whether `name` is a folder within reach.
    pub fn is_folder(&self, name: &str) -> bool {
        self.locate(name).is_ok_and(|path| path.is_dir())
    }

    /// The names in the folder `name`, in order; none if it can't be read. Each folder is looked into once.
    pub fn names_in(&self, name: &str) -> Arc<[String]> {
        self.listed.borrow_mut().entry(name.to_owned()).or_insert_with(|| self.list(name)).clone()
    }

    fn list(&self, name: &str) -> Arc<[String]> {
        let entries = self.locate(name).ok().and_then(|path| path.read_dir().ok());
        let mut names: Vec<String> =
            entries.into_iter().flatten().filter_map(|e| e.ok()?.file_name().into_string().ok()).collect();
        names.sort_unstable();
        names.into()
    }

    /// How far names lead.
    pub fn reach(&self) -> Reach {
        self.reach
    }

    /// The folder that names count from, without links.
    pub(super) fn root(&self) -> &Path {
        &self.root
    }

    /// What was read so far, in order.
    pub fn into_digests(self) -> Vec<FileDigest> {
        self.read
    }

    fn locate(&self, name: &str) -> Result<PathBuf, FileError> {
        if name.contains("://") {
            return Err(FileError::Url { name: name.to_owned() });
        }
        let allowed = |inside: bool| match inside || self.reach == Reach::Anywhere {
            true => Ok(()),
            false => Err(FileError::Outside { name: name.to_owned(), root: self.root.clone() }),
        };
        let named = Path::new(name);
        let is_step = |c: Component| matches!(c, Component::Normal(_) | Component::CurDir);
        allowed(named.components().all(is_step) && !name.is_empty())?;
        let joined = self.root.join(named);
        let path = joined.canonicalize().map_err(|cause| FileError::Read { path: joined, cause })?;
        allowed(path.starts_with(&self.root))?;
        Ok(path)
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
        let mut files = Files::new(&root, Reach::Folder).unwrap();
        for name in ["../secret", "/etc/passwd", "a/../../secret", "link", ""] {
            assert!(matches!(files.read(name), Err(FileError::Outside { .. })), "{name}");
        }
        assert_eq!(files.read("./mesh.bin").unwrap(), b"abc");
        assert!(matches!(files.read("none"), Err(FileError::Read { .. })));
        assert_eq!(files.into_digests().len(), 1);
        let mut files = Files::new(&root, Reach::Anywhere).unwrap();
        let absolute = outer.path().join("secret");
        for name in ["../secret", "./../scene/../secret", absolute.to_str().unwrap()] {
            assert_eq!(files.read(name).unwrap(), b"x", "{name}");
        }
        #[cfg(unix)]
        assert_eq!(files.read("link").unwrap(), b"x");
    }

    #[test]
    fn what_is_no_file_is_refused_wherever_names_may_lead() {
        let root = tempfile::tempdir().unwrap();
        std::fs::create_dir(root.path().join("folder")).unwrap();
        let mut files = Files::new(root.path(), Reach::Anywhere).unwrap();
        let mut no_files = vec!["folder", ""];
        if cfg!(unix) {
            no_files.push("/dev/zero");
        }
        for name in no_files {
            assert!(matches!(files.read(name), Err(FileError::NotAFile { .. })), "{name}");
        }
        for name in ["http://host/a.png", "file:///etc/passwd"] {
            assert!(matches!(files.read(name), Err(FileError::Url { .. })), "{name}");
        }
    }
}
