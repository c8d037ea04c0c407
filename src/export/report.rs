//! What became of materials, as a table, as JSON and as a page.

use comfy_table::{ContentArrangement, LineStyle, Table, presets};
use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, UndefinedBehavior};
use serde_json::json;

use super::{ExportError, Exported};
use crate::convert::Note;

/// A row for each material and field: how well it is kept and why, a `"` for what stands above; then a line that counts. `width` is the terminal's, none for a file.
pub fn table(exported: &Exported, width: Option<u16>) -> String {
    let mut table = Table::new();
    let rule = LineStyle::none().fill('─').junction('─');
    table.load_style(presets::NOTHING.header_separator(rule));
    table.set_header(["material", "field", "quality", "reason"]);
    if let Some(width) = width {
        table.set_content_arrangement(ContentArrangement::Dynamic).set_width(width);
    }
    let mut above: Option<&Note> = None;
    for note in &exported.notes {
        let same = above.filter(|above| above.material == note.material);
        let material = if same.is_some() { String::new() } else { printable(&note.material) };
        let repeats = same.is_some_and(|above| above.reason == note.reason && !note.reason.is_empty());
        let reason = if repeats { "\"".to_owned() } else { printable(&note.reason) };
        above = Some(note);
        table.add_row([material, printable(&note.field), note.quality.name().into(), reason]);
    }
    let rows = if exported.notes.is_empty() { String::new() } else { format!("{}\n\n", table.trim_fmt()) };
    format!("{rows}{}\n", summary(exported))
}

fn summary(exported: &Exported) -> String {
    let counts = crate::convert::Quality::ALL.iter().filter_map(|quality| {
        let count = exported.notes.iter().filter(|n| n.quality == *quality).count();
        (count > 0).then(|| format!("{count} {}", quality.name()))
    });
    let counts: Vec<String> = counts.collect();
    let counts = if counts.is_empty() { "nothing to tell".to_owned() } else { counts.join(", ") };
    let materials = counted(exported.materials, "material");
    let textures = counted(exported.textures, "texture");
    format!("{}: {materials}, {textures}; fields: {counts}", exported.file.display())
}

/// A number of things, as in "1 texture" and "2 textures".
fn counted(count: usize, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}

/// Control characters of names from files would move the terminal's cursor.
fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// All of it, for programs.
pub fn json(exported: &[Exported]) -> serde_json::Value {
    exported
        .iter()
        .map(|e| {
            let notes = e.notes.iter().map(|n| {
                json!({
                    "material": n.material, "field": n.field, "quality": n.quality.name(), "reason": n.reason,
                })
            });
            json!({
                "scene": e.source, "file": e.file, "materials": e.materials, "textures": e.textures,
                "notes": notes.collect::<Vec<_>>(),
                "warnings": e.warnings.iter().map(ToString::to_string).collect::<Vec<_>>(),
            })
        })
        .collect()
}

/// A page that needs no other file.
///
/// # Errors
/// If the template can't be filled in, which tests rule out.
pub fn html(exported: &[Exported]) -> Result<String, ExportError> {
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    let view = json!({ "scenes": json(exported) });
    Ok(environment.render_named_str("page.html", include_str!("page.html"), Serde(view))?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::convert::Quality;

    fn exported() -> Exported {
        let note = |material: &str, field: &str, quality, reason: &str| Note {
            material: material.into(),
            field: field.into(),
            quality,
            reason: reason.into(),
        };
        Exported {
            source: "model.glb".into(),
            file: "out/materials.yaml".into(),
            materials: 2,
            textures: 1,
            notes: vec![
                note("<gold>", "baseColorFactor", Quality::Carried, "albedo +5%"),
                note("<gold>", "alphaMode", Quality::Exact, ""),
                note("coat\n", "KHR_materials_iridescence", Quality::Dropped, "not read"),
            ],
            warnings: Vec::new(),
        }
    }

    #[test]
    fn the_table_names_each_material_once_and_counts() {
        let text = table(&exported(), None);
        assert_eq!(text.matches("<gold>").count(), 1);
        assert!(text.contains("KHR_materials_iridescence   dropped   not read"), "{text}");
        let counted = "out/materials.yaml: 2 materials, 1 texture; fields: 1 exact, 1 carried, 1 dropped\n";
        assert!(text.ends_with(counted), "{text}");
    }

    #[test]
    fn the_page_is_whole_and_escapes_names() {
        let page = html(&[exported()]).unwrap();
        assert!(page.contains("&lt;gold&gt;") && !page.contains("<gold>"));
        assert!(page.contains("albedo +5%") && !page.contains("http"));
        assert!(page.contains("2 materials, 1 texture<"));
        assert_eq!(json(&[exported()])[0]["notes"][2]["quality"], "dropped");
    }
}
