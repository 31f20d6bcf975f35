"""Every place that the documents number or state has a check, and every check stands at a listed place."""

import pytest

from ggxref.verify import coverage, engine

NUMBERED = {"heitz2014": 13, "walter2014": 52, "dupuy2023": 20, "tokuyoshi2024": 43}


@pytest.mark.parametrize("paper, last", NUMBERED.items())
def test_no_number_is_missing_from_the_list(paper, last):
    listed = list(coverage.places()[paper])
    assert listed[:last] == [f"({k})" for k in range(1, last + 1)]


def test_every_place_has_a_check():
    unproved = [place for place, checks in coverage.proofs(engine.registered()).items() if not checks]
    assert not unproved


def test_every_check_has_a_place():
    listed = coverage.places()
    astray = [
        (c.paper, c.equation)
        for c in engine.registered()
        if not c.statement.startswith("erratum") and c.equation not in listed[c.paper]
    ]
    assert not astray
