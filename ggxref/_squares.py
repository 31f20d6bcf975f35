"""The squares of stretched directions that every GGX is made of, and its lobe: with α, each plain form loses digits or range."""

import math

import jax
import jax.numpy as jnp

from ggxref._errorfree import collected, quotient, two_product
from ggxref._types import Scalar, Vec2, Vec3
from ggxref.stable import excess, widened


@widened
def stretched_square(w: Vec3, alpha: Vec2) -> Scalar:
    r"""$(x^2/\alpha_x^2 + y^2/\alpha_y^2 + z^2) / \|w\|^2$, rounded once; its derivative is that of the numerator.

    D is the inverse of its square: half of D's error came from here, and half of that from a `w` that is unit only to its
    dtype.
    """
    return _stretched_square(w[0], w[1], w[2], alpha[0], alpha[1])


@widened
def scaled_square(w: Vec3 | tuple[Scalar, ...], alpha: Vec2 | tuple[Scalar, ...]) -> Scalar:
    r"""$\alpha_x^2 x^2 + \alpha_y^2 y^2$, rounded once: plainly, half of Λ's error."""
    return _scaled_square(w[0], w[1], alpha[0], alpha[1])


@jax.custom_jvp
def _scaled_square(x, y, ax, ay):
    (p, p_rest), (q, q_rest) = two_product(ax, x), two_product(ay, y)
    total, errors = collected([two_product(c, c) for c in (p, q)])
    return total + (sum(errors) + 2 * (p * p_rest + q * q_rest))


@_scaled_square.defjvp
def _scaled_square_jvp(primals, tangents):
    (x, y, ax, ay), (dx, dy, dax, day) = primals, tangents
    return _scaled_square(*primals), 2 * (ax * x * (ax * dx + x * dax) + ay * y * (ay * dy + y * day))


@jax.custom_jvp
def _stretched_square(x, y, z, ax, ay):
    (p, p_rest), (q, q_rest) = quotient(x, ax), quotient(y, ay)
    total, errors = collected([two_product(c, c) for c in (p, q, z)])
    longer = 2 * excess((x, y, z))
    square = jnp.where(longer > -1, 1 + longer, 1)  # ‖w‖², but for the zero vector
    return total + (sum(errors) + 2 * (p * p_rest + q * q_rest) - total * (longer / square))


@_stretched_square.defjvp
def _stretched_square_jvp(primals, tangents):
    (x, y, z, ax, ay), (dx, dy, dz, dax, day) = primals, tangents
    p, q = x / ax, y / ay
    change = p * ((dx - p * dax) / ax) + q * ((dy - q * day) / ay) + z * dz
    return _stretched_square(*primals), 2 * change


@jax.custom_jvp
def refracted_square(c: Scalar, rest: Scalar, eta: Scalar) -> Scalar:
    """The squared cosine behind a boundary, 1 − η²(1 − (c + rest)²), rounded once: towards the critical angle it cancels.

    A rest has no derivative of its own.
    """
    product, lost = two_product(eta, c)
    total, errors = collected([(jnp.ones_like(product), 0), two_product(-eta, eta), two_product(product, product)])
    return total + (sum(errors) + 2 * product * (lost + eta * rest))


@refracted_square.defjvp
def _refracted_square_jvp(primals, tangents):
    (c, _, eta), (dc, _, deta) = primals, tangents
    return refracted_square(*primals), 2 * eta * (eta * c * dc - (1 - c) * (1 + c) * deta)


@jax.custom_jvp
def lobe(a: Scalar, b: Scalar, q: Scalar) -> Scalar:
    r"""$1/(\pi a b q^2)$, the shape of every GGX: each product within the range, and in the derivative each quotient."""
    return 1 / (math.pi * (a * q) * (b * q))


@lobe.defjvp
def _lobe_jvp(primals, tangents):
    value = lobe(*primals)
    da, db, dq = (dx / x for x, dx in zip(primals, tangents, strict=True))
    return value, -value * (da + db + 2 * dq)
