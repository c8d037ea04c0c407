//! OBJ files of a few lines, each with one trap, and files damaged at random.

use glam::{Vec2, Vec3};

use super::*;
use crate::color::Rgb;
use crate::import::Reach;
use crate::scene::source::MtlSlot;

type Imported = (Scene<SourceMaterial>, Vec<Warning>);

fn import_with(obj: &str, others: &[(&str, &[u8])]) -> Result<Imported, ObjError> {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in others {
        std::fs::write(folder.path().join(name), content).unwrap();
    }
    import(&mut Files::new(folder.path(), Reach::Folder).unwrap(), "a.obj", obj.as_bytes())
}

fn ok(obj: &str) -> Imported {
    import_with(obj, &[]).unwrap()
}

fn mtl<'a>(scene: &'a Scene<SourceMaterial>, name: &str) -> &'a MtlMaterial {
    let named = scene.materials.iter().find(|m| m.name == name).unwrap();
    let SourceMaterial::Mtl(material) = &named.item else { panic!("{named:?}") };
    material
}

/// The positions of a mesh's triangles.
fn corners(mesh: &Mesh) -> Vec<[Vec3; 3]> {
    mesh.triangles.iter().map(|t| t.map(|i| mesh.positions[i as usize])).collect()
}

const QUAD: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn negative_continued_and_commented_statements_are_read() {
    let (scene, warnings) =
        ok("\u{feff}# comment \\\nv 0 0 \\\n 0\nv 1 0 0 # here\r\nv 1 1 0\nf -3 \\\n-2 -1\n");
    assert_eq!(corners(&scene.meshes[0]), [[Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0)]]);
    assert!(warnings.is_empty(), "{warnings:?}");
    assert!(scene.meshes[0].normals.is_empty() && scene.meshes[0].uvs.is_empty());
}

#[test]
fn points_and_lines_are_not_triangles() {
    let (scene, warnings) = ok(&format!("{QUAD}l 1 2 3\np 1\nf 1 2\nf 1 2 3\n"));
    assert_eq!(scene.triangle_count(), 1);
    let text: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    assert!(text.iter().any(|w| w.starts_with("a.obj:5: ") && w.contains("(2 times)")), "{text:?}");
    assert!(text.iter().any(|w| w.starts_with("a.obj:7: ") && w.contains("fewer than three")), "{text:?}");
}

#[test]
fn mixed_corners_keep_their_own_coordinates() {
    let (scene, warnings) = ok(&format!("{QUAD}vt .25 .75\nvt .5 .5\nvt 1 0\nf 1 2 3\nf 1/1 3/2 4/3\n"));
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.triangles.len(), 2);
    let uvs = mesh.triangles[1].map(|i| mesh.uvs[0][i as usize]);
    assert_eq!(uvs, [Vec2::new(0.25, 0.25), Vec2::new(0.5, 0.5), Vec2::new(1.0, 1.0)]);
    assert_eq!(mesh.triangles[0].map(|i| mesh.uvs[0][i as usize]), [Vec2::ZERO; 3]);
    assert_eq!(mesh.uvs[0].len(), mesh.positions.len());
    assert_eq!(warnings.len(), 1);
}

#[test]
fn missing_normals_are_the_faces_own_where_others_are_given() {
    let (scene, _) = ok(&format!("{QUAD}vn 0 0 8\nvn 0 0 0\nf 1//1 2//1 3//1\nf 3 4 1//2\n"));
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.normals.len(), mesh.positions.len());
    assert!(mesh.normals.iter().all(|&n| n == Vec3::Z), "{:?}", mesh.normals);
}

/// A ridge: two quads that meet at right angles along the y axis, each cut into faces by `cut`.
fn ridge(cut: &str) -> String {
    format!("v 0 0 0\nv 0 1 0\nv 1 1 -1\nv 1 0 -1\nv -1 0 -1\nv -1 1 -1\n{cut}")
}

