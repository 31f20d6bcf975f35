"""Heitz & d'Eon 2014: tables 1 and §5.3, Walter's trick, the limitation, and the forms of G2 and Λ that §2 names."""

from functools import cache, partial

import jax.numpy as jnp
import numpy as np

from ggxref import slopes
from ggxref.sampling import table as tables
from ggxref.verify import cases, charts, engine, laws, samplers
from ggxref.verify.batch import Batched
from ggxref.verify.charts import NORMAL, dot, front, integrals, unit
from ggxref.verify.engine import relative, worst
from ggxref.verify.heitz2014 import PAPER, beckmann_rule, ggx_rule
from ggxref.verify.heitz2014_slopes import phong_slopes, plane
from ggxref.verify.statistics import FALSE_ALARM

check = partial(engine.check, PAPER)
ONES = jnp.ones(2)


@check(
    "table 1", "χ⁺(0) = 0: no density and no masking term at the edge itself", "exact",
    ["ndf.ggx", "ndf.beckmann", "masking.g1_ggx", "masking.g1_beckmann", "masking.g1_v_cavity"], tolerance=0,
    mutant=("1 at 0", lambda f: lambda m, a: np.where(m[2] == 0, 1.0, f(m, a))),
)  # fmt: skip
def indicator_at_zero(ggx, beckmann, g1, g1_beckmann, g1_v_cavity):
    a, flat, w = np.array([0.5, 0.3]), np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.6, 0.8])
    across = np.array([0.0, -0.8, 0.6])  # w·m = 0
    values = [ggx(flat, a), beckmann(flat, a), g1(w, across, a), g1_beckmann(w, across, a), g1_v_cavity(w, across)]
    return worst([*values, g1(flat, NORMAL, a), g1_beckmann(flat, NORMAL, a)])


@check(
    "§2.1 G2", "not correlated: G2 = G1 G1, so that G2/G1 is shadowing alone", "exact",
    ["masking.g2_separable", "masking.g1_ggx", "bsdf.weight_visible"], tolerance=1e-14,
    mutant=("minimum", lambda f: lambda a, b: np.minimum(a, b)),
)  # fmt: skip
def separable_shadowing(g2, g1, weight):
    i, o = cases.pairs(cases.UP, cases.hemisphere(200))
    m, alpha = unit(i + o), np.array([0.5, 0.3])
    a, b = g1(i, m, alpha), g1(o, m, alpha)
    return worst(weight(a, g2(a, b), 1.0) - b)


@check(
    "§2.1 Λ", "Smith's Λ by its definition: the mean area that faces away, ∫ max(-w·m, 0) D dm / z, Beckmann", "quadrature",
    ["masking.lambda_beckmann", "ndf.beckmann"], tolerance=1e-10, rule=beckmann_rule,
    mutant=("a tenth rougher", lambda f: lambda w, a: f(w, 1.1 * a)),
)  # fmt: skip
@check(
    "§2.1 Λ", "Smith's Λ by its definition: the mean area that faces away, ∫ max(-w·m, 0) D dm / z, GGX", "quadrature",
    ["masking.lambda_ggx", "ndf.ggx"], tolerance=1e-10, rule=ggx_rule,
    mutant=("a tenth rougher", lambda f: lambda w, a: f(w, 1.1 * a)),
)  # fmt: skip
def smith_lambda(smith, D, rule):
    """Relative, where more than 1e-200 faces away."""
    w, alpha = cases.pairs(cases.UP[1:], cases.ALPHAS[2:])
    rules = [rule(-x, a) for x, a in zip(w, alpha, strict=True)]
    hidden = integrals(lambda m, w, a: front(-w, m) * D(m, a), rules, w, alpha) / w[:, 2]
    keep = hidden > 1e-200
    return relative(smith(w, alpha)[keep], hidden[keep])


@check(
    "§2.2 Walter's trick", "α' lowers the largest weight of Beckmann at grazing incidence; GGX's it barely lowers", "exact",
    [lambda z: 1.2 - 0.2 * np.sqrt(z), "ndf.beckmann", "ndf.ggx", "masking.g1_beckmann", "masking.g1_ggx"], tolerance=0.5,
    mutant=("α' = α", lambda f: lambda z: 1.0 + 0 * z),
)  # fmt: skip
def trick_lowers_weights(factor, D_beckmann, D_ggx, g1_beckmann, g1_ggx):
    """Largest weight with the trick over the one without, for Beckmann; infinite if GGX gained as much."""
    i, alpha = cases.direction(np.degrees(1.5), 0.0), np.array([0.3, 0.3])
    x = np.linspace(-6, 6, 241)
    s = np.stack(np.meshgrid(x, x), -1).reshape(-1, 2) * alpha
    m = unit(np.concatenate([-s, np.ones((len(s), 1))], -1))
    o = 2 * dot(i, m)[:, None] * m - i
    seen = (dot(i, m) > 0) & (o[:, 2] > 0)
    m, o = m[seen], o[seen]

    def gain(D, g1):
        plain = dot(i, m) * g1(i, m, alpha) * g1(o, m, alpha) / (i[2] * m[:, 2])
        tricked = plain * D(m, alpha) / D(m, factor(i[2]) * alpha)
        return tricked.max() / plain.max()

    beckmann, ggx = gain(D_beckmann, g1_beckmann), gain(D_ggx, g1_ggx)
    return beckmann if ggx > 1.2 * beckmann else np.inf


