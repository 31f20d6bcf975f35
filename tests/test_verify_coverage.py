"""Every place that the documents number or state has a check, and every check stands at a listed place."""

import pytest

from ggxref.verify import coverage, engine

NUMBERED = {"heitz2014": 13, "walter2014": 52, "dupuy2023": 20, "tokuyoshi2024": 43}


@pytest.mark.parametrize("paper, last", NUMBERED.items())
def test_no_number_is_missing_from_the_list(paper, last):
    listed = list(coverage.places()[paper])
    assert listed[:last] == [f"({k})" for k in range(1, last + 1)]


def test_every_place_has_two_routes():
    """By two methods, or by one with the reason why there is no other."""
    methods = {place: {c.method for c in checks} for place, checks in coverage.proofs(engine.registered()).items()}
    assert all(methods.values())
    assert {place for place, used in methods.items() if len(used) == 1} == set(coverage.one_route())


def test_every_check_has_a_place():
    listed = coverage.places()
    astray = [
        (paper, place)
        for c in engine.registered()
        for paper, place in c.places
        if not c.statement.startswith("erratum") and place not in listed[paper]
    ]
    assert not astray
