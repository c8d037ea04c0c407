//! An OBJ file as a stream that `tobj` reads without surprises.
//!
//! Every statement is checked here: continued lines are joined, points, lines and free-form geometry left out, relative
//! indices resolved, indices checked against what the file holds, vertex colours given to all vertices or none, and vertices
//! stand before faces. Texture coordinates and normals that are missing or unreadable refer to a first entry that is NaN, corners
//! in smoothing groups to normals made for them.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Write as _;

use glam::Vec3;

use super::mtl::unquoted;
use super::polygon::MAX_CORNERS;
use super::smoothing::SmoothNormals;
use super::{Grouping, ObjError};
use crate::record::Warning;

/// A cleaned file.
#[derive(Debug, Default)]
pub(super) struct Cleaned {
    /// The stream for `tobj`: one object a group, named by its index.
    pub stream: String,
    /// The groups that have faces, by first appearance.
    pub groups: Vec<Group>,
    /// The material libraries as the file names them, each with its line.
    pub libraries: Vec<(String, u32)>,
}

/// Faces that share object and material.
#[derive(Debug)]
pub(super) struct Group {
    /// The object's or group's name; may be empty.
    pub name: String,
    /// The material's name, where the file gives one.
    pub material: Option<String>,
    /// The line of the first face.
    pub line: u32,
    faces: String,
}

/// What can be wrong with a statement; each kind is told once, with the first line and the number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Flaw {
    VertexNotFinite,
    FaceOfBadVertex,
    FaceTooSmall,
    UvUnreadable,
    NormalUnreadable,
    ColorUnreadable,
    SmoothingUnreadable,
    NotSurface,
    FreeForm,
    Unknown,
}

impl Flaw {
    fn message(self) -> &'static str {
        match self {
            Self::VertexNotFinite => {
                "vertex without three finite coordinates; the faces that use it are left out"
            }
            Self::FaceOfBadVertex => "face left out: it uses a vertex without finite coordinates",
            Self::FaceTooSmall => "face left out: it has fewer than three corners",
            Self::UvUnreadable => "texture coordinate without finite numbers; read as missing",
            Self::NormalUnreadable => "normal without direction; the face's own is taken",
            Self::ColorUnreadable => "vertex colour without three finite numbers; read as white",
            Self::SmoothingUnreadable => {
                "smoothing group without a whole number; the faces after it are flat"
            }
            Self::NotSurface => "point or line left out: only surfaces are rendered",
            Self::FreeForm => "free-form curve or surface left out: only polygons are read",
            Self::Unknown => "unknown statement left out",
        }
    }
}

/// Flaws counted by kind, with the line where each was seen first.
#[derive(Debug, Default)]
struct Flaws(BTreeMap<Flaw, (u32, u64)>);

impl Flaws {
    fn add(&mut self, flaw: Flaw, line: u32) {
        self.0.entry(flaw).or_insert((line, 0)).1 += 1;
    }

    fn into_warnings(self, file: &str) -> impl Iterator<Item = Warning> {
        self.0.into_iter().map(move |(flaw, (line, count))| {
            let times = if count == 1 { String::new() } else { format!(" ({count} times)") };
            Warning::new(format!("{file}:{line}"), format!("{}{times}", flaw.message()))
        })
    }
}

/// Reads the file `name`. `grouping` says whether its groups are kept apart.
pub(super) fn clean(
    name: &str,
    bytes: &[u8],
    grouping: Grouping,
    warnings: &mut Vec<Warning>,
) -> Result<Cleaned, ObjError> {
    let text = String::from_utf8_lossy(bytes);
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let mut flaws = Flaws::default();
    let mut vertices = Vertices::default();
    for (line, statement) in statements(text) {
        vertices.read(line, &statement, &mut flaws);
    }
    let mut faces = Faces {
        name,
        grouping,
        vertices: &vertices,
        seen: Counts::default(),
        out: Cleaned::default(),
        index: BTreeMap::new(),
        object: String::new(),
        material: None,
        current: None,
        smoothing: None,
        smooth: SmoothNormals::default(),
    };
    for (line, statement) in statements(text) {
        faces.read(line, &statement, &mut flaws)?;
    }
    let Faces { mut out, smooth, .. } = faces;
    out.stream = vertices.into_stream(smooth);
    for (i, group) in out.groups.iter_mut().enumerate() {
        // Writing to a string cannot fail.
        let _ = writeln!(out.stream, "o {i}");
        out.stream.push_str(&std::mem::take(&mut group.faces));
    }
    warnings.extend(flaws.into_warnings(name));
    Ok(out)
}

