r"""The visible-normal densities, $D_{\omega_i}(\omega_m) = \max(0, \omega_i\cdot\omega_m) D(\omega_m)/\sigma(\omega_i)$ [1/sr].

One density a normal distribution, whatever the sampler. heitz2014 (2), (5); dupuy2023 (1), (2); walter2014 (33).
"""

import jax.numpy as jnp

from ggxref import ndf, slopes, stable
from ggxref._seen import over_beckmann, over_ellipsoid, over_ggx
from ggxref._types import Mat3, Scalar, Vec2, Vec3
from ggxref.ellipsoid import sigma as sigma_ellipsoid


@stable.widened
def pdf_ggx(wm: Vec3, wi: Vec3, alpha: Vec2) -> Scalar:
    r"""Density of the visible GGX normals: $\max(0, \omega_i\cdot\omega_m) D(\omega_m)/\sigma(\omega_i)$ [1/sr].

    - `wm`, `wi`: unit, (3,). `wi` anywhere but straight below: from below the horizon σ is the area of the steep slopes
      that it still sees. 0 for back faces and for `wm` below the horizon.
    - `alpha`: positive, (2,).

    heitz2014 (2), (5); dupuy2023 (1), (2).
    """
    cosine = stable.cosine(wi, wm)
    share = 2 * over_ggx(tuple(wi), tuple(wm), tuple(alpha), 1.0, cosine)
    return jnp.where(cosine <= 0, 0, ndf.ggx(wm, alpha) * share)


@stable.widened
def pdf_beckmann(wm: Vec3, wi: Vec3, alpha: Vec2) -> Scalar:
    r"""Density of the visible Beckmann normals: $\max(0, \omega_i\cdot\omega_m) D(\omega_m)/\sigma(\omega_i)$ [1/sr].

    - As `pdf_ggx`; 0 also where σ underflows, far below the horizon.

    heitz2014 (2), (5).
    """
    cosine = stable.cosine(wi, wm)
    share = over_beckmann(tuple(wi), tuple(wm), tuple(alpha), slopes.sigma_beckmann(wi, alpha), cosine)
    return jnp.where(cosine <= 0, 0, ndf.beckmann_times(wm, alpha, share))


@stable.widened
def pdf_ellipsoid(wm: Vec3, wi: Vec3, A: Mat3) -> Scalar:
    r"""Density of the visible normals of the ellipsoid NDF: $\max(0, \omega_i\cdot\omega_m) D(\omega_m)/\sigma(\omega_i)$ [1/sr].

    - `wm`, `wi`: unit, (3,), as `pdf_ggx`. `A`: shape matrix, (3, 3), non-singular.

    walter2014 (33).
    """
    cosine, sigma = stable.cosine(wi, wm), sigma_ellipsoid(wi, A)
    seen = ~((cosine <= 0) | (sigma < jnp.finfo(sigma.dtype).tiny))
    share = over_ellipsoid(tuple(wi), tuple(wm), A, cosine, jnp.where(seen, sigma, 1))
    return jnp.where(seen, ndf.ellipsoid(wm, A) * share, 0)
