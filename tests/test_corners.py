"""No NaN and no infinity at any corner of the stated domain, in a function or its gradient; sampled normals are unit and up."""

from itertools import product

import jax
import jax.numpy as jnp
import ml_dtypes
import numpy as np
import pytest
from library import gradient, numbers, over_rows, public
from points import FUNCTIONS

BELOW_1 = float(np.nextafter(np.float32(1), np.float32(0)))


def polar(z: float, azimuth: float) -> list[float]:
    s = np.sqrt((1 - z) * (1 + z))
    return [s * np.cos(azimuth), s * np.sin(azimuth), z]


N = [0.0, 0.0, 1.0]
UP = [N, polar(0.6, 2.1), polar(1e-6, -0.4), polar(1 - 1e-8, 1.0)]
HORIZON = [[1.0, 0.0, 0.0], polar(0.0, 2.5)]
BELOW = [polar(-1e-6, 0.9), polar(-0.3, -2.0), polar(-0.95, 0.1)]
DIRECTIONS = [*UP, *HORIZON, *BELOW]
SHARES = [0.0, 1e-6, 0.5, 1.0]

# Smallest and largest, isotropic and 1000 times wider than long.
ALPHAS = [[1e-4, 1e-4], [2.0, 2.0], [2.0, 2e-3], [1e-4, 0.1], [1.0, 1.0], [0.3, 0.2]]


def rotation(a: float, b: float) -> np.ndarray:
    (ca, sa), (cb, sb) = (np.cos(a), np.sin(a)), (np.cos(b), np.sin(b))
    return np.array([[ca, -sa, 0], [sa, ca, 0], [0, 0, 1]]) @ np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])


def shapes(alphas=ALPHAS) -> list[np.ndarray]:
    """Canonical, straight and strongly skewed, at every alpha; turned, scaled and mirrored."""
    found = []
    for (ax, ay), (ex, ey) in product(alphas, [(0.0, 0.0), (3.0, -2.0)]):
        found.append(np.array([[ax, 0, 0], [0, ay, 0], [ex, ey, 1]]))
    found.append(3 * rotation(0.4, 1.1) @ found[1])
    found.append(0.5 * rotation(2.0, -0.7) @ np.diag([1, 1, -1]) @ found[-2])
    return found


CORNERS = {
    "w": DIRECTIONS,
    "wi": DIRECTIONS,
    "wi_up": UP,
    "wi_seeing": DIRECTIONS,
    "wo": [*DIRECTIONS, [0.0, 0.0, -1.0]],
    "wm": DIRECTIONS,
    "wm_up": UP,
    "wm_A": DIRECTIONS,
    "alpha": ALPHAS,
    "A": shapes(),
    "mean": [[0.0, 0.0], [3.0, -2.0]],
    "scatter": [[[1e-8, 0.0], [0.0, 1e-8]], [[4.0, 0.0], [0.0, 4e-6]], [[0.09, 0.02], [0.02, 0.04]]],
    "angles": [[0.0, 0.0, 0.0], [1.2, -0.7, 3.0]],
    "size": [0.1, 1.0],
    "slope": [[0.0, 0.0], [1e-4, 0.0], [3.0, -2.0], [1e6, 1e3]],
    "slope_A": [[0.0, 0.0], [-3.0, 2.0], [1e6, 1e3]],
    "u": [*product([0.0, 0.25, 0.6, BELOW_1], [0.0, 1e-7, 0.5, BELOW_1])],
    "u3": [*product([0.0, BELOW_1, 0.3], [0.0, BELOW_1, 0.3], [0.0, BELOW_1, 0.5])],
    "rows": [[(a, b)] * 2 for a, b in product([0.0, 0.25, 0.6, BELOW_1], [0.0, 1e-7, 0.5, BELOW_1])],
    "eta": [0.5, 1 - 1e-6, 1.0, 1.5],
    "n_i": [1.0, 1.5],
    "n_o": [1.0, 1 + 1e-6, 2.5],
    "cos_i": [0.0, 1e-6, 0.3, float(np.sqrt(1 - 1 / 1.5**2)), 1.0, -1.0],
    "k": [0.0, 1e-3, 8.0],
    "f0": SHARES,
    "gamma": [1.1, 2.0, 30.0],
    "g1_i": SHARES,
    "g1_o": SHARES,
    "G2": SHARES,
    "F": SHARES,
    "D": [0.0, 1e-6, 1e7],
}


def corners(name: str, dtype=np.float32, table=None) -> dict[str, np.ndarray]:
    """Every combination of the arguments' corners where the function is defined and finite, rounded to the dtype."""
    table = CORNERS if table is None else table
    below_1 = float(1 - ml_dtypes.finfo(dtype).epsneg)
    columns = zip(*product(*(table[q] for q in FUNCTIONS[name].values())), strict=True)
    inputs = {}
    for (argument, quantity), column in zip(FUNCTIONS[name].items(), columns, strict=True):
        x = np.array(column)
        inputs[argument] = (np.minimum(x, below_1) if quantity in ("u", "u3", "rows") else x).astype(dtype)
    keep = finite(name, float(ml_dtypes.finfo(dtype).eps), **{a: x.astype(np.float64) for a, x in inputs.items()})
    return {a: x[keep] for a, x in inputs.items()}


