"""A study is added by a folder and a line: everything else is made from its definition."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import bouncing_disk_ros
from bouncing_disk_ros.executables import STUDIES

ROOT = Path(__file__).resolve().parents[3]
LINE = '    "toy": ("toy_study.options", "square some numbers"),\n'
#: the package as it is with that line in its list, and the toy's folder in it
ADD = """
import sys, types
file, line, tests = sys.argv[1:4]
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
finally:
    slow = {"rclpy", "numba", "numpy", "matplotlib", "xarray"} & set(sys.modules)
    print("slow:", *slow)
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
options = ["-p", "count:=3", "-p", f"output:={sys.argv[4]}"]
sys.argv = ["bouncing_disk_ros", "toy", "--ros-args", *options]
sys.exit(main())
"""


def output(code: str, *arguments: str) -> str:
    command = [sys.executable, "-c", ADD + code, str(ROOT / "bouncing_disk_ros/executables.py")]
    command += [LINE, str(ROOT / "test"), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=100, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_help_of_a_new_study_is_made_of_its_definition_alone() -> None:
    said = output(HELP)
    assert "Squares of numbers." in said
    assert "largest (double, default 3 m)" in said
    assert "  output (string, default '')" in said
    assert "  bag (" not in said
    assert said.endswith("slow:\n")


def test_a_new_study_has_a_command_a_function_units_and_a_table(tmp_path: Path) -> None:
    said = output(USED, str(tmp_path))
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
