"""The corners that tests are drawn in: a theme names the variant of each quantity that `inputs.draw` gives it.

A theme is used for a function that takes all of the theme's quantities. `_post` names a change made after the draw:
`swap` exchanges x and y in the test of the same theme unswapped, `stretch` makes directions longer or shorter by a few
ulp, `minus zero` turns +0 into −0, and the `INVALID` ones break an input.
"""

from collections.abc import Mapping
from functools import cache

from ggxref.golden.catalogue import Function

Theme = Mapping[str, str]
PLAIN: Theme = {}

THEMES: list[Theme] = [
    {"alpha": "isotropic"},
    {"alpha": "isotropic small"},
    {"alpha": "small"},
    {"alpha": "one"},
    {"alpha": "above one"},
    {"alpha": "mild"},
    {"alpha": "mild", "_post": "swap"},
    {"alpha": "extreme"},
    {"A": "aligned"},
    {"A": "skew"},
    {"A": "strong"},
    {"A": "negative"},
    {"A": "skew", "alpha": "small"},
    {"A": "plain", "alpha": "extreme"},
    {"A": "plain", "alpha": "above one"},
    {"wi": "normal"},
    {"wi": "near"},
    {"wi": "grazing"},
    {"wi": "horizon"},
    {"wi": "below"},
    {"wi": "grazing below"},
    {"wi": "nadir"},
    {"wi": "subnormal"},
    {"wi": "normal", "_post": "minus zero"},
    {"wi": "plain", "_post": "stretch"},
    {"wm": "normal"},
    {"wm": "near"},
    {"wm": "grazing"},
    {"wm": "horizon"},
    {"wm": "below"},
    {"wm": "tail"},
    {"wm": "subnormal"},
    {"wm": "normal", "_post": "minus zero"},
    {"wm": "plain", "_post": "stretch"},
    {"wi": "normal", "wm": "normal"},
    {"wi": "grazing", "wm": "plain"},
    {"wi": "plain", "wm": "perpendicular"},
    {"wi": "grazing", "wm": "wrong side"},
    {"wi": "below", "wm": "wrong side"},
    {"wi": "grazing", "alpha": "small"},
    {"wi": "grazing", "alpha": "above one"},
    {"wi": "near", "alpha": "small"},
    {"wm": "normal", "alpha": "small"},
    {"wi": "grazing", "A": "strong"},
    {"wi": "below", "A": "skew"},
    {"wo": "mirror"},
    {"wo": "same"},
    {"wo": "opposite"},
    {"wo": "normal"},
    {"wo": "grazing"},
    {"wo": "horizon"},
    {"wo": "below"},
    {"slope": "plain", "wm": "tail"},
    {"slope": "plain", "wm": "normal"},
    {"angles": "zero"},
    {"gamma": "two"},
    {"g1_i": "zero"},
    {"g1_i": "one"},
    {"g1_i": "zero", "g1_o": "zero"},
    {"u": "zero turn"},
    {"u": "zero reach"},
    {"u": "zero"},
    {"u": "last turn"},
    {"u": "last reach"},
    {"u": "last"},
    {"u": "quarter"},
    {"u": "half"},
    {"u": "tiny reach"},
    {"u": "zero", "wi": "normal"},
    {"u": "last", "wi": "grazing"},
    {"u": "last reach", "wi": "below"},
    {"eta": "one"},
    {"eta": "near one"},
    {"eta": "near one", "wo": "opposite"},
    {"eta": "dense", "wi": "grazing"},
    {"cos_i": "zero"},
    {"cos_i": "one"},
    {"cos_i": "grazing"},
    {"cos_i": "negative"},
    {"cos_i": "critical", "eta": "dense"},
    {"wm": "critical", "eta": "dense"},
    {"cos_i": "total", "eta": "dense"},
    {"cos_i": "zero", "eta": "one"},
    {"k": "zero"},
    {"k": "zero", "cos_i": "grazing"},
    {"f0": "zero"},
    {"f0": "one"},
    {"F": "one"},
    {"G2": "zero"},
    {"alpha": "plain", "_post": "negative alpha"},
    {"alpha": "plain", "_post": "zero alpha"},
    {"_post": "nan"},
]
# These leave the functions' domains: no result is right, some are acceptable.
INVALID = frozenset({"negative alpha", "zero alpha", "nan"})

# Arguments drawn from another quantity's variant.
_FROM = {"u3": "u", "rows": "u", "mean": "A", "scatter": "A", "n_i": "eta", "factors": "alpha"}


def themes(function: Function) -> list[Theme]:
    """The themes that concern the function, with a plain draw before them and after every second."""
    return _themes(frozenset(function.arguments.values()))


@cache
def _themes(drawn: frozenset[str]) -> list[Theme]:
    quantities = set(drawn)
    quantities |= {_FROM[q] for q in quantities if q in _FROM}
    if "slope" in quantities:
        quantities.add("wm")
    corners = [t for t in THEMES if concerns(t, quantities)]
    plain = [[PLAIN] if i % 2 else [] for i in range(len(corners))]
    return [PLAIN, *(theme for corner, more in zip(corners, plain, strict=True) for theme in (corner, *more))]


def concerns(theme: Theme, quantities: set[str]) -> bool:
    # alpha breaks only what takes alpha itself.
    known = quantities if theme.get("_post") in INVALID else quantities | shapes(quantities)
    return {q for q in theme if q != "_post"} <= known


def shapes(quantities: set[str]) -> set[str]:
    """`alpha` is a variant of a matrix too: its semi-axes."""
    return {"alpha"} if "A" in quantities else set()
