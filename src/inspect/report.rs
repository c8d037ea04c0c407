//! One material looked at, and the files that show it.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use super::chart::{Albedo, Density, Heat, Polar, PolarPanel};
use super::measure::{Curve, Estimate, Measurements, measure};
use super::sphere::lit_sphere;
use super::{InspectError, Subject, page};
use crate::disney::Lobe;
use crate::imagefile::{encode_png, write_whole};
use crate::manifest::names::plain_name;
use crate::render::Control;
use crate::report::chart::{self, Picture, color};

/// How the sphere is rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Its picture's side in pixels.
    pub size: u32,
    /// Samples a pixel.
    pub spp: u32,
}

impl Default for Options {
    fn default() -> Self {
        Self { size: 256, spp: 96 }
    }
}

/// A material that has been looked at.
#[derive(Clone, Debug)]
pub struct Inspected {
    /// The material.
    pub subject: Subject,
    /// What was measured.
    pub measurements: Measurements,
    /// The lit sphere.
    pub sphere: Picture,
}

/// Measures a material and renders its sphere; `control` follows and stops the render.
///
/// # Errors
/// If it can't be rendered.
pub fn look(subject: Subject, options: Options, control: &Control) -> Result<Inspected, InspectError> {
    let measurements = measure(&subject.bsdf);
    let sphere = lit_sphere(&subject.material, options.size, options.spp, control)?;
    Ok(Inspected { subject, measurements, sphere })
}

/// Writes the page, and beside it `sphere_NAME.png`, `polar_NAME.png`, `albedo_NAME.png` and `density_NAME.png` for each material;
/// `comparison.png` as well if there are several. A `path` that ends in `.html` is the page, any other is the folder of
/// `index.html`. Returns the files, the page first.
///
/// # Errors
/// If a chart can't be drawn or a file can't be written.
pub fn write_report(path: &Path, inspected: &[Inspected]) -> Result<Vec<PathBuf>, InspectError> {
    let is_page = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("html"));
    let page_path = if is_page { path.to_owned() } else { path.join("index.html") };
    let folder = page_path.parent().unwrap_or(Path::new(""));
    std::fs::create_dir_all(folder).map_err(|cause| InspectError::File { path: folder.to_owned(), cause })?;
    let mut files = vec![page_path.clone()];
    let mut pages = Vec::new();
    let mut taken = HashSet::new();
    let mut write = |name: String, picture: &Picture| -> Result<Vec<u8>, InspectError> {
        let png = encode_png(picture.width, picture.height, &picture.rgb)?;
        let path = folder.join(name);
        write_whole(&path, &png)?;
        files.push(path);
        Ok(png)
    };
    for one in inspected {
        let name = file_name(&one.subject.name, &mut taken);
        let colors = lobe_colors(inspected, &one.measurements.lobes);
        let (polar, albedo) = (one.polar(&colors), one.albedo(&colors));
        let density = Density { views: &one.measurements.views };
        let heat = chart::picture(&Heat { views: &one.measurements.views })
            .ok()
            .filter(|picture| !picture.rgb.is_empty());
        let sphere_png = write(format!("sphere_{name}.png"), &one.sphere)?;
        write(format!("polar_{name}.png"), &chart::picture(&polar)?)?;
        write(format!("albedo_{name}.png"), &chart::picture(&albedo)?)?;
        let mut parts = vec![chart::picture(&density)?];
        parts.extend(heat.clone());
        write(format!("density_{name}.png"), &chart::stacked(&parts))?;
        let of = |what: &str| format!("{what} of {}", one.subject.name);
        pages.push(page::Section {
            inspected: one,
            sphere_png,
            polar: chart::svg(&polar, &of("polar slices"))?,
            albedo: chart::svg(&albedo, &of("albedo"))?,
            density: chart::svg(&density, &of("density of sampling"))?,
            maps_png: heat.map(|p| encode_png(p.width, p.height, &p.rgb)).transpose()?,
        });
    }
    let comparison = if inspected.len() > 1 {
        let (polar, albedo) = compared(inspected);
        let spheres: Vec<(&str, &Picture)> =
            inspected.iter().map(|one| (one.subject.name.as_str(), &one.sphere)).collect();
        let charts = [chart::picture(&polar)?, chart::picture(&albedo)?];
        let picture = chart::stacked(&[&[chart::row(&spheres)?], &charts[..]].concat());
        write("comparison.png".to_owned(), &picture)?;
        Some((chart::svg(&polar, "polar slices of all")?, chart::svg(&albedo, "albedo of all")?))
    } else {
        None
    };
    write_whole(&page_path, page::html(&pages, comparison)?.as_bytes())?;
    Ok(files)
}

/// A material's name as a part of file names, the same for no two, whatever the case.
fn file_name(name: &str, taken: &mut HashSet<String>) -> String {
    let plain = plain_name(name);
    let mut candidate = plain.clone();
    let mut count = 1;
    while !taken.insert(candidate.to_lowercase()) {
        count += 1;
        candidate = format!("{plain}-{count}");
    }
    candidate
}

