#!/usr/bin/env python3
"""Error against time beside Mitsuba 3: the same scenes, converted, in one run.

    cargo build --release && tests/run --test architecture        # the second puts Mitsuba into target/tools
    target/tools/bin/python benches/beside_mitsuba.py scenes/aris/config/scene/cbox_balls.yaml scenes/shaderball.glb

Where its LLVM works, --variant llvm_ad_rgb compiles Mitsuba for the machine; scalar_rgb runs everywhere and is several times slower.
"""

import functools
import time

import beside
import drjit
import mitsuba
import numpy


def load(options, scene, folder, size):
    """The converted scene in Mitsuba, as a function that renders it."""
    beside.convert(scene, "mitsuba", folder)
    file = folder / "scene.xml"
    file.write_text(file.read_text().replace('sampler type="independent"', f'sampler type="{options.sampler}"'))
    loaded = mitsuba.load_file(str(file), resx=size[0], resy=size[1])

    def render(samples, seed):
        start = time.perf_counter()
        picture = numpy.array(mitsuba.render(loaded, spp=samples, seed=seed), dtype=numpy.float64)
        return picture, time.perf_counter() - start

    return render


def main():
    parser = beside.parser(__doc__)
    parser.add_argument("--variant", default="scalar_rgb")
    parser.add_argument("--sampler", default="multijitter")
    options = parser.parse_args()
    mitsuba.set_variant(options.variant)
    drjit.set_thread_count(options.threads)
    beside.compare("Mitsuba", options, functools.partial(load, options))


if __name__ == "__main__":
    main()
