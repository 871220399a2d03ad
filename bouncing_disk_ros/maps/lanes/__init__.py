"""The map of many starts at once, in SIMD lanes."""
