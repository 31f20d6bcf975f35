"""The tables against the exact inversions where those exist, and against the density where they do not."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads
from scipy import stats

from ggxref import ndf, slopes
from ggxref.measure.accuracy import compiled
from ggxref.measure.derivatives import measure, points
from ggxref.measure.regions import rounded
from ggxref.sampling import slope_beckmann, slope_ggx, table

ONE = jnp.ones(2, jnp.float32)
ALPHA = jnp.array([0.3, 0.1], jnp.float32)
INCIDENT = {"normal": 0.0, "middle": 0.5, "steep": 1.2, "grazing": 1.5}
EXACT = {"ggx": (slopes.ggx, slope_ggx), "beckmann": (slopes.beckmann, slope_beckmann)}

# Compiled once for every incidence.
EXACT_SAMPLE, EXACT_PDF = (
    {name: jax.jit(jax.vmap(getattr(exact, f), (0, None, None))) for name, (_, exact) in EXACT.items()}
    for f in ("sample", "pdf")
)
TABLE_SAMPLE, TABLE_PDF = (jax.jit(jax.vmap(f, (0, None, None, None))) for f in (table.sample, table.pdf))

incidences = pytest.mark.parametrize("theta", INCIDENT.values(), ids=INCIDENT)


@pytest.fixture(scope="module")
def tables():
    densities = {name: partial(density, alpha=ONE) for name, (density, _) in EXACT.items()}
    return {name: table.build(density, size=256) for name, density in densities.items()}


def direction(theta):
    return jnp.array([np.sin(theta) * 0.8, np.sin(theta) * 0.6, np.cos(theta)], jnp.float32)


def draw(count, seed=0):
    return jnp.asarray(np.random.default_rng(seed).random((count, 2)), jnp.float32)


@incidences
@pytest.mark.parametrize("name", EXACT)
def test_maps_as_the_exact_inversion_does(tables, name, theta):
    """256² entries. In the outermost cells, one sample in 10⁴, the inverse runs off to infinity and the table cannot follow."""
    u, wi = draw(1 << 14), direction(theta)
    exact = EXACT_SAMPLE[name](u, wi, ALPHA)
    found = TABLE_SAMPLE(u, wi, ALPHA, tables[name])
    error = np.linalg.norm(found - exact, axis=1)
    # Measured worst: median 2.7e-6, 99.9th percentile 6.6e-4.
    assert np.median(error) < 1e-5
    assert np.quantile(error, 0.999) < 2e-3


@incidences
@pytest.mark.parametrize("name", EXACT)
def test_density_is_the_exact_one(tables, name, theta):
    wi = direction(theta)
    wm = EXACT_SAMPLE[name](draw(1 << 12), wi, ALPHA)
    exact = EXACT_PDF[name](wm, wi, ALPHA)
    found = TABLE_PDF(wm, wi, ALPHA, tables[name])
    # σ is interpolated between 256 angles: (π/2/255)²/8 of its curvature.
    np.testing.assert_allclose(found, exact, rtol=2e-5)


def test_smaller_table_is_worse(tables):
    """The bounds above depend on the table: 16² entries must break the first of them."""
    small = table.build(partial(slopes.ggx, alpha=ONE), size=16)
    u, wi = draw(1 << 12), direction(1.2)
    exact = EXACT_SAMPLE["ggx"](u, wi, ALPHA)
    found = TABLE_SAMPLE(u, wi, ALPHA, small)
    assert np.median(np.linalg.norm(found - exact, axis=1)) > 1e-5
    assert small.nbytes < tables["ggx"].nbytes


def test_student_t_follows_its_density():
    """At normal incidence the slope's square s has the survival (1 + s/(γ−1))^(1−γ): a law that has no other sampler here."""
    gamma = 4.0
    student = table.build(partial(slopes.student_t, alpha=ONE, gamma=gamma), size=256)
    wm = TABLE_SAMPLE(draw(1 << 15), direction(0), ALPHA, student)
    square = (np.asarray(wm)[:, :2] / np.asarray(wm)[:, 2:] / np.asarray(ALPHA)) ** 2
    uniform = (1 + square.sum(1) / (gamma - 1)) ** (1 - gamma)
    # One fixed seed and one test: 1e-4 is one wrong alarm in 10⁴ changes of the seed.
    assert stats.kstest(uniform, "uniform").pvalue > 1e-4
    assert stats.kstest(uniform**1.03, "uniform").pvalue < 1e-4  # the power to see 3 % of an exponent


