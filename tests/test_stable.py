"""Each primitive against exact arithmetic, and the plain form that it replaces failing the same test."""

from fractions import Fraction

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flint import arb
from library import numbers

from ggxref import _kepler, _pairs, _special, _squares, bsdf, fresnel, geometry, ndf, stable
from ggxref._errorfree import fast_two_sum, two_product, two_sum
from ggxref.oracle.precision import working
from ggxref.sampling import ellipsoid_cap, normals

N = 400


def rng():
    return np.random.default_rng(11)


def epsilon(dtype) -> float:
    return float(jnp.finfo(dtype).eps)


def exact(f, *columns) -> np.ndarray:
    """`f` of each row of exact balls, to float64 and beyond: the high part and what it leaves out."""
    with working(200):
        return np.array([f(*(arb(float(x)) for x in row)) for row in zip(*columns, strict=True)], object)


def ulps(got, true, dtype) -> float:
    """Largest error in spacings of the dtype at the true value."""
    with working(200):
        errors = [
            float(abs(arb(float(g)) - t).mid()) / float(np.spacing(np.abs(np.asarray(float(t.mid()), dtype))))
            for g, t in zip(np.ravel(got), np.ravel(true), strict=True)
        ]
    return max(errors)


def perpendicular(dtype):
    """Unit vectors whose dot product is a rounding error or a little more."""
    r = rng()
    a = r.normal(size=(N, 3))
    b = np.cross(a, r.normal(size=(N, 3)))
    a, b = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (a, b))
    return a.astype(dtype), (b + a * np.exp(r.uniform(-40, -5, (N, 1)))).astype(dtype)


def rational(v):
    return [Fraction(float(x)) for x in v]


def dots(a, b) -> np.ndarray:
    sums = [sum(x * y for x, y in zip(rational(p), rational(q), strict=True)) for p, q in zip(a, b, strict=True)]
    return np.array([float(s) for s in sums])


def rounded_once(got, true, dtype, *, fold) -> bool:
    """The bound of a sum of a few products of unit vectors in `fold` times the precision, rounded once (Ogita et al. 2005)."""
    eps = epsilon(dtype)
    return bool(np.all(np.abs(np.asarray(got, np.float64) - true) <= eps * np.abs(true) + 16 * eps**fold))


def relative(got, true):
    return np.max(np.abs(np.asarray(got, np.float64) - true) / np.abs(true))


def test_dot_of_nearly_perpendicular_vectors(dtype):
    """One rounding of a sum in two or three times the precision; the plain sum keeps no digit."""
    a, b = perpendicular(dtype)
    true = dots(a, b)
    assert rounded_once(jax.jit(jax.vmap(stable.dot))(a, b), true, dtype, fold=2)
    assert not rounded_once(jax.jit(jax.vmap(jnp.dot))(a, b), true, dtype, fold=2)
    assert rounded_once(jax.jit(jax.vmap(stable.cosine))(a, b), true, dtype, fold=3)
    assert not rounded_once(jax.jit(jax.vmap(stable.dot))(a, b), true, dtype, fold=3)


def test_dot_of_half_precision_is_rounded_once():
    a, b = perpendicular(jnp.float16)
    true = dots(a, b)
    np.testing.assert_allclose(jax.vmap(stable.dot)(a, b).astype(float), true, rtol=2**-11, atol=2**-24)


def test_dot_has_the_plain_derivative(dtype):
    a, b, da, db = jnp.asarray(rng().normal(size=(4, 3)), dtype)
    _, change = jax.jvp(stable.dot, (a, b), (da, db))
    np.testing.assert_allclose(change, da @ b + a @ db, rtol=8 * epsilon(dtype))