def dots(a, b):
    return np.sum(a * b, axis=-1)


def finite(name: str, eps: float, **inputs) -> np.ndarray:
    """Rows where the exact result is finite: outside the poles that the docstrings name."""
    keep = np.ones(len(next(iter(inputs.values()))), bool)
    match name.rpartition(".")[2]:
        case "lambda_ggx" | "lambda_beckmann":
            keep = inputs["w"][:, 2] != 0
        case "reflection":
            keep = np.abs(dots(inputs["wo"], inputs["wm"])) > eps
        case "refraction" | "btdf":
            straight = np.all(inputs["wo"] == -inputs["wi"], axis=-1) & (inputs["n_i"] == inputs["n_o"])
            path = 1.0
            if "wm" in inputs:  # a microfacet seen along its edge from both sides: 0/0
                path = inputs["n_i"] * dots(inputs["wi"], inputs["wm"]) + inputs["n_o"] * dots(
                    inputs["wo"], inputs["wm"]
                )
            keep = ~straight & (np.abs(path) > 4 * eps)
    return keep


def shown(rows: np.ndarray, inputs: dict[str, np.ndarray]) -> str:
    """The first few rows that are not finite, with their inputs."""
    where = np.flatnonzero(~np.all(np.isfinite(rows), axis=1))
    few = [{a: x[i].tolist() for a, x in inputs.items()} | {"result": rows[i].tolist()} for i in where[:4]]
    return f"{len(where)} of {len(rows)} rows, such as {few}"


@pytest.mark.parametrize("name", FUNCTIONS)
def test_finite(name):
    inputs = corners(name)
    rows = numbers(over_rows(public(name), inputs))
    assert np.all(np.isfinite(rows)), shown(rows, inputs)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_gradient_is_finite(name):
    inputs = corners(name)
    rows = numbers(over_rows(gradient(public(name)), inputs))
    assert np.all(np.isfinite(rows)), shown(rows, inputs)


@pytest.mark.parametrize("form", [lambda w: jnp.sqrt(w[0] ** 2 + w[1] ** 2), lambda w: jnp.arccos(w[2])])
def test_a_plain_form_is_caught(form):
    """Lengths and angles in their plain form have no gradient at the normal."""
    inputs = {"w": np.array(DIRECTIONS, np.float32)}
    assert np.all(np.isfinite(numbers(over_rows(form, inputs))))
    assert not np.all(np.isfinite(numbers(over_rows(gradient(form), inputs))))


DENSITIES = [n for n in FUNCTIONS if n.split(".")[-1].startswith("pdf") or n.startswith("ndf.")]


@pytest.mark.parametrize("name", DENSITIES)
def test_density_is_not_negative(name):
    assert np.all(numbers(over_rows(public(name), corners(name))) >= 0)


# Where a number is 0 the slope is infinite, and the normal in the horizon; by the caps' construction it never is.
REACHES_THE_HORIZON = {"sampling.slope_ggx.sample", "sampling.slope_beckmann.sample", "sampling.lune.sample"}
SAMPLERS = [n for n in FUNCTIONS if n.split(".")[-1].startswith("sample")]


@pytest.mark.parametrize("name", SAMPLERS)
def test_sample_is_unit_and_above_the_horizon(name):
    """For every number in [0, 1), the largest below 1 and 0 too, but where rejection found nothing."""
    inputs = corners(name)
    wm = numbers(over_rows(public(name), inputs))
    if "rejection" in name:
        wm, inputs = wm[wm[:, 3] > 0], {a: x[wm[:, 3] > 0] for a, x in inputs.items()}
    # Rounding each component and the length: 4 half ulps of 1.
    np.testing.assert_allclose(np.linalg.norm(wm[:, :3], axis=1), 1, atol=2 * 2.0**-23)
    interior = np.ones(len(wm), bool)
    if name in REACHES_THE_HORIZON:
        assert np.all(wm[:, 2] >= 0)
        interior = np.all(inputs["u"] > 0, axis=1)
    assert np.all(wm[interior, 2] > 0), shown(np.where(wm[:, 2:3] > 0, 0, np.nan), inputs)


