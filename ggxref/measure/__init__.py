"""Accuracy, speed, stability and variance of functions, and of the variants of them that are in use elsewhere."""
