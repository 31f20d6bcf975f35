"""The samplers and their densities in arbitrary precision, one method a file."""
