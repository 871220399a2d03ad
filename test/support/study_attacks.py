"""All studies that are run beside the simulator at random options."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from support import studied
from support.studied_branches import attack_basin_shares, attack_bifurcation
from support.studied_lines import attack_curves, attack_manifolds
from support.studied_motor import attack_motor

ATTACKS: dict[str, Callable[[np.random.Generator, Path], list[str]]] = {
    "basins": studied.attack_basins,
    "resilience": studied.attack_resilience,
    "parameter_map": studied.attack_parameter_map,
    "toss_map": studied.attack_toss_map,
    "toss_paths": studied.attack_toss_paths,
    "basin_shares": attack_basin_shares,
    "bifurcation": attack_bifurcation,
    "motor": attack_motor,
    "manifolds": attack_manifolds,
    "curves": attack_curves,
}
"""Study -> what differs at one draw of its options, nothing if all agrees."""
