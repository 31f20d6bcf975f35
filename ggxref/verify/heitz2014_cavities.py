"""Heitz & d'Eon 2014, §2.1 and §4: V-cavities by casting rays into their profile, algorithm 3 step by step."""

from functools import partial

import numpy as np

from ggxref.verify import cases, engine, samplers
from ggxref.verify.charts import dot, front
from ggxref.verify.engine import worst
from ggxref.verify.heitz2014 import PAPER, mirrored, unclamped_v_cavity

check = partial(engine.check, PAPER)

# Rays an evenly spaced sample of a line: the end of the part that is seen falls between two of them.
RAYS = 4096
SPACING = 2 / RAYS


def cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def profile(w, m):
    """Directions in the plane across the groove, (..., 1, 2): x towards the side that m leans to, z up. And the rim's height.

    The facet of m runs from the bottom (0, 0) to its rim (-1, h), the one of m' from there to (1, h).
    """
    flat = np.hypot(m[:, 0], m[:, 1])
    across = (w[:, 0] * m[:, 0] + w[:, 1] * m[:, 1]) / flat
    return np.stack([across, w[:, 2]], axis=-1)[:, None], flat / m[:, 2]


def meets(origin, d, start, along):
    """Distances along the ray and along the segment (in units of its length) at which the two lines cross."""
    apart, turn = origin - start, cross(along, d)
    return cross(apart, along) / turn, cross(apart, d) / turn


def facet(h, *, at=0.0, to=1.0):
    """Start and extent of the segment from (at, h|at|) to (to, h|to|)."""
    start = np.stack([0 * h + at, h * abs(at)], axis=-1)[:, None]
    return start, np.stack([0 * h + to, h * abs(to)], axis=-1)[:, None] - start


def share_of_rays(w, m):
    """Part of the parallel rays into the opening that meet the facet of m first."""
    d, h = profile(w, m)
    x = -1 + (np.arange(RAYS) + 0.5) * SPACING
    origin = np.stack(np.broadcast_arrays(x, h[:, None]), axis=-1)
    first, at = meets(origin, -d, *facet(h, to=-1.0))
    second, there = meets(origin, -d, *facet(h))
    hit, other = (first >= 0) & (at >= 0) & (at <= 1), (second >= 0) & (there >= 0) & (there <= 1)
    return np.mean(hit & (~other | (first < second)), axis=-1)


def points_seen(w, m):
    """Whether evenly spaced points of the facet of m are seen from w, above or below: past the facet that faces it there."""
    d, h = profile(w, m)
    t = (np.arange(RAYS) + 0.5) / RAYS
    origin = np.stack([-t + 0 * h[:, None], t * h[:, None]], axis=-1)
    above, below = meets(origin, d, *facet(h)), meets(origin, d, *neighbour(h))
    distance, at = (np.where(w[:, 2:] > 0, a, b) for a, b in zip(above, below, strict=True))
    facing = dot(w, m) * w[:, 2] > 0
    return facing[:, None] & ~((distance > 0) & (at > 0) & (at < 1))


def neighbour(h):
    """From below the facet faces that of the next cavity, from the rim (-1, h) down to (-2, 0)."""
    start = np.stack([0 * h - 1, h], axis=-1)[:, None]
    return start, np.stack([0 * h - 1, -h], axis=-1)[:, None]


def oblique(n):
    """Micronormals that lean: a level facet has no cavity."""
    m = cases.hemisphere(n)
    return m[m[:, 2] < 0.99]


@check(
    "(3)", "rays cast into the profile: the facet of m catches the part G1 ⟨w,m⟩/(2 (m·n)(w·n)) of them", "quadrature",
    "masking.g1_v_cavity", tolerance=2 * SPACING, mutant=("no minimum with 1", lambda g1: unclamped_v_cavity),
)  # fmt: skip
def rays_caught(g1):
    w, m = cases.pairs(cases.UP[1:4], oblique(60))
    return worst(g1(w, m) * front(w, m) / (2 * m[:, 2] * w[:, 2]) - share_of_rays(w, m))


@check(
    "§2.1 G2", "rays cast from the facet: the part of it that wi and wo both see is G2, for reflection and transmission", "quadrature",
    "masking.g2_v_cavity", tolerance=2 * SPACING,
    mutant=("reflection's branch for both", lambda g2: lambda i, o, m: g2(i, o * np.sign(o[:, 2:]), m)),
)  # fmt: skip
def points_seen_by_both(g2):
    i, o, m = cases.triples(cases.UP[1:4], cases.sphere(20), oblique(20))
    return worst(g2(i, o, m) - np.mean(points_seen(i, m) & points_seen(o, m), axis=-1))


for _name in ("ggx", "beckmann"):

    @check(
        "algorithm 3", f"the third number below ⟨wi·m'⟩/(⟨wi·m⟩ + ⟨wi·m'⟩) takes m' for the sample m of D cos, {_name}", "exact",
        ["sampling.v_cavity.sample", f"sampling.normals.sample_{_name}"], tolerance=1e-13, distribution=_name,
        mutant=("above it", lambda f: lambda u, *v, **k: f(u * [1, 1, -1] + [0, 0, 1], *v, **k)),
    )  # fmt: skip
    def swap_test(sample, normals, distribution):
        """Numbers within 1e-9 of the threshold are left out: rounding decides there."""
        errors = []
        for i, alpha in samplers.ABOVE:
            u = np.c_[samplers.lattice(500), (np.arange(500) + 0.5) * 0.61803398875 % 1]
            m = normals(u[:, :2], alpha)
            seen, other = m @ i, mirrored(m) @ i
            swap = u[:, 2] - np.maximum(other, 0) / (np.maximum(seen, 0) + np.maximum(other, 0))
            expected = np.where(swap[:, None] < 0, mirrored(m), m)
            got = sample(u, i, alpha, distribution=distribution)
            errors.append(worst((got - expected)[np.abs(swap) > 1e-9]))
        return max(errors)
