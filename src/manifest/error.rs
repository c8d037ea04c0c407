//! Everything that is wrong with a manifest, each thing where it stands.

use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};

use super::edit::EditError;
use super::nearest::listed;

/// One thing that is wrong.
#[derive(Debug, thiserror::Error)]
pub enum ManifestError {
    /// The file cannot be read.
    #[error("cannot read the manifest: {0}")]
    Read(#[source] std::io::Error),
    /// The file is far larger than any manifest.
    #[error("the manifest has {size} bytes; at most {limit} are read")]
    TooLarge {
        /// Its size.
        size: u64,
        /// The limit.
        limit: u64,
    },
    /// The file is not UTF-8.
    #[error("the manifest is not UTF-8 text: byte {at} fits no character")]
    NotUtf8 {
        /// The first byte that does not fit.
        at: usize,
    },
    /// It is not TOML.
    #[error("{message}")]
    Toml {
        /// What the TOML parser says.
        message: Box<str>,
    },
    /// A key that means nothing.
    #[error("{table} has no key `{key}`")]
    UnknownKey {
        /// The key.
        key: Box<str>,
        /// The table, as in `[sheet]`.
        table: &'static str,
        /// What was probably meant.
        nearest: Option<&'static str>,
        /// The table that has such a key.
        belongs: Option<&'static str>,
        /// The keys there are.
        known: &'static [&'static str],
    },
    /// A key that must be there.
    #[error("{table} needs {what}")]
    Missing {
        /// The table.
        table: &'static str,
        /// The key or keys, as words.
        what: &'static str,
    },
    /// A value of another type, or out of range.
    #[error("`{key}` must be {expected}")]
    Expected {
        /// The key or path.
        key: Box<str>,
        /// What it takes.
        expected: Box<str>,
    },
    /// Two keys of which one is enough.
    #[error("{table} has both `{first}` and `{second}`: one of them is enough")]
    Both {
        /// The table.
        table: &'static str,
        /// The one.
        first: &'static str,
        /// The other.
        second: &'static str,
    },
    /// A path or its value is wrong in every scene.
    #[error(transparent)]
    Edit(#[from] EditError),
    /// A path or its value does not suit a scene.
    #[error("in {}: {error}", scene.display())]
    InScene {
        /// The scene's file.
        scene: PathBuf,
        /// What does not suit.
        error: EditError,
    },
    /// A file that an override names is missing.
    #[error("there is no file {}", file.display())]
    MissingFile {
        /// The file.
        file: PathBuf,
    },
    /// No file matches `scene`.
    #[error("no scene matches `{pattern}` in {}", folder.display())]
    NoScene {
        /// The pattern.
        pattern: Box<str>,
        /// The manifest's folder.
        folder: PathBuf,
    },
    /// Some path is set more than once.
    #[error("`{path}` is set twice")]
    Twice {
        /// The path.
        path: Box<str>,
    },
    /// As many labels as values are needed.
    #[error("{labels} labels for {values} values")]
    LabelCount {
        /// Labels.
        labels: usize,
        /// Values.
        values: usize,
    },
    /// A `zip` axis whose value has not one entry a path.
    #[error("{values} values for the {paths} paths of this `zip`")]
    ZipWidth {
        /// Values.
        values: usize,
        /// Paths.
        paths: usize,
    },
    /// Steps of an axis that make no sense together.
    #[error("{why}")]
    Steps {
        /// Why.
        why: &'static str,
    },
    /// A product of axes beyond the limit.
    #[error("the manifest asks for {jobs} jobs, more than max_jobs = {limit}")]
    TooManyJobs {
        /// How many; the largest number for more than that.
        jobs: u64,
        /// The limit.
        limit: u64,
    },
    /// Jobs with so many overrides that they would not fit in memory.
    #[error("{jobs} jobs with {overrides} overrides each are more than {limit} overrides")]
    TooManyOverrides {
        /// Jobs.
        jobs: u64,
        /// Overrides of each.
        overrides: u64,
        /// The limit on their product.
        limit: u64,
    },
    /// Two jobs would have one name, and so one output file.
    #[error("two jobs would both be called `{name}`: {first} and {second}")]
    SameName {
        /// The name.
        name: Box<str>,
        /// What the one is made of.
        first: Box<str>,
        /// What the other is made of.
        second: Box<str>,
    },
    /// Something that must be an axis is not.
    #[error("`{path}` is not an axis of this manifest")]
    NotAnAxis {
        /// What was named.
        path: Box<str>,
        /// The axis that was probably meant.
        nearest: Option<Box<str>>,
        /// The axes there are.
        known: Vec<String>,
    },
    /// An `exclude` that no job matches.
    #[error("this `exclude` matches no job")]
    ExcludesNothing,
    /// Nothing is left.
    #[error("`exclude` leaves no job")]
    ExcludesAll,
}

impl ManifestError {
    /// What to do instead, where there is something to say.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Edit(error) | Self::InScene { error, .. } => error.hint(),
            Self::UnknownKey { belongs: Some(home), .. } => Some(format!("it belongs in {home}")),
            Self::UnknownKey { nearest: Some(nearest), .. } => Some(format!("did you mean `{nearest}`?")),
            Self::UnknownKey { known, table, .. } => {
                let all: Vec<String> = known.iter().map(|k| format!("`{k}`")).collect();
                Some(format!("{table} has {}", all.join(", ")))
            }
            Self::NotAnAxis { nearest, known, .. } => {
                let meant = nearest.as_ref().map(|n| format!("did you mean `{n}`? ")).unwrap_or_default();
                Some(match known.as_slice() {
                    [] => "it has no axes".to_owned(),
                    [one] => format!("{meant}its axis is `{one}`"),
                    several => format!("{meant}its axes are {}", listed(several)),
                })
            }
            Self::SameName { .. } => Some("`labels` give values names of their own".to_owned()),
            Self::TooManyJobs { .. } => Some("fewer steps, or a larger `max_jobs` at the top".to_owned()),
            Self::ExcludesNothing => {
                Some("a value must be one of the axis' values, or one of its labels".to_owned())
            }
            _ => None,
        }
    }
}

