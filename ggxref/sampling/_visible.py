r"""The visible-normal densities, $D_{\omega_i}(\omega_m) = \max(0, \omega_i\cdot\omega_m) D(\omega_m)/\sigma(\omega_i)$ [1/sr].

One density a normal distribution, whatever the sampler. heitz2014 (2), (5); dupuy2023 (1), (2); walter2014 (33).
"""

import jax.numpy as jnp

from ggxref import ndf, slopes, stable
from ggxref._types import Mat3, Scalar, Vec2, Vec3
from ggxref.ellipsoid import sigma as sigma_ellipsoid


def _density(wm, wi, D, sigma):
    cosine = stable.cosine(wi, wm)
    seen = (cosine > 0) & (sigma >= jnp.finfo(sigma.dtype).tiny)
    # The quotient first, which is finite: in the tails of Beckmann, cosine · D is 0 where the density is not.
    return jnp.where(seen, D * (cosine / jnp.where(seen, sigma, 1)), 0)


@stable.widened
def pdf_ggx(wm: Vec3, wi: Vec3, alpha: Vec2) -> Scalar:
    r"""Density of the visible GGX normals: $\max(0, \omega_i\cdot\omega_m) D(\omega_m)/\sigma(\omega_i)$ [1/sr].

    - `wm`, `wi`: unit, (3,). `wi` anywhere but straight below: from below the horizon σ is the area of the steep slopes
      that it still sees. 0 for back faces and for `wm` below the horizon.
    - `alpha`: positive, (2,).

    heitz2014 (2), (5); dupuy2023 (1), (2).
    """
    return _density(wm, wi, ndf.ggx(wm, alpha), slopes.sigma_ggx(wi, alpha))


@stable.widened
def pdf_beckmann(wm: Vec3, wi: Vec3, alpha: Vec2) -> Scalar:
    r"""Density of the visible Beckmann normals: $\max(0, \omega_i\cdot\omega_m) D(\omega_m)/\sigma(\omega_i)$ [1/sr].

    - As `pdf_ggx`; 0 also where σ underflows, far below the horizon.

    heitz2014 (2), (5).
    """
    return _density(wm, wi, ndf.beckmann(wm, alpha), slopes.sigma_beckmann(wi, alpha))


@stable.widened
def pdf_ellipsoid(wm: Vec3, wi: Vec3, A: Mat3) -> Scalar:
    r"""Density of the visible normals of the ellipsoid NDF: $\max(0, \omega_i\cdot\omega_m) D(\omega_m)/\sigma(\omega_i)$ [1/sr].

    - `wm`, `wi`: unit, (3,), as `pdf_ggx`. `A`: shape matrix, (3, 3), non-singular.

    walter2014 (33).
    """
    return _density(wm, wi, ndf.ellipsoid(wm, A), sigma_ellipsoid(wi, A))