@pytest.fixture(scope="module")
def small():
    """Without and with the density of the normals."""
    density, normals = partial(slopes.ggx, alpha=ONE), partial(ndf.ggx, alpha=ONE)
    return table.build(density, size=64), table.build(density, size=64, normals=normals)


def test_density_by_normals_is_that_by_slopes(small):
    wi = direction(1.2)
    wm = EXACT_SAMPLE["ggx"](draw(1 << 10), wi, ALPHA)
    np.testing.assert_allclose(*(TABLE_PDF(wm, wi, ALPHA, t) for t in small), rtol=2e-6)


def test_derivatives_of_the_density_keep_four_digits(small):
    """By grazing ω_m only with the density of the normals: that of the slopes has a derivative that underflows."""

    def worst(t, region):
        return measure("table.pdf", partial(table.pdf, table=t), ("wm", "wi", "alpha"), region, 4096).worst

    by_slopes, by_normals = small
    for region in ("grazing", "smooth", "near_normal", "ordinals"):
        assert worst(by_normals, region) < 5e-5
    assert worst(by_slopes, "grazing") > 1


@pytest.mark.parametrize("theta", [0.3, 1.2])
def test_derivatives_of_the_density_are_difference_quotients(small, theta):
    """The first and the second, by the table of σ too."""
    by_normals = small[1]

    def density(wm, wi, alpha, sigma):
        wm, wi = (w / jnp.sqrt(w @ w) for w in (wm, wi))
        return table.pdf(wm, wi, alpha, replace(by_normals, sigma=sigma))

    with jax.enable_x64(True):
        args = jnp.asarray([0.28, 0.0, 0.96]), direction(theta), ALPHA, by_normals.sigma
        args = tuple(np.asarray(a, np.float64) for a in args)
        check_grads(jax.jit(density), args, order=2, rtol=1e-5)


def test_samples_beside_the_ends_of_the_tables_keep_their_digits(small):
    """Cosines of angles near ±π/2, from their distances to it: 0.3 % of a sample and half of a derivative otherwise."""
    drawn = rounded(points("ordinals", np.random.default_rng(3), 1 << 15), np.float32)
    args, sample = [drawn[k] for k in ("u", "wi", "alpha")], partial(table.sample, table=small[0])
    found, exactly = compiled(sample)(*args), compiled(sample)(*(a.astype(np.float64) for a in args))
    assert np.linalg.norm(found - exactly, axis=0).max() < 3e-5
    assert measure("table.sample", sample, ("u", "wi", "alpha"), "ordinals", 4096).worst < 5e-4


def test_nan_stays(small):
    """In any number of an argument, whichever density the table has."""
    sample_args = dict(u=[0.3, 0.6], wi=[0.48, 0.36, 0.8], alpha=[0.3, 0.5])
    pdf_args = dict(wm=[0.0, 0.28, 0.96]) | {k: sample_args[k] for k in ("wi", "alpha")}
    for function, given in ((table.sample, sample_args), (table.pdf, pdf_args)):
        given = {k: np.asarray(x, np.float32) for k, x in given.items()}
        for t in small:
            compute = jax.jit(partial(function, table=t))
            assert np.isfinite(compute(**given)).all()
            for name, x in given.items():
                for k in range(x.size):
                    lost = np.where(np.arange(x.size) == k, np.nan, x).astype(np.float32)
                    assert np.isnan(compute(**given | {name: lost})).any(), (function.__name__, name, k)


@pytest.mark.parametrize("half", [jnp.float16, jnp.bfloat16])
def test_half_precision_is_computed_in_single(small, half):
    """As the table is float32, so is the result: that of the same numbers in float32."""
    u, wi, wm, alpha = (jnp.asarray(x, half) for x in ([0.3, 0.6], [0.48, 0.36, 0.8], [0.0, 0.28, 0.96], [0.3, 0.5]))
    for function, *args in ((table.sample, u, wi, alpha), (table.pdf, wm, wi, alpha)):
        np.testing.assert_array_equal(
            function(*args, small[1]), function(*(a.astype(np.float32) for a in args), small[1])
        )


def test_density_where_that_of_slopes_underflows_is_0(small):
    """0 times an infinite 1/z⁴ is NaN."""
    wm = jnp.asarray([1, 0, 1e-20], jnp.float32)
    assert jax.jit(table.pdf)(wm, direction(0.5), ALPHA, small[0]) == 0
