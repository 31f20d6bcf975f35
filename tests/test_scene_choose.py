"""The search takes what is within the tolerance, takes back what is too much together, and keeps the richest at 0."""

import numpy as np
import pytest

from ggxref.errors import InputError
from ggxref.scene import choose, read
from ggxref.scene.compare import Batches, Deviation
from ggxref.scene.search import AXES, Search

SCENE = """
[view]
origin = [0, -4, 1]
width = 8
height = 6
[materials.skewed]
surface = "conductor"
A = [[0.1, 0, 0], [0, 0.3, 0], [0.1, -0.2, 1]]
eta = 0.2
k = 3.9
[materials.plain]
surface = "conductor"
alpha = 0.1
f0 = 0.9
[[shapes]]
kind = "sphere"
center = [-1, 0, 0]
radius = 0.9
material = "skewed"
[[shapes]]
kind = "sphere"
center = [1, 0, 0]
radius = 0.9
material = "plain"
[[lights]]
kind = "sky"
bottom = 0.2
top = 0.8
"""

# What an option takes off the picture, per material; plainer on several axes, they add.
LOSS = {
    "skewed": {"isotropic": 0.3, "anisotropic": 0.1, "separable": 0.006, "one": 0.02, "schlick": 0.006},
    "plain": {"isotropic": 0.0, "anisotropic": 0.0, "separable": 0.001, "one": 0.03},
}
ERROR = 1e-4


@pytest.fixture
def search(tmp_path, monkeypatch):
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    asked = []

    def measure(self, choices):
        asked.append(choices)
        losses = {
            name: sum(LOSS[name].get(getattr(choice, axis), 0.0) for axis in AXES) for name, choice in choices.items()
        }
        return {name: Deviation(loss, ERROR) for name, loss in losses.items()}

    monkeypatch.setattr(Search, "measure", measure)
    monkeypatch.setattr(Search, "cost", lambda self, name, choice: 100.0)
    make = lambda tolerance: Search(read.read(path), tolerance, lambda text: None)  # noqa: E731
    return make, asked


def settle(search):
    steps = choose._steps(search)
    return choose._together(search, choose._affordable(search, steps), steps)


def test_takes_what_is_within(search):
    chosen, found = settle(search[0](0.05))
    assert (chosen["plain"].model, chosen["plain"].g2, chosen["plain"].fresnel) == ("isotropic", "separable", "one")
    assert (chosen["skewed"].model, chosen["skewed"].g2, chosen["skewed"].fresnel) == ("ellipsoid", "separable", "one")
    assert all(each.most < 0.05 for each in found.values())


def test_takes_back_what_is_too_much_together(search):
    """At 0.01 each of the skewed material's small steps is within, and the two together are not."""
    chosen, found = settle(search[0](0.01))
    small = chosen["skewed"].g2 == "separable", chosen["skewed"].fresnel == "schlick"
    assert sorted(small) == [False, True]
    assert chosen["plain"].fresnel == "schlick"  # a neighbour's excess takes nothing from it but its own: 0.03
    assert all(each.most < 0.01 for each in found.values())


def test_tolerance_0_keeps_the_richest(search):
    every = search[0](0.0)
    chosen, found = settle(every)
    assert chosen == every.richest
    assert all(each.value == 0 for each in found.values())


def test_sampler_follows_the_model(search):
    chosen, _ = settle(search[0](0.2))
    assert (chosen["skewed"].model, chosen["skewed"].sampler) == ("anisotropic", "spherical_cap")
    chosen, _ = settle(search[0](0.05))
    assert (chosen["skewed"].model, chosen["skewed"].sampler) == ("ellipsoid", "ellipsoid_cap")


def test_what_costs_more_is_not_taken(search, monkeypatch):
    """The separable form is within; at a fifth more than the richest it is not worth its error, at a hundredth less it is."""
    for factor, expected in ((1.2, "height_correlated"), (0.99, "separable")):
        cost = lambda self, name, choice, factor=factor: 100.0 * (factor if choice.g2 == "separable" else 1)  # noqa: E731
        monkeypatch.setattr(Search, "cost", cost)
        assert settle(search[0](0.05))[0]["plain"].g2 == expected


@pytest.mark.parametrize(("ns", "named"), [(130.0, 0), (70.0, 1)])
def test_what_is_slower_as_a_whole_is_not_named(search, monkeypatch, ns, named):
    """Formulas that are cheaper by themselves may be dearer in a picture: then the richest is named, by a factor of 1."""
    every = search[0](0.05)
    plainer = {
        name: choose.with_option(every.named[name], each, "g2", "separable") for name, each in every.richest.items()
    }
    candidates = [every.richest, plainer]

    def whole(choices, samples, seed=0):
        return Batches(np.zeros((8, 6, 8)), np.ones((6, 8)), ns + seed % 2 if choices == plainer else 100.0 + seed % 2)

    monkeypatch.setattr(every, "whole", whole)
    best, pictures, faster, error = choose._fastest(every, candidates)
    assert best == candidates[named]
    assert faster == pytest.approx([1.0, 100 / 70][named], rel=0.02)
    assert error < 0.02
    assert pictures["chosen"].ns_per_sample in ((100.0, 101.0), (ns, ns + 1))[named]  # a turn's, the middle one


def test_rounds_of_the_search_are_counted(search):
    """Nine options, two materials to find a sampler for, and the richest, the chosen together, the timing."""
    assert choose.stages(search[0](0.1).scene) == 9 + 2 + 3


def test_seconds_set_the_samples(tmp_path, monkeypatch):
    """8 batches of 8 × 6 pixels at 1000 ns: 0.384 s is 1000 samples a pixel and batch."""
    path = tmp_path / "scene.toml"
    path.write_text(SCENE + "[budget]\nseconds = 0.384\n")
    trial = Batches(np.zeros((8, 6, 8)), np.zeros((6, 8)), 1000.0)
    monkeypatch.setattr(Search, "_batches", lambda self, choices, samples: trial)
    assert Search(read.read(path), 0.1, print).samples == 1000


def test_an_option_is_measured_for_all_materials_at_once(search):
    make, asked = search
    choose._steps(make(0.05))
    # isotropic, anisotropic, separable, one, schlick, two forms of trigonometry, two precisions; not eighteen
    assert len(asked) == 9


@pytest.mark.parametrize("tolerance", [-0.1, np.nan, np.inf])
def test_bad_tolerance_is_refused(search, tolerance):
    with pytest.raises(InputError, match="--tolerance"):
        choose.choose(search[0](0.1).scene, tolerance)


def test_a_black_picture_is_refused(search, monkeypatch):
    """Every deviation would be 0 of 0."""
    dark = Batches(np.zeros((8, 6, 8)), np.zeros((6, 8)), 1000.0)
    monkeypatch.setattr(Search, "_batches", lambda self, choices, samples: dark)
    with pytest.raises(InputError, match="no light reaches the view"):
        choose.choose(search[0](0.1).scene, 0.1)
