//! Why an edit cannot be made.

use std::path::PathBuf;

use crate::manifest::nearest::listed;

/// An error of any kind, from the caller's loader of images.
pub type BoxedError = Box<dyn std::error::Error + Send + Sync>;

/// Why a path cannot be set to a value. Names and lists are in the message; what to do instead is in [`EditError::hint`].
#[derive(Debug, thiserror::Error)]
pub enum EditError {
    /// The path begins with nothing known.
    #[error("no path begins with `{root}`")]
    UnknownRoot {
        /// What it begins with.
        root: String,
        /// What was probably meant.
        nearest: Option<&'static str>,
    },
    /// The path has too few parts.
    #[error("`{path}` is not a whole path: expected `{form}`")]
    Incomplete {
        /// The path.
        path: String,
        /// How such paths look.
        form: &'static str,
    },
    /// The last part is not a field.
    #[error("{of} has no field `{field}`")]
    UnknownField {
        /// Whose field it should be, with its article.
        of: &'static str,
        /// The field.
        field: String,
        /// What was probably meant.
        nearest: Option<&'static str>,
        /// The fields there are.
        known: Vec<&'static str>,
    },
    /// The scene has nothing of that name.
    #[error("the scene has no {kind} `{name}`")]
    UnknownName {
        /// What it should be: `material`, `light` or `camera`.
        kind: &'static str,
        /// The name, or the pattern.
        name: String,
        /// What was probably meant.
        nearest: Option<String>,
        /// The names there are.
        known: Vec<String>,
    },
    /// The value is of another type or out of range.
    #[error("`{path}` is {found}, but must be {expected}")]
    Value {
        /// The path.
        path: String,
        /// The value, shortened.
        found: String,
        /// What it takes.
        expected: &'static str,
    },
    /// What the path reaches does not have this field.
    #[error("`{path}` cannot be set: {why}")]
    NotApplicable {
        /// The path.
        path: String,
        /// Why not.
        why: &'static str,
    },
    /// Two camera fields that contradict each other.
    #[error("`camera.{first}` and `camera.{second}` cannot both be set")]
    Conflict {
        /// The one.
        first: &'static str,
        /// The other.
        second: &'static str,
    },
    /// The camera would have no direction of view.
    #[error("the camera's position and target are the same point ({x}, {y}, {z})")]
    NoViewDirection {
        /// Its x.
        x: f32,
        /// Its y.
        y: f32,
        /// Its z.
        z: f32,
    },
    /// The scene has no camera to change, and no position to make one of.
    #[error("the scene has no camera")]
    NoCamera,
    /// An image could not be loaded.
    #[error("cannot use {} as `environment.image`: {cause}", file.display())]
    Image {
        /// The file.
        file: PathBuf,
        /// Why not.
        cause: BoxedError,
    },
    /// An environment's image holds infinities or NaN.
    #[error("{} has values that are not finite, which an environment cannot have", file.display())]
    ImageNotFinite {
        /// The file.
        file: PathBuf,
    },
    /// An image's pixels do not fit its size.
    #[error("{} has {found} values, but its size asks for {expected}", file.display())]
    ImageSize {
        /// The file.
        file: PathBuf,
        /// Its values.
        found: usize,
        /// Width · height · channels.
        expected: usize,
    },
    /// A path that is not part of a scene's content.
    #[error("`scene` chooses the file and cannot be changed inside one")]
    SceneItself,
}

/// The half of an override that an error is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Half {
    /// The path.
    Path,
    /// The value.
    Value,
}

impl EditError {
    /// What to do instead, where there is something to say.
    pub fn hint(&self) -> Option<String> {
        let meant = |nearest: Option<&str>| nearest.map(|n| format!("did you mean `{n}`? "));
        match self {
            Self::UnknownRoot { nearest, .. } => {
                let meant = meant(*nearest).unwrap_or_default();
                Some(format!("{meant}paths begin with {}", listed(super::ROOTS)))
            }
            Self::UnknownField { nearest, known, of, .. } => {
                let meant = meant(*nearest).unwrap_or_default();
                // A field's name is found among all; a list of twelve would hide half of a material's.
                let all: Vec<String> = known.iter().map(|n| format!("`{n}`")).collect();
                Some(format!("{meant}{of} has {}", all.join(", ")))
            }
            Self::UnknownName { nearest, known, kind, .. } if known.is_empty() => {
                debug_assert!(nearest.is_none());
                Some(format!("it has no {kind} at all"))
            }
            Self::UnknownName { nearest, known, kind, .. } => {
                let meant = meant(nearest.as_deref()).unwrap_or_default();
                let plural = if known.len() == 1 { "" } else { "s" };
                Some(format!("{meant}it has the {kind}{plural} {}", listed(known)))
            }
            Self::NoCamera => Some("`camera.position` makes one".to_owned()),
            _ => None,
        }
    }

    /// Whether the path or the value is at fault.
    pub fn half(&self) -> Half {
        match self {
            Self::Value { .. }
            | Self::Image { .. }
            | Self::ImageNotFinite { .. }
            | Self::ImageSize { .. }
            | Self::NoViewDirection { .. } => Half::Value,
            // The name of a camera is a value.
            Self::UnknownName { kind: "camera", .. } => Half::Value,
            _ => Half::Path,
        }
    }
}
