"""Options that several studies have."""

from __future__ import annotations

from bouncing_disk_ros.parameters import TABLE, Spec

_PAPER = "paper, Fig. 2"
TOSS_OPTIONS = (
    Spec("arc_amplitude", 0.25, "m", "amplitude of the path of the hand, c = √(A² + (a_e Φ)²)", "c",
         low=1e-9, high=1e6, source=_PAPER),
    Spec("gravity", 10.0, "m/s²", "acceleration of gravity", "g", low=1e-9, high=1e9,
         source=_PAPER),
    *(TABLE[name] for name in ("frequency", "mass", "friction", "friction_radius",
                               "gyration_radius", "preload", "load_torque")),
)  # fmt: skip
"""What the studies of single tosses share; the defaults are those of the paper."""

RESTITUTION = Spec("restitution", 0.5, "1", "coefficient of restitution", "ε", low=0.0, high=1.0)


def map_options(where: str, *names: str) -> tuple[Spec, ...]:
    """Parameters of the next-collision map that a study fixes: these, or all; and where it does."""
    specs = (
        Spec("axial_forcing", 0.45, "1", f"axial forcing {where}", "Γ", low=0.0, high=1e3),
        Spec("restitution", 0.5, "1", f"restitution {where}", "ε", low=0.0, high=1.0),
        Spec("phase_lag", 0.0, "rad", f"phase lag {where}", "θ", low=-1e3, high=1e3),
        Spec("angular_forcing", 100.0, "1", f"angular forcing {where}", "Γ_T", low=1e-9,
             high=1e12),
    )  # fmt: skip
    return tuple(spec for spec in specs if not names or spec.name in names)