#[test]
fn smoothing_groups_give_the_mean_normal_however_faces_are_cut() {
    let up_at_ridge = |obj: &str| {
        let (scene, warnings) = ok(obj);
        assert!(warnings.is_empty(), "{warnings:?}");
        for mesh in &scene.meshes {
            assert_eq!(mesh.normals.len(), mesh.positions.len());
            for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
                let expected = Vec3::new(p.x.signum() * f32::from(p.x != 0.0), 0.0, 1.0).normalize();
                assert!((*n - expected).length() < 1e-6, "{obj}: {p} {n}");
            }
        }
    };
    up_at_ridge(&ridge("s 1\nf 1 4 3 2\nf 1 2 6 5\n"));
    up_at_ridge(&ridge("s on\nf 1 4 3\nf 1 3 2\nf 1 2 6 5\n"));
    // Smoothing goes across materials.
    up_at_ridge(&ridge("s 7\nusemtl a\nf 1 4 3 2\nusemtl b\nf 1 2 6 5\n").replace("usemtl", "g"));
}

#[test]
fn edges_between_smoothing_groups_stay_sharp_and_given_normals_stay() {
    let (scene, _) = ok(&ridge("s 1\nf 1 4 3 2\ns 2\nf 1 2 6 5\n"));
    for n in &scene.meshes[0].normals {
        assert!((n.x.abs() - 0.5_f32.sqrt()).abs() < 1e-6, "{n}");
    }
    let (scene, _) = ok(&ridge("vn 0 1 0\ns 1\nf 1//1 4 3 2\nf 1//1 2 6 5\n"));
    assert_eq!(scene.meshes[0].normals[0], Vec3::Y);
    assert_eq!(scene.meshes[0].normals[3], Vec3::Z);
    assert!(ok(&ridge("s 1\ns off\nf 1 4 3 2\n")).0.meshes[0].normals.is_empty());
    let (scene, warnings) = ok(&ridge("s 1\ns blub\nf 1 4 3 2\n"));
    assert!(scene.meshes[0].normals.is_empty() && warnings[0].place == "a.obj:8", "{warnings:?}");
}

#[test]
fn faces_back_to_back_in_one_smoothing_group_are_flat() {
    let (scene, _) = ok(&format!("{QUAD}s 1\nf 1 2 3\nf 3 2 1\n"));
    assert!(scene.meshes[0].normals.is_empty(), "{:?}", scene.meshes[0].normals);
}

#[test]
fn concave_polygons_are_not_fanned() {
    let (scene, _) = ok("v 0 0 0\nv 2 1 0\nv 0 2 0\nv 0.5 1 0\nf 2 3 4 1\nf 1 2 3 4\n");
    for triangle in corners(&scene.meshes[0]) {
        let [a, b, c] = triangle;
        assert!((b - a).cross(c - a).z > 0.0, "{triangle:?}");
    }
}

#[test]
fn vertices_that_are_not_finite_take_their_faces_along() {
    let (scene, warnings) = ok(
        "v 0 0 0\nv 1 0 0\nv nan 1 0\nv inf 0 0\nv 0 1e99 0\nv 1 1 0\nv 1\nf 1 2 3\nf 1 2 4\nf 1 2 5\nf 1 2 6\n",
    );
    assert_eq!(corners(&scene.meshes[0]), [[Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0)]]);
    assert!(scene.meshes[0].positions.iter().all(|p| p.is_finite()));
    assert!(warnings.iter().any(|w| w.place == "a.obj:3" && w.message.contains("(4 times)")), "{warnings:?}");
    assert!(warnings.iter().any(|w| w.place == "a.obj:8" && w.message.contains("(3 times)")), "{warnings:?}");
}

#[test]
fn colours_on_some_vertices_only_are_white_elsewhere() {
    let (scene, _) = ok("v 0 0 0\nv 1 0 0 1 0 0\nv 1 1 0\nf 1 2 3\n");
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.colors.len(), 3);
    assert_eq!((mesh.colors[0].y, mesh.colors[1].y, mesh.colors[1].x), (1.0, 0.0, 1.0));
    assert!(mtl(&scene, "default").vertex_color);
}

#[test]
fn objects_without_colours_stay_grey_beside_coloured_ones() {
    let grey = "o grey\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\n";
    let red = "o red\nv 0 0 1 1 0 0\nv 1 0 1 1 0 0\nv 1 1 1 1 0 0\nf -3 -2 -1\n";
    for (text, grey_one) in [(format!("{grey}{red}"), 0), (format!("{red}{grey}"), 1)] {
        let (scene, warnings) = ok(&text);
        assert!(mtl(&scene, "default").vertex_color && warnings.is_empty());
        assert_eq!(scene.meshes[grey_one].colors, [UNCOLORED; 3]);
        assert_eq!(scene.meshes[1 - grey_one].colors, [Vec4::new(1.0, 0.0, 0.0, 1.0); 3]);
    }
    let library: &[u8] = b"newmtl m\nKd 1 1 1\n";
    let (_, warnings) =
        import_with(&format!("mtllib m.mtl\nusemtl m\n{grey}usemtl none\n{red}"), &[("m.mtl", library)])
            .unwrap();
    assert!(!warnings.iter().any(|w| w.message.contains("not used")), "its mesh has none: {warnings:?}");
}