/// The statements with the number of their first line: trimmed, continued lines joined, comments and empty lines left out.
fn statements(text: &str) -> impl Iterator<Item = (u32, Cow<'_, str>)> {
    let mut lines = (1_u32..).zip(text.split('\n').map(str::trim));
    std::iter::from_fn(move || {
        loop {
            let (number, line) = lines.next()?;
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let Some(start) = line.strip_suffix('\\') else { return Some((number, Cow::Borrowed(line))) };
            let mut joined = start.to_owned();
            for (_, next) in lines.by_ref() {
                joined.push(' ');
                match next.strip_suffix('\\') {
                    Some(part) => joined.push_str(part),
                    None => {
                        joined.push_str(next);
                        break;
                    }
                }
            }
            return Some((number, Cow::Owned(joined)));
        }
    })
}

/// The words of a statement up to a comment.
fn words(rest: &str) -> impl Iterator<Item = &str> {
    rest.split_whitespace().take_while(|word| !word.starts_with('#'))
}

/// The keyword and the rest of a statement.
fn split(statement: &str) -> (&str, &str) {
    statement.split_once(char::is_whitespace).map_or((statement, ""), |(key, rest)| (key, rest.trim()))
}

fn finite(word: &str) -> Option<f32> {
    word.parse::<f32>().ok().filter(|value| value.is_finite())
}

/// How many of each there are.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    positions: usize,
    uvs: usize,
    normals: usize,
}

/// The vertex statements, ready for `tobj`.
#[derive(Debug, Default)]
struct Vertices {
    counts: Counts,
    positions: String,
    uvs: String,
    normals: String,
    /// The positions as numbers, in the order of `positions`.
    points: Vec<Vec3>,
    /// Indices of vertices that are not finite, ascending.
    bad: Vec<usize>,
    /// Whether a vertex had a colour; from then on all need one for `tobj`, and those without have NaN.
    colored: bool,
}

impl Vertices {
    fn read(&mut self, line: u32, statement: &str, flaws: &mut Flaws) {
        let (key, rest) = split(statement);
        match key {
            "v" => self.position(line, rest, flaws),
            "vt" => {
                let mut numbers = words(rest).map(finite);
                // One-dimensional coordinates are legal, a depth is not used.
                let uv = match (numbers.next(), numbers.next()) {
                    (Some(Some(u)), None) => Some((u, 0.0)),
                    (Some(Some(u)), Some(Some(v))) => Some((u, v)),
                    _ => None,
                };
                let (u, v) = uv.unwrap_or_else(|| {
                    flaws.add(Flaw::UvUnreadable, line);
                    (f32::NAN, f32::NAN)
                });
                let _ = writeln!(self.uvs, "vt {u} {v}");
                self.counts.uvs += 1;
            }
            "vn" => {
                let mut numbers = words(rest).map(finite);
                let normal = [(); 3].map(|()| numbers.next().flatten());
                let [x, y, z] = match normal {
                    [Some(x), Some(y), Some(z)] if [x, y, z] != [0.0; 3] => [x, y, z],
                    _ => {
                        flaws.add(Flaw::NormalUnreadable, line);
                        [f32::NAN; 3]
                    }
                };
                let _ = writeln!(self.normals, "vn {x} {y} {z}");
                self.counts.normals += 1;
            }
            _ => {}
        }
    }

