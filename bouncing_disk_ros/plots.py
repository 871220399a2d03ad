"""Figures of results, each from the folder of its subject, loaded when first used.

>>> from bouncing_disk_ros import basins, plots
>>> plots.basins_picture(basins(axial_forcing=0.34, width=200, height=200)).savefig("basins.pdf")
"""

from bouncing_disk_ros.public_names import PublicNames as _PublicNames

_names = _PublicNames(__name__, __file__)
__all__, __getattr__, __dir__ = _names.all, _names.load, _names.listed