def test_cross_of_nearly_parallel_vectors(dtype):
    """Their plain cross product has lost as many digits as they share."""
    a, b = perpendicular(dtype)
    b = (a + 1e-4 * b).astype(dtype)

    def true(p, q):
        (x, y, z), (u, v, w) = rational(p), rational(q)
        return [float(y * w - z * v), float(z * u - x * w), float(x * v - y * u)]

    expected = np.array([true(p, q) for p, q in zip(a, b, strict=True)])
    eps = epsilon(dtype)
    assert relative(jax.jit(jax.vmap(stable.cross))(a, b), expected) <= 2 * eps
    assert relative(jax.jit(jax.vmap(jnp.cross))(a, b), expected) > 100 * eps


def test_excess_of_length(dtype):
    """(w·w − 1)/2 of rounded unit vectors: the plain form rounds w·w to a few multiples of eps."""
    w = perpendicular(dtype)[0]
    true = np.array([float(sum(x * x for x in rational(v)) - 1) / 2 for v in w])
    assert rounded_once(jax.jit(jax.vmap(stable.excess))(w), true, dtype, fold=2)
    assert not rounded_once(jax.jit(jax.vmap(lambda w: (w @ w - 1) / 2))(w), true, dtype, fold=2)


def test_stretched_square(dtype):
    """Rounded once, for a length that is 1 only to the dtype; the plain form is not."""
    w = perpendicular(dtype)[0]
    alpha = np.exp(rng().uniform(-9, 1, (N, 2))).astype(dtype)

    def square(x, y, z, ax, ay):
        return ((x / ax) ** 2 + (y / ay) ** 2 + z**2) / (x**2 + y**2 + z**2)

    def plain(w, alpha):
        return (w[0] / alpha[0]) ** 2 + (w[1] / alpha[1]) ** 2 + w[2] ** 2

    true = exact(square, *w.T, *alpha.T)
    assert ulps(jax.jit(jax.vmap(_squares.stretched_square))(w, alpha), true, dtype) < 1
    assert ulps(jax.jit(jax.vmap(plain))(w, alpha), true, dtype) > 2
    assert jnp.isfinite(_squares.stretched_square(jnp.zeros(3, dtype), jnp.ones(2, dtype)))


def test_scaled_square(dtype):
    """Rounded once; the plain form is not."""
    w = perpendicular(dtype)[0]
    alpha = np.exp(rng().uniform(-9, 1, (N, 2))).astype(dtype)

    def square(x, y, ax, ay):
        return (ax * x) ** 2 + (ay * y) ** 2

    true = exact(square, *w[:, :2].T, *alpha.T)
    assert ulps(jax.jit(jax.vmap(_squares.scaled_square))(w, alpha), true, dtype) < 0.6
    assert ulps(jax.jit(jax.vmap(lambda w, a: square(w[0], w[1], *a)))(w, alpha), true, dtype) > 1


def test_log1p(dtype):
    x = rng().uniform(-0.999, 1, 4 * N).astype(dtype)
    assert ulps(jax.jit(jax.vmap(_special.log1p))(x), exact(lambda x: x.log1p(), x), dtype) < 3


def test_square_root_has_no_infinite_derivative(dtype):
    slope = jax.vmap(jax.grad(stable.sqrt))(jnp.asarray([0, 4], dtype))
    np.testing.assert_array_equal(slope, [0, 0.25])
    assert not np.isfinite(jax.grad(jnp.sqrt)(jnp.asarray(0, dtype)))


def test_rsqrt(dtype):
    """Two binades hold every case: the guess and the steps repeat with each factor of 4. The ends of the range, too."""
    if dtype == np.float32:
        x = np.arange(2**23, 3 * 2**23, dtype=np.uint32).view(np.float32) * np.float32(2**126)
    else:
        x = 2 ** rng().uniform(0, 2, N)
    x = np.concatenate([x, [np.finfo(dtype).tiny, np.finfo(dtype).max]]).astype(dtype)
    wide = np.longdouble if dtype == np.float64 else np.float64
    true = 1 / np.sqrt(x.astype(wide))
    got = np.asarray(jax.jit(jax.vmap(stable.rsqrt))(x)).astype(wide)
    assert np.max(np.abs(got - true) / np.spacing(true.astype(dtype)).astype(wide)) < 1
    assert np.isnan(stable.rsqrt(jnp.asarray(np.nan, dtype)))
    slope = jax.vmap(jax.grad(stable.rsqrt))(jnp.asarray([0.25, 9], dtype))
    np.testing.assert_allclose(slope, [-4, -1 / 54], rtol=4 * epsilon(dtype))


