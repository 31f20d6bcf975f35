"""The pages say what the checks say: every place with its proofs, every misprint with its numbers."""

from pathlib import Path

from ggxref.verify import coverage, engine, pages

DOCS = Path(__file__).parent.parent / "docs"


def test_equations_are_fresh():
    """Stale: run ggxref verify --pages docs."""
    assert pages.equations(engine.registered()) == (DOCS / "equations.md").read_text("utf-8")


def test_every_place_begins_a_row():
    page = pages.equations(engine.registered())
    for listed in coverage.places().values():
        for place in listed:
            assert f"\n| {place} | " in page


def test_misprint_shows_both_numbers():
    checks = [c for c in engine.registered() if c.statement.startswith("erratum") and c.paper == "tokuyoshi2024"]
    (row,) = [
        r for r in pages.misprints([c.run() for c in checks]).splitlines() if r.startswith("| tokuyoshi2024 | (25)")
    ]
    assert "| < 1e-12 | 2 | exact | print |" in row
