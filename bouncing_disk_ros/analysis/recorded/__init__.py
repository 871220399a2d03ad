"""What recorded impacts and states show: sections, orbits, transients, estimates."""
