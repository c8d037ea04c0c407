#!/usr/bin/env python3
"""Error against time beside Blender's Cycles: the same scenes, converted, in one run.

    cargo build --release
    python3.11 -m venv target/blender && target/blender/bin/pip install bpy==5.0.1             # Blender as a module; 375 MB
    target/blender/bin/python benches/beside_cycles.py scenes/aris/config/scene/cbox_balls.yaml scenes/shaderball.glb

Cycles renders on the processor and is unbiased here: nothing clamped, blurred or denoised, every pixel with all samples.
"""

import functools
import pathlib
import sys

import bpy

# The wheel brings OpenImageIO along, where only Blender's own program looks.
sys.path.append(str(pathlib.Path(bpy.utils.resource_path("LOCAL"), "python/lib/python3.11/site-packages")))
import beside
import OpenImageIO

# Cycles counts no bounce for direct light: our 16 scattering events are its 15 bounces.
BOUNCES = 15


def load(options, scene, folder, size):
    """The converted scene in Blender, as a function that renders it."""
    for note in beside.convert(scene, "gltf", folder):
        if note["field"] == "environment" and not note["material"]:
            raise beside.LeftOut(f"its environment does not reach Blender: {note['reason']}")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.app.debug_value = 1  # the importer's word for warnings only
    # Lights as they are, in W/sr, not by lumens.
    bpy.ops.import_scene.gltf(filepath=str(folder / "scene.glb"), export_import_convert_lighting_mode="COMPAT")
    blender = bpy.context.scene
    cameras = [thing for thing in bpy.data.objects if thing.type == "CAMERA"]
    if len(cameras) != 1:
        raise beside.LeftOut(f"it has {len(cameras)} cameras, and the one that {beside.PIPELINE.name} takes is not known here")
    [blender.camera] = cameras
    for material in bpy.data.materials:
        if material.use_backface_culling:
            emit_in_front(material)
    set_up(blender, options.threads, size)
    file = folder / "render.exr"

    def render(samples, seed):
        blender.cycles.samples = samples
        blender.cycles.seed = seed
        bpy.ops.render.render()
        bpy.data.images["Render Result"].save_render(str(file))
        return beside.read(file), seconds_of(file)

    return render


def emit_in_front(material):
    """Lets a material that emits do so on its front alone, as single-sided ones do here; Cycles' emit on both sides."""
    nodes, links = material.node_tree.nodes, material.node_tree.links
    for surface in [node for node in nodes if node.type == "BSDF_PRINCIPLED" and node.inputs["Emission Strength"].default_value > 0]:
        # By the colour: the strength stays a number, which the light tree needs to weigh lights.
        color, front = surface.inputs["Emission Color"], nodes.new("ShaderNodeMix")
        front.data_type = "RGBA"
        of_front, of_back = (one for one in front.inputs if one.type == "RGBA")
        of_front.default_value, of_back.default_value = color.default_value, (0, 0, 0, 1)
        for link in color.links:
            links.new(link.from_socket, of_front)
        links.new(nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], front.inputs["Factor"])
        links.new(next(one for one in front.outputs if one.type == "RGBA"), color)
        material.cycles.emission_sampling = "FRONT"


def set_up(scene, threads, size):
    """Cycles as a path tracer without bias, whose pictures are written with linear colours in floats."""
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.threads_mode, scene.render.threads = "FIXED", threads
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_light_tree = True
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.blur_glossy = 0
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1
    cycles.film_exposure = 1
    for kind in ("max", "diffuse", "glossy", "transmission", "volume", "transparent_max"):
        setattr(cycles, f"{kind}_bounces", BOUNCES)


def seconds_of(file):
    """The seconds of rendering without synchronization, as Cycles itself notes in the file, to a hundredth: 1:02.34 or 1:01:02.34."""
    noted = OpenImageIO.ImageInput.open(str(file)).spec().getattribute("cycles.ViewLayer.render_time")
    return functools.reduce(lambda sum, part: 60 * sum + float(part), noted.split(":"), 0.0)


def main():
    options = beside.parser(__doc__).parse_args()
    beside.compare("Cycles", options, functools.partial(load, options))


if __name__ == "__main__":
    main()
