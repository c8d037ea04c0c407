"""Error against time beside another renderer: what benches/beside_*.py have in common.

Each renderer is held against a long render of its own, as `pipeline bench` does: the error is the mean over pixels and channels of
(x - ref)²/(ref² + 0.01), and work is error × seconds of rendering, without loading the scene and building its BVH. Materials are
similar, not equal, so the ratio of work tells how efficient a renderer is on such a scene. *Mean* is that of the reference: where two
differ by more than a fifth the scene is lit differently, and no ratio is given; --pictures shows the two.
"""

import argparse
import json
import os
import pathlib
import statistics
import subprocess
import tempfile

import numpy
import OpenImageIO

PIPELINE = pathlib.Path(__file__).parent.parent / "target/release/pipeline"
REFERENCE_SEED = 1 << 20
# How far the mean of the other's reference may be off ours, as a part of it.
ALIKE = 0.2


class LeftOut(Exception):
    """A scene that the other renderer can't be given as it is, with the reason."""


def parser(description):
    """A parser of the arguments that all comparisons have."""
    made = argparse.ArgumentParser(description=f"{description}\n{__doc__}", formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("scenes", nargs="+")
    made.add_argument("--samples", type=int, default=64)
    made.add_argument("--reference", type=int, default=1024, help="samples of the references")
    made.add_argument("--seeds", type=int, default=3)
    made.add_argument("--height", type=int, default=150)
    made.add_argument("--threads", type=int, default=os.cpu_count())
    made.add_argument("--pictures", type=pathlib.Path, help="a folder for the references as PNG, ours on the left")
    return made


def convert(scene, target, folder):
    """Writes the scene for another program into `folder`, and gives the notes on what became of it."""
    command = [PIPELINE, "convert", scene, "--to", target, "-o", folder, "--report", "json", "--quiet"]
    [report] = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    return report["notes"]


def read(file):
    """The colours of an image's first part, as rows of pixels of three channels."""
    image = OpenImageIO.ImageInput.open(str(file))
    if image is None:
        raise OSError(OpenImageIO.geterror())
    channels = image.spec().channelnames
    return image.read_image("float")[..., [channels.index(name) for name in "RGB"]].astype(numpy.float64)


def compare(peer, options, load):
    """Prints the table. `load(scene, folder, size)` makes a scene ready in the other renderer, and gives what renders it: a function
    of samples and seed to the picture and the seconds of rendering. It raises `LeftOut` where it can't be done right."""
    print(f"{'scene':<20} {'':>8} {'error':>9} {'seconds':>8} {'work':>9} {'mean':>7}  work, ours/{peer}")
    for scene in options.scenes:
        name = pathlib.Path(scene).name.split(".")[0]
        with tempfile.TemporaryDirectory() as folder:
            error, seconds, reference = _measure_ours(scene, options, pathlib.Path(folder) / "ours")
            rows, columns, _ = reference.shape
            try:
                render = load(scene, pathlib.Path(folder) / "peer", (columns, rows))
            except LeftOut as reason:
                print(f"{name:<20} left out: {reason}", flush=True)
                continue
            peer_error, peer_seconds, peer_reference = _measure(render, options)
        alike = abs(peer_reference.mean() / reference.mean() - 1) <= ALIKE
        verdict = f"{error * seconds / (peer_error * peer_seconds):.3f}" if alike else "lit differently"
        print(f"{_row(name, 'ours', error, seconds, reference)}  {verdict}")
        print(_row("", peer, peer_error, peer_seconds, peer_reference), flush=True)
        if options.pictures:
            _show(options.pictures / f"{name}.png", numpy.hstack([reference, peer_reference]))


def _measure_ours(scene, options, folder):
    """Mean error and median seconds of our renders, and the reference."""
    command = [PIPELINE, "bench", scene, "--levels", options.samples, "--seeds", options.seeds, "--reference", options.reference]
    command += ["--height", options.height, "--threads", options.threads, "--output", folder, "--quiet"]
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)
    head, *rows = [row.split(",") for row in (folder / "runs.csv").read_text().splitlines()]
    runs = [dict(zip(head, row)) for row in rows]
    errors, seconds = ([float(run[name]) for run in runs] for name in ("error", "seconds"))
    [reference] = folder.glob("reference-*.exr")
    return statistics.mean(errors), statistics.median(seconds), read(reference)


def _measure(render, options):
    """The same of the other renderer's."""
    reference, _ = render(options.reference, REFERENCE_SEED)
    errors, seconds = [], []
    for seed in range(options.seeds):
        picture, taken = render(options.samples, seed)
        errors.append(float(numpy.mean((picture - reference) ** 2 / (reference**2 + 0.01))))
        seconds.append(taken)
    return statistics.mean(errors), statistics.median(seconds), reference


def _row(name, renderer, error, seconds, reference):
    return f"{name:<20} {renderer:>8} {error:>9.5f} {seconds:>8.2f} {error * seconds:>9.5f} {reference.mean():>7.4f}"


def _show(file, picture):
    """Writes a picture of linear colours as others show it, in sRGB."""
    file.parent.mkdir(parents=True, exist_ok=True)
    linear = OpenImageIO.ImageBuf(numpy.ascontiguousarray(picture, dtype=numpy.float32))
    if not OpenImageIO.ImageBufAlgo.colorconvert(linear, "lin_rec709", "sRGB").write(str(file)):
        raise OSError(f"{file}: {OpenImageIO.geterror()}")
