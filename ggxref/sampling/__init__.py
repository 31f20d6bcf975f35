"""Samplers of micronormals, one method a file, each with `sample(u, wi, …)` and `pdf(wm, wi, …)`.

In every `u`, uniform in [0, 1), `u[0]` turns (an azimuth) and `u[1]` reaches (a radius or a height).
"""

from ggxref.sampling import (
    bounded_cap,
    cross_section,
    ellipsoid_bounded,
    ellipsoid_cap,
    lune,
    normals,
    slope_beckmann,
    slope_ggx,
    spherical_cap,
    table,
    v_cavity,
)

__all__ = [
    "bounded_cap",
    "cross_section",
    "ellipsoid_bounded",
    "ellipsoid_cap",
    "lune",
    "normals",
    "slope_beckmann",
    "slope_ggx",
    "spherical_cap",
    "table",
    "v_cavity",
]
