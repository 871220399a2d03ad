"""Long computations in parts: stored as they grow, resumed, on all cores or on many machines.

A `Study` says what is computed; `run` computes what its store does not hold yet. The names are
loaded when first used: the help of a study needs none of them.
"""

from bouncing_disk_ros.public_names import PublicNames as _PublicNames

_names = _PublicNames(__name__, __file__)
__all__, __getattr__, __dir__ = _names.all, _names.load, _names.listed
