//! What others made, by mistake or in malice: a clear error, in memory that the input's size explains, and nothing read from outside the
//! scene's folder unless that is allowed.

use std::io::Write;

use serde_json::{Value, json};

use crate::support::{Desk, Run, SMALL_ARGUMENTS, SQUARE, confined, repository};

/// `pipeline render` of a small picture.
fn render(desk: &Desk, scene: &str, more: &[&str]) -> Run {
    let arguments = ["render", scene, "-o", "picture.exr"];
    confined(desk, 0, &[&arguments[..], &SMALL_ARGUMENTS, more].concat())
}

/// A desk with these files.
fn desk(files: &[(&str, &[u8])]) -> Desk {
    let desk = Desk::new("");
    for (name, bytes) in files {
        std::fs::write(desk.path(name), bytes).unwrap();
    }
    desk
}

/// A triangle as glTF, its 36 bytes of positions in a file of their own.
fn triangle(edit: impl FnOnce(&mut Value)) -> Vec<u8> {
    let mut json = json!({
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 36, "uri": "t.bin"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "count": 3, "componentType": 5126, "type": "VEC3"}],
        "materials": [{}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}]
    });
    edit(&mut json);
    json.to_string().into_bytes()
}

fn positions() -> Vec<u8> {
    [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0f32].iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// A triangle that shines with the image `uri`.
fn shining(uri: &str) -> Vec<u8> {
    triangle(|json| {
        json["images"] = json!([{"uri": uri}]);
        json["textures"] = json!([{"source": 0}]);
        json["materials"][0]["emissiveFactor"] = json!([1, 1, 1]);
        json["materials"][0]["emissiveTexture"] = json!({"index": 0});
    })
}

#[test]
fn gltf_that_claims_what_is_not_there() {
    type Edit = fn(&mut Value);
    let cases: [(Edit, &str); 8] = [
        (|j| j["accessors"][0]["count"] = json!(4), "accessors[0] needs 48 bytes, but bufferViews[0] has 36"),
        (
            |j| {
                j["buffers"][0]["byteLength"] = json!(10);
                j["bufferViews"][0]["byteLength"] = json!(10);
                j["accessors"][0]["count"] = json!(1_000_000_000);
            },
            "accessors[0] needs 12000000000 bytes, but bufferViews[0] has 10",
        ),
        (
            |j| j["accessors"][0] = json!({"count": 1_000_000, "componentType": 5126, "type": "VEC3"}),
            "without a bufferView",
        ),
        (|j| j["buffers"][0]["byteLength"] = json!(37), "buffers[0] needs 37 bytes"),
        (|j| j["buffers"][0]["uri"] = json!("none.bin"), "none.bin"),
        (|j| j["nodes"] = json!([{"mesh": 0, "children": [1]}, {"children": [0]}]), "must be a tree"),
        (
            |j| {
                j["bufferViews"]
                    .as_array_mut()
                    .unwrap()
                    .push(json!({"buffer": 0, "byteOffset": 4, "byteLength": 12}));
                let indices = json!({"bufferView": 1, "count": 3, "componentType": 5125, "type": "SCALAR"});
                j["accessors"].as_array_mut().unwrap().push(indices);
                j["meshes"][0]["primitives"][0]["indices"] = json!(1);
            },
            "holds the index 1065353216",
        ),
        (|j| j["scenes"][0]["nodes"] = json!([9]), "scenes[0] refers to nodes[9]"),
    ];
    for (edit, told) in cases {
        let desk = desk(&[("t.bin", &positions()), ("t.gltf", &triangle(edit))]);
        render(&desk, "t.gltf", &[]).ends_with(2).tells("error: t.gltf: ").tells(told);
    }
    let whole = std::fs::read(repository("scenes/spheres.glb")).unwrap();
    let desk = desk(&[("half.glb", &whole[..whole.len() / 2])]);
    render(&desk, "half.glb", &[]).ends_with(2).tells("error: half.glb: the GLB's length needs");
}

#[test]
fn gltf_that_asks_for_the_same_again_and_again() {
    let many = |edit: fn(&mut Value)| desk(&[("t.bin", &positions()), ("t.gltf", &triangle(edit))]);
    let zeros = json!({"count": 65_536, "componentType": 5126, "type": "VEC3"});
    let instances = |count: usize, name: String| {
        let translation = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}});
        let bytes = triangle(|j| {
            j["accessors"].as_array_mut().unwrap().push(zeros.clone());
            j["nodes"] = json!(vec![json!({"mesh": 0, "name": name, "extensions": translation}); count]);
            j["scenes"][0]["nodes"] = json!((0..count).collect::<Vec<_>>());
        });
        desk(&[("t.bin", &positions()), ("t.gltf", &bytes)])
    };
    // 65,536 bytes of zeros each, all in one place.
    let mut zeros_by_meshopt = vec![0xa1];
    zeros_by_meshopt.extend([0b1010_1010; 64]);
    zeros_by_meshopt.extend([0; 24]);
    let unpacked = triangle(|j| {
        let length = zeros_by_meshopt.len();
        j["buffers"] = json!([{"byteLength": length, "uri": "t.bin"}]);
        let packed = json!({"EXT_meshopt_compression": {
            "buffer": 0, "byteLength": length, "byteStride": 4, "count": 16_384, "mode": "ATTRIBUTES",
        }});
        let view = json!({"buffer": 0, "byteLength": 65_536, "byteStride": 4, "extensions": packed});
        j["bufferViews"] = json!(vec![view; 1100]);
        j["extensionsUsed"] = json!(["EXT_meshopt_compression"]);
    });
    let packed = desk(&[("t.bin", &zeros_by_meshopt), ("t.gltf", &unpacked)]);
    render(&packed, "t.gltf", &[]).ends_with(2).tells("unpacked bytes, more than any file of its size");
    for desk in [instances(60, "a".to_owned()), instances(1, "long".repeat(100_000))] {
        render(&desk, "t.gltf", &[]).ends_with(2).tells("t.gltf: ").tells("for meshes and instances");
    }
    let morphs = many(|j| {
        j["buffers"][0] = json!({"byteLength": 36_000, "uri": format!("data:,{}", "0".repeat(36_000))});
        j["bufferViews"][0]["byteLength"] = json!(36_000);
        j["accessors"][0]["count"] = json!(3000);
        j["meshes"][0]["weights"] = json!(vec![1; 20_000]);
        j["meshes"][0]["primitives"][0]["targets"] = json!(vec![json!({"POSITION": 0}); 20_000]);
    });
    render(&morphs, "t.gltf", &[]).ends_with(2).tells("elements of accessors");
    // What many images have in common is decoded once.
    let images = many(|j| {
        j["images"] = json!(vec![json!({"uri": "t.png"}); 100]);
        j["textures"] = json!((0..100).map(|i| json!({"source": i})).collect::<Vec<_>>());
        j["materials"] = json!(
            (0..100)
                .map(|i| json!({"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": i}}))
                .collect::<Vec<_>>()
        );
    });
    let side = 3000;
    let png = pipeline::imagefile::encode_png(side, side, &vec![0; (side * side * 3) as usize]).unwrap();
    std::fs::write(images.path("t.png"), png).unwrap();
    render(&images, "t.gltf", &[]).ends_with(0);
    let deep = [br#"{"asset": {"version": "2.0"}, "extras": "#.to_vec(), b"[".repeat(1_000_000)].concat();
    render(&desk(&[("deep.gltf", &deep)]), "deep.gltf", &[]).ends_with(2).tells("recursion limit");
    let objects =
        format!(r#"{{"asset": {{"version": "2.0"}}, "extras": [{}0]}}"#, r#"{"a":0},"#.repeat(1_000_000));
    render(&desk(&[("o.gltf", objects.as_bytes())]), "o.gltf", &[]).ends_with(2).tells("objects in its JSON");
}

/// Headers of images of `side` × `side` pixels with nothing behind them.
fn headers(side: u32) -> Vec<(&'static str, Vec<u8>)> {
    let (be, le) = (side.to_be_bytes(), side.to_le_bytes());
    let mut ihdr = [b"IHDR".as_slice(), &be, &be, &[8, 6, 0, 0, 0]].concat();
    let mut crc = flate2::Crc::new();
    crc.update(&ihdr);
    ihdr.extend(crc.sum().to_be_bytes());
    let png = [b"\x89PNG\r\n\x1a\n\0\0\0\x0d".as_slice(), &ihdr, b"\0\0\0\0IDAT\x35\xaf\x06\x1e"].concat();
    let ktx2 = [
        b"\xabKTX 20\xbb\r\n\x1a\n".as_slice(),
        &37u32.to_le_bytes(),
        &1u32.to_le_bytes(),
        &le,
        &le,
        &[0; 8],
        &1u32.to_le_bytes(),
        &1u32.to_le_bytes(),
        &[0; 100],
    ]
    .concat();
    let hdr = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {side} +X {side}\n").into_bytes();
    let attribute = |name: &str, kind: &str, value: &[u8]| {
        [name.as_bytes(), b"\0", kind.as_bytes(), b"\0", &(value.len() as u32).to_le_bytes(), value].concat()
    };
    let last = (side - 1).to_le_bytes();
    let window = [&[0; 8], last.as_slice(), &last].concat();
    let channel =
        [b"Y\0".as_slice(), &2u32.to_le_bytes(), &[0; 4], &1u32.to_le_bytes(), &1u32.to_le_bytes(), b"\0"]
            .concat();
    let exr = [
        b"\x76\x2f\x31\x01\x02\0\0\0".to_vec(),
        attribute("channels", "chlist", &channel),
        attribute("compression", "compression", &[3]),
        attribute("dataWindow", "box2i", &window),
        attribute("displayWindow", "box2i", &window),
        attribute("lineOrder", "lineOrder", &[0]),
        attribute("pixelAspectRatio", "float", &1f32.to_le_bytes()),
        attribute("screenWindowCenter", "v2f", &[0; 8]),
        attribute("screenWindowWidth", "float", &1f32.to_le_bytes()),
        vec![0; 65],
    ]
    .concat();
    let mut all = vec![("png", png), ("ktx2", ktx2), ("hdr", hdr), ("exr", exr)];
    // The others' headers have 16 and 14 bits for a side.
    if let Ok(short) = u16::try_from(side).map(u16::to_be_bytes) {
        let sof = [b"\xff\xc0\0\x11\x08".as_slice(), &short, &short, b"\x03\x01\x11\0\x02\x11\0\x03\x11\0"]
            .concat();
        all.push((
            "jpeg",
            [b"\xff\xd8".as_slice(), &sof, b"\xff\xda\0\x0c\x03\x01\0\x02\0\x03\0\0\x3f\0\xff\xd9"].concat(),
        ));
    }
    if side <= 1 << 14 {
        let bits = (side - 1) | (side - 1) << 14;
        let data = [b"VP8L\x10\0\0\0\x2f".as_slice(), &bits.to_le_bytes(), &[0; 11]].concat();
        all.push(("webp", [b"RIFF\x1c\0\0\0WEBP".as_slice(), &data].concat()));
    }
    all
}

#[test]
fn images_that_declare_more_than_they_hold() {
    for side in [100_000, 65_535, 16_384, 8_192] {
        for (kind, bytes) in headers(side) {
            let desk = desk(&[("t.bin", &positions()), ("t.gltf", &shining("big.img")), ("big.img", &bytes)]);
            let run = render(&desk, "t.gltf", &[]).ends_with(2).tells("error: t.gltf: big.img");
            // The others' decoders find the damage first.
            if side > 16_384 && kind != "jpeg" {
                run.tells(&format!("{side} × {side} pixels"));
            } else if matches!(kind, "exr" | "ktx2") && side == 8_192 {
                run.tells("bytes of pixels, more than its");
            }
            confined(&desk, 0, &["diff", "big.img", "big.img"]).ends_with(2).tells("big.img");
        }
    }
}

#[test]
fn packed_scenes_that_unpack_without_end() {
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    let zeros = vec![0; 1 << 20];
    (0..512).for_each(|_| packer.write_all(&zeros).unwrap());
    // Blocks of 128 KiB that repeat a byte: RFC 8878, 3.1.1.2.
    let mut frame = b"\x28\xb5\x2f\xfd\x00\x58".to_vec();
    for i in 0..4096u32 {
        frame.extend(&(131_072 << 3 | 2 | u32::from(i == 4095)).to_le_bytes()[..3]);
        frame.push(b'#');
    }
    for (name, bytes) in [("bomb.obj.gz", packer.finish().unwrap()), ("bomb.glb.zst", frame)] {
        render(&desk(&[(name, &bytes)]), name, &[]).ends_with(2).tells(name).tells("unpacks to more than");
    }
}

#[test]
fn obj_that_goes_too_far() {
    let error = |statement: &str| {
        let obj = SQUARE.replace("mtllib square.mtl\n", "") + statement;
        render(&desk(&[("a.obj", obj.as_bytes())]), "a.obj", &[]).ends_with(2)
    };
    error("f 1 2 1000000000\n").tells("error: a.obj:7: \"1000000000\" names a vertex that is not there");
    error("f 1 2 -1000000000\n").tells("a.obj:7: \"-1000000000\"");
    error("f 1 2 99999999999999999999\n").tells("a.obj:7: ");
    // A line that doesn't end.
    error(&format!("f{}", " 1".repeat(1_000_000))).tells("a.obj:7: a polygon has 65537 corners");
    let size = 100 << 20;
    let long = vec![b'a'; size];
    let desk = desk(&[("long.obj", &long)]);
    confined(&desk, size * 2, &["render", "long.obj", "-o", "a.exr"])
        .ends_with(2)
        .tells("long.obj has no face");
}

#[test]
fn yaml_that_multiplies_itself() {
    let list = |of: &str| [of; 10].join(",");
    let laughs: String =
        (1..12).map(|i| format!("a{i}: &a{i} [{}]\n", list(&format!("*a{}", i - 1)))).collect();
    let inserted: String =
        (1..12).map(|i| format!("a{i}: \"{}\"\n", format!("${{a{}}}", i - 1).repeat(10))).collect();
    for (text, told) in [
        (format!("a0: &a0 [{}]\n{laughs}", list("lol")), "s.yaml:"),
        (format!("a0: {}\n{inserted}", "x".repeat(1000)), "interpolations insert too much"),
        (format!("a: {}", "[".repeat(100_000)), "s.yaml:1:"),
        ("{a: ".repeat(100_000), "s.yaml:1:"),
        ("defaults: [s]\n".to_owned(), "does a file name itself?"),
        ("a: &a [*a]\n".to_owned(), "s.yaml:1:"),
    ] {
        render(&desk(&[("s.yaml", text.as_bytes())]), "s.yaml", &[]).ends_with(2).tells(told);
        let run = confined(&desk(&[("s.yaml", text.as_bytes())]), 0, &["inspect", "s.yaml"]);
        run.ends_with(2).tells("s.yaml");
    }
}

#[test]
fn manifests_that_ask_for_too_much() {
    let axis = "[[axis]]\npath = \"render.seed\"\nrange = { from = 0, to = 1, steps = 1_000_000_000_000 }\n";
    let unknown: String = (0..20_000).map(|i| format!("key{i} = 1\n")).collect();
    for (text, told) in [
        (format!("scene = \"s.glb\"\n{axis}"), "asks for 1000000000000 jobs"),
        (format!("scene = \"s.glb\"\nmax_jobs = 1_000_000_000_000\n{axis}"), "whole number in [1, 1000000]"),
        (format!("scene = {}", "[".repeat(1_000_000)), "error: "),
        (format!("[set]\n{}x = 1\n", "a.".repeat(100_000)), "error: "),
        (format!("scene = \"{}", "x".repeat(1_000_000)), "sweep.toml:3:"),
        (unknown, "has no key `key0`"),
        ("#".repeat(5 << 20), "at most 4194304 are read"),
    ] {
        let desk = Desk::new(&text);
        confined(&desk, text.len() * 40, &["sweep", "sweep.toml", "--list"]).ends_with(2).tells(told);
    }
}

/// A folder with a scene's folder in it, and beside that an image.
#[cfg(unix)]
fn with_secret(files: &[(&str, &[u8])]) -> Desk {
    let desk = Desk::new("");
    let image = pipeline::imagefile::encode_png(1, 1, &[255, 0, 0]).unwrap();
    std::fs::write(desk.path("secret.png"), image).unwrap();
    std::fs::create_dir_all(desk.path("scene/sub")).unwrap();
    std::os::unix::fs::symlink("../secret.png", desk.path("scene/link.png")).unwrap();
    std::os::unix::fs::symlink("..", desk.path("scene/up")).unwrap();
    for (name, bytes) in files {
        std::fs::write(desk.path("scene").join(name), bytes).unwrap();
    }
    desk
}

#[cfg(unix)]
const ALLOW: &[&str] = &["--allow-outside"];

/// Names that lead to the image outside: all dialects' and glTF's alone.
#[cfg(unix)]
fn leading_out(desk: &Desk) -> ([String; 5], [&'static str; 2]) {
    let absolute = desk.path("secret.png").display().to_string();
    let names = ["../secret.png", "sub/../../secret.png", "link.png", "up/secret.png"].map(str::to_owned);
    let [a, b, c, d] = names;
    ([a, b, c, d, absolute], ["%2e%2e/secret.png", "%2E%2E%2Fsecret.png"])
}

#[cfg(unix)]
#[test]
fn gltf_reads_outside_its_folder_only_where_that_is_allowed() {
    let desk = with_secret(&[("t.bin", &positions())]);
    let (plain, escaped) = leading_out(&desk);
    for uri in plain.iter().map(String::as_str).chain(escaped) {
        std::fs::write(desk.path("scene/t.gltf"), shining(uri)).unwrap();
        let refused = render(&desk, "scene/t.gltf", &[]).ends_with(2);
        refused.tells("images[0]: ").tells("leads out of the scene's folder").tells("hint: --allow-outside");
        render(&desk, "scene/t.gltf", ALLOW).ends_with(0);
        for command in [
            &["convert", "scene/t.gltf", "-o", "out"][..],
            &["inspect", "scene/t.gltf", "-o", "out", "--spp", "1", "--size", "16"],
        ] {
            confined(&desk, 0, command).ends_with(2).tells("--allow-outside");
        }
    }
    confined(&desk, 0, &["convert", "scene/t.gltf", "-o", "out", ALLOW[0]]).ends_with(0);
    let inspect = ["inspect", "scene/t.gltf", "-o", "out", "--spp", "1", "--size", "16", ALLOW[0]];
    confined(&desk, 64 << 20, &inspect).ends_with(0);
    for uri in ["http://localhost/a.png", "file:///secret.png", "//host/a.png", "C:\\secret.png"] {
        std::fs::write(desk.path("scene/t.gltf"), shining(uri)).unwrap();
        for more in [&[], ALLOW] {
            render(&desk, "scene/t.gltf", more).ends_with(2).tells("images[0]").tells("relative file names");
        }
    }
    // Here a backslash is a character like others.
    std::fs::write(desk.path("scene/t.gltf"), shining("..\\secret.png")).unwrap();
    render(&desk, "scene/t.gltf", &[]).ends_with(2).tells("No such file");
}

#[cfg(unix)]
#[test]
fn obj_reads_outside_its_folder_only_where_that_is_allowed() {
    let desk = with_secret(&[("a.obj", SQUARE.as_bytes())]);
    let (names, _) = leading_out(&desk);
    for name in names.iter().map(String::as_str).chain(["..\\secret.png"]) {
        std::fs::write(desk.path("scene/square.mtl"), format!("newmtl paint\nmap_Ke {name}\n")).unwrap();
        let refused = render(&desk, "scene/a.obj", &[]).ends_with(0);
        refused
            .tells("warning: square.mtl:2: map_Ke ")
            .tells("leads out of the scene's folder; hint: --allow-outside");
        render(&desk, "scene/a.obj", ALLOW).ends_with(0).tells_not("square.mtl:2");
    }
    std::fs::write(desk.path("scene/square.mtl"), "newmtl paint\nmap_Ke http://host/a.png\n").unwrap();
    render(&desk, "scene/a.obj", ALLOW)
        .ends_with(0)
        .tells("square.mtl:2: map_Ke \"http://host/a.png\" is a URL");
    std::fs::write(desk.path("secret.mtl"), "newmtl paint\nKd 1 0 0\n").unwrap();
    let obj = SQUARE.replace("square.mtl", "../secret.mtl");
    std::fs::write(desk.path("scene/a.obj"), obj).unwrap();
    render(&desk, "scene/a.obj", &[])
        .ends_with(0)
        .tells("a.obj:1: material library \"../secret.mtl\" leads out");
    render(&desk, "scene/a.obj", ALLOW).ends_with(0).tells_not("secret.mtl");
}

#[cfg(unix)]
#[test]
fn aris_and_libraries_read_outside_their_folder_only_where_that_is_allowed() {
    let desk = with_secret(&[("a.obj", SQUARE.as_bytes())]);
    std::fs::write(desk.path("out.obj"), SQUARE).unwrap();
    let aris = |mesh: &str| {
        format!(
            "geometry: {{name: mesh, config: {{paths: [\"{mesh}\"]}}}}\nbrdf: [{{name: diffuse, config: {{color: [1, 1, 1]}}}}]\n\
             camera: {{name: perspective, config: {{fov: 90, c2w: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 3]]}}}}\n"
        )
    };
    std::fs::write(desk.path("scene/s.yaml"), aris("../out.obj")).unwrap();
    let key = "geometry.config.paths[0]: \"../out.obj\" leads out";
    render(&desk, "scene/s.yaml", &[]).ends_with(2).tells(key).tells("--allow-outside");
    render(&desk, "scene/s.yaml", ALLOW).ends_with(0);
    std::fs::write(desk.path("scene/s.yaml"), aris("http://host/a.obj")).unwrap();
    render(&desk, "scene/s.yaml", ALLOW).ends_with(2).tells("is a URL");

    std::fs::write(desk.path("scene/m.yaml"), "default: {base_color: {file: ../secret.png}}\n").unwrap();
    let obj = SQUARE.replace("mtllib square.mtl\nusemtl paint\n", "");
    std::fs::write(desk.path("scene/a.obj"), obj).unwrap();
    let materials = ["--materials", "scene/m.yaml"];
    render(&desk, "scene/a.obj", &materials).ends_with(2).tells("m.yaml").tells("--allow-outside");
    render(&desk, "scene/a.obj", &[&materials[..], ALLOW].concat()).ends_with(0);
}

#[cfg(unix)]
#[test]
fn a_sweep_lets_its_scenes_read_outside_by_flag_or_key() {
    let small = "scene = \"scene/t.gltf\"\n[render]\nwidth = 8\nheight = 6\nspp = 1\n";
    let desk = with_secret(&[("t.bin", &positions()), ("t.gltf", &shining("../secret.png"))]);
    desk.rewrite(small);
    desk.sweep(&[]).ends_with(2).says("FAILED").says("--allow-outside");
    desk.sweep(&["--dry-run"]).ends_with(2).tells("--allow-outside");
    desk.sweep(&["--dry-run", "--allow-outside"]).ends_with(0);
    desk.sweep(ALLOW).ends_with(0).says("1 job: 1 rendered");
    let bench = ["bench", "sweep.toml", "--levels", "1", "--seeds", "1", "--reference", "2", "-o", "bench"];
    desk.run(bench).ends_with(2).tells("--allow-outside");
    desk.run(bench.iter().chain(ALLOW)).ends_with(0);
    desk.run(bench.iter().chain(&["--time", "1"])).ends_with(2).tells("hint: [set] with import.…");
    desk.rewrite(&format!("allow_outside = true\n{small}"));
    // What may be read is no part of the job.
    desk.sweep(&[]).ends_with(0).says("1 job: 0 rendered, 1 reused");
    desk.rewrite(&format!("allow_outside = 1\n{small}"));
    desk.sweep(&[]).ends_with(2).tells("`allow_outside` must be true or false");
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_no_files() {
    let desk = with_secret(&[
        ("t.bin", &positions()),
        ("a.obj", SQUARE.as_bytes()),
        ("t.gltf", &shining("pipe.png")),
    ]);
    let made = std::process::Command::new("mkfifo").arg(desk.path("scene/pipe.png")).status().unwrap();
    assert!(made.success());
    for name in ["square.mtl", "zero.glb", "zero.yaml"] {
        std::os::unix::fs::symlink("/dev/zero", desk.path("scene").join(name)).unwrap();
    }
    for more in [&[], ALLOW] {
        render(&desk, "scene/t.gltf", more).ends_with(2).tells("images[0]: ").tells("pipe.png is not a file");
        render(&desk, "scene/a.obj", more).ends_with(0).tells("a.obj:1: material library \"square.mtl\"");
    }
    for name in ["scene/zero.glb", "scene/zero.yaml"] {
        render(&desk, name, &[]).ends_with(2).tells("leads out of the scene's folder");
        render(&desk, name, ALLOW).ends_with(2).tells("/dev/zero is not a file");
    }
    confined(&desk, 0, &["diff", "/dev/zero", "secret.png"]).ends_with(2).tells("/dev/zero is not a file");
    confined(&desk, 256 << 20, &["inspect", "--eval", "/dev/zero"])
        .ends_with(2)
        .tells("bytes of rows are read");
}
