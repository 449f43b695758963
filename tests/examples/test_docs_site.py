"""The documentation builds as a site without a warning, and its pages ask no other host for anything."""

import importlib.util
import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("mkdocs", reason="the extra `tests` is not installed")

ROOT = Path(__file__).parents[2]
CONFIG = ROOT / "docs" / "site" / "mkdocs.yml"
LOADS = {"script": "src", "img": "src", "iframe": "src", "source": "src", "link": "href", "use": "href"}
NO_LOAD = {"canonical", "next", "prev"}
"""Relations of a link that a browser does not fetch."""


@pytest.fixture(scope="module")
def hooks():
    spec = importlib.util.spec_from_file_location("docs_site_hooks", ROOT / "docs" / "site" / "hooks.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Built, with every warning an error."""
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "-q", "--strict", "-f", CONFIG, "-d", folder],
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder


class Loads(HTMLParser):
    """What a page makes a browser fetch."""

    def __init__(self):
        super().__init__()
        self.found = []

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        address = given.get(LOADS.get(tag, ""))
        if address and not NO_LOAD & set((given.get("rel") or "").split()):
            self.found.append(address)


@pytest.mark.slow
def test_no_page_loads_anything_from_another_host(site):
    for path in site.rglob("*.html"):
        text = path.read_text(encoding="utf-8")
        loads = Loads()
        loads.feed(text)
        assert not [address for address in loads.found if re.match(r"(https?:)?//", address)], path
        assert "mermaid" not in text, f"{path}: its renderer would be fetched from another host"
    for path in site.rglob("*.css"):
        assert not re.search(r"(url\(|@import)\s*['\"]?(https?:)?//", path.read_text(encoding="utf-8")), path


@pytest.mark.slow
def test_equations_sources_and_public_names_are_in_the_site(site):
    assert (site / "fusion.html").read_text().count('<svg role="img"') > 4
    assert "groundstation.scenario.load" in (site / "api.html").read_text()
    assert (site / "source" / "groundstation" / "fusion" / "fix_judge.py.html").is_file()


def test_a_row_without_its_file_is_left_out_and_a_file_without_a_row_stands_at_the_end(hooks):
    rows = [{"Start": ["index.md", {"Not yet": "how_to/no_such_page.md"}]}, {"Gone": ["gone.md"]}]
    made = hooks.on_config(SimpleNamespace(nav=rows, mdx_configs={}))
    assert made.nav[0] == {"Start": ["index.md"]}
    assert [*made.nav[-1]] == ["More"]
    assert "fusion.md" in made.nav[-1]["More"]
    assert len(made.nav) == 2


def test_a_link_out_of_the_docs_leads_to_a_page_of_its_own(hooks):
    assert hooks._path("how_to/replay.md", "../../README.md") == "README.md"
    assert hooks._path("how_to/replay.md", "../frames.md") == ""
    assert hooks._path("how_to/replay.md", "https://example.org/x.md") == ""
    assert hooks._shown("README.md").startswith("---\ntitle: README.md")


@pytest.mark.parametrize("page", sorted((ROOT / "docs").rglob("*.md")), ids=lambda page: page.name)
def test_every_equation_can_be_drawn(hooks, page):
    for source in re.findall(r"^```math\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S):
        drawn = hooks._equation(source, "", "", None, None)
        assert drawn.count("<svg") == source.count("\\\\") + 1
