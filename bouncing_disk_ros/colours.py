"""The colours of all figures: Okabe and Ito's, which colour-blind people can distinguish."""

BLUE, ORANGE, GREEN, VERMILION = "#0072B2", "#E69F00", "#009E73", "#D55E00"
SKY, YELLOW, PURPLE, GREY, BLACK = "#56B4E9", "#F0E442", "#CC79A7", "#999999", "#000000"

DISK, PLATFORM, THEORY = BLUE, ORANGE, VERMILION
"""The same in every figure and on the page."""
INK = "#444444"
"""Of values that belong to no attractor, beside attractors in their colours."""
UNRESOLVED = "#777777"
REST, CONTACT = "#f3ead8", "#d9d9d9"
"""Areas of a map: a disk at rest, and an attractor with contact. White is the 0 of a scale."""