    fn position(&mut self, line: u32, rest: &str, flaws: &mut Flaws) {
        let numbers: Vec<&str> = words(rest).take(8).collect();
        let [x, y, z] =
            std::array::from_fn(|i| numbers.get(i).copied().and_then(finite)).map(|c| c.unwrap_or(f32::NAN));
        let [x, y, z] = if [x, y, z].iter().all(|c| c.is_finite()) {
            [x, y, z]
        } else {
            flaws.add(Flaw::VertexNotFinite, line);
            self.bad.push(self.counts.positions);
            [0.0; 3]
        };
        // x y z r g b, or x y z w r g b; the weight w is for rational curves and changes no polygon.
        let color = match numbers.len() {
            6 => Some(&numbers[3..6]),
            7 => Some(&numbers[4..7]),
            _ => None,
        };
        if color.is_some() && !self.colored {
            self.colored = true;
            self.positions = self.positions.replace('\n', " NaN NaN NaN\n");
        }
        let _ = write!(self.positions, "v {x} {y} {z}");
        if self.colored {
            let rgb = color.map(|c| std::array::from_fn(|i| finite(c[i])));
            let [r, g, b] = match rgb {
                None => [f32::NAN; 3],
                Some([Some(r), Some(g), Some(b)]) => [r, g, b],
                Some(_) => {
                    flaws.add(Flaw::ColorUnreadable, line);
                    [1.0; 3]
                }
            };
            let _ = write!(self.positions, " {r} {g} {b}");
        }
        self.positions.push('\n');
        self.points.push(Vec3::new(x, y, z));
        self.counts.positions += 1;
    }

    /// The stream so far: the entries for what is missing first, the normals made for smoothing groups last.
    fn into_stream(self, smooth: SmoothNormals) -> String {
        let mut stream = self.positions;
        stream.push_str("vt NaN NaN\n");
        stream.push_str(&self.uvs);
        stream.push_str("vn NaN NaN NaN\n");
        stream.push_str(&self.normals);
        for normal in smooth.into_normals() {
            let Vec3 { x, y, z } = normal.unwrap_or(Vec3::NAN);
            let _ = writeln!(stream, "vn {x} {y} {z}");
        }
        stream
    }
}

/// The second pass: faces, now that all vertices are known.
struct Faces<'a> {
    name: &'a str,
    grouping: Grouping,
    vertices: &'a Vertices,
    /// Vertices before the current line: what relative indices count back from.
    seen: Counts,
    out: Cleaned,
    index: BTreeMap<(String, Option<String>), usize>,
    object: String,
    material: Option<String>,
    /// The group of the last face, while object and material stay.
    current: Option<usize>,
    /// The smoothing group of the faces that follow.
    smoothing: Option<u32>,
    smooth: SmoothNormals,
}

impl Faces<'_> {
    fn read(&mut self, line: u32, statement: &str, flaws: &mut Flaws) -> Result<(), ObjError> {
        let (key, rest) = split(statement);
        match key {
            "v" => self.seen.positions += 1,
            "vt" => self.seen.uvs += 1,
            "vn" => self.seen.normals += 1,
            // "fo" is an obsolete spelling.
            "f" | "fo" => self.face(line, rest, flaws)?,
            "o" | "g" => {
                rest.clone_into(&mut self.object);
                self.current = None;
            }
            "usemtl" => {
                let name = unquoted(rest);
                self.material = (!name.is_empty()).then(|| name.to_owned());
                self.current = None;
            }
            "mtllib" => self.out.libraries.push((rest.to_owned(), line)),
            "p" | "l" => flaws.add(Flaw::NotSurface, line),
            "vp" | "cstype" | "deg" | "bmat" | "step" | "curv" | "curv2" | "surf" | "parm" | "trim"
            | "hole" | "scrv" | "sp" | "end" | "con" | "bzp" | "bsp" | "cdc" | "cdp" | "res" => {
                flaws.add(Flaw::FreeForm, line)
            }
            "s" => self.smoothing(line, rest, flaws),
            // Merging groups, display attributes.
            "mg" | "bevel" | "c_interp" | "d_interp" | "lod" | "usemap" | "maplib" | "shadow_obj"
            | "trace_obj" | "ctech" | "stech" => {}
            _ => flaws.add(Flaw::Unknown, line),
        }
        Ok(())
    }

    fn face(&mut self, line: u32, rest: &str, flaws: &mut Flaws) -> Result<(), ObjError> {
        let mut corners = Vec::with_capacity(4);
        for word in words(rest) {
            let corner = Corner::parse(word, self.seen, self.vertices.counts)
                .map_err(|flaw| flaw.at(self.name, line, word, self.vertices.counts))?;
            corners.push(corner);
            if corners.len() > MAX_CORNERS {
                let place = format!("{}:{line}", self.name);
                return Err(ObjError::PolygonTooLarge { place, corners: corners.len() });
            }
        }
        let is_bad = |corner: &Corner| self.vertices.bad.binary_search(&corner.position).is_ok();
        if corners.iter().any(is_bad) {
            flaws.add(Flaw::FaceOfBadVertex, line);
        } else if corners.len() < 3 {
            flaws.add(Flaw::FaceTooSmall, line);
        } else {
            self.write(line, &corners);
        }
        Ok(())
    }

    /// Adds a face to its group.
    fn write(&mut self, line: u32, corners: &[Corner]) {
        let smooth = self.smoothing.map(|smoothing| {
            let positions: Vec<usize> = corners.iter().map(|corner| corner.position).collect();
            self.smooth.add(&positions, &self.vertices.points, smoothing)
        });
        let group = self.group(line);
        let faces = &mut self.out.groups[group].faces;
        faces.push('f');
        for (i, corner) in corners.iter().enumerate() {
            // The stream has the normals that are made behind the file's own.
            let made = || smooth.as_ref().map(|places| self.vertices.counts.normals + places[i]);
            let normal = corner.normal.or_else(made);
            // The first coordinate and normal of the stream stand for missing ones.
            let shifted = |i: Option<usize>| i.map_or(1, |i| i + 2);
            let _ = write!(faces, " {}/{}/{}", corner.position + 1, shifted(corner.uv), shifted(normal));
        }
        faces.push('\n');
    }

    /// `s`: a group by its number, `on` as 1. A file read as one mesh has the normals that it gives, and no others.
    fn smoothing(&mut self, line: u32, rest: &str, flaws: &mut Flaws) {
        let group = match words(rest).next() {
            None | Some("off") => Some(0),
            Some("on") => Some(1),
            Some(number) => number.parse().ok(),
        };
        if group.is_none() {
            flaws.add(Flaw::SmoothingUnreadable, line);
        }
        self.smoothing = group.filter(|&g| g > 0 && self.grouping == Grouping::ByObjectAndMaterial);
    }

    /// The index of the group that faces now belong to.
    fn group(&mut self, line: u32) -> usize {
        if let Some(current) = self.current {
            return current;
        }
        let key = match self.grouping {
            Grouping::ByObjectAndMaterial => (self.object.clone(), self.material.clone()),
            Grouping::Whole => (String::new(), None),
        };
        let groups = &mut self.out.groups;
        let group = *self.index.entry(key).or_insert_with_key(|(name, material)| {
            groups.push(Group { name: name.clone(), material: material.clone(), line, faces: String::new() });
            groups.len() - 1
        });
        self.current = Some(group);
        group
    }
}

