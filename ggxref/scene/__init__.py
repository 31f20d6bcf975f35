"""The least model that a scene needs: a small path tracer over the library's formulas, and what to choose for a scene."""
