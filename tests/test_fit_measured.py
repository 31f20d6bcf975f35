"""Fits of real measurements, in the folder that GGXREF_DATA names: what is known of them is found."""

import math
import os
from pathlib import Path

import pytest

from ggxref.fit import fit, read

DATA = Path(os.environ.get("GGXREF_DATA", "no folder named"))


def ladder(name):
    if not (DATA / name).exists():
        pytest.skip(f"measured data not here: set GGXREF_DATA to the folder that holds {name}")
    return fit(read(DATA / name))


def by_model(ladder):
    return {fit.model: fit for fit in ladder.fits}


def test_aluminium():
    found = ladder("merl/aluminum_brdf.csv")
    isotropic = by_model(found)["isotropic"]
    assert not isotropic.trouble
    assert isotropic.log_rmse <= 0.74
    assert 0.07 < isotropic.values["alpha_x"] < 0.09
    assert found.chosen == "isotropic"


def test_striated_surface_is_anisotropic_and_skewed():
    found = ladder("height/matrix-2.txt")
    fits = by_model(found)
    assert found.chosen == "ellipsoid" and not found.best.trouble
    assert found.best.values["alpha_x"] == pytest.approx(0.13, abs=0.005)
    assert found.best.values["alpha_y"] == pytest.approx(0.085, abs=0.005)
    assert math.hypot(found.best.values["mean_x"], found.best.values["mean_y"]) == pytest.approx(0.013, abs=0.001)
    assert -found.best.loss >= 1.383
    assert -fits["isotropic"].loss == pytest.approx(1.316, abs=5e-4)


def test_the_other_striated_surface_is_strongly_anisotropic():
    best = ladder("height/x3p-2.x3p").best
    assert best.values["anisotropy"] > 2 and not best.trouble


def test_a_curved_surface_needs_levelling():
    land = ladder("height/sample-land.x3p")
    curved = fit(land.measurement, degree=2)
    assert curved.best.loss < land.best.loss - 0.1


@pytest.mark.parametrize("name", ["starlink/chassis_brdf.csv", "starlink/solar_array_brdf.csv"])
def test_starlink(name):
    found = ladder(name)
    assert not found.best.trouble
    assert found.measurement.excluded == {"on the horizon": 8}