@pytest.mark.parametrize("form", [stable.unit, stable.direction], ids=["unit", "direction"])
def test_unit(form, dtype):
    v = rng().normal(size=(N, 3)).astype(dtype)
    w = numbers(jax.vmap(form)(*v.T)).reshape(N, 3)
    np.testing.assert_allclose(np.linalg.norm(w, axis=1), 1, atol=3 * epsilon(dtype))
    np.testing.assert_allclose(np.cross(w, v), 0, atol=4 * epsilon(dtype) * np.max(np.abs(v)))


@pytest.mark.parametrize("form", [stable.unit, stable.direction], ids=["unit", "direction"])
def test_unit_of_the_zero_vector_is_zero_with_a_zero_gradient(form, dtype):
    zero = jnp.zeros((), dtype)
    value, slope = jax.value_and_grad(lambda x: jnp.sum(jnp.stack(tuple(form(x, zero, zero)))))(zero)
    assert value == 0
    assert np.isfinite(slope)


def test_half_precision_is_normalised_in_float32():
    """1e-4 squared is 0 in float16."""
    x = jnp.asarray(1e-4, jnp.float16)
    assert x * x == 0
    w = stable.direction(x, 0 * x, x)
    assert w.dtype == jnp.float16
    np.testing.assert_allclose(w.astype(float), [np.sqrt(0.5), 0, np.sqrt(0.5)], rtol=2**-10)


def test_azimuth(dtype):
    x, y = rng().normal(size=(2, N)).astype(dtype)
    c, s = jax.vmap(stable.azimuth)(x, y)
    np.testing.assert_allclose(np.arctan2(s, c), np.arctan2(y, x), atol=4 * epsilon(dtype))
    zero = jnp.zeros((), dtype)
    assert stable.azimuth(zero, zero, pole=(0.0, -1.0)) == (0, -1)


def test_sums_with_a_constant_keep_their_rest(dtype):
    """XLA makes one of the constants of a sum: of (x + 1) - 1, x."""
    x = (np.exp(rng().uniform(-12, 0, N)) * rng().choice([-1, 1], N)).astype(dtype)
    forms = (lambda x: two_sum(jnp.ones_like(x), x), lambda x: two_sum(x, jnp.ones_like(x)),
             lambda x: fast_two_sum(jnp.ones_like(x), x))  # fmt: skip
    for form in forms:
        pairs = zip(*map(rational, jax.jit(form)(x)), strict=True)
        assert [value + rest for value, rest in pairs] == [1 + c for c in rational(x)]


def test_cos_sin_turn(dtype):
    """Near half a turn the sine of a rounded 2πu has only the digits that π u keeps of u − 1/2."""
    u = np.concatenate([rng().uniform(0, 1, N), 0.5 + np.exp(rng().uniform(-12, -2, N))]).astype(dtype)

    def pair(u):
        sin, cos = (2 * u).sin_cos_pi()
        return cos, sin

    true = np.array([*exact(pair, u)])
    assert ulps(np.stack(jax.jit(jax.vmap(_special.cos_sin_turn))(u), axis=1), true, dtype) < 2.5
    plain = jax.jit(lambda u: (jnp.cos(2 * np.pi * u), jnp.sin(2 * np.pi * u)))(u)
    assert ulps(np.stack(plain, axis=1), true, dtype) > 100


