"""Public names of `study`, for type checkers and for `PublicNames`."""

from .by_name import named as named
from .computation import Arrays as Arrays
from .computation import Axis as Axis
from .computation import Field as Field
from .computation import Region as Region
from .computation import Study as Study
from .exports import export as export
from .exports import export_tables as export_tables
from .runner import Progress as Progress
from .runner import run as run
from .store import open_result as open_result

__all__: list[str]