/// One thing that is wrong, with its place.
#[derive(Debug)]
pub struct Diagnostic {
    /// What.
    pub error: ManifestError,
    /// Where, as a range of bytes in the manifest; none for the whole file.
    pub span: Option<Range<usize>>,
    /// Another place that matters, with a word on it.
    pub other: Option<(Range<usize>, &'static str)>,
}

impl Diagnostic {
    /// `error` at `span`.
    pub(super) fn new(error: impl Into<ManifestError>, span: Range<usize>) -> Self {
        Self { error: error.into(), span: Some(span), other: None }
    }

    /// With another place that matters.
    pub(super) fn and(mut self, span: Range<usize>, word: &'static str) -> Self {
        self.other = Some((span, word));
        self
    }
}

/// The text of a manifest and where it comes from, for messages.
#[derive(Clone, Debug)]
pub struct Source {
    /// The file.
    pub path: PathBuf,
    /// Its text.
    pub text: Arc<str>,
}

/// Everything that is wrong with a manifest, in the order of the file; never empty.
#[derive(Debug)]
pub struct ManifestErrors {
    /// The manifest.
    pub source: Source,
    /// What is wrong.
    pub diagnostics: Vec<Diagnostic>,
}

/// Whether a rendered page of errors has terminal colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Color {
    /// Plain text.
    Never,
    /// ANSI escapes.
    Always,
}

/// More errors than these are counted, not shown.
const MOST_SHOWN: usize = 50;

/// More text than this is not shown around an error, in bytes.
const MOST_TEXT: usize = 64 << 10;

impl ManifestErrors {
    pub(super) fn new(source: Source, mut diagnostics: Vec<Diagnostic>) -> Self {
        diagnostics.sort_by_key(|d| d.span.as_ref().map_or(0, |s| s.start));
        Self { source, diagnostics }
    }

