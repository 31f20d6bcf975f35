"""Heitz & d'Eon 2014 by samples: the ranges of table 2, and Walter's trick as an unbiased estimator."""

from functools import partial

import numpy as np

from ggxref.verify import cases, engine, samplers
from ggxref.verify.charts import unit
from ggxref.verify.engine import worst
from ggxref.verify.heitz2014 import PAPER
from ggxref.verify.heitz2014_bsdf import hemispherical
from ggxref.verify.statistics import FALSE_ALARM, unlikely_mean

check = partial(engine.check, PAPER)


def reflected(i, m):
    """Micronormals that reflect i above the horizon, and where to."""
    o = 2 * (m @ i)[:, None] * m - i
    keep = (m @ i > 1e-6) & (o[:, 2] > 1e-6)
    return m[keep], o[keep]


def outside(weight, top):
    return max(worst(np.maximum(0, weight - top)), worst(np.minimum(0, weight)))


@check(
    "table 2", "weights of samples: Smith in [0, 1] by visible normals, V-cavities in [0, 1] and, by D cos, in [0, 2]", "monte_carlo",
    ["bsdf.weight_visible", "bsdf.weight_normals", "masking.g1_ggx", "masking.g2_height_correlated", "masking.g1_v_cavity",
     "masking.g2_v_cavity", "sampling.slope_ggx.sample", "sampling.v_cavity.sample", "sampling.normals.sample_ggx"],
    tolerance=1e-9, mutant=("divided by G1 twice", lambda w: lambda gi, G, F: w(gi * gi, G, F)),
)  # fmt: skip
def weights_of_samples(visible, normals, g1, g2, cavity_g1, cavity_g2, by_slopes, by_cavity, by_normals, stream):
    n, errors = stream.samples // 16, []
    for i, alpha in samplers.ABOVE:
        m, o = reflected(i, by_slopes(stream.uniform(n, 2), i, alpha))
        seen = g1(i, m, alpha)
        errors.append(outside(visible(seen, g2(seen, g1(o, m, alpha)), 1.0), 1))
        m, o = reflected(i, by_cavity(stream.uniform(n, 3), i, alpha))
        errors.append(outside(visible(cavity_g1(i, m), cavity_g2(i, o, m), 1.0), 1))
        m, o = reflected(i, by_normals(stream.uniform(n, 2), alpha))
        errors.append(outside(normals(i, m, cavity_g2(i, o, m)), 2) if len(m) else 0.0)
    return max(errors)


@check(
    "§2.2 Walter's trick", "samples of D with α' = (1.2 - 0.2√|wi·n|) α, weighted by that density, estimate the albedo of α", "monte_carlo",
    ["sampling.normals.pdf_beckmann", "sampling.normals.sample_beckmann", "bsdf.brdf", "ndf.beckmann", "masking.g1_beckmann",
     "jacobian.reflection"],
    tolerance=FALSE_ALARM, mutant=("density of twice α", lambda p: lambda m, a: p(m, 2 * a)),
)  # fmt: skip
def trick_is_unbiased(pdf, sample, brdf, D, g1, jacobian, stream):
    alpha = np.array([0.4, 0.6])

    def f(i, o):
        m = unit(i + o)
        return brdf(i, o, D(m, alpha), g1(i, m, alpha) * g1(o, m, alpha), 1.0) * np.abs(o[:, 2])

    i, values = cases.UP[1:3], []
    for x in i:
        wider = (1.2 - 0.2 * np.sqrt(x[2])) * alpha
        m = sample(stream.uniform(stream.samples, 2), wider)
        o = 2 * (m @ x)[:, None] * m - x
        keep = (m @ x > 0) & (o[:, 2] > 0)
        weight = f(np.broadcast_to(x, o.shape), o) / (pdf(m, wider) * jacobian(o, m))
        values.append(np.where(keep, weight, 0))
    return unlikely_mean(np.array(values), hemispherical(f, i))
