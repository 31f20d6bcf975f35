"""Each sampler's density is the Jacobian of its map, and each keeps the conventions that its docstring states."""

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from library import over_rows, public
from numpy.testing import assert_allclose
from points import FUNCTIONS, points

from ggxref import ndf
from ggxref.sampling import bounded_cap, ellipsoid_bounded, lune, normals, slope_beckmann, slope_ggx, v_cavity

DENSITY = {"sample_ggx": "pdf_ggx", "sample_beckmann": "pdf_beckmann", "sample": "pdf"}
# The rejection versions choose a row of u: they have no one map.
SAMPLERS = [n for n in FUNCTIONS if n.rpartition(".")[2] in DENSITY]
COUNT = 200


def density_of(name: str):
    module, _, function = name.rpartition(".")
    return public(f"{module}.{DENSITY[function]}")


@cache
def cases(name: str) -> dict[str, np.ndarray]:
    """Random inputs of the sampler, with numbers away from 0 and 1, where its map has no derivative."""
    inputs = points(name, COUNT, seed=3)
    u = np.random.default_rng(4).uniform(0.01, 0.99, inputs["u"].shape)
    return inputs | {"u": u}


def density_times_area(sample, density):
    """pdf(m) |∂m/∂u₀ × ∂m/∂u₁| at one point: 1 where the density is that of the map."""

    def product(u, **rest):
        wm = sample(u, **rest)
        J = jax.jacfwd(sample)(u, **rest)
        return density(wm, **rest) * jnp.linalg.norm(jnp.cross(J[:, 0], J[:, 1]))

    return product


def shares(name: str, product: np.ndarray, inputs) -> np.ndarray:
    """What pdf · area should be. A V-cavity's wall is a choice: its map has the share that the wall was drawn with."""
    if "v_cavity" not in name:
        return np.ones_like(product)
    wm = over_rows(public(name), inputs)
    other = wm * [-1, -1, 1]
    a, b = (np.maximum(np.sum(w * inputs["wi"], axis=1), 0) for w in (wm, other))
    return 2 * a / (a + b)


@pytest.mark.parametrize("name", SAMPLERS)
def test_density_is_the_jacobian_of_the_map(name):
    """In float64. Measured worst 1.1e-11, of the lune on a nearly singular shape; 1.5e-14 without a shape matrix."""
    inputs = cases(name)
    product = over_rows(density_times_area(public(name), density_of(name)), inputs)
    assert_allclose(product, shares(name, product, inputs), rtol=1e-10)


def test_a_density_of_another_law_is_caught():
    inputs = cases("sampling.spherical_cap.sample")

    def normals_instead(wm, wi, alpha):
        return normals.pdf_ggx(wm, alpha)

    product = over_rows(density_times_area(public("sampling.spherical_cap.sample"), normals_instead), inputs)
    assert np.median(np.abs(product - 1)) > 0.05


@pytest.mark.parametrize("name", [n for n in SAMPLERS if "slope" not in n])
def test_samples_stay_above_the_horizon(name):
    """For every number in [0, 1) in float32, `wi` grazing and below the horizon too."""
    inputs = points(name, 4000, seed=7, dtype=np.float32)
    if "lune" in name:
        inputs["u"] = np.maximum(inputs["u"], np.float32(2**-24))  # 0 is the rim of its disk, in the horizon
    assert np.all(over_rows(public(name), inputs)[:, 2] > 0)


def f32(*values):
    return jnp.asarray(values, jnp.float32)


N, ALPHA = f32(0, 0, 1), f32(0.3, 0.1)


@pytest.mark.parametrize("module", [slope_ggx, slope_beckmann], ids=["ggx", "beckmann"])
def test_slopes_reach_the_horizon_at_0(module):
    """A number 0 is an infinite slope along (u[0]) or across (u[1]) the view: by convention never a NaN."""
    assert_allclose(module.sample(f32(0.3, 0), N, ALPHA), [0, 1, 0], atol=1e-7)
    along = module.sample(f32(0, 0.5), N, ALPHA)
    assert_allclose(along, [1, 0, 0], atol=1e-7)


def test_slope_ggx_inverts_the_marginal():
    """heitz2014 (11): u₀ = (cos θ + sin(ψ + θ))/(1 + cos θ) for the slope tan ψ along the view, at α = 1."""
    theta, u = 1.1, np.linspace(0.05, 0.95, 7)
    wi = f32(np.sin(theta), 0, np.cos(theta))
    m = np.stack([slope_ggx.sample(f32(a, 0.3), wi, f32(1, 1)) for a in u])
    psi = np.arctan2(-m[:, 0], m[:, 2])
    assert_allclose((np.cos(theta) + np.sin(psi + theta)) / (1 + np.cos(theta)), u, atol=1e-6)


