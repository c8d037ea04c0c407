#!/usr/bin/env python3
"""Writes disney_brdf.csv: golden values of the Disney BRDF in double precision.

    python3 tests/golden/disney_brdf.py > tests/golden/disney_brdf.csv

Written from Burley, "Physically-Based Shading at Disney" (2012), and the published disney.brdf, in the paper's notation, apart from the Rust
code that it checks: textbook formulas, a normalised half vector, no rearrangement. A row holds the inputs, rounded to single precision, and
the BRDF per channel, without the cosine, for both roughnesses of the masking term G (matched, remapped) and three diffuse terms.
"""

import math
import random
import struct

SCALARS = ["metallic", "subsurface", "specular", "roughness", "specular_tint", "anisotropic", "sheen", "sheen_tint", "clearcoat",
           "clearcoat_gloss"]
MAXIMUM = {"specular": 12.5, "clearcoat": 4.0}
MASKINGS = ["matched", "remapped"]
DIFFUSE = ["burley", "lambert", "lambert_fresnel"]
ROWS = 600


def mix(a, b, t):
    return a * (1 - t) + b * t


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def schlick_fresnel(u):
    return min(max(1 - u, 0.0), 1.0) ** 5


def gtr1(n_dot_h, a):
    a2 = a * a
    return (a2 - 1) / (math.pi * math.log(a2) * (1 + (a2 - 1) * n_dot_h**2))


def gtr2_aniso(h, ax, ay):
    return 1 / (math.pi * ax * ay * ((h[0] / ax) ** 2 + (h[1] / ay) ** 2 + h[2] ** 2) ** 2)


def smith_g(n_dot_v, alpha):
    a = alpha * alpha
    b = n_dot_v * n_dot_v
    return 1 / (n_dot_v + math.sqrt(a + b - a * b))


def smith_g_aniso(v, ax, ay):
    return 1 / (v[2] + math.sqrt((v[0] * ax) ** 2 + (v[1] * ay) ** 2 + v[2] ** 2))


def alphas(roughness, anisotropic):
    aspect = math.sqrt(1 - anisotropic * 0.9)
    return max(0.001, roughness**2 / aspect), max(0.001, roughness**2 * aspect)


def brdf(color, p, l, v, masking, diffuse):
    nl, nv = l[2], v[2]
    length = math.sqrt(sum((a + b) ** 2 for a, b in zip(l, v)))
    h = [(a + b) / length for a, b in zip(l, v)]
    lh = dot(l, h)

    luminance = dot(color, (0.3, 0.6, 0.1))
    tint = [c / luminance for c in color] if luminance > 0 else [1.0] * 3
    spec0 = [mix(p["specular"] * 0.08 * mix(1, t, p["specular_tint"]), c, p["metallic"]) for t, c in zip(tint, color)]
    sheen_color = [mix(1, t, p["sheen_tint"]) for t in tint]

    fl, fv, fh = schlick_fresnel(nl), schlick_fresnel(nv), schlick_fresnel(lh)
    fd90 = 0.5 + 2 * lh**2 * p["roughness"]
    fd = mix(1, fd90, fl) * mix(1, fd90, fv) if diffuse == "burley" else 1.0
    fss90 = lh**2 * p["roughness"]
    fss = mix(1, fss90, fl) * mix(1, fss90, fv)
    ss = 1.25 * (fss * (1 / (nl + nv) - 0.5) + 0.5)

    ax, ay = alphas(p["roughness"], p["anisotropic"])
    ds = gtr2_aniso(h, ax, ay)
    fs = [mix(s, 1, fh) for s in spec0]
    g_roughness = p["roughness"] if masking == "matched" else 0.5 + p["roughness"] / 2
    gx, gy = alphas(g_roughness, p["anisotropic"])
    gs = smith_g_aniso(l, gx, gy) * smith_g_aniso(v, gx, gy)

    dr = gtr1(h[2], mix(0.1, 0.001, p["clearcoat_gloss"]))
    fr = mix(0.04, 1, fh)
    gr = smith_g(nl, 0.25) * smith_g(nv, 0.25)
    coat = 0.25 * p["clearcoat"] * gr * fr * dr

    result = []
    for c in range(3):
        transmitted = max(0.0, 1 - fs[c]) if diffuse == "lambert_fresnel" else 1.0
        base = mix(fd, ss, p["subsurface"]) * color[c] / math.pi * transmitted
        sheen = fh * p["sheen"] * sheen_color[c]
        result.append((base + sheen) * (1 - p["metallic"]) + gs * fs[c] * ds + coat)
    return result


def single(x):
    """x rounded to single precision."""
    return struct.unpack("f", struct.pack("f", x))[0]


def parameter(rng, maximum=1.0):
    return single(rng.choice([0.0, maximum, rng.random() * maximum, rng.random() * maximum]))


def direction(rng):
    z = 10 ** (-5 * rng.random()) if rng.random() < 0.2 else 1 - rng.random()
    phi = 2 * math.pi * rng.random()
    r = math.sqrt(1 - z * z)
    return [r * math.cos(phi), r * math.sin(phi), z]


def near_mirror(rng, v):
    """About the mirror direction, off by up to one, evenly on a logarithmic scale."""
    size = 10 ** (-4 * rng.random())
    l = [-v[0] + size * rng.uniform(-1, 1), -v[1] + size * rng.uniform(-1, 1), abs(v[2] + size * rng.uniform(-1, 1))]
    return [x / math.sqrt(dot(l, l)) for x in l]


def main():
    rng = random.Random(2012)
    columns = [f"{m}_{d}_{c}" for m in MASKINGS for d in DIFFUSE for c in "rgb"]
    print(",".join(["base_color_r", "base_color_g", "base_color_b"] + SCALARS + ["lx", "ly", "lz", "vx", "vy", "vz"] + columns))
    for _ in range(ROWS):
        color = [parameter(rng) for _ in range(3)]
        p = {name: parameter(rng, MAXIMUM.get(name, 1.0)) for name in SCALARS}
        v = direction(rng)
        l = near_mirror(rng, v) if rng.random() < 0.4 else direction(rng)
        l, v = [single(x) for x in l], [single(x) for x in v]
        inputs = color + [p[name] for name in SCALARS] + l + v
        values = [x for m in MASKINGS for d in DIFFUSE for x in brdf(color, p, l, v, m, d)]
        print(",".join([f"{x:.9g}" for x in inputs] + [f"{x:.10g}" for x in values]))


if __name__ == "__main__":
    main()
