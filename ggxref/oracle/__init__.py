"""The public functions of ggxref again, in arbitrary precision with proven enclosures (python-flint balls).

Every formula is its document's plainest statement, misprints corrected. Nothing here imports the rest of ggxref.
"""