#[test]
fn objects_and_materials_make_instances_in_the_order_of_the_file() {
    let text =
        format!("{QUAD}o A\nusemtl x\nf 1 2 3\nusemtl y\nf 1 2 4\nusemtl x\nf 1 3 4\no B b\nf 2 3 4\n");
    let (scene, warnings) = ok(&text);
    let summary: Vec<_> = scene
        .instances
        .iter()
        .map(|i| {
            (
                i.name.as_str(),
                scene.materials[i.material.0 as usize].name.as_str(),
                scene.mesh_of(i).triangles.len(),
            )
        })
        .collect();
    assert_eq!(summary, [("A", "x", 2), ("A", "y", 1), ("B b", "x", 1)]);
    assert_eq!(warnings.len(), 2, "each missing material is told once: {warnings:?}");
}

#[test]
fn references_out_of_range_are_errors_with_line_and_word() {
    for (faces, expected) in [
        ("f 1 2 9\n", "a.obj:5: \"9\" names a vertex that is not there; the file has 4 (numbered from 1)"),
        ("f 1 2 0\n", "a.obj:5: \"0\" names a vertex"),
        ("f 1 2 -5\n", "a.obj:5: \"-5\" names a vertex"),
        ("f 1/1 2 3\n", "a.obj:5: \"1/1\" names a texture coordinate"),
        ("f 1//9223372036854775807 2 3\n", "names a normal"),
        ("f 1 2 -9223372036854775808\n", "names a vertex"),
        ("f 1 2 x\n", "a.obj:5: \"x\" is not a face's corner"),
        ("f 1 2 1/2/3/4\n", "is not a face's corner"),
        ("f 1 2 /1\n", "is not a face's corner"),
        ("", "a.obj has no face"),
        ("f 1 1 2\n", "a.obj has no face"),
    ] {
        let error = import_with(&format!("{QUAD}{faces}"), &[]).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn faces_may_refer_to_later_vertices() {
    assert_eq!(ok(&format!("f 1 2 3\n{QUAD}")).0.triangle_count(), 1);
}

#[test]
fn libraries_and_maps_are_found_and_missing_ones_told() {
    let mut png = std::io::Cursor::new(Vec::new());
    let pixels = image::RgbaImage::from_pixel(2, 2, image::Rgba([255, 0, 0, 128]));
    image::DynamicImage::ImageRgba8(pixels).write_to(&mut png, image::ImageFormat::Png).unwrap();
    let library = b"newmtl unused\nnewmtl red paint\nKd 1 0 0\nmap_Kd Wood.PNG\nmap_d wood.png\nmap_Pr gone.png\nmap_Ka wood.png\nmap_Bump -imfchan r wood.png\n";
    let text = format!("mtllib My Lib.MTL\nmtllib gone.mtl\n{QUAD}usemtl red paint\nf 1 2 3 4\n");
    let (scene, warnings) =
        import_with(&text, &[("my lib.mtl", library), ("wood.png", &png.into_inner())]).unwrap();
    assert_eq!(scene.materials.len(), 1, "unused materials are left out");
    let material = mtl(&scene, "red paint");
    assert_eq!(material.kd, Some(Rgb::new(1.0, 0.0, 0.0)));
    assert_eq!((scene.images.len(), scene.textures.len()), (2, 3), "one image, sRGB, linear, and its slopes");
    assert_eq!(scene.images[1].name, "wood-normals.png");
    assert!(material.map(MtlSlot::D).unwrap().has_alpha);
    assert!(material.map(MtlSlot::Kd).unwrap().texture.is_some());
    assert!(material.map(MtlSlot::Ka).unwrap().texture.is_none(), "not read, so not loaded");
    let quoted = text.replace("red paint", "\"red paint\"");
    let (scene, _) = import_with(&quoted, &[("my lib.mtl", library)]).unwrap();
    assert_eq!(mtl(&scene, "red paint").kd, Some(Rgb::new(1.0, 0.0, 0.0)), "names may stand in quotes");
    let text: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    assert_eq!(text.len(), 2, "{text:?}");
    assert!(text[0].starts_with("a.obj:2: material library \"gone.mtl\" is not there"), "{text:?}");
    assert!(text[1].starts_with("my lib.mtl:6: map_Pr \"gone.png\" is not there"), "{text:?}");
}

#[test]
fn a_whole_file_can_be_one_mesh() {
    let text = format!("{QUAD}o A\nusemtl x\nf 1 2 3\no B\nf 1 3 4\n");
    let mesh = read_mesh("a.obj", text.as_bytes(), &mut Vec::new()).unwrap();
    assert_eq!((mesh.triangles.len(), mesh.positions.len()), (2, 4));
}

#[test]
fn damaged_files_never_panic() {
    let obj = "mtllib a.mtl\nv 0 0 0 1 .5 0\nv 1 0 0\nv 1 1 -0\nv 0 1e3 0\nvt 0 1\nvt .5 .5\nvn 0 0 1\no A\nusemtl m\n\
               f 1/1/1 2/2/1 3/1/1 4/2/-1\nf -1 -2 -3\nl 1 2\ng g\nf 4//1 3//1 1//1\n";
    let library = "newmtl m\nKd 1 .5 .2\nNs 10\nd -halo .5\nmap_Kd -s 1 2 3 -o 1 x.png\nillum 4\nTf 1 1 1\n";
    let mut state = 0x9e37_79b9_u32;
    let mut random = move |below: usize| {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state as usize % below
    };
    let folder = tempfile::tempdir().unwrap();
    let mut files = Files::new(folder.path(), Reach::Folder).unwrap();
    let mut read = 0;
    for _ in 0..2000 {
        let mut damaged = obj.as_bytes().to_vec();
        for _ in 0..=random(4) {
            let at = random(damaged.len());
            match random(4) {
                0 => damaged.truncate(at + 1),
                1 => damaged[at] = random(256) as u8,
                2 => damaged[at] = b"0123456789-/. \n\\"[random(16)],
                _ => damaged.insert(at, b"9-/e\\\n"[random(6)]),
            }
        }
        if let Ok((scene, _)) = import(&mut files, "a.obj", &damaged) {
            read += 1;
            for mesh in &scene.meshes {
                let n = mesh.positions.len();
                assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < n));
                assert!(mesh.positions.iter().all(|p| p.is_finite()));
                assert!(mesh.normals.iter().all(|v| (v.length() - 1.0).abs() < 1e-4));
                assert!(mesh.normals.is_empty() || mesh.normals.len() == n);
                assert!(mesh.uvs.iter().all(|set| set.len() == n && set.iter().all(|uv| uv.is_finite())));
            }
        }
        let mut damaged = library.as_bytes().to_vec();
        let at = random(damaged.len());
        damaged[at] = random(256) as u8;
        damaged.truncate(random(library.len()) + 1);
        mtl::parse("a.mtl", &damaged, &mut Vec::new());
    }
    assert!(read > 200, "{read} of 2000 could be read");
}

#[test]
#[expect(clippy::print_stderr, reason = "a test that leaves something out says so")]
fn the_corpus_is_read() {
    let Some(corpus) = std::env::var_os("PIPELINE_CORPUS") else {
        std::io::Write::write_all(&mut std::io::stderr(), b"skipped: PIPELINE_CORPUS is not set\n")
            .expect("stderr");
        return;
    };
    let corpus = std::path::PathBuf::from(corpus);
    for (folder, name, triangles) in [("obj", "teapot.obj", 6320), ("aris/data/meshes", "bunny.obj", 0)] {
        let mut files = Files::new(&corpus.join(folder), Reach::Folder).unwrap();
        let bytes = files.read(name).unwrap();
        let (scene, warnings) = import(&mut files, name, &bytes).unwrap();
        eprintln!("{name}: {} triangles, {warnings:?}", scene.triangle_count());
        let expected = if triangles == 0 {
            bytes.split(|&b| b == b'\n').filter(|line| line.starts_with(b"f ")).count()
        } else {
            triangles
        };
        assert_eq!(scene.triangle_count(), expected, "{name}");
    }
}
