//! OpenImageIO reads what we write, and we read what it reads: parts, names, channels, types, windows, attributes, values.
//!
//! The environment's `PIPELINE_OIIO_PYTHON` names a Python that has OpenImageIO, `PIPELINE_CORPUS` a folder whose `exr/` holds
//! images; a test that lacks its own says so and passes.

#![expect(clippy::print_stderr, reason = "says what is refused")]

#[path = "common/outside.rs"]
mod outside;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use outside::outside;
use pipeline::imagefile::{self, ImageFileError};
use pipeline::raster::{Attribute, Layer, Raster, SampleType, Window};

/// Prints what OpenImageIO sees, a line each: parts with windows, channels with the bits of their values, attributes.
const SCRIPT: &str = r#"
import sys
import OpenImageIO as oiio
path = sys.argv[1]
part = 0
while True:
    image = oiio.ImageInput.open(path)
    if image is None:
        print("error", oiio.geterror().replace("\n", " "))
        break
    if not image.seek_subimage(part, 0):
        break
    spec = image.spec()
    name = spec.get_string_attribute("oiio:subimagename") or spec.get_string_attribute("name")
    print("part", part, name)
    print("window", spec.x, spec.y, spec.width, spec.height)
    print("display", spec.full_x, spec.full_y, spec.full_width, spec.full_height)
    for c in range(spec.nchannels):
        format = spec.channelformat(c)
        native = "uint" if str(format) == "uint" else "float"
        values = image.read_image(part, 0, c, c + 1, native)
        if values is None:
            print("error", image.geterror().replace("\n", " "))
            sys.exit()
        if native == "float":
            values[values != values] = float("nan")  # one NaN is as good as another
        bits = values.astype("<u4" if native == "uint" else "<f4").tobytes().hex()
        print("channel", spec.channelnames[c], format, bits)
    for attribute in spec.extra_attribs:
        if str(attribute.type) in ("string", "int", "float"):
            print("attribute", attribute.name, attribute.type, repr(attribute.value))
    image.close()
    part += 1
"#;

fn python() -> Option<PathBuf> {
    outside("PIPELINE_OIIO_PYTHON")
}

/// One part as OpenImageIO sees it.
#[derive(Debug, Default)]
struct Seen {
    name: String,
    window: String,
    display: String,
    /// Type and hexadecimal bits of the values, by name.
    channels: BTreeMap<String, (String, String)>,
    /// In OpenImageIO's order.
    channel_names: Vec<String>,
    attributes: BTreeMap<String, String>,
}

/// What OpenImageIO sees in a file, or why it doesn't.
fn see(python: &Path, file: &Path) -> Result<Vec<Seen>, String> {
    let output = Command::new(python).arg("-c").arg(SCRIPT).arg(file).output().expect("Python runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut parts: Vec<Seen> = Vec::new();
    for line in String::from_utf8(output.stdout).expect("UTF-8").lines() {
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        if word == "error" {
            return Err(rest.to_owned());
        }
        if word == "part" {
            let name = rest.split_once(' ').map_or("", |(_, name)| name).to_owned();
            parts.push(Seen { name, ..Seen::default() });
            continue;
        }
        let part = parts.last_mut().expect("a part comes first");
        let fields: Vec<&str> = rest.splitn(3, ' ').collect();
        match word {
            "window" => part.window = rest.to_owned(),
            "display" => part.display = rest.to_owned(),
            "channel" => {
                part.channel_names.push(fields[0].to_owned());
                part.channels.insert(fields[0].to_owned(), (fields[1].to_owned(), fields[2].to_owned()));
            }
            "attribute" => {
                part.attributes.insert(fields[0].to_owned(), format!("{} {}", fields[1], fields[2]));
            }
            other => panic!("unexpected line {other:?}"),
        }
    }
    Ok(parts)
}

fn corners(window: &Window) -> String {
    format!("{} {} {} {}", window.x, window.y, window.width, window.height)
}

fn hex(bytes: impl IntoIterator<Item = [u8; 4]>) -> String {
    bytes.into_iter().flatten().map(|byte| format!("{byte:02x}")).collect()
}

/// A channel's type and bits as the script prints them.
fn printed(channel: &pipeline::raster::Channel) -> (String, String) {
    let floats = || hex(channel.values.iter().map(|v| if v.is_nan() { f32::NAN } else { *v }.to_le_bytes()));
    match channel.stored_as {
        SampleType::U32 => ("uint".into(), hex(channel.values.iter().map(|&v| (v as u32).to_le_bytes()))),
        SampleType::F16 => ("half".into(), floats()),
        SampleType::F32 => ("float".into(), floats()),
        SampleType::U8 => ("uint8".into(), floats()),
        SampleType::U16 => ("uint16".into(), floats()),
    }
}

/// Values of all kinds that are halves, so that they come back as they are whatever the channel's type.
fn values(count: usize, seed: usize) -> Vec<f32> {
    let special = [f32::INFINITY, f32::NEG_INFINITY, -0.0, 65504.0, 1.0 / 16_777_216.0];
    (0..count)
        .map(|i| match (i * 7 + seed) % 23 {
            k if k < special.len() => special[k],
            k => ((i * 31 + seed * 17) % 512) as f32 / 64.0 - k as f32,
        })
        .collect()
}

#[test]
fn open_image_io_reads_what_we_write() {
    let Some(python) = python() else { return };
    let window = Window { x: -3, y: 4, width: 21, height: 37 };
    let other = Window { x: 0, y: 0, width: 5, height: 50 };
    let fill = |mut layer: Layer, names: &str| {
        for (seed, name) in names.split(' ').enumerate() {
            let count = layer.window.pixels();
            layer = layer.with(name, values(count, seed));
        }
        layer
    };
    let mut beauty = fill(Layer::new("beauty", window), "R G B A");
    beauty.channels[0].stored_as = SampleType::F16;
    beauty.channels[3].stored_as = SampleType::F16;
    beauty.channels[1].values[5] = f32::NAN;
    beauty.attributes = vec![
        ("pipeline:identity".into(), Attribute::Text("0123abcd Zürich".into())),
        ("pipeline:spp".into(), Attribute::Int(-64)),
        ("pipeline:exposure".into(), Attribute::Float(0.1)),
    ];
    let mut data = fill(
        Layer::new("data", other),
        "albedo.R albedo.G albedo.B normal.X normal.Y normal.Z Z variance.R variance.G variance.B",
    );
    data = data.with("samples", (0..250).map(|i| (i * 1000) as f32).collect());
    data.channels[10].stored_as = SampleType::U32;
    data.attributes = vec![("pipeline:replicates".into(), Attribute::Int(4))];
    let display = Window { x: 1, y: -2, width: 64, height: 48 };
    let raster = Raster { display, layers: vec![beauty, data] };

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ours.exr");
    assert_eq!(imagefile::write_exr(&path, &raster).unwrap(), 0);
    let parts = see(&python, &path).unwrap();

    assert_eq!(parts.len(), raster.layers.len());
    for (seen, layer) in parts.iter().zip(&raster.layers) {
        assert_eq!((&seen.name, &seen.window), (&layer.name, &corners(&layer.window)));
        assert_eq!(seen.display, corners(&raster.display));
        assert_eq!(seen.channels.len(), layer.channels.len());
        for channel in &layer.channels {
            assert_eq!(seen.channels[&channel.name], printed(channel), "{}", channel.name);
        }
    }
    assert_eq!(parts[0].channel_names, ["R", "G", "B", "A"]);
    let attribute = |part: usize, name: &str| parts[part].attributes.get(name).map(String::as_str);
    assert_eq!(attribute(0, "pipeline:identity"), Some("string '0123abcd Zürich'"));
    assert_eq!(attribute(0, "pipeline:spp"), Some("int -64"));
    assert_eq!(attribute(0, "pipeline:exposure"), Some("float 0.10000000149011612"));
    assert_eq!(attribute(0, "compression"), Some("string 'zip'"));
    assert_eq!(attribute(1, "pipeline:replicates"), Some("int 4"));
    assert_eq!(attribute(1, "pipeline:spp"), None);
}

#[test]
fn open_image_io_reads_our_png() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ours.png");
    let rgb: Vec<u8> = (0..7 * 5 * 3).map(|i| (i * 11 % 256) as u8).collect();
    imagefile::write_png(&path, 7, 5, &rgb).unwrap();
    let parts = see(&python, &path).unwrap();
    let ours = imagefile::read(&path).unwrap();
    for channel in &ours.picture().channels {
        assert_eq!(parts[0].channels[&channel.name], printed(channel), "{}", channel.name);
    }
}

