#!/usr/bin/env python3
"""Error against time beside Mitsuba 3: the same scenes, converted, in one run.

    cargo build --release && tests/run --test architecture        # the second puts Mitsuba into target/tools
    target/tools/bin/python benches/beside_mitsuba.py scenes/aris/config/scene/cbox_balls.yaml scenes/shaderball.glb

--variant llvm_ad_rgb compiles Mitsuba for the machine, which is about three times as fast as scalar_rgb. It needs LLVM as a library: unless
DRJIT_LIBLLVM_PATH names one, the Rust compiler's own is taken, which is newer than many systems'.
"""

import functools
import os
import pathlib
import subprocess
import time

import beside
import numpy

# Samples that are rendered at once: llvm_ad_rgb keeps the state of all of them.
MOST_AT_ONCE = 1 << 24


def find_llvm():
    """Names the Rust compiler's LLVM to Mitsuba, if no other is named."""
    if "DRJIT_LIBLLVM_PATH" in os.environ:
        return
    root = subprocess.run(["rustc", "--print", "sysroot"], check=True, capture_output=True, text=True).stdout.strip()
    # Beside the library lies a linker's script of a similar name.
    found = max(pathlib.Path(root, "lib").glob("libLLVM*"), key=lambda file: file.stat().st_size, default=None)
    if found is not None:
        os.environ["DRJIT_LIBLLVM_PATH"] = str(found)


def load(mitsuba, options, scene, folder, size):
    """The converted scene in Mitsuba, as a function that renders it."""
    beside.convert(scene, "mitsuba", folder)
    file = folder / "scene.xml"
    file.write_text(file.read_text().replace('sampler type="independent"', f'sampler type="{options.sampler}"'))
    loaded = mitsuba.load_file(str(file), resx=size[0], resy=size[1])

    def render(samples, seed):
        passes = -(-samples * size[0] * size[1] // MOST_AT_ONCE)
        start = time.perf_counter()
        pictures = [
            numpy.array(mitsuba.render(loaded, spp=-(-samples // passes), seed=seed * passes + part), dtype=numpy.float64)
            for part in range(passes)
        ]
        return numpy.mean(pictures, axis=0), time.perf_counter() - start

    return render


def main():
    parser = beside.parser(__doc__)
    parser.add_argument("--variant", default="scalar_rgb")
    parser.add_argument("--sampler", default="multijitter")
    options = parser.parse_args()
    if options.variant.startswith("llvm"):
        find_llvm()
    # Looks for LLVM as it is imported.
    import drjit
    import mitsuba

    mitsuba.set_variant(options.variant)
    drjit.set_thread_count(options.threads)
    beside.compare("Mitsuba", options, functools.partial(load, mitsuba, options))


if __name__ == "__main__":
    main()
