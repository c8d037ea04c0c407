//! Files that appear whole: a reader sees the old content or the new, never a part.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

use super::ImageFileError;

/// What temporary names begin with.
const PREFIX: &str = ".writing-";
/// What they end with.
const SUFFIX: &str = ".tmp";

/// Writes a file so that it appears whole or not at all: under a temporary name in the same folder, synced, then renamed.
/// An existing file is replaced. Creates no folders.
///
/// # Errors
/// If the folder is missing or can't be written, or the disk is full; the temporary file is removed and the old file, if
/// any, is untouched.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), ImageFileError> {
    place(path, bytes).map_err(|cause| ImageFileError::Write { path: path.into(), cause })
}

fn place(path: &Path, bytes: &[u8]) -> io::Result<()> {
    if path.file_name().is_none() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "the path names no file"));
    }
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut file = claimed(folder)?;
    file.as_file_mut().write_all(bytes)?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|failed| failed.error)?;
    sync_folder(folder)
}

/// Removes the temporary files that killed runs left in `folder`, and tells how many. Those of writers that live are locked and
/// stay; so do all where the system has no locks.
///
/// # Errors
/// If the folder can't be read.
pub fn remove_leftovers(folder: &Path) -> io::Result<usize> {
    let mut removed = 0;
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        let is_ours =
            name.to_str().is_some_and(|n| n.starts_with(PREFIX) && n.ends_with(SUFFIX)) && is_file(&entry);
        // Whatever fails here, the file's writer was quicker, or it is not ours to touch: it is no part of any result.
        if is_ours
            && let Ok(file) = File::options().write(true).open(entry.path())
            && file.try_lock().is_ok()
            && std::fs::remove_file(entry.path()).is_ok()
        {
            removed += 1;
        }
    }
    Ok(removed)
}

fn is_file(entry: &std::fs::DirEntry) -> bool {
    entry.file_type().is_ok_and(|kind| kind.is_file())
}

/// A temporary file, locked as long as it is written.
fn claimed(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    loop {
        let file = temporary(folder)?;
        // Where the file system has no locks, nobody can tell a leftover, and nobody removes one.
        if file.as_file().lock().is_err() || !is_removed(file.as_file())? {
            return Ok(file);
        }
    }
}

/// Somebody took the file for a leftover between its creation and its lock.
#[cfg(unix)]
fn is_removed(file: &File) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    Ok(file.metadata()?.nlink() == 0)
}

/// Here an open file can't be removed.
#[cfg(not(unix))]
fn is_removed(_file: &File) -> io::Result<bool> {
    Ok(false)
}

/// A hidden file that is removed when dropped, with the permissions that any new file would get.
fn temporary(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // The process' mask takes away what it should; tempfile's own default is for secrets.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder).map_err(without_name)
}

/// The reason alone: nobody asked for the temporary name, which is another each time. `tempfile` hides the system's number behind
/// it, not its kind.
fn without_name(error: io::Error) -> io::Error {
    if error.get_ref().is_some() { error.kind().into() } else { error }
}

/// The new name itself is in the folder, which has its own place on the disk.
#[cfg(unix)]
fn sync_folder(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
}

/// Folders can't be opened as files here; the system keeps the name.
#[cfg(not(unix))]
fn sync_folder(_folder: &Path) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> = std::fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn the_file_is_there_with_its_content_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        write_whole(&path, b"one").unwrap();
        write_whole(&path, b"two").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        assert_eq!(names(folder.path()), ["a.bin"]);
    }

    #[test]
    fn a_missing_folder_is_an_error_that_names_the_file_and_creates_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sub/a.bin");
        let error = write_whole(&path, b"x").unwrap_err();
        assert!(error.to_string().contains("a.bin") && !error.to_string().contains(PREFIX), "{error}");
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn a_failed_rename_leaves_no_temporary_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("taken");
        std::fs::create_dir(&path).unwrap();
        std::fs::write(path.join("inside"), b"x").unwrap();
        assert!(write_whole(&path, b"x").is_err());
        assert_eq!(names(folder.path()), ["taken"]);
        assert!(write_whole(Path::new("/"), b"x").is_err());
    }

    #[test]
    fn leftovers_are_removed_but_not_what_is_being_written_or_is_not_ours() {
        let folder = tempfile::tempdir().unwrap();
        for name in [".writing-abc.tmp", ".writing-abc", "writing.tmp"] {
            std::fs::write(folder.path().join(name), b"half").unwrap();
        }
        std::fs::create_dir(folder.path().join(".writing-folder.tmp")).unwrap();
        let alive = claimed(folder.path()).unwrap();
        assert_eq!(remove_leftovers(folder.path()).unwrap(), 1);
        assert!(alive.path().exists());
        drop(alive);
        assert_eq!(names(folder.path()), [".writing-abc", ".writing-folder.tmp", "writing.tmp"]);
        assert!(remove_leftovers(&folder.path().join("none")).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn others_may_read_what_is_written_as_the_mask_allows() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (ours, plain) = (folder.path().join("ours"), folder.path().join("plain"));
        write_whole(&ours, b"x").unwrap();
        std::fs::write(&plain, b"x").unwrap();
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }
}