    pub(super) fn of_file(path: &std::path::Path, error: ManifestError) -> Self {
        let source = Source { path: path.to_owned(), text: "".into() };
        Self { source, diagnostics: vec![Diagnostic { error, span: None, other: None }] }
    }

    /// The line and column of a diagnostic, both from 1, columns in characters.
    pub fn position(&self, diagnostic: &Diagnostic) -> Option<(usize, usize)> {
        let start = self.clamped(diagnostic.span.as_ref()?).start;
        let before = &self.source.text[..start];
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
        Some((line, column))
    }

    /// A page in the compiler's style: each error with line, column, the text around it and a hint.
    pub fn render(&self, color: Color) -> String {
        let path = self.source.path.display().to_string();
        let renderer = match color {
            Color::Never => Renderer::plain(),
            Color::Always => Renderer::styled(),
        };
        let mut pages: Vec<String> =
            self.diagnostics.iter().take(MOST_SHOWN).map(|d| self.render_one(&renderer, &path, d)).collect();
        if let Some(more) = self.diagnostics.len().checked_sub(MOST_SHOWN).filter(|n| *n > 0) {
            pages.push(format!("… and {more} more errors"));
        }
        pages.join("\n\n")
    }

    fn render_one(&self, renderer: &Renderer, path: &str, diagnostic: &Diagnostic) -> String {
        let title = Level::ERROR.primary_title(one_line(&diagnostic.error.to_string()));
        let mut group = match (&diagnostic.span, self.position(diagnostic)) {
            (Some(span), Some((line, column))) => {
                let primary = self.clamped(span);
                let other = diagnostic.other.as_ref().map(|(span, word)| (self.clamped(span), *word));
                let lines = self.lines(&primary, other.as_ref().map(|(span, _)| span));
                let inside = |span: Range<usize>| span.start - lines.start..span.end - lines.start;
                if lines.len() > MOST_TEXT {
                    let origin = Origin::path(path).line(line).char_column(column);
                    title.element(origin)
                } else {
                    let first = self.source.text[..lines.start].matches('\n').count() + 1;
                    let mut snippet = Snippet::source(&self.source.text[lines.clone()])
                        .line_start(first)
                        .path(path)
                        .annotation(AnnotationKind::Primary.span(inside(primary)));
                    if let Some((span, word)) = other {
                        let other = AnnotationKind::Context.span(inside(span)).label(word);
                        snippet = snippet.annotation(other);
                    }
                    title.element(snippet)
                }
            }
            _ => Group::with_title(title).element(Origin::path(path)),
        };
        if let Some(hint) = diagnostic.error.hint() {
            group = group.element(Level::HELP.message(one_line(&hint)));
        }
        renderer.render(&[group])
    }

    /// The whole lines from one of two spans to the other: what is shown, without going through all of the text for each error.
    fn lines(&self, one: &Range<usize>, other: Option<&Range<usize>>) -> Range<usize> {
        let text = &self.source.text;
        let other = other.unwrap_or(one);
        let (start, end) = (one.start.min(other.start), one.end.max(other.end));
        let start = text[..start].rfind('\n').map_or(0, |at| at + 1);
        start..text[end..].find('\n').map_or(text.len(), |n| end + n)
    }

    /// The part of a span's first line, on the borders of characters.
    fn clamped(&self, span: &Range<usize>) -> Range<usize> {
        let text = &self.source.text;
        let start = floor_boundary(text, span.start);
        let line_end = text[start..].find(['\n', '\r']).map_or(text.len(), |n| start + n);
        let end = floor_boundary(text, span.end).clamp(start, line_end);
        start..end
    }
}

/// The largest border of a character up to `at`.
fn floor_boundary(text: &str, at: usize) -> usize {
    (0..=at.min(text.len())).rev().find(|i| text.is_char_boundary(*i)).unwrap_or(0)
}

/// Control characters, which names from files may hold, made visible.
fn one_line(text: &str) -> String {
    text.chars().flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] }).collect()
}

impl std::fmt::Display for ManifestErrors {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.render(Color::Never))
    }
}

impl std::error::Error for ManifestErrors {}
