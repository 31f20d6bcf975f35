"""Fits of real measurements, in the folder that GGXREF_DATA names: what is known of them is found."""

import math
import os
from pathlib import Path

import pytest

from ggxref.fit import fit, read

DATA = Path(os.environ.get("GGXREF_DATA", "no folder named"))


def ladder(name, **options):
    if not (DATA / name).exists():
        pytest.skip(f"measured data not here: set GGXREF_DATA to the folder that holds {name}")
    return fit(read(DATA / name), **options)


def by_model(ladder):
    return {fit.model.name: fit for fit in ladder.fits}


def test_aluminium():
    found = ladder("merl/aluminum_brdf.csv")
    fits = by_model(found)
    assert not fits["isotropic"].trouble
    assert fits["isotropic"].log_rmse <= 0.74
    assert 0.07 < fits["isotropic"].values["alpha_x"] < 0.09
    assert fits["isotropic student_t"].log_rmse <= 0.68
    assert found.chosen == "isotropic student_t"


def test_striated_surface_is_anisotropic_and_skewed():
    found = ladder("height/matrix-2.txt")
    fits = by_model(found)
    best = fits["ellipsoid"]
    assert found.chosen == "ellipsoid" and not best.trouble
    assert best.values["alpha_x"] == pytest.approx(0.13, abs=0.005)
    assert best.values["alpha_y"] == pytest.approx(0.085, abs=0.005)
    assert math.hypot(best.values["mean_x"], best.values["mean_y"]) == pytest.approx(0.013, abs=0.001)
    assert -best.loss >= 1.383
    assert -fits["isotropic"].loss == pytest.approx(1.316, abs=5e-4)


def test_a_gaussian_is_far_off():
    """The maximum-likelihood normal of the striated surface's slopes: 0.722."""
    fits = by_model(ladder("height/matrix-2.txt", tail="beckmann"))
    assert -fits["ellipsoid beckmann"].loss == pytest.approx(0.722, abs=5e-4)


def test_the_other_striated_surface_is_strongly_anisotropic():
    best = ladder("height/x3p-2.x3p").best
    assert best.values["anisotropy"] > 2 and not best.trouble


def test_a_curved_surface_needs_levelling():
    land = ladder("height/sample-land.x3p")
    curved = by_model(fit(land.measurement, degree=2))
    assert curved["ellipsoid"].loss < by_model(land)["ellipsoid"].loss - 0.1


@pytest.mark.parametrize("name", ["starlink/chassis_brdf.csv", "starlink/solar_array_brdf.csv"])
def test_starlink(name):
    found = ladder(name)
    assert not found.best.trouble
    assert found.measurement.counts == {"left out: on the horizon": 8}