/// Each lobe's colour: the same for all materials of a page.
fn lobe_colors(inspected: &[Inspected], lobes: &[Lobe]) -> Vec<(Lobe, plotters::style::RGBColor)> {
    // The most common ones come first, so that they always look the same.
    let mut all = vec![Lobe::Diffuse, Lobe::Specular, Lobe::Clearcoat, Lobe::Sheen];
    for lobe in inspected.iter().flat_map(|one| &one.measurements.lobes) {
        if !all.contains(lobe) {
            all.push(*lobe);
        }
    }
    let place = |lobe: &Lobe| all.iter().position(|l| l == lobe).unwrap_or(0);
    lobes.iter().map(|lobe| (*lobe, color(place(lobe)))).collect()
}

type Colors = [(Lobe, plotters::style::RGBColor)];

fn color_of(colors: &Colors, lobe: Lobe) -> plotters::style::RGBColor {
    colors.iter().find(|(l, _)| *l == lobe).map_or(chart::FAINT, |(_, color)| *color)
}

fn lobe_legend(colors: &Colors) -> Vec<(String, plotters::style::RGBColor)> {
    colors.iter().map(|(lobe, color)| (lobe.name().to_owned(), *color)).collect()
}

impl Inspected {
    fn polar(&self, colors: &Colors) -> Polar<'_> {
        let panels = self.measurements.views.iter().map(|view| PolarPanel {
            angle: view.angle,
            curves: view.lobes.iter().map(|(lobe, curve)| (color_of(colors, *lobe), curve)).collect(),
            spikes: view.spikes.iter().map(|s| (color_of(colors, s.lobe), s.angle, s.weight)).collect(),
        });
        Polar { panels: panels.collect(), legend: lobe_legend(colors) }
    }

    fn albedo(&self, colors: &Colors) -> Albedo {
        let estimates = &self.measurements.albedo;
        let curve = |value: &dyn Fn(&Estimate) -> f64| -> Curve {
            estimates.iter().map(|e| (e.angle, value(e))).collect()
        };
        let part = |i: usize| curve(&|e: &Estimate| e.lobes[i].1);
        let areas = (0..colors.len()).map(|i| (colors[i].1, part(i))).collect();
        let mut legend = lobe_legend(colors);
        legend.push(("all lobes, luminance".to_owned(), chart::INK));
        let mut channels = Vec::new();
        let is_colored = estimates.iter().any(|e| {
            let [r, g, b] = e.albedo.to_array();
            (r - g).abs().max((g - b).abs()) > 0.01
        });
        if is_colored {
            for (i, (name, rgb)) in (0..).zip([
                ("red", [0xd6, 0x27, 0x28]),
                ("green", [0x2c, 0x8a, 0x2c]),
                ("blue", [0x1f, 0x4f, 0xd0]),
            ]) {
                let color = plotters::style::RGBColor(rgb[0], rgb[1], rgb[2]);
                channels.push((color, curve(&|e: &Estimate| e.albedo.to_array()[i])));
                legend.push((name.to_owned(), color));
            }
        }
        Albedo { areas, lines: vec![(chart::INK, curve(&Estimate::luminance))], channels, legend }
    }
}

/// All materials in one chart: the sum of their lobes, and their albedo.
fn compared(inspected: &[Inspected]) -> (Polar<'_>, Albedo) {
    let legend: Vec<_> =
        inspected.iter().enumerate().map(|(i, one)| (one.subject.name.clone(), color(i))).collect();
    let views = &inspected[0].measurements.views;
    let panels = views.iter().enumerate().map(|(v, view)| {
        let seen = || inspected.iter().map(move |one| &one.measurements.views[v]).enumerate();
        PolarPanel {
            angle: view.angle,
            curves: seen().map(|(i, view)| (color(i), &view.total)).collect(),
            spikes: seen()
                .flat_map(|(i, view)| view.spikes.iter().map(move |s| (color(i), s.angle, s.weight)))
                .collect(),
        }
    });
    let lines = inspected.iter().enumerate().map(|(i, one)| {
        let curve = one.measurements.albedo.iter().map(|e| (e.angle, e.luminance())).collect();
        (color(i), curve)
    });
    let albedo =
        Albedo { areas: Vec::new(), lines: lines.collect(), channels: Vec::new(), legend: legend.clone() };
    (Polar { panels: panels.collect(), legend }, albedo)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_names_are_safe_and_differ_in_more_than_case() {
        let mut taken = HashSet::new();
        let names = ["../Gold: 1", "../gold; 1", "..", "rough=0.1"].map(|n| file_name(n, &mut taken));
        assert_eq!(names, ["_.._Gold__1", "_.._gold__1-2", "_..", "rough_0.1"]);
    }
}
