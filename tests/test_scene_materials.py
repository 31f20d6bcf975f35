"""A kind of many forms does what the kind of the one form does that its row names; a stored precision rounds what it must."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from ggxref.scene import materials
from ggxref.scene.materials import PRECISIONS, TURNS, Kind, Rows

ROUGH = Kind(fresnel=("schlick",))
MANY = replace(ROUGH, trigonometry=tuple(TURNS), precision=tuple(PRECISIONS))
EXACT = {"trigonometry": 2, "precision": 2}
WI = jnp.array([0.6, 0.0, 0.8], jnp.float32)
U = jnp.array([0.1, 0.7, 0.0, 0.0], jnp.float32)


def row(**numbers):
    forms = dict.fromkeys(materials.FORMS, 0) | numbers
    single = {"eta": 1.5, "k": 0.0, "f0": 0.8, "albedo": 0.0}
    arrays = {"alpha": [0.3, 0.5], "A": np.diag([0.3, 0.5, 1]), "turn": [1, 0]} | single
    floats = {name: jnp.array(value, jnp.float32) for name, value in arrays.items()}
    return Rows(**floats, **{name: jnp.int32(number) for name, number in forms.items()})


sample = jax.jit(materials.sample, static_argnums=0)


@pytest.mark.parametrize("axis, option", [("trigonometry", "2 terms"), ("trigonometry", "3 terms"), *(
    ("precision", name) for name in ("bfloat16", "float16"))])  # fmt: skip
def test_row_names_the_form(axis, option):
    """Up to rounding: the compiler contracts products and sums of two programs differently."""
    number = {"trigonometry": tuple(TURNS), "precision": tuple(PRECISIONS)}[axis].index(option)
    of_row = sample(MANY, row(**(EXACT | {axis: number})), U, WI)
    of_kind = sample(replace(ROUGH, **{axis: (option,)}), row(), U, WI)
    exact = sample(MANY, row(**EXACT), U, WI)
    # A last bit of the result may fall to the other side of a stored number.
    rtol = 2.0 ** -PRECISIONS[option][1] if axis == "precision" else 1e-5
    for mine, theirs in zip(of_row, of_kind, strict=True):
        assert_allclose(mine, theirs, rtol=rtol)
    assert np.abs(of_row.wo - exact.wo).max() > 1e-6


def test_series_of_more_terms_is_nearer():
    error, u = {}, np.linspace(0, 1, 1001, dtype=np.float32)
    angle = 2 * np.pi * u.astype(float)
    for name, turn in TURNS.items():
        x, y = jax.vmap(turn)(jnp.array(u))
        error[name] = np.hypot(x - np.cos(angle), y - np.sin(angle)).max()
    # What the series leave out at an eighth of a turn, x = π/4, is near x⁴/4! and x⁶/6!.
    assert_allclose([error["2 terms"], error["3 terms"]], [0.0158, 3.26e-4], rtol=0.05)
    assert error["exact"] < 2e-7


@pytest.mark.parametrize("name", PRECISIONS)
def test_stored_precision_is_that_of_the_dtype(name):
    x = jnp.array([1 / 3, 1000.1, 3e-4], jnp.float32)
    rounded = materials._rounded(replace(ROUGH, precision=(name,)), row(), x)
    assert_array_equal(rounded, x.astype(name).astype(jnp.float32))


def test_evaluation_takes_and_returns_what_is_stored():
    kind = replace(ROUGH, precision=("bfloat16",))
    wo = jnp.array([-0.36, 0.48, 0.8], jnp.float32)
    stored = partial(materials._rounded, kind, row())
    unit = [stored(w) / jnp.linalg.norm(stored(w)) for w in (WI, wo)]
    numbers = {name: stored(x) for name, x in row()._asdict().items() if name not in materials.FORMS}
    by_hand = materials.evaluate(ROUGH, row()._replace(**numbers), *unit)
    found = materials.evaluate(kind, row(), WI, wo)
    assert_allclose(found, [stored(x) for x in by_hand], rtol=2**-8)
    plain = materials.evaluate(ROUGH, row(), WI, wo)
    assert np.abs(np.array(found) / np.array(plain) - 1).max() > 1e-3
