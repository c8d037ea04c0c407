//! A lenient parser of MTL libraries: a line that cannot be read is told with its number and left out, the others count.

use std::collections::BTreeMap;

use glam::Vec2;

use crate::color::Rgb;
use crate::record::Warning;
use crate::scene::material::TextureChannel;
use crate::scene::source::{MtlMap, MtlMaterial, MtlSlot};
use crate::scene::texture::Wrap;

/// The most warnings a library gets line by line.
const MAX_WARNINGS: usize = 100;

/// Reads the library `file`: its materials by name, in order. A name that comes twice has its last definition.
pub(super) fn parse(file: &str, bytes: &[u8], warnings: &mut Vec<Warning>) -> Vec<(String, MtlMaterial)> {
    let text = String::from_utf8_lossy(bytes);
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let mut parser = Parser {
        file,
        line: 0,
        warnings: Vec::new(),
        left_out: 0,
        materials: Vec::new(),
        latest: BTreeMap::new(),
    };
    for (number, line) in (1_u32..).zip(text.split('\n')) {
        parser.line = number;
        parser.read(line.trim());
    }
    warnings.append(&mut parser.warnings);
    if parser.left_out > 0 {
        warnings.push(Warning::new(file, format!("{} more warnings left out", parser.left_out)));
    }
    let Parser { materials, latest, .. } = parser;
    let counts = |(at, (name, _)): &(usize, (String, MtlMaterial))| latest.get(name) == Some(at);
    materials.into_iter().enumerate().filter(counts).map(|(_, material)| material).collect()
}

struct Parser<'a> {
    file: &'a str,
    line: u32,
    warnings: Vec<Warning>,
    left_out: u64,
    materials: Vec<(String, MtlMaterial)>,
    /// The index of each name's last definition.
    latest: BTreeMap<String, usize>,
}

