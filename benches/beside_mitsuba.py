#!/usr/bin/env python3
"""Error against time beside Mitsuba 3: the same scenes, converted, in one run.

    cargo build --release && tests/run --test architecture        # the second puts Mitsuba into target/tools
    target/tools/bin/python benches/beside_mitsuba.py scenes/aris/config/scene/cbox_balls.yaml scenes/shaderball.glb

Each renderer is held against a long render of its own, as `pipeline bench` does: the error is the mean over pixels and channels of
(x - ref)²/(ref² + 0.01), and work is error × seconds of rendering. Materials are similar, not equal, so the ratio tells how efficient a
renderer is on such a scene. Where its LLVM works, --variant llvm_ad_rgb compiles Mitsuba for the machine; scalar_rgb runs everywhere
and is several times slower.
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import tempfile
import time

import mitsuba
import numpy

PIPELINE = pathlib.Path(__file__).parent.parent / "target/release/pipeline"


def measure_ours(scene, options, folder):
    """Mean error and median seconds of our renders, and the picture's columns and rows."""
    command = [PIPELINE, "bench", scene, "--levels", options.samples, "--seeds", options.seeds]
    command += ["--reference", options.reference, "--height", options.height, "--output", folder, "--quiet"]
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)
    [bench] = json.loads((folder / "summary.json").read_text())
    head, *rows = [row.split(",") for row in (folder / "runs.csv").read_text().splitlines()]
    runs = [dict(zip(head, row)) for row in rows]
    errors, seconds = ([float(run[name]) for run in runs] for name in ("error", "seconds"))
    return statistics.mean(errors), statistics.median(seconds), bench["size"]


def measure_mitsuba(scene, options, folder, size):
    """The same of Mitsuba's renders of the converted scene."""
    subprocess.run([str(PIPELINE), "convert", scene, "--to", "mitsuba", "-o", str(folder)], check=True, capture_output=True)
    file = folder / "scene.xml"
    file.write_text(file.read_text().replace('sampler type="independent"', f'sampler type="{options.sampler}"'))
    loaded = mitsuba.load_file(str(file), resx=size[0], resy=size[1])

    def render(samples, seed):
        start = time.perf_counter()
        picture = numpy.array(mitsuba.render(loaded, spp=samples, seed=seed), dtype=numpy.float64)
        return picture, time.perf_counter() - start

    reference, _ = render(options.reference, 1 << 20)
    errors, seconds = [], []
    for seed in range(options.seeds):
        picture, taken = render(options.samples, seed)
        errors.append(float(numpy.mean((picture - reference) ** 2 / (reference**2 + 0.01))))
        seconds.append(taken)
    return statistics.mean(errors), statistics.median(seconds)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--variant", default="scalar_rgb")
    parser.add_argument("--sampler", default="multijitter")
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--reference", type=int, default=1024)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--height", type=int, default=150)
    options = parser.parse_args()
    mitsuba.set_variant(options.variant)
    print(f"{'scene':<20} {'':>8} {'error':>9} {'seconds':>8} {'work':>9} {'work, ours/Mitsuba':>19}")
    for scene in options.scenes:
        with tempfile.TemporaryDirectory() as folder:
            ours, theirs = pathlib.Path(folder) / "ours", pathlib.Path(folder) / "mitsuba"
            error, seconds, size = measure_ours(scene, options, ours)
            peer_error, peer_seconds = measure_mitsuba(scene, options, theirs, size)
        name, work, peer_work = pathlib.Path(scene).name.split(".")[0], error * seconds, peer_error * peer_seconds
        print(f"{name:<20} {'ours':>8} {error:>9.5f} {seconds:>8.2f} {work:>9.5f} {work / peer_work:>19.3f}")
        print(f"{'':<20} {'Mitsuba':>8} {peer_error:>9.5f} {peer_seconds:>8.2f} {peer_work:>9.5f}", flush=True)


if __name__ == "__main__":
    main()
