"""Fits of real measurements, in the folder that GGXREF_DATA names: what is known of them is found."""

import math
import os
from pathlib import Path

import numpy as np
import pytest

from ggxref.fit import fit, read
from ggxref.fit.readers import rgl

DATA = Path(os.environ.get("GGXREF_DATA", "no folder named"))


def file(name):
    if not (DATA / name).exists():
        pytest.skip(f"measured data not here: set GGXREF_DATA to the folder that holds {name}")
    return DATA / name


def ladder(name, **options):
    return fit(read(file(name)), **options)


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


def projected(table):
    """The integrand over u of ∫ D cosθ dω, with θ = u² π/2, of an RGL table of D; and u. The last of the even azimuths is the first."""
    u = np.linspace(0, 1, table.shape[1])
    theta = u * u * math.pi / 2
    return table[:-1].mean(axis=0) * np.cos(theta) * np.sin(theta) * 2 * math.pi * math.pi * u, u


RGL = ("cc_ibiza_sunset", "chm_mint", "chm_orange", "colodur_napoli_4f", "ilm_solo_m_68", "irid_flake_paint1",
       "paper_white", "satin_rosaline", "vch_golden_yellow")  # fmt: skip


@pytest.fixture(params=RGL)
def density(request):
    path = file(f"rgl/{request.param}_rgb.bsdf")
    return np.asarray(rgl.read_fields(path.read_bytes(), str(path))["ndf"], float)


def test_the_tables_normalise(density):
    """The files' makers made the *mean* over the 128 nodes 1, to float32's digits; the trapezoid integral is 128/127 of it."""
    integrand, u = projected(density)
    assert integrand.mean() == pytest.approx(1, abs=1e-7)
    assert np.trapezoid(integrand, u) == pytest.approx(128 / 127, abs=1e-7)


def test_the_tables_do_not_normalise_over_another_axis(density):
    """With nodes even in θ, and not in its root, the same table must miss 1."""
    theta = np.linspace(0, math.pi / 2, density.shape[1])
    area = np.trapezoid(density[0] * np.cos(theta) * np.sin(theta) * 2 * math.pi, theta)
    assert abs(area - 1) > 0.5
