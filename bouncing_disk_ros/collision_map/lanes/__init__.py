"""Many trajectories and tosses at once, in SIMD lanes: see `lane`."""
