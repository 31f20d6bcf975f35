"""Walter et al. 2014, §4 by samples: each step of the procedure in place, and bounds on random shapes."""

from functools import partial

import numpy as np

from ggxref.verify import engine, laws, samplers
from ggxref.verify.charts import NORMAL, unit
from ggxref.verify.engine import worst
from ggxref.verify.statistics import FALSE_ALARM, uniform_square
from ggxref.verify.walter2014 import PAPER
from ggxref.verify.walter2014_steps import DISK, POSITIVE, compression, crescent, frame, lune_point, micronormal

check = partial(engine.check, PAPER)


def disk_inverse(u, to_disk):
    """a and b of the concentric map's points: the larger is ± the radius, the other its share of an eighth of a turn."""
    x, y = to_disk(u).T
    wide = np.abs(x) > np.abs(y)
    first, second = np.where(wide, x, y), np.where(wide, y, x)
    larger = np.sign(first) * np.hypot(x, y)
    smaller = larger * 4 / np.pi * np.arctan(second / first)
    return np.where(wide, larger, smaller), np.where(wide, smaller, larger)


@check(
    "(34)", "the disk's point, unmapped, has a = 2ξ₁ - 1", "exact", DISK, tolerance=1e-13, number=0,
    mutant=("a = ξ₁", lambda f: lambda u: f(np.c_[(1 + u[:, 0]) / 2, u[:, 1]])),
)  # fmt: skip
@check(
    "(35)", "the disk's point, unmapped, has b = 2ξ₂ - 1", "exact", DISK, tolerance=1e-13, number=1,
    mutant=("b = ξ₂", lambda f: lambda u: f(np.c_[u[:, 0], (1 + u[:, 1]) / 2])),
)  # fmt: skip
def numbers_of_disk(to_disk, number):
    u = samplers.lattice(1000)
    return worst(disk_inverse(u, to_disk)[number] - (2 * u[:, number] - 1))


def by_crescent(step):
    """(39)–(41) in the procedure."""
    return lambda disk, i, A: step(disk, compression(i, A)) @ frame(i, A)


def by_frame(rows):
    """(42) and (44) in the procedure."""
    return lambda disk, i, A: crescent(disk, compression(i, A)) @ rows(i, A)


def by_second_axis(axis):
    """(43) in the procedure."""

    def rows(i, A):
        e3, e2 = unit(A @ i), axis(i, A)
        return np.stack([np.cross(e2, e3), e2, e3])

    return by_frame(rows)


def by_inverse(i, A):
    """Last form of (43)."""
    return unit(np.linalg.solve(A.T, np.cross(i, NORMAL)))


STEPS = {
    "(39)": ("x_b", by_crescent, crescent, ("s and 1 - s exchanged", lambda f: lambda d, s: f(d, 1 - s))),
    "(40)": ("y_b", by_crescent, crescent, ("y compressed too", lambda f: lambda d, s: f(d, s) * [1, s, 1])),
    "(41)": (
        "z_b", by_crescent, crescent,
        ("z of the disk's own point", lambda f: lambda d, s: np.c_[f(d, s)[:, :2], np.sqrt(1 - np.sum(d**2, -1))]),
    ),
    "(42)": ("e3", by_frame, frame, ("A⁻ᵀψ", lambda f: lambda i, A: f(unit(np.linalg.inv(A.T @ A) @ i), A))),
    "(43)": ("e2", by_second_axis, by_inverse, ("Aᵀ(ψ × n)", lambda f: lambda i, A: unit(A.T @ np.cross(i, NORMAL)))),
    "(44)": ("e1", by_frame, frame, ("e3 × e2", lambda f: lambda i, A: f(i, A) * [[-1], [1], [1]])),
    "(45)": (
        "p_c", lambda point: point, lune_point,
        ("e1 and e2 exchanged", lambda f: lambda d, i, A: crescent(d, compression(i, A)) @ frame(i, A)[[1, 0, 2]]),
    ),
}  # fmt: skip

for _place, (_name, _procedure, _step, _mutant) in STEPS.items():

    @check(
        _place, f"samples of the procedure with this {_name} follow p_h", "monte_carlo", _step, tolerance=FALSE_ALARM,
        procedure=_procedure, mutant=_mutant,
    )  # fmt: skip
    def procedure_follows(step, procedure, stream):
        point = procedure(step)
        v = []
        for i, A in POSITIVE[1:]:
            m = micronormal(point(DISK(stream.uniform(stream.samples // 4, 2)), i, A), A)
            v.append(laws.ellipsoid_visible(m, i, A))
        return uniform_square(np.array(v))


AREAS = ["masking.g1_ellipsoid", "ellipsoid.lune_area", "ellipsoid.projected_area"]


@check(
    "(31)", "A_ℓ⊥(ψ, n) G1(ψ) ≤ A_e⊥(n) |ψ·n| for random shapes and directions", "monte_carlo", AREAS, tolerance=1e-9,
    excess=lambda area, weight, shadowing: area - 1, mutant=("G1 = 1", lambda g1: lambda u, m, A: np.ones(len(u))),
)  # fmt: skip
@check(
    "(51)", "weight ≤ G1(ω, m) F for random shapes and directions", "monte_carlo", AREAS, tolerance=1e-9,
    excess=lambda area, weight, shadowing: weight - shadowing, mutant=("G1 = 1", lambda g1: lambda u, m, A: np.ones(len(u))),
)  # fmt: skip
@check(
    "(52)", "weight ≤ 1 for random shapes and directions", "monte_carlo", AREAS, tolerance=1e-9,
    excess=lambda area, weight, shadowing: weight - 1, mutant=("G1 = 1", lambda g1: lambda u, m, A: np.ones(len(u))),
)  # fmt: skip
def random_shapes(g1, lune_area, projected_area, excess, stream):
    """Tolerance: a matrix of random entries is close to singular now and then."""
    n = stream.samples // 8
    A = 2 * stream.uniform(n, 3, 3) - 1
    i, o = (unit((2 * stream.uniform(n, 3) - 1) * [1, 1, 0.5] + [0, 0, 0.5]) for _ in range(2))
    m = unit(i + o)
    area = g1(i, m, A) * lune_area(i, NORMAL, A, 1.0) / (i[:, 2] * projected_area(NORMAL, A, 1.0))
    shadowing = g1(o, m, A)
    return worst(np.maximum(0, excess(area, area * shadowing, shadowing)))
