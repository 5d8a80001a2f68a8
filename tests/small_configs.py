"""Pieces of configs of small experiments: join them with what a test is about."""

SWATCH = """\
[scene]
head = "none"
[groom]
source = "swatch"
"""
"""A patch of strands without a head; no other groom is made faster."""

ONE_LIGHT = """\
[[scene.lights]]
direction = [0, 1, 0]
irradiance = 4.0
"""
"""A light whose values a test can change."""
