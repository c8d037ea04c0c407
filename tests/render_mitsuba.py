"""Renders Mitsuba scenes: each WIDTH HEIGHT SPP scene.xml leaves mean.exr and variance.exr beside the scene, of four independent renders."""

import sys
from pathlib import Path

import mitsuba
import numpy

mitsuba.set_variant("scalar_rgb")
mitsuba.set_log_level(mitsuba.LogLevel.Error)
RUNS = 4
width, height, spp = map(int, sys.argv[1:4])
for path in map(Path, sys.argv[4:]):
    scene = mitsuba.load_file(str(path), resx=width, resy=height, spp=spp // RUNS)
    runs = numpy.array([mitsuba.render(scene, seed=seed) for seed in range(RUNS)])
    pictures = {"mean": runs.mean(axis=0), "variance": runs.var(axis=0, ddof=1) / RUNS}
    for name, picture in pictures.items():
        mitsuba.Bitmap(picture.astype(numpy.float32)).write(str(path.with_name(f"{name}.exr")))
