"""Double-double stand-ins for the oracle, by public name."""

from ggxref.measure.reference import geometry as geometry  # they register their functions
from ggxref.measure.reference import samplers as samplers
from ggxref.measure.reference import slopes as slopes
from ggxref.measure.reference.formulas import REFERENCES

__all__ = ["REFERENCES"]
