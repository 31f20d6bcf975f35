"""ggxref: a JAX research toolkit and reference oracle for GGX microfacet models.

One point per function; batch with `jax.vmap`. Directions are unit vectors away from the surface, the macronormal is +z.
"""

from ggxref import bsdf, ellipsoid, fresnel, geometry, jacobian, masking, ndf, sampling, slopes

__all__ = ["bsdf", "ellipsoid", "fresnel", "geometry", "jacobian", "masking", "ndf", "sampling", "slopes"]
