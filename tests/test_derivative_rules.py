"""Derivatives against difference quotients of the oracle, in float64, each argument for itself, by forward and by reverse mode;
and second derivatives by each pair of arguments. For the rules of differentiation that are written by hand.

`test_gradients.py` moves all arguments at once: there a wrong term may hide behind a larger one.
"""

from itertools import combinations_with_replacement

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from exact import BITS, STEP, leaves, moved
from library import hastily, public

from ggxref import fresnel
from ggxref.measure.accuracy import arguments
from ggxref.measure.derivatives import points
from ggxref.measure.regions import DIRECTIONS
from ggxref.measure.tables import DRAWS
from ggxref.oracle.precision import exact, lookup, raised

# Function -> the regions from which its points are. Of the first table, second derivatives as well.
TWICE = {
    "fresnel.dielectric": "typical grazing",
    "fresnel.conductor": "typical grazing",
    "fresnel.schlick": "typical grazing",
    "ellipsoid.canonical": "typical skew smooth",
    "ellipsoid.from_slopes": "typical skew smooth",
    "ndf.ggx": "typical smooth",
    "ndf.beckmann": "lobe smooth",
    "ndf.student_t": "lobe smooth",
    "ndf.ellipsoid": "typical skew smooth",
    "masking.lambda_ggx": "typical smooth",
    "masking.g1_ggx": "typical smooth",
    "masking.g2_height_correlated": "typical",
    "bsdf.brdf_ggx": "typical smooth",
    "sampling.cross_section.sample": "typical anisotropic",
    "sampling.ellipsoid_bounded.bound": "typical skew smooth",
    "sampling.lune.sample": "typical skew",
}
ONCE = {
    "ellipsoid.lune_area": "typical skew smooth",
    "slopes.ellipsoid": "typical skew smooth",
    "masking.g1_ellipsoid": "typical skew smooth",
    "masking.g1_beckmann": "rough",
    "geometry.half_refraction": "typical grazing",
    "jacobian.refraction": "typical grazing",
    "sampling.v_cavity.pdf": "typical smooth",
}
CASES = TWICE | ONCE
COUNT = 2  # points a region
# Errors over the sum of the terms of each derivative. Measured at most 1.8e-14 and 3e-14, both of the BRDF of smooth surfaces.
FIRST, SECOND = 1e-12, 1e-12


def flat(function, draws):
    """All numbers of the result, with directions normalised before, as the oracle does."""

    def numbers(*args):
        on_sphere = [a / jnp.sqrt(jnp.sum(a * a)) if d in DIRECTIONS else a for a, d in zip(args, draws, strict=True)]
        return jnp.concatenate([jnp.ravel(x) for x in jax.tree.leaves(function(*on_sphere))])

    return numbers


def derivatives(function, args, draws, twice: bool):
    """By forward mode, by reverse mode, and second ones or None: for each argument (points, out, in) or, for two, (…, in, in)."""
    numbers, every = flat(function, draws), tuple(range(len(draws)))

    def once(*args):
        return jax.jacfwd(numbers, every)(*args), jax.jacrev(numbers, every)(*args), None

    def again(*args):
        def first(*args):
            reverse = jax.jacrev(numbers, every)(*args)
            return (numbers(*args), reverse), reverse

        (forward, second), reverse = jax.jacfwd(first, every, has_aux=True)(*args)
        return forward, reverse, second

    with jax.enable_x64(True):
        return jax.tree.map(np.asarray, hastily(jax.vmap(again if twice else once), args))


def change(rng, draw, x):
    """A way to move: a direction in its tangent plane, the rest in proportion."""
    if draw in DIRECTIONS:
        return np.cross(x, rng.normal(size=3))
    factors = rng.uniform(-1, 1, x.shape)
    return x * (factors + factors.T if draw == "scatter" else factors)


def difference(name, inputs, ways):
    """The oracle's central difference along each of the ways, (argument, change), in turn: a float for each number."""
    start, ways = {a: exact(x) for a, x in inputs.items()}, [(a, exact(way)) for a, way in ways]

    def along(point, ways):
        if not ways:
            return [*leaves(lookup(name)(**point))]
        (a, way), *others = ways
        above, below = (along(point | {a: moved(point[a], way, sign * STEP)}, others) for sign in (1, -1))
        return [(p - q) / (2 * STEP) for p, q in zip(above, below, strict=True)]

    return raised(lambda: np.array([float(x.mid()) for x in along(start, ways)]), 2 * BITS, name, inputs)


