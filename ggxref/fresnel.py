"""Fresnel reflectance of a smooth interface for unpolarised light, dimensionless in [0, 1].

`cos_i` is the cosine between the direction and the micronormal; its absolute value is used, so the side is said by the
indices alone.
"""

import jax.numpy as jnp

from ggxref import stable
from ggxref._types import Real, Scalar


def dielectric(cos_i: Real, eta: Real) -> Scalar:
    r"""$F = (R_s^2 + R_p^2)/2$, $R_s = \frac{\eta c - c_t}{\eta c + c_t}$, $R_p = \frac{c - \eta c_t}{c + \eta c_t}$,
    $c_t = \sqrt{1 - \eta^2(1 - c^2)}$; 1 in total reflection, 0 at `eta = 1`.

    - `cos_i` in [-1, 1]; `eta = n_i / n_o > 0`.

    Fresnel's equations (Walter et al. 2007 (22)), used by heitz2014 §2.1 and walter2014 §1.1.
    """
    c = jnp.abs(jnp.asarray(cos_i))
    gap = (1 - eta) * (1 + eta)  # 1 - eta², exact also near eta = 1
    square = gap + (eta * c) ** 2
    total = square <= 0
    ct = stable.sqrt(square)
    # Both numerators times their conjugates: ηc − c_t and c − ηc_t cancel as η → 1, these do not.
    s_sum, p_sum = eta * c + ct, c + eta * ct
    fine = (s_sum > 0) & ~total & (gap != 0)
    r_s = gap / jnp.where(fine, s_sum, 1) ** 2
    r_p = gap * (c * c - eta**2 * (1 - c) * (1 + c)) / jnp.where(fine, p_sum, 1) ** 2
    return jnp.where(total & (gap < 0), 1, jnp.where(fine, (r_s * r_s + r_p * r_p) / 2, 0))


def conductor(cos_i: Real, eta: Real, k: Real) -> Scalar:
    r"""$F$ for the complex index $\eta + ik = n_o/n_i$ of the metal, relative to the side that the light is on.

    This is the η of the tables of metals, the inverse of `dielectric`'s: `conductor(c, n, 0) = dielectric(c, 1/n)`.

    - `cos_i` in [-1, 1]; `eta > 0`, `k >= 0`.

    Fresnel's equations for absorbing media, as in heitz2014 §2.1 and walter2014 §1.1 ("complex index of refraction").
    """
    c = jnp.abs(jnp.asarray(cos_i))
    sin_square = (1 - c) * (1 + c)
    # (a + ib)² = (η + ik)² − sin²θ; the smaller of a, b comes from the product ab = ηk, as its difference cancels.
    gap = (eta - 1) * (eta + 1) - k * k
    real, imaginary = gap + c * c, eta * k
    large_square = (stable.sqrt(real * real + 4 * imaginary * imaginary) + jnp.abs(real)) / 2
    large = stable.sqrt(large_square)
    small = imaginary / jnp.where(large > 0, large, 1)
    a, b_square = jnp.where(real >= 0, large, small), jnp.where(real >= 0, small * small, large_square)
    total = a + c
    # a − c cancels as the index goes to 1; a² − c² = gap + b² does not.
    faint = (total > 0) & (jnp.abs(gap) + b_square < c * total)
    difference = jnp.where(faint, (gap + b_square) / jnp.where(faint, total, 1), a - c)
    # Each numerator and denominator as a sum of squares, and one quotient of them all.
    s_minus, s_plus = difference * difference + b_square, total * total + b_square
    p_minus, p_plus = ((a * c + sign * sin_square) ** 2 + b_square * c * c for sign in (-1, 1))
    p_plus, p_minus = (jnp.where(p_plus > 0, p, 1) for p in (p_plus, p_minus))
    whole = s_plus * p_plus
    return jnp.where(whole > 0, s_minus * (p_plus + p_minus) / (2 * jnp.where(whole > 0, whole, 1)), 0)


def schlick(cos_i: Real, f0: Real) -> Scalar:
    r"""Schlick's approximation: $F = F_0 + (1 - F_0)(1 - |c|)^5$.

    - `cos_i` in [-1, 1]; `f0` in [0, 1], the reflectance at normal incidence.

    Schlick 1994.
    """
    return f0 + (1 - f0) * (1 - jnp.abs(jnp.asarray(cos_i))) ** 5
