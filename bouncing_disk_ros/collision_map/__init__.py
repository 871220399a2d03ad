"""The next-collision map: from one impact to the next, alone and in SIMD lanes; single tosses."""
