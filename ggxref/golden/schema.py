"""Names and versions of the file formats."""

VECTORS, MANIFEST, TEXT = "ggxref-vectors-1", "ggxref-manifest-1", "ggxref-text-1"
MANIFEST_NAME = "manifest.json"
# Raised whenever the same order gives other tests.
VERSION = 2