def test_two_word_turn(dtype):
    """Value and rest together, to 0.4 ε; its derivative is a right angle ahead, 2π times as long."""
    u = rng().uniform(0, 1, N).astype(dtype)
    turn = jax.vmap(_special.two_word_turn)
    words = jax.jit(lambda u: jax.vmap(stable.one_loop)(*sum(turn(u), ())))(u)
    c, c_rest, s, s_rest = ([arb(float(x)) for x in word] for word in words)
    with working(200):
        for k, angle in enumerate(u):
            sin, cos = (2 * arb(float(angle))).sin_cos_pi()
            for value, rest, true in ((c[k], c_rest[k], cos), (s[k], s_rest[k], sin)):
                assert abs(value + rest - true) < 0.4 * epsilon(dtype)
    (dc, _), (ds, _) = jax.jvp(turn, (u,), (np.ones_like(u),))[1]
    np.testing.assert_allclose([dc, ds], 2 * np.pi * np.array([-words[2], words[0]]), rtol=4 * epsilon(dtype))


def test_cos_sin_turn_of_quarters(dtype):
    c, s = jax.vmap(_special.cos_sin_turn)(jnp.asarray([0, 0.25, 0.5, 0.75], dtype))
    np.testing.assert_array_equal(c, [1, 0, -1, 0])
    np.testing.assert_array_equal(s, [0, 1, 0, -1])


def scaled_ierfc(a: arb) -> arb:
    """exp(a²) ierfc(a)."""
    return 1 / arb.pi().sqrt() - a * (a * a).exp() * a.erfc()


def chebyshev(function, count: int, nodes: int = 96) -> list[float]:
    """Coefficients of the series of a smooth function on [-1, 1], by the discrete cosine transform."""
    angles = [(arb(2 * k + 1) / (2 * nodes)) for k in range(nodes)]
    values = [function(angle.cos_pi()) for angle in angles]
    sums = (sum((y * (j * a).cos_pi() for y, a in zip(values, angles, strict=True)), arb(0)) for j in range(count))
    return [float((s * (1 if j == 0 else 2) / nodes).mid()) for j, s in enumerate(sums)]


def test_ierfc_coefficients():
    """The Chebyshev series of √π (1 + √π a + 2a²) exp(a²) ierfc(a) in t = (a − 3)/(a + 3), and the constants in two words."""

    def function(t):
        a = 3 * (1 + t) / (1 - t)
        return arb.pi().sqrt() * (1 + arb.pi().sqrt() * a + 2 * a * a) * scaled_ierfc(a)

    with working(400):
        *true, first_left_out = chebyshev(function, len(_special._IERFC) + 1)
        (rest,) = chebyshev(lambda t: function(t) - _special._IERFC[0], 1)
        root_rest = float((arb.pi().sqrt() - _special._ROOT_PI).mid())
    np.testing.assert_allclose(_special._IERFC, true, rtol=1e-15, atol=1e-19)
    np.testing.assert_allclose([_special._IERFC_REST, _special._ROOT_PI_REST], [rest, root_rest], rtol=1e-15)
    assert abs(first_left_out) < 2**-53


def test_half_ierfc(dtype):
    """a² in two words keeps the digits of the exponential; `a` alone, rounded, does not."""
    a = np.concatenate([rng().uniform(0, 9, N), [0.0]]).astype(dtype)

    def half(a, square):
        (top, top_rest), (bottom, bottom_rest), k = _special.half_ierfc(a, square)
        return (top + top_rest) / (bottom + bottom_rest) * _special.power_of_two(-k)

    def graded(square):
        return ulps(jax.jit(jax.vmap(lambda a: half(a, square(a))))(a), true, dtype)

    true = exact(lambda a: scaled_ierfc(a) * (-a * a).exp() / 2, a)
    assert graded(lambda a: two_product(a, a)) < 3  # the quotient and its two sums round, and `a` did
    assert graded(lambda a: (a * a, jnp.zeros_like(a))) > 10


