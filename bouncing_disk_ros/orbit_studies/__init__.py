"""What destroys a multiple toss: curves of its orbits, manifolds of its saddles, fatal changes."""

NO_ROTATION = (
    "Friction acts along the surface alone, so nothing that this study computes depends on the "
    "rotation: axial_forcing and restitution decide it"
)
"""Why the studies of this folder do not take parameters of the rotation."""