# float16 has no number between 6e-8 and 0 nor above 65504: its corners are those of a surface that it can describe.
HALF_DIRECTIONS = [
    N,
    polar(0.6, 2.1),
    polar(1e-3, -0.4),
    *HORIZON,
    polar(-1e-3, 0.9),
    polar(-0.3, -2.0),
    polar(-0.95, 0.1),
]
HALF_ALPHAS = [[0.02, 0.02], [2.0, 2.0], [2.0, 0.02], [1.0, 1.0], [0.3, 0.2]]
HALF_CORNERS = CORNERS | {
    **dict.fromkeys(["w", "wi", "wi_seeing", "wo", "wm", "wm_A"], HALF_DIRECTIONS),
    **dict.fromkeys(["wi_up", "wm_up"], HALF_DIRECTIONS[:3]),
    "alpha": HALF_ALPHAS,
    "A": shapes(HALF_ALPHAS),
    "scatter": [[[4e-4, 0.0], [0.0, 4e-4]], [[0.09, 0.02], [0.02, 0.04]]],
    "slope": [[0.0, 0.0], [0.05, 0.0], [3.0, -2.0]],
    "slope_A": [[0.0, 0.0], [-3.0, 2.0]],
    "D": [0.0, 1e-3, 1e3],
}
HALVES = {"f16": (np.float16, HALF_CORNERS), "bf16": (ml_dtypes.bfloat16, CORNERS)}
# Beside 65504 a square of an intermediate is beyond it.
OVERFLOWS = 0.5


@pytest.mark.slow
@pytest.mark.parametrize(("half", "table"), HALVES.values(), ids=HALVES)
@pytest.mark.parametrize("name", FUNCTIONS)
def test_half_precision_is_finite_where_the_value_is(name, half, table):
    inputs = {a: x.astype(half) for a, x in corners(name, half, table).items()}
    info = ml_dtypes.finfo(half)
    exact = numbers(over_rows(public(name), {a: x.astype(np.float64) for a, x in inputs.items()}))
    keep = np.all(np.abs(exact) < OVERFLOWS * float(info.max), axis=1)
    rows = numbers(over_rows(public(name), inputs))[keep]
    assert np.all(np.isfinite(rows)), shown(rows, {a: x[keep] for a, x in inputs.items()})


@pytest.mark.parametrize("alpha", [(0.5, 0.25), (1e-4, 1e-4), (10.0, 0.1)])
@pytest.mark.parametrize("height", [1e-6, 1e-12, 1e-17])
def test_brdf_of_opposite_directions_does_not_underflow(height, alpha):
    """h = (0, 0, 2z), whose fourth power is below float32's range: D of the normal, G2 and 1/(4 z²) give 1/(4π αx² αy z), about."""
    wi, wo = (jnp.asarray([x, 0, height], jnp.float32) for x in (1, -1))
    found = public("bsdf.brdf_ggx")(wi, wo, jnp.asarray(alpha, jnp.float32))
    length = np.hypot(alpha[0], height)
    np.testing.assert_allclose(found, 1 / (4 * np.pi * alpha[0] * alpha[1] * length * float(wi[2])), rtol=2e-6)


@pytest.mark.parametrize(("alpha", "height"), [(1e-4, 1e-30), (1e-2, 1e-35), (1e-8, 1e-20)])
def test_brdf_at_the_horizon_of_a_smooth_surface(alpha, height):
    """ω_i and ω_o a quarter turn apart: q is 1/α², and what divides is α³ z; its gradient is finite."""
    wi, wo = (jnp.asarray([x, 1 - x, height], jnp.float32) for x in (1, 0))
    brdf, alphas = public("bsdf.brdf_ggx"), jnp.full(2, alpha, jnp.float32)
    np.testing.assert_allclose(brdf(wi, wo, alphas), alpha / (4 * np.pi * height), rtol=2e-6)
    assert all(np.isfinite(slope).all() for slope in jax.grad(brdf, (0, 1, 2))(wi, wo, alphas))


@pytest.mark.parametrize(
    ("cosine", "eta", "k", "F"),
    [
        (1, 1e-20, 0, 1),
        (1, 2e-4, 0, 0.99920032),
        (0.5, 1, 1e7, 1),
        (0.5, 1e9, 0, 1),
        (0, 1, 0, 0),
        (0.3, 1, 0, 0),
        (1e-9, 1e9, 1e9, 0.5999999977374455),
    ],
)
def test_conductor_of_extreme_indices(cosine, eta, k, F):
    """The products in it go with the index to the ninth, and a small one cancels."""
    found = public("fresnel.conductor")(*(jnp.float32(x) for x in (cosine, eta, k)))
    np.testing.assert_allclose(found, F, rtol=1e-6)


def test_conductor_reflects_no_more_than_all():
    """Total reflection, where F is 1 but for its rounding."""
    rng = np.random.default_rng(3)
    cosine, eta = rng.uniform(0, 0.3, 4096).astype(np.float32), rng.uniform(0.05, 0.9, 4096).astype(np.float32)
    found = over_rows(public("fresnel.conductor"), {"cos_i": cosine, "eta": eta, "k": np.zeros_like(eta)})
    assert np.all(found <= 1) and np.all(found > 1 - 2e-6)
