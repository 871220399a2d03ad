"""`make docs` builds the guides and the API without a warning; every public name is there."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

import bouncing_disk_ros
from support.processes import finished

#: Sphinx takes half a minute; test_public_names.py holds that each name has its section
pytestmark = [pytest.mark.interop, pytest.mark.timeout(300)]

ROOT = Path(__file__).resolve().parents[2]
#: where Sphinx may be besides this interpreter's own packages
OWN = ":".join(path for path in sys.path if path.endswith("site-packages"))
PAGES = sorted(path.stem for path in (ROOT / "docs").glob("*.md"))


def make(*words: str | Path, code: int = 0) -> subprocess.CompletedProcess[str]:
    home = Path(bouncing_disk_ros.__file__).resolve().parents[1]
    env = {"PYTHONPATH": f"{home}:{ROOT / 'tools'}:{OWN}"}
    return finished(sys.executable, *words, code=code, env=env, timeout=250.0)


@pytest.fixture(scope="module")
def html(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if any(importlib.util.find_spec(name) is None for name in ("furo", "myst_parser", "sphinx")):
        pytest.skip("Sphinx is not installed here: pip install .[docs]")
    folder = tmp_path_factory.mktemp("docs")
    done = make(ROOT / "tools" / "make_docs.py", folder)
    assert done.stderr == ""
    return folder / "html"


def test_every_public_name_has_an_entry(html: Path) -> None:
    page = "".join(path.read_text("utf-8") for path in sorted(html.glob("api_*.html")))
    modules = {"__version__", "bag", "plots", "study"}
    for name in set(bouncing_disk_ros.__all__) - modules:
        assert f'.{name}">' in page, name
    for name in bouncing_disk_ros.plots.__all__:
        assert f'id="bouncing_disk_ros.plots.{name}"' in page, name
    assert "Alias for field number" not in page
    assert "&lt;factory&gt;" not in page


@pytest.mark.parametrize("page", PAGES)
def test_every_guide_is_a_page_in_the_menu(html: Path, page: str) -> None:
    assert (html / f"{page}.html").is_file()
    assert f'href="{page}.html"' in (html / "index.html").read_text("utf-8")


BROKEN = """
import sys
from pathlib import Path

import make_docs

make_docs.copy_guides = lambda source: None
make_docs.api = lambda: {"api.md": "# API"}
make_docs.index = lambda: "# A page\\n\\n```{toctree}\\napi\\n```\\n\\n[lost](nowhere.md)"
sys.exit(0 if make_docs.build(Path(sys.argv[1])) else 1)
"""


def test_a_link_to_nowhere_is_an_error(html: Path, tmp_path: Path) -> None:
    done = make("-c", BROKEN, tmp_path, code=1)
    assert done.stderr.count("WARNING") == 1
    assert "'nowhere.md'" in done.stderr