def relative(block, ways, expected):
    """Error of a block of derivatives applied to the ways, over the sum of its terms: of the worst number of the result."""
    terms = block.reshape(len(block), *(way.size for way in ways))
    for axis, way in enumerate(ways, start=1):
        terms = terms * way.reshape([-1 if k == axis else 1 for k in range(terms.ndim)])
    inner = tuple(range(1, terms.ndim))
    miss, size = np.abs(terms.sum(inner) - expected), np.abs(terms).sum(inner)
    return np.max(miss / np.where(size > 0, size, np.where(miss > 0, miss, 1)))


def errors(name, function):
    """Worst error of the derivatives of `function`, which stands for the public one: of first ones and of second ones."""
    names, draws = arguments(public(name)), DRAWS.get(name, arguments(public(name)))
    rng = np.random.default_rng([7, *name.encode()])
    drawn = [points(region, rng, COUNT) for region in CASES[name].split()]
    args = [np.moveaxis(np.concatenate([p[draw] for p in drawn], axis=-1), -1, 0) for draw in draws]
    forward, reverse, second = derivatives(function, args, draws, name in TWICE)
    seen, once, twice = np.zeros(len(names)), [], [0.0]
    for k in range(len(args[0])):
        inputs = {n: a[k] for n, a in zip(names, args, strict=True)}
        ways = [np.asarray(change(rng, draw, a[k])) for draw, a in zip(draws, args, strict=True)]
        for i, way in enumerate(ways):
            expected = difference(name, inputs, [(names[i], way)])
            seen[i] += np.abs(expected).max()
            once += [relative(block[i][k], [way], expected) for block in (forward, reverse)]
        for i, j in combinations_with_replacement(range(len(names)), 2) if second else ():
            expected = difference(name, inputs, [(names[i], ways[i]), (names[j], ways[j])])
            twice.append(relative(second[i][j][k], [ways[i], ways[j]], expected))
    # G1 knows of the micronormal only which side it shows.
    assert all(x > 0 for x, n in zip(seen, names, strict=True) if (name[:10], n) != ("masking.g1", "wm")), seen
    return max(once), max(twice)


@pytest.mark.parametrize("name", CASES)
def test_rule(name):
    once, twice = errors(name, public(name))
    assert once < FIRST and twice < SECOND


def test_a_small_wrong_term_is_caught():
    @jax.custom_jvp
    def wrong(cos_i, f0):
        return fresnel.schlick(cos_i, f0)

    @wrong.defjvp
    def rule(primals, tangents):
        value, change = jax.jvp(fresnel.schlick, primals, tangents)
        return value, change + 1e-8 * primals[1] * tangents[1]

    assert FIRST < errors("fresnel.schlick", wrong)[0] < 1e-6


def test_a_derivative_held_constant_is_caught():
    """By the second derivatives, the first being right."""

    @jax.custom_jvp
    def held(cos_i, f0):
        return fresnel.schlick(cos_i, f0)

    @held.defjvp
    def rule(primals, tangents):
        by_c, by_f0 = jax.lax.stop_gradient(jax.grad(fresnel.schlick, (0, 1))(*primals))
        return fresnel.schlick(*primals), jnp.asarray(by_c * tangents[0] + by_f0 * tangents[1])

    once, twice = errors("fresnel.schlick", held)
    assert once < FIRST and twice == 1


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
def test_dielectric_of_a_small_index(dtype):
    """Where cosine and index are small, V⁴ is 0 in float32, and its expansion about U loses all digits; float64 has them."""
    eta, shares = np.meshgrid([1e-3, 1e-2, 0.1] if dtype == np.float16 else [1e-12, 1e-6, 1e-2], [0.0, 0.3, 0.9, 4.0])
    args = [(eta * shares).ravel().astype(dtype), eta.ravel().astype(dtype)]
    slopes = jax.jit(jax.vmap(jax.grad(fresnel.dielectric, (0, 1))))
    found = np.array(slopes(*args), np.float64)
    with jax.enable_x64(True):
        expected = np.array(slopes(*(a.astype(np.float64) for a in args)))
    np.testing.assert_allclose(found, expected, rtol=2e-3 if dtype == np.float16 else 1e-5)
