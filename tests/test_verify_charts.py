"""Quadrature integrates what has a closed form, and the exact laws are the integrals of the densities they belong to."""

import numpy as np
import pytest
from scipy.special import erf

from ggxref.verify import cases, charts, laws
from ggxref.verify.charts import NORMAL, diagonal

ALPHA = np.array([0.4, 0.7])
WI = cases.direction(60, 0.7)


def ggx(m, alpha):
    q = (m[:, 0] / alpha[0]) ** 2 + (m[:, 1] / alpha[1]) ** 2 + m[:, 2] ** 2
    return 1 / (np.pi * alpha[0] * alpha[1] * q**2)


def beckmann(m, alpha):
    t = ((m[:, 0] / alpha[0]) ** 2 + (m[:, 1] / alpha[1]) ** 2) / m[:, 2] ** 2
    return np.exp(-t) / (np.pi * alpha[0] * alpha[1] * m[:, 2] ** 4)


@pytest.mark.parametrize("A", cases.SHAPES)
def test_lune_covers_its_solid_angle(A):
    """The lune of two directions θ apart is 2(π - θ) steradians wide, whatever matrix spreads the nodes."""
    A = A / np.linalg.norm(A[:, 2])
    m, weight = charts.lune(NORMAL, NORMAL, A, 300)
    assert np.all(m[:, 2] > 0)
    assert weight.sum() == pytest.approx(2 * np.pi, rel=1e-6)


def test_lune_of_two_directions():
    m, weight = charts.lune(WI, NORMAL, np.eye(3))
    assert np.all(m @ WI > 0) and np.all(m[:, 2] > 0)
    assert weight.sum() == pytest.approx(2 * (np.pi - np.radians(60)), rel=1e-13)


def test_gaussian_rule_integrates_beckmann():
    m, weight = charts.gaussian(WI, ALPHA)
    a = charts.cotangent(WI, ALPHA)
    s = np.hypot(*(ALPHA * WI[:2]))
    expected = WI[2] * (1 + erf(a)) / 2 + s * np.exp(-(a**2)) / (2 * np.sqrt(np.pi))
    assert weight @ (m @ WI * beckmann(m, ALPHA)) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("gamma", [1.2, 2.0, 5.0])
def test_student_rule_is_a_change_of_variable(gamma):
    """∫ z dω over the hemisphere is π, though the rule is meant for another integrand."""
    m, weight = charts.student(np.array([1.0, 1.0]), gamma, 200)
    assert weight @ m[:, 2] ** 8 == pytest.approx(2 * np.pi / 9, rel=1e-3)


def test_surface_of_an_ellipsoid_of_revolution():
    """Half the area of the prolate spheroid with half axes 1, 1, 2 in closed form."""
    A = np.diag([1, 1, 0.5])
    _, area = charts.surface(NORMAL, NORMAL, A, 60)
    e = np.sqrt(3) / 2
    assert area.sum() == pytest.approx(np.pi * (1 + 2 / e * np.arcsin(e)), rel=1e-12)


def density_by_differences(law, m, h=1e-6):
    """|∂v/∂m| in two tangent directions: the density of the micronormals that the law maps to uniform points."""
    t = charts.unit(np.cross(m, [0.3, 0.5, 0.8]))
    b = np.cross(m, t)
    dt, db = ((law(charts.unit(m + h * d)) - law(charts.unit(m - h * d))) / (2 * h) for d in (t, b))
    return np.abs(dt[:, 0] * db[:, 1] - dt[:, 1] * db[:, 0])


def visible(D, i, chart):
    m, weight = chart
    return lambda x: np.maximum(0, x @ i) * D(x, ALPHA) / (weight @ (np.maximum(0, m @ i) * D(m, ALPHA)))


LAWS = {
    "ggx": (lambda m: laws.ggx_visible(m, WI, ALPHA), visible(ggx, WI, charts.lune(WI, NORMAL, diagonal(ALPHA)))),
    "beckmann": (lambda m: laws.beckmann_visible(m, WI, ALPHA), visible(beckmann, WI, charts.gaussian(WI, ALPHA))),
    "ggx normals": (lambda m: laws.ggx_normals(m, ALPHA), lambda m: m[:, 2] * ggx(m, ALPHA)),
    "beckmann normals": (lambda m: laws.beckmann_normals(m, ALPHA), lambda m: m[:, 2] * beckmann(m, ALPHA)),
}
for _name, _D in (("ggx", ggx), ("beckmann", beckmann)):

    def _cavity(m, D=_D):
        a, b = np.maximum(0, m @ WI), np.maximum(0, (m * [-1, -1, 1]) @ WI)
        return 2 * a / (a + b) * m[:, 2] * D(m, ALPHA)

    LAWS[f"v-cavity {_name}"] = (lambda m, n=_name: laws.v_cavity(m, WI, ALPHA, n), _cavity)


@pytest.mark.parametrize("name", LAWS)
def test_law_has_the_density(name):
    """Micronormals whose slopes keep clear of the edge of what wi sees and of the cavity's fold."""
    law, density = LAWS[name]
    slope = np.array([[0.3, 0.2], [-0.6, 0.9], [0.05, -1.1], [-1.5, -0.4]]) * ALPHA
    m = charts.unit(np.concatenate([-slope, np.ones((4, 1))], axis=-1))
    m = m[m @ WI > 0.1]
    np.testing.assert_allclose(density_by_differences(law, m), density(m), rtol=1e-7)


def test_law_of_the_reflected_cap_has_its_density():
    """With low = -i'_z it is the density of all visible normals of the ellipsoid."""
    A = cases.SHAPES[2]
    low = -float(charts.unit(A @ WI) @ charts.unit(A[:, 2]))
    m = charts.unit(np.array([[0.1, 0.2, 1.0], [-0.3, 0.1, 1.0], [0.2, -0.5, 1.0]]))
    whole = density_by_differences(lambda x: laws.reflected_cap(x, WI, A, low), m)
    np.testing.assert_allclose(whole, density_by_differences(lambda x: laws.ellipsoid_visible(x, WI, A), m), rtol=1e-7)


def test_law_at_the_ends_of_the_lobe():
    """The steepest slopes that wi sees map to 1, those away from it to 0."""
    away = charts.unit(np.array([[ALPHA[0] * WI[0] * 50, ALPHA[1] * WI[1] * 50, 0.02]]))
    assert laws.ggx_visible(away, WI, ALPHA)[0, 0] < 0.01
