"""What destroys a multiple toss: curves of its orbits, manifolds of its saddles, fatal changes."""
