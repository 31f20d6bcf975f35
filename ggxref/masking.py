r"""Masking: Λ, G1 and G2, dimensionless.

Above the horizon $G_1 = (\omega\cdot n)/\sigma(\omega)$ on front faces, with σ the projected area of the faces turned to ω
(`slopes.sigma_ggx`, `slopes.sigma_beckmann`, `ellipsoid.sigma`). A direction below the horizon looks at the surface from below:
$\Lambda(\omega) = \Lambda(-\omega)$ and $G_1(\omega, \omega_m) = G_1(-\omega, \omega_m)$ where it sees the microfacet's
other side (walter2014 (7)), as transmission needs. All directions are unit, (3,); `alpha` is positive, (2,).
"""

import jax
import jax.numpy as jnp
from jax import Array, lax
from jaxtyping import Bool

from ggxref import _squares, stable
from ggxref._seen import ellipsoid_hides, over_beckmann, over_ellipsoid, over_ggx
from ggxref._types import Mat3, Real, Scalar, Vec2, Vec3
from ggxref.ellipsoid import sigma as sigma_ellipsoid
from ggxref.slopes import gaussian_tail, sigma_beckmann


@stable.widened
def lambda_ggx(w: Vec3, alpha: Vec2) -> Scalar:
    r"""$\Lambda = (-1 + \sqrt{1 + (\alpha_x^2 x^2 + \alpha_y^2 y^2)/z^2})/2$; infinite at the horizon. tokuyoshi2024."""
    square = _squares.scaled_square(w, alpha)
    z = jnp.abs(w[2])
    return square / (2 * z * (z + stable.sqrt(square + z * z)))  # -1 + sqrt(1 + a²) cancels for small a


@stable.widened
def lambda_beckmann(w: Vec3, alpha: Vec2) -> Scalar:
    r"""$\Lambda = (\mathrm{erf}\,a - 1)/2 + e^{-a^2}/(2a\sqrt\pi)$, $a = |z|/\|(\alpha_x x, \alpha_y y)\|$; infinite at the horizon.

    Smith 1967, in heitz2014 §2.1.
    """
    tail, scale = gaussian_tail(w, alpha)
    return tail / jnp.abs(w[2]) * scale


def _on_front(w, wm, g1):
    """`g1` where this side of the microfacet is turned to `w`, seen from w's side of the surface: χ⁺ of eq. (3) of heitz2014.

    Else 0, but NaN of a NaN.
    """
    cosine = lax.stop_gradient(stable.cosine(w, wm))
    front = ((cosine > 0) & (w[2] > 0)) | ((cosine < 0) & (w[2] < 0))  # a product could underflow
    return jnp.where(front, g1, jnp.where(jnp.isnan(cosine), cosine, 0))


def _up(w):
    """`w`, or `-w` where it points below the horizon."""
    return jnp.where(w[2] < 0, -w, w)


def _n(z):
    """The macronormal: G1 = z/σ is the share that it would have among the visible normals."""
    return jnp.zeros_like(z), jnp.zeros_like(z), jnp.ones_like(z)


@stable.widened
def g1_ggx(w: Vec3, wm: Vec3, alpha: Vec2) -> Scalar:
    r"""Smith's G1 for GGX: $2|z|/(|z| + \|(\alpha_x x, \alpha_y y, z)\|)$ on front faces, else 0.

    dupuy2023 (15)–(17); tokuyoshi2024 as 1/(1 + Λ).
    """
    x, y, z = _up(w)
    return _on_front(w, wm, 2 * over_ggx((x, y, z), _n(z), tuple(alpha), 1.0, z))


@stable.widened
def g1_beckmann(w: Vec3, wm: Vec3, alpha: Vec2) -> Scalar:
    r"""Smith's G1 for Beckmann: $1/(1 + \Lambda(\omega))$ on front faces, else 0. heitz2014 §2.1 (Smith 1967)."""
    up = _up(w)
    g1 = over_beckmann(tuple(up), _n(up[2]), tuple(alpha), sigma_beckmann(up, alpha), up[2])
    return _on_front(w, wm, g1)


