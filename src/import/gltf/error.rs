//! Why a glTF file can't be imported.

use crate::imagefile::ImageFileError;
use crate::import::FileError;

/// Why a glTF file can't be imported. Elements are named as in the file's JSON, such as `meshes[0].primitives[1]`.
#[derive(Debug, thiserror::Error)]
pub enum GltfError {
    /// A GLB that ends too early.
    #[error("the GLB's {part} needs {needed} bytes, but {found} are there")]
    Truncated {
        /// Header or chunk.
        part: &'static str,
        /// How many bytes it should have.
        needed: u64,
        /// How many there are.
        found: u64,
    },
    /// A GLB whose version or chunk order isn't glTF 2.0's.
    #[error("the GLB's {part} is {found:#x}; expected {expected:#x}")]
    Container {
        /// What is wrong.
        part: &'static str,
        /// What should stand there.
        expected: u32,
        /// What stands there.
        found: u32,
    },
    /// More JSON than any scene needs.
    #[error("the JSON has {size} bytes; at most {limit} are read")]
    JsonSize {
        /// Its size.
        size: usize,
        /// The limit.
        limit: usize,
    },
    /// JSON that isn't JSON, or not glTF's.
    #[error("the JSON is not that of a glTF file: {0}")]
    Json(#[from] gltf::json::Error),
    /// Another version of glTF.
    #[error("the file is glTF {found:?}; version 2.0 is read")]
    Version {
        /// `asset.version`, or `asset.minVersion` if that is the reason.
        found: String,
    },
    /// The file can't be understood without an extension that is not read.
    #[error("the file requires the extension {extension}, which is not read; these are: {}", known.join(", "))]
    Required {
        /// The extension.
        extension: String,
        /// The extensions that are read.
        known: &'static [&'static str],
    },
    /// The caller asks for something by a name that nothing has.
    #[error("there is no {kind} called {name:?}; {}", names(known))]
    Unknown {
        /// What it asks for.
        kind: &'static str,
        /// The name.
        name: String,
        /// The names that there are.
        known: Vec<String>,
    },
    /// An element's data is only there through an extension that is not read.
    #[error("{element} needs the extension {extension}, which is not read")]
    Extension {
        /// The element.
        element: String,
        /// The extension.
        extension: &'static str,
    },
    /// A reference to an element that isn't there.
    #[error("{element} refers to {target}[{index}], but there are {count}")]
    Reference {
        /// What refers.
        element: String,
        /// The array it refers to.
        target: &'static str,
        /// The index.
        index: u64,
        /// The array's length.
        count: usize,
    },
    /// A property is missing.
    #[error("{element} has no {property}")]
    Missing {
        /// The element.
        element: String,
        /// The property.
        property: &'static str,
    },
    /// A property has a value that the specification forbids.
    #[error("{element} has an invalid {property}; expected {expected}")]
    Invalid {
        /// The element.
        element: String,
        /// The property.
        property: &'static str,
        /// What it should be.
        expected: &'static str,
    },
    /// A number of a material out of range.
    #[error("material {material:?}: {field} is {value}, but must be {expected}")]
    Factor {
        /// The material.
        material: String,
        /// The field.
        field: &'static str,
        /// The value.
        value: f32,
        /// The range.
        expected: &'static str,
    },
    /// A number out of range elsewhere.
    #[error("{element}: {property} is {value}, but must be {expected}")]
    Range {
        /// The element.
        element: String,
        /// The property.
        property: &'static str,
        /// The value.
        value: f32,
        /// The range.
        expected: &'static str,
    },
    /// An element reaches beyond the data it lies in.
    #[error("{element} needs {needed} bytes, but {container} has {available}")]
    Bytes {
        /// The element.
        element: String,
        /// What it lies in.
        container: String,
        /// The bytes it needs, from the container's start.
        needed: u128,
        /// The bytes that are there.
        available: u64,
    },
    /// A vertex attribute has not one value a vertex.
    #[error("{element}: {attribute} has {found} values for {vertices} vertices")]
    AttributeCount {
        /// The primitive.
        element: String,
        /// The attribute.
        attribute: String,
        /// How many values it has.
        found: usize,
        /// How many vertices there are.
        vertices: usize,
    },
    /// An index beyond the vertices, or a sparse accessor's index beyond its elements.
    #[error("{element} holds the index {index}, but there are {count} elements")]
    VertexIndex {
        /// What holds it.
        element: String,
        /// The index.
        index: u32,
        /// How many elements there are.
        count: u64,
    },
    /// A node that is reached twice: the hierarchy isn't a tree.
    #[error("nodes[{node}] has two parents or is its own ancestor; a glTF scene must be a tree")]
    Tree {
        /// The node.
        node: usize,
    },
    /// More of something than is read, all in all.
    #[error("the file asks for more than {limit} {what}")]
    TooMany {
        /// What.
        what: &'static str,
        /// The limit.
        limit: u64,
    },
    /// A `uri` that can't be followed.
    #[error("{element} has the uri {uri:?}: {problem}")]
    Uri {
        /// The element.
        element: String,
        /// The `uri`, its beginning if it is long.
        uri: String,
        /// What is wrong with it.
        problem: UriProblem,
    },
    /// A file that it names can't be read.
    #[error("{element}: {cause}")]
    File {
        /// The element.
        element: String,
        /// Why.
        cause: FileError,
    },
    /// An image that can't be used.
    #[error(transparent)]
    Image(#[from] ImageFileError),
}

/// The names to choose from, in a sentence.
fn names(known: &[String]) -> String {
    if known.is_empty() { "the file has none".to_owned() } else { format!("there are: {}", known.join(", ")) }
}

/// What is wrong with a `uri`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UriProblem {
    /// Another scheme than data:.
    #[error("only data: and relative file names are followed")]
    Scheme,
    /// A % without two hexadecimal digits behind it, or something that isn't UTF-8 when decoded.
    #[error("a % must be followed by two hexadecimal digits, and the name must be UTF-8")]
    Percent,
    /// A data: URI without a comma.
    #[error("a data: URI has a comma before its data")]
    Comma,
    /// Base64 that isn't.
    #[error("its base64 is damaged")]
    Base64,
}
