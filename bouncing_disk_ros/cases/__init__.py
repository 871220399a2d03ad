"""Reference cases: events of the rigid-impact law with certain bounds, to compare with."""