def test_slope_ggx_inverts_the_conditional():
    """At normal incidence the slope across has the Student-t density of 3 degrees of freedom, seen past the slope along."""
    from scipy import stats

    u = np.linspace(0.05, 0.95, 7)
    m = np.stack([slope_ggx.sample(f32(0.4, b), N, f32(1, 1)) for b in u])
    along, across = -m[:, 0] / m[:, 2], -m[:, 1] / m[:, 2]
    assert_allclose(stats.t(3).cdf(across * np.sqrt(3 / (1 + along**2))), u, atol=1e-6)


@pytest.mark.parametrize("distribution", ["ggx", "beckmann"])
def test_v_cavity_turns_the_wall_at_its_share(distribution):
    u, wi = f32(0.2, 0.6), f32(0.6, 0.0, 0.8)
    m = getattr(normals, f"sample_{distribution}")(u, ALPHA)
    other = m * f32(-1, -1, 1)
    share = float(jnp.maximum(other @ wi, 0) / (jnp.maximum(other @ wi, 0) + jnp.maximum(m @ wi, 0)))
    assert 0.01 < share < 0.99
    for third, expected in ((share - 1e-3, other), (share + 1e-3, m)):
        got = v_cavity.sample(jnp.append(u, f32(third)), wi, ALPHA, distribution=distribution)
        assert_allclose(got, expected, atol=1e-7)


@pytest.mark.parametrize("sample", [lune.sample_rejection_sphere, lune.sample_rejection_ellipsoid])
def test_rejection_takes_the_first_row_that_is_seen(sample):
    A, wi = jnp.diag(f32(0.3, 0.1, 1)), f32(0.99, 0.0, -np.sqrt(1 - 0.99**2))  # sees few of the normals
    rows = jnp.asarray(np.random.default_rng(2).random((20, 2)), jnp.float32)
    compiled = jax.jit(sample)
    wm, tries = compiled(rows, wi, A)
    assert tries > 1
    alone, first = compiled(jnp.tile(rows[tries - 1], (20, 1)), wi, A)
    assert first == 1
    assert_allclose(alone, wm, atol=1e-6)
    nothing, none = compiled(jnp.tile(rows[tries - 2], (20, 1)), wi, A)
    assert none == 0
    assert not np.any(nothing)


def test_bound_of_the_ellipsoid_is_tokuyoshis_for_ggx():
    """Without skew and for α at most 1, where both are the same minimum."""
    inputs = points("sampling.bounded_cap.bound", COUNT, seed=8)
    inputs["alpha"] = np.minimum(inputs["alpha"], 1)

    def lower(wi, alpha):
        i = jnp.array([alpha[0] * wi[0], alpha[1] * wi[1], wi[2]])
        theirs = -bounded_cap.bound(wi, alpha) * i[2] / jnp.linalg.norm(i)
        return jnp.stack([ellipsoid_bounded.bound(wi, jnp.diag(jnp.append(alpha, 1))), theirs])

    ours, theirs = over_rows(lower, inputs).T
    assert_allclose(ours, theirs, rtol=1e-12, atol=1e-14)


def test_bound_leaves_out_no_reflection_above_the_horizon():
    """Every normal that reflects `wi` upwards has a density in the bounded cap, skewed and rough surfaces too."""
    inputs = points("sampling.ellipsoid_bounded.pdf", 4000, seed=9)

    def reflected(wm, wi, A):
        up = 2 * (wi @ wm) * wm[2] - wi[2]
        return jnp.stack([up, wi[2], wi @ wm, ndf.ellipsoid(wm, A), ellipsoid_bounded.pdf(wm, wi, A)])

    up, z_i, facing, D, pdf = over_rows(reflected, inputs).T
    due = (up > 0) & (z_i > 0) & (facing > 0) & (D > 0)
    assert due.sum() > 300
    assert np.all(pdf[due] > 0)


def test_bound_does_leave_out_reflections_below_it():
    """A bound that cuts nothing off would pass the test above."""
    inputs = points("sampling.ellipsoid_bounded.pdf", 4000, seed=9)
    visible = over_rows(public("sampling.ellipsoid_cap.pdf"), inputs)
    bounded = over_rows(public("sampling.ellipsoid_bounded.pdf"), inputs)
    assert np.sum((visible > 0) & (bounded == 0)) > 30
