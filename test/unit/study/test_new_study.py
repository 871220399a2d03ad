"""A study is added by a folder and a line: everything else is made from its definition."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import bouncing_disk_ros
from bouncing_disk_ros.executables import STUDIES
from support.processes import finished

ROOT = Path(__file__).resolve().parents[3]
LINE = '    "toy": ("toy_study.options", "square some numbers"),\n'
#: the package as it is with that line in its list, and the toy's folder in it
ADD = """
import sys, types
file, line, tests, output = sys.argv[1:]
module = types.ModuleType("bouncing_disk_ros.executables")
head, begin, rest = open(file).read().partition("STUDIES: dict[str, tuple[str, str]] = {\\n")
sys.modules[module.__name__] = module
exec(head + begin + line + rest, module.__dict__)
import bouncing_disk_ros
bouncing_disk_ros.__path__.append(tests + "/support")
sys.path.append(tests)
from bouncing_disk_ros.__main__ import main
"""
HELP = """
sys.argv = ["bouncing_disk_ros", "toy", "--help"]
try:
    main()
except SystemExit as end:
    assert end.code == 0
slow = {"rclpy", "numba", "numpy", "matplotlib", "xarray"} & set(sys.modules)
assert not slow, slow
print("end of the help")
"""
USED = """
import inspect
from bouncing_disk_ros import figures, help_text, study
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.executables import entry_point

assert "toy" in dir(bouncing_disk_ros) and "toy" in bouncing_disk_ros.__all__
assert entry_point("toy") == "bouncing_disk_ros.toy_study.options:main"  # the console script
result = bouncing_disk_ros.toy(count=3, marks=[1.0, 2.0])
assert result["square"].values.tolist() == [0.0, 2.25, 9.0]
assert result.attrs["parameter_marks"] == "1.0 2.0"
for name, units in (("number", "m"), ("square", "m2"), ("sum", "m2")):
    assert result[name].attrs["units"] == units
assert list(figures(result)) == ["toy"]
toy, basins = bouncing_disk_ros.toy, bouncing_disk_ros.basins
assert str(inspect.signature(toy)) == str(inspect.signature(basins))
text = inspect.getdoc(toy)
assert text.startswith("Squares of numbers.") and "- `largest` (3.0 m): the last of them" in text
page = help_text.parameters_page()
assert "## The study toy\\n" in page and "| `largest` |  | double | 3 | m | a finite" in page
for given, words in (
    ({"gravity": 1.0}, "parameter: got 'gravity', allowed: count, largest, marks. Squares do not"),
    ({"count": 1, "largest": 2.0}, "largest: got 2.0, allowed: none with count:=1. The one number"),
    ({"count": 0}, "count: got 0, allowed: an integer >= 1"),
):
    try:
        study.named("toy", **given)
    except InputError as error:
        assert words in error.line, error.line
    else:
        raise AssertionError(given)
options = ["-p", "count:=3", "-p", f"output:={output}"]
sys.argv = ["bouncing_disk_ros", "toy", "--ros-args", *options]
sys.exit(main())
"""


def test_a_new_study_has_help_a_command_a_function_units_and_a_table(tmp_path: Path) -> None:
    """All in one process: its help, before anything slow is imported, then the rest."""
    executables = str(ROOT / "bouncing_disk_ros/executables.py")
    code = ADD + HELP + USED
    done = finished(sys.executable, "-c", code, executables, LINE, ROOT / "test", tmp_path)
    help_text, _, said = done.stdout.partition("end of the help\n")
    assert "Squares of numbers." in help_text
    assert "largest (double, default 3 m)" in help_text
    assert "  output (string, default '')" in help_text
    assert "  bag (" not in help_text
    assert "  sum of squares 11.25 m²\n" in said
    assert {path.name for path in tmp_path.iterdir()} >= {"toy.png", "result.nc", "result.zarr"}


def test_type_checkers_know_the_function_of_each_study() -> None:
    tree = ast.parse((ROOT / "bouncing_disk_ros" / "__init__.pyi").read_text("utf-8"))
    notes = [node for node in ast.walk(tree) if isinstance(node, ast.AnnAssign)]
    known = {
        ast.unparse(note.target)
        for note in notes
        if ast.unparse(note.annotation) == "StudyFunction"
    }
    assert known == STUDIES.keys() & set(bouncing_disk_ros.__all__)
