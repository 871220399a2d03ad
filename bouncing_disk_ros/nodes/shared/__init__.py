"""What executables of several packages share: start, options, figure kinds, run records."""
