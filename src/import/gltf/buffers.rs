//! Buffers and their views: where the bytes of accessors and images lie.

use std::borrow::Cow;
use std::collections::BTreeMap;

use gltf::json::buffer::View;
use gltf::json::validation::USize64;
use gltf::json::{Index, Root};

use super::container::Document;
use super::error::{GltfError, UriProblem};
use super::meshopt::{self, Compressed};
use super::uri::{self, Target};
use crate::import::Files;

/// The most bytes that all buffers of a file may have together.
const MAX_TOTAL: u64 = 8 << 30;

/// The most that may be unpacked of a file however small it is, and for each byte that it was read from.
const FREE_UNPACKED: u64 = 64 << 20;
const UNPACKED_PER_BYTE: u64 = 256;

/// The bytes of every buffer, checked to be as many as the file says.
pub(super) struct Buffers<'a> {
    /// Index into `contents` and the length that the file declares.
    buffers: Vec<(usize, usize)>,
    contents: Vec<Cow<'a, [u8]>>,
    /// The bytes of all of them, and those of them that were unpacked.
    total: u64,
    unpacked: u64,
    /// Those of the files and strings that they were read from, each once.
    stored: u64,
}

impl<'a> Buffers<'a> {
    /// Reads every buffer: the GLB's own chunk, data: URIs, and files, each once.
    pub(super) fn load(document: &Document<'a>, files: &mut Files) -> Result<Self, GltfError> {
        let mut loaded = Self { buffers: Vec::new(), contents: Vec::new(), total: 0, unpacked: 0, stored: 0 };
        let mut by_name: BTreeMap<String, usize> = BTreeMap::new();
        for (i, buffer) in document.root.buffers.iter().enumerate() {
            let element = format!("buffers[{i}]");
            let content = match &buffer.uri {
                None if i == 0 && document.blob.is_some() => {
                    loaded.push(Cow::Borrowed(document.blob.unwrap_or_default()))
                }
                None if meshopt::is_used(&document.root.extensions_used) => {
                    // A placeholder: what lies in it is decompressed from elsewhere.
                    let empty = loaded.push(Cow::Borrowed(&[]));
                    loaded.buffers.push((empty, 0));
                    continue;
                }
                None => {
                    let property = "uri, and the file no binary chunk";
                    return Err(GltfError::Missing { element, property });
                }
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
            loaded.charge(available)?;
            loaded.buffers.push((content, buffer.byte_length.0 as usize));
        }
        loaded.stored = loaded.contents.iter().map(|content| content.len() as u64).sum();
        Ok(loaded)
    }

    /// The bytes that buffers were read from, before anything was decompressed.
    pub(super) fn stored(&self) -> u64 {
        self.stored
    }

    fn push(&mut self, bytes: Cow<'a, [u8]>) -> usize {
        self.contents.push(bytes);
        self.contents.len() - 1
    }

    /// Counts what buffers take.
    fn charge(&mut self, bytes: u64) -> Result<(), GltfError> {
        self.total = self.total.saturating_add(bytes);
        if self.total > MAX_TOTAL {
            return Err(GltfError::TooMany { what: "bytes in buffers", limit: MAX_TOTAL });
        }
        Ok(())
    }

    /// Counts what is unpacked: few bytes may be packed again and again.
    fn charge_unpacked(&mut self, bytes: u64) -> Result<(), GltfError> {
        self.unpacked = self.unpacked.saturating_add(bytes);
        let limit = FREE_UNPACKED.saturating_add(UNPACKED_PER_BYTE.saturating_mul(self.stored));
        if self.unpacked > limit {
            return Err(GltfError::TooMany { what: "unpacked bytes, more than any file of its size", limit });
        }
        self.charge(bytes)
    }

    /// Decompresses every view of `root` that meshopt has packed: it then lies in a buffer of its own.
    pub(super) fn decompress(&mut self, root: &mut Root) -> Result<(), GltfError> {
        for (i, view) in root.buffer_views.iter_mut().enumerate() {
            let Some(packed) = Compressed::of(view)? else { continue };
            let element = format!("bufferViews[{i}]");
            self.charge_unpacked(view.byte_length.0)?;
            let data = self.range(packed.buffer, packed.byte_offset, packed.byte_length, &element)?;
            let bytes = packed.decode(view, data, &element)?;
            view.byte_offset = None;
            view.buffer = Index::new(self.add(bytes));
        }
        Ok(())
    }

    /// A new buffer of `bytes`.
    fn add(&mut self, bytes: Vec<u8>) -> u32 {
        let length = bytes.len();
        let content = self.push(Cow::Owned(bytes));
        self.buffers.push((content, length));
        self.buffers.len() as u32 - 1
    }

    /// A new view in `root` of a new buffer of `bytes`.
    pub(super) fn add_view(&mut self, root: &mut Root, bytes: Vec<u8>) -> Result<u32, GltfError> {
        let byte_length = USize64(bytes.len() as u64);
        self.charge_unpacked(byte_length.0)?;
        let buffer = Index::new(self.add(bytes));
        root.buffer_views.push(View {
            buffer,
            byte_length,
            byte_offset: None,
            byte_stride: None,
            name: None,
            target: None,
            extensions: None,
            extras: Default::default(),
        });
        Ok(root.buffer_views.len() as u32 - 1)
    }

    /// The bytes of `bufferViews[index]`, which `element` refers to, with the view itself.
    pub(super) fn view<'r>(
        &'r self,
        root: &'r Root,
        index: usize,
        element: &str,
    ) -> Result<(&'r [u8], &'r View), GltfError> {
        let view = lookup(&root.buffer_views, index, element, "bufferViews")?;
        let offset = view.byte_offset.unwrap_or_default().0;
        let name = format!("bufferViews[{index}]");
        Ok((self.range(view.buffer.value(), offset, view.byte_length.0, &name)?, view))
    }

    /// `length` bytes from `offset` on of `buffers[index]`, which `element` refers to.
    fn range(&self, index: usize, offset: u64, length: u64, element: &str) -> Result<&[u8], GltfError> {
        let &(content, size) = lookup(&self.buffers, index, element, "buffers")?;
        let end = u128::from(offset) + u128::from(length);
        if end > size as u128 {
            let container = format!("buffers[{index}]");
            let (element, available) = (element.to_owned(), size as u64);
            return Err(GltfError::Bytes { element, container, needed: end, available });
        }
        Ok(&self.contents[content][offset as usize..end as usize])
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
