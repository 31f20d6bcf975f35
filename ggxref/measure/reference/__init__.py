"""Double-double stand-ins for the oracle, by public name."""

from ggxref.measure.reference import samplers as samplers  # registers its functions
from ggxref.measure.reference.formulas import REFERENCES

__all__ = ["REFERENCES"]