def test_exponential_in_two_words(dtype):
    """To the ends of the range and beyond, where the power of two is 0 and the rest is not."""
    x = np.concatenate([rng().uniform(0, 80, N), [0.0, 80, 2000]]).astype(dtype)
    rest = (rng().uniform(-0.5, 0.5, len(x)) * np.spacing(x)).astype(dtype)
    m, m_rest, k = jax.jit(jax.vmap(_special.exp_minus))(x, rest)
    scaled = exact(lambda x, r, k: (k * arb.const_log2() - x - r).exp(), x, rest, k)
    with working(200):
        error = max(abs(arb(float(a)) + float(b) - t) for a, b, t in zip(m, m_rest, scaled, strict=True))
    assert error < 0.25 * epsilon(dtype)
    np.testing.assert_array_equal(jax.vmap(_special.power_of_two)(-k)[-3:], [1, 2.0 ** -float(k[-2]), 0])


def test_reciprocal(dtype):
    x = np.exp(rng().uniform(-80, 80, N)).astype(dtype)
    assert ulps(jax.jit(jax.vmap(stable.reciprocal))(x), exact(lambda x: 1 / x, x), dtype) <= 1


def test_gaussian_tails(dtype):
    """The two terms of the scaled ierfc agree in all but 1/2a² of themselves: their difference loses as much."""
    a = np.exp(rng().uniform(-8, 4, N)).astype(dtype)
    tail, integral = jax.jit(jax.vmap(_special.gaussian_tails))(a)
    true = exact(scaled_ierfc, a)
    assert ulps(tail, exact(lambda a: (a * a).exp() * a.erfc(), a), dtype) < 16
    assert ulps(integral, true, dtype) < 8
    assert ulps(1 / np.sqrt(np.pi).astype(dtype) - a * np.asarray(tail), true, dtype) > 1e3


def eccentric_anomaly(v: arb) -> arb:
    """The root E of E − sin E = 2πv."""
    E = arb((12 * np.pi * float(v.mid())) ** (1 / 3))
    for _ in range(12):
        E = (E - (E - E.sin() - 2 * arb.pi() * v) / (1 - E.cos())).mid()
    return E


def test_kepler_coefficients():
    """The Chebyshev series of the two odd functions, of v^(1/3) up to 1/2 and of 1/2 − v up to 3/8, over their argument."""

    def near(t):
        w = ((1 + t) / 8).sqrt()
        return eccentric_anomaly((w**3).mid()) / (4 * arb.pi() * w)

    def far(t):
        d = (9 * (1 + t) / 128).sqrt()
        return (arb.pi() - eccentric_anomaly((arb(1) / 2 - d).mid())) / (4 * arb.pi() * d)

    tables = (_kepler._KEPLER_NEAR, _kepler._KEPLER_FAR)
    for function, table, rest in zip((near, far), tables, _kepler._KEPLER_RESTS, strict=True):
        with working(400):
            *true, first_left_out = chebyshev(function, len(table) + 1, 64)
            (beyond,) = chebyshev(lambda t, f=function, first=table[0]: f(t) - first, 1, 64)
        np.testing.assert_allclose(table, true, rtol=1e-15, atol=1e-19)
        np.testing.assert_allclose(rest, beyond, rtol=1e-15)
        assert abs(first_left_out) < 2**-53 * table[0]


def test_kepler(dtype):
    """E − sin E = 2πv; both sides vanish as E³/6, and cos E/2 at v = 1/2, where plain differences would be 0."""
    v = np.exp(rng().uniform(-30, np.log(0.5), N))
    v[::2] = 0.5 - v[::2] / 1.01
    v = np.concatenate([v, np.exp(rng().uniform(-80, -30, 64))]).astype(dtype)
    c, s = jax.jit(jax.vmap(_kepler.kepler))(v)

    def corrected(c, s, v):  # Newton's step from the result is its error
        E = 2 * arb.atan2(s, c)
        return E - (E - E.sin() - 2 * arb.pi() * v) / (1 - E.cos())

    # Half of it is the last rounding. With an angle of one word, 1.6 ulp.
    assert ulps(c, exact(lambda *a: (corrected(*a) / 2).cos(), c, s, v), dtype) < 1
    assert ulps(s, exact(lambda *a: (corrected(*a) / 2).sin(), c, s, v), dtype) < 1
    E = 2 * np.arctan2(np.asarray(s), np.asarray(c))
    assert ulps(np.cos(E / 2), exact(lambda *a: (corrected(*a) / 2).cos(), c, s, v), dtype) > 1e2