impl Parser<'_> {
    fn warn(&mut self, message: impl Into<String>) {
        if self.warnings.len() < MAX_WARNINGS {
            self.warnings.push(Warning::new(format!("{}:{}", self.file, self.line), message));
        } else {
            self.left_out += 1;
        }
    }

    fn read(&mut self, line: &str) {
        if line.is_empty() || line.starts_with('#') {
            return;
        }
        let (key, rest) = line.split_once(char::is_whitespace).map_or((line, ""), |(k, r)| (k, r.trim()));
        if key.eq_ignore_ascii_case("newmtl") {
            return self.begin(rest);
        }
        if self.materials.is_empty() {
            return self.warn(format!("{} stands before the first newmtl; left out", shown(key)));
        }
        if let Some(slot) = MtlSlot::from_statement(key) {
            return self.map(slot, key, rest);
        }
        match key.to_ascii_lowercase().as_str() {
            "ka" => self.color(rest, key, |m| &mut m.ka),
            "kd" => self.color(rest, key, |m| &mut m.kd),
            "ks" => self.color(rest, key, |m| &mut m.ks),
            "ke" => self.color(rest, key, |m| &mut m.ke),
            "tf" => self.color(rest, key, |m| &mut m.tf),
            "ns" => self.number(rest, key, |m| &mut m.ns),
            "ni" => self.number(rest, key, |m| &mut m.ni),
            "d" => self.dissolve(rest, key),
            "tr" => self.number(rest, key, |m| &mut m.tr),
            "pr" => self.number(rest, key, |m| &mut m.pr),
            "pm" => self.number(rest, key, |m| &mut m.pm),
            "ps" => self.number(rest, key, |m| &mut m.ps),
            "pc" => self.number(rest, key, |m| &mut m.pc),
            "pcr" => self.number(rest, key, |m| &mut m.pcr),
            "aniso" => self.number(rest, key, |m| &mut m.aniso),
            "anisor" => self.number(rest, key, |m| &mut m.anisor),
            "illum" => self.illum(rest),
            // Sharpness of reflection maps, and antialiasing of textures: no effect here.
            "sharpness" | "map_aat" => {}
            _ => self.warn(format!("unknown statement {}; left out", shown(key))),
        }
    }

    fn begin(&mut self, name: &str) {
        let name = unquoted(name).to_owned();
        if name.is_empty() {
            self.warn("newmtl without a name");
        }
        let material =
            MtlMaterial { library: self.file.to_owned(), line: self.line, ..MtlMaterial::default() };
        if let Some(at) = self.latest.insert(name.clone(), self.materials.len()) {
            let first = self.materials[at].1.line;
            self.warn(format!(
                "material {} is defined in line {first} already; this one counts",
                shown(&name)
            ));
        }
        self.materials.push((name, material));
    }

    fn set<T>(&mut self, field: impl Fn(&mut MtlMaterial) -> &mut Option<T>, value: T) {
        if let Some((_, material)) = self.materials.last_mut() {
            *field(material) = Some(value);
        }
    }

    fn color(&mut self, rest: &str, key: &str, field: impl Fn(&mut MtlMaterial) -> &mut Option<Rgb>) {
        let mut words = words(rest);
        let first = words.next();
        if let Some(kind @ ("spectral" | "xyz")) = first {
            return self.warn(format!("{} {kind} is not read; left out", shown(key)));
        }
        let values: Vec<Option<f32>> = first.into_iter().chain(words).take(3).map(finite).collect();
        match values[..] {
            // One number is a grey; two leave blue out.
            [Some(grey)] => self.set(field, Rgb::grey(grey)),
            [Some(r), Some(g), Some(b)] => self.set(field, Rgb::new(r, g, b)),
            _ => self.warn(format!("{} wants one or three numbers; left out", shown(key))),
        }
    }

    fn number(&mut self, rest: &str, key: &str, field: impl Fn(&mut MtlMaterial) -> &mut Option<f32>) {
        match words(rest).next().and_then(finite) {
            Some(value) => self.set(field, value),
            None => self.warn(format!("{} wants a number; left out", shown(key))),
        }
    }

    fn dissolve(&mut self, rest: &str, key: &str) {
        match rest.strip_prefix("-halo") {
            None => self.number(rest, key, |m| &mut m.d),
            Some(rest) => {
                self.warn("-halo is not read: the dissolve is the same from all sides");
                self.number(rest, key, |m| &mut m.d);
            }
        }
    }

    fn illum(&mut self, rest: &str) {
        // Some exporters write `2.0`.
        let value =
            words(rest).next().and_then(finite).filter(|v| (0.0..=10.0).contains(v) && v.fract() == 0.0);
        match value {
            Some(value) => self.set(|m| &mut m.illum, value as u32),
            None => self.warn("illum wants a whole number from 0 to 10; left out"),
        }
    }

    fn map(&mut self, slot: MtlSlot, key: &str, rest: &str) {
        let mut map = MtlMap::new("", self.line);
        let file = self.options(rest, &mut map);
        let file = unquoted(file);
        if file.is_empty() {
            return self.warn(format!("{} names no file; left out", shown(key)));
        }
        file.clone_into(&mut map.file);
        if let Some((_, material)) = self.materials.last_mut() {
            material.maps.retain(|(s, _)| *s != slot);
            material.maps.push((slot, map));
        }
    }

    /// Reads the options before a map's file into `map` and returns the rest: file names may hold blanks.
    fn options<'t>(&mut self, mut rest: &'t str, map: &mut MtlMap) -> &'t str {
        loop {
            let Some(option) = rest.split_whitespace().next().filter(|word| word.starts_with('-')) else {
                return rest;
            };
            let arguments = rest[option.len()..].trim_start();
            let numbers = |most: usize| {
                let values: Vec<f32> = arguments.split_whitespace().map_while(finite).take(most).collect();
                let after = skip_words(arguments, values.len());
                (values, after)
            };
            let word = || (arguments.split_whitespace().next().unwrap_or(""), skip_words(arguments, 1));
            rest = match option {
                "-o" => {
                    let (v, after) = numbers(3);
                    map.offset = vec2(&v, 0.0);
                    after
                }
                "-s" => {
                    let (v, after) = numbers(3);
                    map.scale = vec2(&v, 1.0);
                    after
                }
                "-bm" => {
                    let (v, after) = numbers(1);
                    map.bump_multiplier = v.first().copied().unwrap_or(1.0);
                    after
                }
                "-clamp" => {
                    let (value, after) = word();
                    map.wrap = if value == "on" { Wrap::Clamp } else { Wrap::Repeat };
                    after
                }
                "-imfchan" => {
                    let (value, after) = word();
                    map.channel = match value {
                        "r" => Some(TextureChannel::R),
                        "g" => Some(TextureChannel::G),
                        "b" => Some(TextureChannel::B),
                        "m" => Some(TextureChannel::A),
                        "l" => Some(TextureChannel::Y),
                        _ => {
                            self.warn(format!("-imfchan {} is not read; left out", shown(value)));
                            None
                        }
                    };
                    after
                }
                // These change nothing: blending and colour correction are those of the sampler.
                "-blendu" | "-blendv" | "-cc" | "-type" => word().1,
                "-boost" | "-texres" | "-t" | "-mm" => {
                    let (v, after) = numbers(if option == "-t" { 3 } else { 2 });
                    if !matches!((option, &v[..]), ("-boost" | "-texres", _) | ("-mm", [0.0, 1.0])) {
                        self.warn(format!("{option} is not read; left out"));
                    }
                    after
                }
                _ => return rest,
            };
        }
    }
}

/// Two numbers of at least one; `missing` stands for the others.
fn vec2(values: &[f32], missing: f32) -> Vec2 {
    Vec2::new(values.first().copied().unwrap_or(missing), values.get(1).copied().unwrap_or(missing))
}

fn skip_words(mut text: &str, count: usize) -> &str {
    for _ in 0..count {
        text = text.trim_start();
        text = text.find(char::is_whitespace).map_or("", |at| &text[at..]);
    }
    text.trim_start()
}

