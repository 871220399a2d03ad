"""What fits of measured impacts compute, compiled: the likelihood, and chains of flights."""
