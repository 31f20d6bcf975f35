"""ggxref: a JAX research toolkit and reference oracle for GGX microfacet models."""