fn words(rest: &str) -> impl Iterator<Item = &str> {
    rest.split_whitespace().take_while(|word| !word.starts_with('#'))
}

fn finite(word: &str) -> Option<f32> {
    word.parse::<f32>().ok().filter(|value| value.is_finite())
}

/// Names may stand in quotes.
pub(super) fn unquoted(name: &str) -> &str {
    let inner = name.strip_prefix('"').and_then(|n| n.strip_suffix('"'));
    inner.or_else(|| name.strip_prefix('\'').and_then(|n| n.strip_suffix('\''))).unwrap_or(name).trim()
}

/// A word as a message shows it: quoted, and never longer than a line.
fn shown(word: &str) -> String {
    format!("{:?}", word.chars().take(64).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(text: &str) -> (MtlMaterial, Vec<String>) {
        let mut warnings = Vec::new();
        let materials = parse("m.mtl", format!("newmtl a\n{text}").as_bytes(), &mut warnings);
        (materials.into_iter().next().unwrap().1, warnings.iter().map(ToString::to_string).collect())
    }

    #[test]
    fn every_statement_is_read() {
        let (m, warnings) =
            one("Kd .1 .2 .3\nKs 0.5\nKe 1 2 3\nTf 1 1 0\nNs 250 # shiny\nNi 1.45\nd .5\nTr .25\nillum 2\n\
             Pr .3\nPm 1\nPs .1\nPc .2\nPcr .4\naniso .6\nanisor .25\nKa 1 1 1\n");
        assert!(warnings.is_empty(), "{warnings:?}");
        assert_eq!((m.kd, m.ks), (Some(Rgb::new(0.1, 0.2, 0.3)), Some(Rgb::grey(0.5))));
        assert_eq!((m.ke, m.tf), (Some(Rgb::new(1.0, 2.0, 3.0)), Some(Rgb::new(1.0, 1.0, 0.0))));
        assert_eq!(
            (m.ns, m.ni, m.d, m.tr, m.illum),
            (Some(250.0), Some(1.45), Some(0.5), Some(0.25), Some(2))
        );
        assert_eq!((m.pr, m.pm, m.ps, m.pc, m.pcr), (Some(0.3), Some(1.0), Some(0.1), Some(0.2), Some(0.4)));
        assert_eq!((m.aniso, m.anisor), (Some(0.6), Some(0.25)));
        assert!(m.is_physically_based());
    }

    #[test]
    fn a_bad_line_costs_itself_alone_and_is_told_with_its_number() {
        let (m, warnings) = one(
            "Kd spectral file.rfl 1.0\nd -halo .6\nillum 2.0\nNs shiny\nKs .1 .2\nNi nan\nPr .5\nblub 3\n",
        );
        assert_eq!((m.d, m.illum, m.pr), (Some(0.6), Some(2), Some(0.5)));
        assert_eq!((m.kd, m.ns, m.ks, m.ni), (None, None, None, None));
        for (line, part) in [(2, "spectral"), (3, "-halo"), (5, "Ns"), (6, "Ks"), (7, "Ni"), (9, "blub")] {
            assert!(
                warnings.iter().any(|w| w.starts_with(&format!("m.mtl:{line}: ")) && w.contains(part)),
                "{line} {part}: {warnings:?}"
            );
        }
        assert_eq!(warnings.len(), 6);
    }

    #[test]
    fn map_options_and_names_with_blanks_are_read() {
        let (m, warnings) = one(
            "map_Kd -s 2 3 1 -o .5 -clamp on \"my wood.png\"\nbump -bm .2 a\\b c.png\nmap_d -imfchan g x.png\nmap_Ns -imfchan l x.png\n",
        );
        assert!(warnings.is_empty(), "{warnings:?}");
        let kd = m.map(MtlSlot::Kd).unwrap();
        assert_eq!(
            (kd.file.as_str(), kd.scale, kd.offset),
            ("my wood.png", Vec2::new(2.0, 3.0), Vec2::new(0.5, 0.0))
        );
        assert_eq!(kd.wrap, Wrap::Clamp);
        let bump = m.map(MtlSlot::Bump).unwrap();
        assert_eq!((bump.file.as_str(), bump.bump_multiplier), ("a\\b c.png", 0.2));
        assert_eq!(m.map(MtlSlot::D).unwrap().channel, Some(TextureChannel::G));
        assert_eq!(m.map(MtlSlot::Ns).unwrap().channel, Some(TextureChannel::Y));
    }

    #[test]
    fn statements_without_a_material_and_second_definitions_are_told() {
        let mut warnings = Vec::new();
        let text = "Kd 1 0 0\nnewmtl a\nKd 1 0 0\nnewmtl b\nnewmtl a\nKd 0 1 0\n";
        let materials = parse("m.mtl", text.as_bytes(), &mut warnings);
        assert_eq!(materials.len(), 2);
        assert_eq!(materials[1].1.kd, Some(Rgb::new(0.0, 1.0, 0.0)));
        assert_eq!(warnings.len(), 2, "{warnings:?}");
    }
}
