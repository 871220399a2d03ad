"""The reference case `drop` by MuJoCo, and how far a soft contact is from the rigid-impact law.

    python examples/case_by_mujoco.py [TIMESTEP] [TIME_CONSTANT]     (pip install mujoco)

Without arguments MuJoCo's defaults: a step of 2 ms, a contact of 20 ms, critically damped. MuJoCo
has no restitution: with TIME_CONSTANT (s) the damping ratio of the contact is the one of a linear
spring and damper that returns the speed times 0.75. Prints the comparison, from samples of time and
height.
"""

import math
import sys

if "--help" in sys.argv:
    print(__doc__)
    sys.exit()

import mujoco
import numpy as np

from bouncing_disk_ros import compare_with_case, reference_case

MODEL = """<mujoco><option timestep="{step}" gravity="0 0 -{g}"/><worldbody>
<geom type="plane" size="5 5 1" {contact}/>
<body pos="0 0 {height}"><joint type="slide" axis="0 0 1"/>
<geom type="sphere" size="{radius}" mass="{mass}" {contact}/></body></worldbody></mujoco>"""
RADIUS = 0.1  # m


def samples(step: float, time_constant: float) -> dict[str, np.ndarray]:
    """Times and heights of the case `drop`; time constant 0: MuJoCo's default contact."""
    p = reference_case("drop").keywords()
    contact = ""
    if time_constant:
        log = math.log(p["restitution"])
        damping = -log / math.hypot(math.pi, log)
        contact = f'solref="{time_constant} {damping}" solimp="0.99 0.99 0.001"'
    text = MODEL.format(step=step, g=p["gravity"], mass=p["mass"], radius=RADIUS, contact=contact,
                        height=p["initial_height"] + RADIUS)  # fmt: skip
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    rows = [(0.0, p["initial_height"])]
    while data.time < reference_case("drop").duration:
        mujoco.mj_step(model, data)
        rows.append((data.time, p["initial_height"] + data.qpos[0]))
    time, position = np.array(rows).T
    return {"time": time, "position": position}


def main(step: str = "0.002", time_constant: str = "0") -> None:
    """Run the case, and print how far it is from the law."""
    found = samples(float(step), float(time_constant))
    print("\n".join(compare_with_case("drop", found, tolerance=1e-6).lines))


if __name__ == "__main__":
    main(*sys.argv[1:])