@check(
    "limitation", "Phong's distribution of slopes is not shape-invariant: the sides of (8) differ; reciprocal of their largest ratio", "exact",
    phong_slopes, tolerance=0.1, mutant=("GGX, which is", lambda f: lambda s, a: ggx_slopes(s, a)),
)  # fmt: skip
def phong_is_not_invariant(P22):
    s, alpha = plane(), np.array([0.3, 0.3])
    ratio = P22(s * alpha, alpha) / (P22(s * alpha / 2, alpha / 2) / 4)
    return 1 / float(ratio.max())


def ggx_slopes(s, alpha):
    return 1 / (np.pi * alpha.prod(axis=-1) * (1 + np.sum((s / alpha) ** 2, axis=-1)) ** 2)


SIZE = 128
GAMMA = 4.0


@cache
def tabulated(name: str) -> tables.Table:
    """Tables of GGX, Beckmann or Student-t slopes, of 128 entries a side: 0.13 MB for both."""
    density = {
        "ggx": partial(slopes.ggx, alpha=ONES),
        "beckmann": partial(slopes.beckmann, alpha=ONES),
        "student_t": partial(slopes.student_t, alpha=ONES, gamma=GAMMA),
    }[name]
    return tables.build(density, size=SIZE)


@cache
def from_table(name: str) -> Batched:
    """`sampling.table.sample` with that table; kept, as each new function would be compiled anew."""
    lookup = tabulated(name)

    def sample(u, wi, alpha):
        return tables.sample(u, wi, alpha, lookup)

    return Batched(sample, (1, 1, 1))


for _name, _law in (("ggx", laws.ggx_visible), ("beckmann", laws.beckmann_visible)):

    @check(
        "§5.3", f"two tables in place of the inverses: error of the distribution functions, {_name}", "exact",
        lambda n=_name: from_table(n), tolerance=2e-4, law=_law,
        mutant=("the table of another distribution", lambda f: lambda: from_table("student_t")),
    )  # fmt: skip
    def table_errors(sample, law):
        """Tolerance: 128 entries a side in single precision, measured 4e-5 (1024 in 8 MiB: 6e-7); α from 0.01 and up to 85°."""
        found = []
        for case in samplers.VISIBLE[0:1] + samplers.VISIBLE[2:5]:
            u = samplers.lattice(1000)
            found.append(np.abs(law(sample()(u, *case), *case) - u)[np.all((u > 0.02) & (u < 0.98), axis=-1)])
        return max(float(np.max(f)) for f in found)


@check(
    "§5.3", "tables for Student-t slopes, which have no inverse: the samples' slopes follow the density's moments", "monte_carlo",
    lambda: from_table("student_t"), tolerance=FALSE_ALARM, mutant=("GGX's table", lambda f: lambda: from_table("ggx")),
)  # fmt: skip
def student_tables(sample, stream):
    """The marginal of x̃ by quadrature as distribution function; uniform where the samples follow it."""
    from ggxref.verify.statistics import kolmogorov_smirnov, unlikeliness

    p = []
    for i, alpha in (
        (cases.direction(60, 0.0), np.array([0.5, 0.5])),
        (cases.direction(30, 0.0), np.array([0.1, 0.1])),
    ):
        m = sample()(stream.uniform(stream.samples // 4, 2), i, alpha)
        cot = charts.cotangent(i, alpha)
        psi = np.linspace(-np.pi / 2, np.arctan(cot), 20001)
        x = np.tan(psi)
        # ∫ (γ-1)^γ/(π (γ-1 + x² + y²)^γ) dy ∝ (γ-1 + x²)^(1/2-γ)
        density = np.maximum(0, cot - x) * (GAMMA - 1 + x**2) ** (0.5 - GAMMA) * (1 + x**2)
        below = np.concatenate([[0], np.cumsum((density[1:] + density[:-1]) / 2)])
        p.append(kolmogorov_smirnov(np.interp(np.arctan(-m[:, 0] / m[:, 2] / alpha[0]), psi, below / below[-1])))
    return unlikeliness(p)
