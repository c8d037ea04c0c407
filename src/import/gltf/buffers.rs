//! Buffers and their views: where the bytes of accessors and images lie.

use std::borrow::Cow;
use std::collections::BTreeMap;

use gltf::json::Root;
use gltf::json::buffer::View;

use super::container::Document;
use super::error::{GltfError, UriProblem};
use super::uri::{self, Target};
use crate::import::Files;

/// The most bytes that all buffers of a file may have together.
const MAX_TOTAL: u64 = 8 << 30;

/// The bytes of every buffer, checked to be as many as the file says.
pub(super) struct Buffers<'a> {
    /// Index into `contents` and the length that the file declares.
    buffers: Vec<(usize, usize)>,
    contents: Vec<Cow<'a, [u8]>>,
}

impl<'a> Buffers<'a> {
    /// Reads every buffer: the GLB's own chunk, data: URIs, and files, each once.
    pub(super) fn load(document: &Document<'a>, files: &mut Files) -> Result<Self, GltfError> {
        let mut loaded = Self { buffers: Vec::new(), contents: Vec::new() };
        let mut by_name: BTreeMap<String, usize> = BTreeMap::new();
        let mut total = 0u64;
        for (i, buffer) in document.root.buffers.iter().enumerate() {
            let element = format!("buffers[{i}]");
            let content = match &buffer.uri {
                None if i == 0 && document.blob.is_some() => {
                    loaded.push(Cow::Borrowed(document.blob.unwrap_or_default()))
                }
                None => return Err(without_data(document, element)),
                Some(uri) => match resolve(uri, &element)? {
                    Target::Data(bytes) => loaded.push(Cow::Owned(bytes)),
                    Target::File(name) => match by_name.get(&name) {
                        Some(&content) => content,
                        None => {
                            let content = loaded.push(Cow::Owned(read_file(files, &name, &element)?));
                            by_name.insert(name, content);
                            content
                        }
                    },
                },
            };
            let available = loaded.contents[content].len() as u64;
            if buffer.byte_length.0 > available {
                return Err(GltfError::Bytes {
                    element,
                    container: "its data".into(),
                    needed: u128::from(buffer.byte_length.0),
                    available,
                });
            }
            total = total.saturating_add(available);
            if total > MAX_TOTAL {
                return Err(GltfError::TooMany { what: "bytes in buffers", limit: MAX_TOTAL });
            }
            loaded.buffers.push((content, buffer.byte_length.0 as usize));
        }
        Ok(loaded)
    }

    fn push(&mut self, bytes: Cow<'a, [u8]>) -> usize {
        self.contents.push(bytes);
        self.contents.len() - 1
    }

    /// The bytes of `bufferViews[index]`, which `element` refers to, with the view itself.
    pub(super) fn view<'r>(
        &'r self,
        root: &'r Root,
        index: usize,
        element: &str,
    ) -> Result<(&'r [u8], &'r View), GltfError> {
        let view = lookup(&root.buffer_views, index, element, "bufferViews")?;
        let name = format!("bufferViews[{index}]");
        let &(content, length) = lookup(&self.buffers, view.buffer.value(), &name, "buffers")?;
        let bytes = &self.contents[content][..length];
        let offset = view.byte_offset.unwrap_or_default().0;
        let end = u128::from(offset) + u128::from(view.byte_length.0);
        if end > length as u128 {
            let container = format!("buffers[{}]", view.buffer.value());
            return Err(GltfError::Bytes { element: name, container, needed: end, available: length as u64 });
        }
        Ok((&bytes[offset as usize..end as usize], view))
    }
}

/// The item at `index` that `element` refers to.
pub(super) fn lookup<'t, T>(
    items: &'t [T],
    index: usize,
    element: &str,
    target: &'static str,
) -> Result<&'t T, GltfError> {
    items.get(index).ok_or_else(|| GltfError::Reference {
        element: element.to_owned(),
        target,
        index: index as u64,
        count: items.len(),
    })
}

/// Where the `uri` of `element` leads.
pub(super) fn resolve(uri: &str, element: &str) -> Result<Target, GltfError> {
    uri::resolve(uri).map_err(|problem: UriProblem| GltfError::Uri {
        element: element.to_owned(),
        uri: uri.chars().take(80).collect(),
        problem,
    })
}

/// The file that `element` names.
pub(super) fn read_file(files: &mut Files, name: &str, element: &str) -> Result<Vec<u8>, GltfError> {
    files.read(name).map_err(|cause| GltfError::File { element: element.to_owned(), cause })
}

/// A buffer without data: a placeholder for what only an extension can read, or a mistake.
fn without_data(document: &Document, element: String) -> GltfError {
    let used = &document.root.extensions_used;
    for extension in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        if used.iter().any(|e| e == extension) {
            return GltfError::Extension { element, extension };
        }
    }
    GltfError::Missing { element, property: "uri, and the file no binary chunk" }
}