/// One corner of a face, indices from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Corner {
    position: usize,
    uv: Option<usize>,
    normal: Option<usize>,
}

/// Why a corner cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum CornerFlaw {
    NotAnIndex,
    OutOfRange { what: &'static str },
}

impl CornerFlaw {
    fn at(self, file: &str, line: u32, word: &str, counts: Counts) -> ObjError {
        let (file, word) = (file.to_owned(), word.chars().take(64).collect());
        match self {
            Self::NotAnIndex => ObjError::Face { file, line, word },
            Self::OutOfRange { what } => {
                let count = match what {
                    "vertex" => counts.positions,
                    "texture coordinate" => counts.uvs,
                    _ => counts.normals,
                };
                ObjError::Index { file, line, word, what, count }
            }
        }
    }
}

impl Corner {
    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`; negative indices count back from what was `seen`, positive ones may point ahead.
    fn parse(word: &str, seen: Counts, all: Counts) -> Result<Self, CornerFlaw> {
        if word.split('/').count() > 3 {
            return Err(CornerFlaw::NotAnIndex);
        }
        let mut parts = word.split('/');
        let mut next = |what, seen: usize, all: usize| -> Result<Option<usize>, CornerFlaw> {
            match parts.next() {
                None | Some("") => Ok(None),
                Some(part) => {
                    let index: i64 = part.parse().map_err(|_| CornerFlaw::NotAnIndex)?;
                    let absolute =
                        if index < 0 { index.checked_add(seen as i64) } else { index.checked_sub(1) };
                    let valid = absolute.and_then(|i| usize::try_from(i).ok()).filter(|&i| i < all);
                    valid.map(Some).ok_or(CornerFlaw::OutOfRange { what })
                }
            }
        };
        let position = next("vertex", seen.positions, all.positions)?.ok_or(CornerFlaw::NotAnIndex)?;
        let uv = next("texture coordinate", seen.uvs, all.uvs)?;
        let normal = next("normal", seen.normals, all.normals)?;
        Ok(Self { position, uv, normal })
    }
}
