"""The renderer against deterministic quadrature, energy, and itself by other strategies and samplers."""

import math
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose

from ggxref.scene import lights, materials, render, shapes
from ggxref.scene.materials import Kind, Rows

# A mean of n samples misses its expectation by more than 5 standard errors once in 1.7 million times; the seeds are fixed.
ERRORS = 5.0


def f32(*values):
    return jnp.array(values[0] if len(values) == 1 else values, jnp.float32)


def row(alpha=(0.3, 0.5), g2=1, albedo=0.0, skew=(0.0, 0.0)):
    A = np.diag([*alpha, 1.0])
    A[2, :2] = skew
    shape = {"alpha": f32([alpha]), "A": f32(A)[None], "turn": f32([[1.0, 0.0]])}
    single = {"eta": 1.5, "k": 0.0, "f0": 0.8, "albedo": albedo}
    forms = dict.fromkeys(materials.FORMS, jnp.zeros(1, jnp.int32)) | {"g2": jnp.full(1, g2)}
    return Rows(**shape, **{name: f32([value]) for name, value in single.items()}, **forms)


# Two forms of G2 in one kind, chosen by the row: compiled once for all tests.
ROUGH = Kind(g2=("separable", "height_correlated"), fresnel=("schlick",))
PLANE = shapes.Plane(f32(0, 0, 0), f32(0, 0, 1), f32(1, 0, 0), jnp.int32(0))
SPHERE = shapes.Sphere(f32(0, 0, 0), f32(1.0), jnp.int32(0))
SLAB = shapes.Slab(f32(-1, -1, -0.2), f32(1, 1, 0.2), jnp.int32(0))
GRADIENT = lights.Sky(f32(0.1), f32(1.0))
WHITE = lights.Sky(f32(1.0), f32(1.0))
SUN = lights.Sun(f32(0.0, 0.6, 0.8), f32(math.radians(10)), f32(20.0))
AREA = lights.Area(f32(0, 2, 2), f32(1, 0, 0), f32([0, -1, 1]), f32(5.0))
BACK = lights.Area(f32(0, -2, 2), f32(1, 0, 0), f32([0, 1, 1]), f32(5.0))  # shines away: dark, but samples go there
VIEW = np.array([0.0, -math.sin(1.2), math.cos(1.2)])  # 69° off the normal, where the forms of G2 part


def picture(kind, rows, shape, sky, *, samples=4096, fov=1e-3, seed=1, **settings):
    """A 4x4 picture: of one direction, or with a wide `fov` of the whole shape."""
    world = render.World(render.look(tuple(4 * VIEW), (0, 0, 0), fov, 4, 4), (shape,), sky, (rows,))
    return render.render((kind,), world, render.Settings(4, 4, lanes=1 << 10, **settings), samples=samples, seed=seed)


def estimate(*arguments, **keywords):
    """Mean radiance of the picture and its standard error."""
    p = picture(*arguments, **keywords)
    return p.mean.mean(), math.sqrt(p.variance.mean() / (16 * p.samples))


def quadrature(kind, rows):
    """∫ f cos θ L dω over the upper hemisphere under the gradient sky: 400 × 400 midpoints in (cos θ, φ)."""
    n = 400
    z, phi = (np.stack(np.meshgrid(np.arange(n) + 0.5, np.arange(n) + 0.5)) / n).reshape(2, -1)
    wo = np.stack([np.sqrt(1 - z * z) * np.cos(2 * np.pi * phi), np.sqrt(1 - z * z) * np.sin(2 * np.pi * phi), z])
    single = Rows(*(field[0] for field in rows))
    wi = f32(VIEW)
    value, _ = jax.vmap(lambda w: materials.evaluate(kind, single, wi, w), -1)(f32(wo))
    return float(np.mean(np.asarray(value, float) * (0.1 + 0.9 * (1 + z) / 2)) * 2 * np.pi)


def test_one_bounce_is_the_integral():
    mean, error = estimate(ROUGH, row(), PLANE, (GRADIENT,))
    assert abs(mean - quadrature(ROUGH, row())) < ERRORS * error


def test_one_bounce_can_fail():
    """A picture with the separable G2 must not pass for the correlated one."""
    mean, error = estimate(ROUGH, row(g2=0), PLANE, (GRADIENT,))
    assert abs(mean - quadrature(ROUGH, row())) > 2 * ERRORS * error
    assert abs(mean - quadrature(ROUGH, row(g2=0))) < ERRORS * error


def test_strategies_agree():
    """Light and BSDF sampling share one integral, and a wrong light density would part them."""
    matte, sky = Kind("diffuse", sampler=""), (GRADIENT, SUN, AREA, BACK)
    found = [
        estimate(matte, row(albedo=0.5), PLANE, sky, strategy=name, samples=8192) for name in ("bsdf", "light", "mis")
    ]
    for mean, error in found[:2]:
        assert abs(mean - found[2][0]) < ERRORS * math.hypot(error, found[2][1])
    # Sun and rectangle are a good part of it: without them it is another picture.
    fewer, error = estimate(matte, row(albedo=0.5), PLANE, (GRADIENT,))
    assert fewer < 0.8 * found[2][0]


@pytest.mark.slow
@pytest.mark.parametrize("sampler", ["normals", "v_cavity", "slope_ggx", "cross_section", "bounded_cap"])
def test_samplers_agree(sampler):
    mean, error = estimate(replace(ROUGH, sampler=sampler), row(alpha=(0.4, 0.15)), PLANE, (GRADIENT,), strategy="bsdf")
    expected = quadrature(ROUGH, row(alpha=(0.4, 0.15)))
    assert abs(mean - expected) < ERRORS * error


