"""What README and tutorial tell users to type: parameters, topics and messages exist, code runs."""

from __future__ import annotations

import pkgutil
import re
import runpy
import shlex
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pytest
import yaml

import bouncing_disk_ros
from bouncing_disk_ros import parameters
from bouncing_disk_ros.executables import EXECUTABLES, STUDIES
from bouncing_disk_ros.juggling import juggle
from bouncing_disk_ros.measured import fit_options, impact_times
from bouncing_disk_ros.nodes import echo_impacts, perform
from bouncing_disk_ros.nodes.demo import demo
from bouncing_disk_ros.nodes.recorder import recorder_options as recorder_options
from bouncing_disk_ros.ros.qos import message_class
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.run.programmes import load_programme, parse_programme
from bouncing_disk_ros.study.by_name import definition_of
from bouncing_disk_ros.topics import SERVICES, TOPICS
from bouncing_disk_ros.workbench import workbench
from support.processes import finished

ROOT = Path(__file__).resolve().parents[2]
FILES = (ROOT / "README.md", *(ROOT / "docs").glob("*.md"))
PAGES = {path.name: path.read_text("utf-8") for path in FILES}
TABLES = {
    "simulator": parameters.TABLE,
    "perform": perform.OPTIONS,
    "echo_impacts": echo_impacts.OPTIONS,
    "demo": demo.OPTIONS,
    "fit_impacts": fit_options.OPTIONS,
    "impact_times": impact_times.OPTIONS,
    "juggle": juggle.OPTIONS,
    "recorder": recorder_options.OPTIONS,
    "workbench": workbench.OPTIONS,
    **{name: definition_of(name).table for name in STUDIES},
}
#: plugins by name alone: the entry point of an installed package would register ours twice; and
#: `colcon test` hands its options down in a variable: the child would overwrite its report
NO_PYTEST_SETTINGS = {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTEST_ADDOPTS": None}


RUN_ALL = """
import os, runpy, sys
scripts, options = sys.argv[1:sys.argv.index("-q")], sys.argv[sys.argv.index("-q"):]
for file in scripts:
    print(file)
    os.chdir(os.path.dirname(file))
    runpy.run_path(file, run_name="__main__")
import pytest
sys.exit(pytest.main(options))
"""


def is_fragment(block: str) -> bool:
    """Whether a block does not run by itself: a part of a callback, or a node without end."""
    inner = "cloud" in block and "stepped_simulator" not in block
    return inner or "rclpy.spin(" in block  # test_lockstep_processes runs that one


def commands() -> list[str]:
    """Every ros2 command in code blocks and in code spans."""
    found = []
    for text in PAGES.values():
        blocks = "\n".join(re.findall(r"```sh\n(.*?)```", text, re.DOTALL))
        spans = re.findall(r"`(ros2 [^`]+)`", text)
        found += [line for line in [*blocks.splitlines(), *spans] if line.startswith("ros2 ")]
    general = ("…", " NAME", " name value")
    whole = {line for line in found if not any(word in line for word in general)}
    return sorted(whole - {"ros2 topic pub --once"})


def blocks(kind: str) -> list[tuple[str, str]]:
    return [
        (page, block)
        for page, text in PAGES.items()
        for block in re.findall(rf"```{kind}\n(.*?)```", text, re.DOTALL)
    ]


def fill(message: Any, values: dict[str, Any]) -> None:
    """As `ros2 topic pub` fills a message; unknown names are AttributeErrors."""
    for name, value in values.items():
        field = getattr(message, name)
        if isinstance(value, dict):
            fill(field, value)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            kind = message.get_fields_and_field_types()[name].removeprefix("sequence<").rstrip(">")
            package, short = kind.split("/")
            items = [message_class(f"{package}/msg/{short}")() for _ in value]
            for item, content in zip(items, value, strict=True):
                fill(item, content)
            setattr(message, name, items)
        else:
            setattr(message, name, type(field)(value) if isinstance(field, float) else value)


def check_run(name: str, *rest: str) -> None:
    assert name in EXECUTABLES
    for given in (value for word, value in pairwise(rest) if word == "-p"):
        key, value = given.split(":=")
        if key != "use_sim_time":
            TABLES[name][key].checked(yaml.safe_load(value))
        if key == "preset" and not value.startswith("./"):  # a file that fit_impacts writes
            load_preset(value)
    if name == "perform" and rest and rest[0] not in ("--ros-args", "./mine.yaml"):
        load_programme(rest[0])


def check_publication(topic: str, kind: str, content: str) -> None:
    assert TOPICS[topic.removeprefix("/")].type == kind
    fill(message_class(kind)(), yaml.safe_load(content))


def check_call(service: str, kind: str, content: str = "{}") -> None:
    assert SERVICES[service.replace("/bouncing_disk", "~")].type == kind
    fill(message_class(kind).Request(), yaml.safe_load(content))


def check_setting(node: str, name: str, value: str) -> None:
    spec = {"/bouncing_disk": parameters.TABLE, "/juggle": juggle.OPTIONS}[node][name]
    assert not spec.read_only
    spec.checked(yaml.safe_load(value))


def check_launch(package: str, file: str, *arguments: str) -> None:
    assert package == "bouncing_disk_ros"
    text = (ROOT / "launch" / file).read_text("utf-8")
    own = [argument for argument in arguments if argument != "--show-args"]
    assert all(f'"{argument.split(":=")[0]}"' in text for argument in own)


def check_transition(node: str, transition: str) -> None:
    assert node == "/bouncing_disk"
    assert transition in ("configure", "activate", "deactivate", "cleanup", "shutdown")


def check_topic(*words: str) -> None:
    others = ("/diagnostics", "/juggle/status")
    assert words[-1] in others or words[-1].removeprefix("/") in TOPICS


KINDS: dict[tuple[str, ...], Callable[..., None]] = {
    ("run", "bouncing_disk_ros"): check_run,
    ("topic", "pub", "--once"): check_publication,
    ("topic", "echo"): check_topic,
    ("topic", "info"): check_topic,
    ("service", "call"): check_call,
    ("param", "set"): check_setting,
    ("launch",): check_launch,
    ("lifecycle", "set"): check_transition,
    ("node", "list"): lambda: None,
    ("topic", "list"): lambda: None,
}


def test_commands_name_what_exists() -> None:
    for command in commands():
        words = [word for word in shlex.split(command, comments=True)[1:] if word != ">"]
        kind = next(kind for kind in KINDS if tuple(words[: len(kind)]) == kind)
        KINDS[kind](*words[len(kind) :])


def test_parameter_files_are_found_from_any_folder() -> None:
    share = "$(ros2 pkg prefix --share bouncing_disk_ros)/"
    files = [line.split("--params-file ")[1] for line in commands() if "--params-file " in line]
    assert len(files) > 10
    for file in files:
        assert file.startswith(share)
        assert (ROOT / file.removeprefix(share).split()[0]).is_file()


def test_each_command_of_a_study_has_its_line_without_ros2() -> None:
    lines = PAGES["studies.md"].splitlines()
    share = "$(ros2 pkg prefix --share bouncing_disk_ros)/"
    with_ros2 = [place for place, line in enumerate(lines) if line.startswith("ros2 run ")]
    assert len(with_ros2) >= 2 + len(STUDIES)
    for place in with_ros2:
        wanted = lines[place].replace("ros2 run", "python -m", 1).replace(share, "")
        assert lines[place + 1] == wanted
    for name in STUDIES:
        section = PAGES["studies.md"].split(f"\n## {name}\n")[1].split("\n## ")[0]
        assert f"ros2 run bouncing_disk_ros {name} " in section
        assert "```python\n" in section, name


def run_blocks(
    chosen: list[tuple[str, str]], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each block by itself: here, for imports take most of the time.

    Those with nodes are in one process of their own, scripts before tests.
    """
    home = str(Path(bouncing_disk_ros.__file__).resolve().parents[1])
    plugins = ("-p", "no:cacheprovider", "-p", "bouncing_disk_ros.testing")
    tests: list[str] = []
    scripts: list[str] = []
    for number, (page, block) in enumerate(chosen):
        file = folder / page / f"test_block_{number}.py"
        file.parent.mkdir(exist_ok=True)
        file.write_text(block, "utf-8")
        if "def test_" in block:
            tests.append(str(file))
        elif "rclpy" in block or "SimulatorNode" in block:
            scripts.append(str(file))
        else:
            monkeypatch.chdir(file.parent)
            runpy.run_path(str(file), run_name="__main__")
    plt.close("all")
    if not scripts + tests:
        return
    command = (sys.executable, "-c", RUN_ALL, *scripts, "-q", *plugins, *tests)
    env = {**NO_PYTEST_SETTINGS, "PYTHONPATH": home}
    finished(*command, env=env, cwd=folder, timeout=280.0)


LONG = "studies.md"
"""Its blocks take 30 s; test_public_names.py computes each of its studies."""


@pytest.mark.timeout(300)
@pytest.mark.parametrize("long", [False, pytest.param(True, marks=pytest.mark.interop)])
def test_python_runs(long: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    chosen = [(page, text) for page, text in blocks("python") if (page == LONG) == long]
    whole = [(page, text) for page, text in chosen if not is_fragment(text)]
    run_blocks(whole, tmp_path, monkeypatch)


def test_programmes_are_sound() -> None:
    for page, block in blocks("yaml"):
        parse_programme(page, yaml.safe_load(block))


def test_links_lead_somewhere() -> None:
    for page, text in PAGES.items():
        folder = ROOT if page == "README.md" else ROOT / "docs"
        for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", text):
            assert target.startswith("http") or (folder / target).exists(), (page, target)


def dotted_names() -> list[tuple[str, str]]:
    """Names within packages of ours in code spans, but those of a variable called like one."""
    packages = {path.name for path in Path(bouncing_disk_ros.__file__).parent.iterdir()}
    found = set()
    for page, text in PAGES.items():
        spans = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
        for name in re.findall(r"`(?:bouncing_disk_ros\.)?([a-z_]+(?:\.\w+)+)`", spans):
            first = name.split(".")[0]
            if first in packages and f" as {first}:" not in text:
                found.add((page, name))
    return sorted(found)


def test_names_within_the_package_exist() -> None:
    for _, name in dotted_names():
        pkgutil.resolve_name(f"bouncing_disk_ros.{name}")


# security.md --------------------------------------------------------------------------------------
def test_each_promise_of_the_security_page_names_a_test_that_exists() -> None:
    page = PAGES["security.md"]
    rows = [line for line in page.splitlines() if line.startswith("| ")][1:]
    assert len(rows) >= 6
    assert [row for row in rows if "`test_" not in row] == []
    named = re.findall(r"`(test_\w+\.py)(?:::(test_\w+))?`", page)
    assert page.count("`test_") == len(named) >= 25
    for file, function in named:
        (path,) = (ROOT / "test").rglob(file)
        assert f"def {function}(" in path.read_text("utf-8") or not function, function