@stable.widened
def g1_v_cavity(w: Vec3, wm: Vec3) -> Scalar:
    r"""G1 of V-cavities: $\min(1, 2|\omega_m\cdot n||\omega\cdot n|/|\omega\cdot\omega_m|)$ on front faces, else 0.

    heitz2014 (3).
    """
    cosine = jnp.abs(stable.cosine(w, wm))
    masked = 2 * jnp.abs(wm[2] * w[2])
    # Compare before dividing: the quotient overflows where the microfacet is seen edge-on.
    whole = masked >= cosine
    g1 = jnp.where(whole, 1, masked / jnp.where(whole, 1, cosine))
    return _on_front(w, wm, g1)


@stable.widened
def g1_ellipsoid(w: Vec3, wm: Vec3, A: Mat3) -> Scalar:
    r"""Ellipsoid G1: $\min(1, 2\|An\|^2|\omega\cdot n|/(\|A\omega\|\|An\| + A\omega\cdot An))$ on front faces, else 0.

    The minimum acts only where the ellipsoid is skewed: there the visible area is less than the surface's, and a little
    energy is lost rather than G1 > 1 (walter2014 note 4).

    - `A`: shape matrix, (3, 3), non-singular.

    walter2014 (6), (7), (32).
    """
    up = _up(w)
    ray, z, sigma = tuple(up), up[2], sigma_ellipsoid(up, A)
    least = jnp.finfo(sigma.dtype).tiny
    share = over_ellipsoid(ray, _n(z), A, z, jnp.where(sigma < least, least, sigma))
    return _on_front(w, wm, _at_most_one(share, ellipsoid_hides(ray, A)))


@jax.custom_jvp
def _at_most_one(x: Scalar, below: Bool[Array, ""]) -> Scalar:
    """The smaller of `x` and 1; `below`, whether x is, is the derivative's alone: next to the kink rounding decides x."""
    return jnp.where(x >= 1, 1, x)


@_at_most_one.defjvp
def _at_most_one_jvp(primals, tangents):
    return _at_most_one(*primals), jnp.where(primals[1], tangents[0], 0)


def g2_separable(g1_i: Real, g1_o: Real) -> Scalar:
    r"""Masking and shadowing independent: $G_2 = G_1(\omega_i)\,G_1(\omega_o)$. heitz2014 §2.1, walter2014 (5)."""
    return jnp.asarray(g1_i) * g1_o


@jax.custom_jvp
def _correlated(g1_i, g1_o):
    denominator = g1_i + g1_o * (1 - g1_i)
    masked = denominator <= 0
    return jnp.where(masked, 0, g1_i * g1_o / jnp.where(masked, 1, denominator))


@_correlated.defjvp
def _correlated_jvp(primals, tangents):
    """The squares of the shares of the sum: the quotient rule's terms cancel where one G1 is small."""
    (g1_i, g1_o), (di, do) = primals, tangents
    denominator = g1_i + g1_o * (1 - g1_i)
    denominator = jnp.where(denominator > 0, denominator, jnp.inf)
    return _correlated(*primals), (g1_o / denominator) ** 2 * di + (g1_i / denominator) ** 2 * do


@stable.widened
def g2_height_correlated(g1_i: Real, g1_o: Real) -> Scalar:
    r"""Smith's G2 with correlated heights: $G_iG_o/(G_i + G_o - G_iG_o)$, for reflection; 0 where both are 0.

    dupuy2023 (13).
    """
    return _correlated(*stable.floats(g1_i, g1_o))


@stable.widened
def g2_v_cavity(wi: Vec3, wo: Vec3, wm: Vec3) -> Scalar:
    r"""G2 of V-cavities: $\min(G_1, G_1')$ for reflection ($\omega_o\cdot n > 0$), $\max(G_1 + G_1' - 1, 0)$ for transmission.

    - `wi`: above the horizon. `wm` on the upper side.

    heitz2014 §2.1.
    """
    g1_i, g1_o = g1_v_cavity(wi, wm), g1_v_cavity(wo, wm)
    low, high = jnp.minimum(g1_i, g1_o), jnp.maximum(g1_i, g1_o)
    # high - 1 is exact where the result is not 0; low + high would round away the digits of a small `low`.
    return jnp.where(wo[2] > 0, low, jnp.maximum(low + (high - 1), 0))