@pytest.mark.slow
@pytest.mark.parametrize("sampler", ["lune", "ellipsoid_cap", "ellipsoid_bounded"])
def test_skewed_samplers_agree(sampler):
    kind = replace(ROUGH, ndf="ellipsoid", sampler=sampler)
    rows = row(alpha=(0.3, 0.2), skew=(0.1, -0.2))
    mean, error = estimate(kind, rows, PLANE, (GRADIENT,), strategy="bsdf")
    assert abs(mean - quadrature(kind, rows)) < ERRORS * error


@pytest.mark.slow
def test_diffuse_part_is_added():
    mean, error = estimate(replace(ROUGH, diffuse=True), row(albedo=0.5), PLANE, (GRADIENT,))
    assert abs(mean - quadrature(replace(ROUGH, diffuse=True), row(albedo=0.5))) < ERRORS * error
    assert mean > quadrature(ROUGH, row()) + 0.1


def test_white_furnace_of_diffuse_is_one():
    p = picture(Kind("diffuse", sampler=""), row(albedo=1.0), SPHERE, (WHITE,), fov=0.7)
    # Light samples are exact only on average: a pixel's mean of 4096 has an error below 1 %.
    assert_allclose(p.mean, 1, atol=ERRORS * p.error.max())
    assert p.error.max() < 0.01


@pytest.mark.slow
def test_underside_has_the_same_microsurface():
    """A surface with one material on both sides, seen from below with all directions reversed, looks as from above."""
    kind, rows = replace(ROUGH, ndf="ellipsoid", sampler="ellipsoid_cap"), row(alpha=(0.3, 0.2), skew=(0.1, -0.3))
    above, error_above = estimate(kind, rows, PLANE, (GRADIENT,))
    reverse = lights.Sky(GRADIENT.top, GRADIENT.bottom)
    camera = render.look(tuple(-4 * VIEW), (0, 0, 0), 1e-3, 4, 4)
    p = render.render((kind,), render.World(camera, (PLANE,), (reverse,), (rows,)), render.Settings(4, 4, lanes=1 << 10),
                      samples=4096, seed=1)  # fmt: skip
    error = math.sqrt(p.variance.mean() / (16 * p.samples))
    assert abs(p.mean.mean() - above) < ERRORS * math.hypot(error, error_above)
    other, error_other = estimate(kind, row(alpha=(0.3, 0.2), skew=(0.1, 0.3)), PLANE, (GRADIENT,))
    assert abs(other - above) > ERRORS * math.hypot(error_other, error_above)  # the skew can be told


def test_batches_are_independent_pictures():
    """Their mean is one picture's within errors, and no two are alike."""
    batches = picture(Kind("diffuse", sampler=""), row(albedo=1.0), SPHERE, (WHITE,), fov=0.7, batches=3)
    assert batches.mean.shape == (3, 4, 4)
    assert_allclose(batches.mean, 1, atol=ERRORS * batches.error.max())
    assert not np.isclose(batches.mean[0], batches.mean[1], atol=1e-7).all()


def test_bounces_of_a_convex_ball():
    """A ray that hits a convex ball sends one on, which leaves: two a path."""
    ball = picture(Kind("diffuse", sampler=""), row(albedo=1.0), SPHERE, (WHITE,), fov=0.3)
    assert_allclose(ball.bounces, 2)


GLASS = Kind("dielectric", g2=("separable",))


def test_furnace_of_smooth_glass_is_one_and_of_rough_glass_less():
    """Unbounded paths: glass absorbs nothing; G2 loses what a second bounce on the microsurface would keep."""
    smooth, error = estimate(GLASS, row(alpha=(1e-3, 1e-3)), SLAB, (WHITE,), fov=0.3)
    assert abs(smooth - 1) < 0.003 + ERRORS * error  # microfacets of α = 1e-3 lose 0.1 %
    rough, error = estimate(GLASS, row(alpha=(0.4, 0.4)), SLAB, (WHITE,), fov=0.3)
    assert 0.3 < rough < 1 - ERRORS * error


@pytest.mark.slow
def test_sampling_glass_by_normals_and_by_visible_normals_agree():
    kinds = GLASS, replace(GLASS, sampler="normals")
    (a, error_a), (b, error_b) = (estimate(kind, row(alpha=(0.1, 0.3)), SLAB, (GRADIENT,), fov=0.3) for kind in kinds)
    assert abs(a - b) < ERRORS * math.hypot(error_a, error_b)
    assert error_b > 1.5 * error_a  # heitz2014: visible normals have less variance


def test_seed_decides_the_picture():
    pictures = [
        picture(Kind("diffuse", sampler=""), row(albedo=1.0), SPHERE, (WHITE,), fov=0.7, seed=seed).mean
        for seed in (3, 3, 4)
    ]
    assert (pictures[0] == pictures[1]).all()
    assert (pictures[0] != pictures[2]).any()


def test_uniforms_are_uniform_and_independent():
    """Means of 2¹⁸ numbers within 5 errors of 1/2, correlations of neighbours within 5/√n of 0."""
    n = 1 << 18
    u = np.stack(render.uniforms(np.uint32(1), np.arange(n, dtype=np.uint32), np.uint32(2), 0))
    assert (u >= 0).all() and (u < 1).all()
    assert (np.abs(u.mean(axis=1) - 0.5) < ERRORS / math.sqrt(12 * n)).all()
    columns = np.concatenate([u, np.roll(u, 1, axis=1)])
    correlation = np.corrcoef(columns) - np.eye(8)
    assert np.abs(correlation).max() < ERRORS / math.sqrt(n)