def test_kepler_derivative(dtype):
    v = np.array([1e-6, 0.1, 0.25, 0.49], dtype)
    c, s = (np.asarray(x, np.float64) for x in jax.vmap(_kepler.kepler)(v))
    by_c, by_s = jax.vmap(jax.jacfwd(_kepler.kepler))(v)
    np.testing.assert_allclose(by_c, -np.pi / (2 * s), rtol=16 * epsilon(dtype))
    np.testing.assert_allclose(by_s, np.pi * c / (2 * s * s), rtol=16 * epsilon(dtype))
    assert jax.jacfwd(_kepler.kepler)(jnp.asarray(0, dtype)) == (0, 0)


def test_one_loop_changes_nothing(dtype):
    """Bit for bit, with NaN, infinities and the sign of 0; its derivative is 1."""
    rows = np.array([[0.1, -0.0, np.inf], [np.nan, 3e-37, -np.inf], [-2.5, 1e30, 0.0]], dtype)
    mapped = jax.vmap(stable.one_loop)
    for form in (mapped, jax.jit(mapped)):
        np.testing.assert_array_equal(np.stack(form(*jnp.asarray(rows))).view(np.uint8), rows.view(np.uint8))
    out, change = jax.jvp(mapped, tuple(jnp.asarray(rows)), tuple(jnp.asarray(-rows)))
    np.testing.assert_array_equal(np.stack(out), rows)
    np.testing.assert_array_equal(np.stack(change), -rows)


def test_either_picks_whole_vectors():
    one, other = jnp.arange(3.0), -jnp.arange(3.0)
    picked = jax.vmap(stable.either, (0, None, None))(jnp.array([True, False]), one, other)
    np.testing.assert_array_equal(picked, [one, other])


@pytest.mark.parametrize("half", [jnp.float16, jnp.bfloat16])
def test_half_precision_beside_single_is_widened(half):
    """Every argument alone in half precision: the result has the dtype of all together."""
    w, alpha, A, u = (np.asarray(x, np.float32) for x in ((0.6, 0, 0.8), (0.5, 0.25), np.eye(3), (0.25, 0.5)))
    calls = [(ndf.ellipsoid, w, A), (ndf.beckmann, w, alpha), (normals.sample_ggx, u, alpha)]
    for function, *args in [*calls, (ellipsoid_cap.sample, u, w, A)]:
        whole = function(*map(jnp.asarray, args))
        for k in range(len(args)):
            mixed = [jnp.asarray(x, half if j == k else np.float32) for j, x in enumerate(args)]
            got = function(*mixed)
            assert got.dtype == jnp.float32
            np.testing.assert_allclose(got, whole, rtol=0.1, atol=0.01)  # w of bfloat16 has three digits


@pytest.mark.parametrize("half", [jnp.float16, jnp.bfloat16])
@pytest.mark.parametrize("x64", [False, True])
def test_a_number_beside_half_precision_leaves_it_half(half, x64):
    """A Python number has no dtype of its own: F = 1 beside float16 is float16's."""
    with jax.enable_x64(x64):
        g, w = jnp.asarray(0.5, half), jnp.asarray([0.6, 0.0, 0.8], half)
        assert bsdf.weight_visible(g, g, 1.0).dtype == half
        assert fresnel.schlick(g, 0.04).dtype == half and fresnel.conductor(g, 0.2, 3.5).dtype == half
        assert geometry.refract(w, w, 1 / 1.5).dtype == half


def test_roots_of_pairs_pass_nan_on_and_are_0_of_what_rounding_made_negative():
    nan, zero = jnp.asarray(jnp.nan, jnp.float32), jnp.zeros((), jnp.float32)
    assert jnp.isnan(_pairs.square_root((nan, zero))[0])
    assert _pairs.square_root((zero - 1e-9, zero)) == (0, 0)