/// The files of the corpus with an extension, at most `most` below four mebibytes, in order.
fn corpus(extension: &str, most: usize) -> Vec<PathBuf> {
    let Some(folder) = outside("PIPELINE_CORPUS") else { return Vec::new() };
    let mut files: Vec<PathBuf> = walkdir::WalkDir::new(folder)
        .sort_by_file_name()
        .into_iter()
        .map(|entry| entry.expect("the corpus can be read"))
        .filter(|entry| entry.metadata().is_ok_and(|data| data.is_file() && data.len() < 4 << 20))
        .map(walkdir::DirEntry::into_path)
        .filter(|path| path.extension().is_some_and(|found| found == extension))
        .collect();
    assert!(!files.is_empty(), "the corpus has no {extension}");
    files.truncate(most);
    files
}

/// Reads each file as OpenImageIO does, or refuses it for what it has.
fn read_alike(python: &Path, files: &[PathBuf]) {
    let mut read = 0;
    for file in files {
        let ours = match imagefile::read(file) {
            Ok(raster) => raster,
            Err(error @ ImageFileError::Unsupported { .. }) => {
                eprintln!("refused: {error}");
                continue;
            }
            Err(error) => panic!("{error}"),
        };
        let theirs = see(python, file).unwrap();
        assert_eq!(ours.layers.len(), theirs.len(), "{}", file.display());
        for (layer, seen) in ours.layers.iter().zip(&theirs) {
            assert_eq!(corners(&layer.window), seen.window, "{}", file.display());
            assert_eq!(corners(&ours.display), seen.display, "{}", file.display());
            assert_eq!(layer.channels.len(), seen.channels.len(), "{}", file.display());
            for channel in &layer.channels {
                let same = seen.channels[&channel.name] == printed(channel);
                assert!(same, "{}: channel {} differs", file.display(), channel.name);
            }
        }
        read += 1;
    }
    assert!(read > 0 || files.is_empty(), "nothing was read");
}

#[test]
fn the_corpus_exrs_are_read_as_open_image_io_reads_them_or_refused_clearly() {
    let Some(python) = python() else { return };
    read_alike(&python, &corpus("exr", 100));
}

#[test]
fn the_corpus_pngs_are_read_as_open_image_io_reads_them() {
    let Some(python) = python() else { return };
    read_alike(&python, &corpus("png", 6));
}

#[test]
fn the_corpus_hdrs_are_read_as_open_image_io_reads_them() {
    let Some(python) = python() else { return };
    read_alike(&python, &corpus("hdr", 2));
}
