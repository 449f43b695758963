"""What mkdocs does not bring: tolerant navigation, files outside ``docs``, lists as on GitHub, equations.

Called by mkdocs while it builds; `mkdocs.yml` beside it names this file.
"""

import html
import posixpath
import re
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.path import Path as Outline
from matplotlib.textpath import TextPath
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
Row = str | dict[str, Any]
SOURCE = "source"
"""Where files that pages link to, but that are no pages, stand in the site."""
LINK = re.compile(r"(?<=\]\()([^)\s#]+)(#[^)\s]*)?(?=\))")
FENCE = re.compile(r"^\s*(```|~~~)")
ITEM = re.compile(r"^(?:[-*]|\d+\.) ")
Z = Outline.CLOSEPOLY
LETTERS = {Outline.MOVETO: "M", Outline.LINETO: "L", Outline.CURVE3: "Q", Outline.CURVE4: "C", Z: "Z"}
LANGUAGES = {".py": "python", ".toml": "toml", ".c": "c", ".h": "c", ".md": "markdown", ".json": "json"}


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Leave out rows without a file, add files without a row, and let ```` ```math ```` be an equation."""
    nav = [row for row in map(_existing, config.nav or []) if row]
    named = set(_pages(nav))
    rest = [
        path.relative_to(DOCS).as_posix()
        for path in sorted(DOCS.rglob("*.md"))
        if path.parent.name not in ("decisions", "site")
    ]
    if missing := [page for page in rest if page not in named]:
        nav.append({"More": missing})
    config.nav = nav
    fences = config.mdx_configs.setdefault("pymdownx.superfences", {}).setdefault("custom_fences", [])
    fences.append({"name": "math", "class": "math", "format": _equation})
    return config


def _existing(row: Row) -> Row | None:
    """The row without what names no file; empty if nothing is left."""
    if isinstance(row, str):
        return row if (DOCS / row).is_file() else None
    ((title, inside),) = row.items()
    kept = (
        [each for each in map(_existing, inside) if each] if isinstance(inside, list) else _existing(inside)
    )
    return {title: kept} if kept else None


def _pages(rows: list[Row]) -> list[str]:
    """Files that rows name, at any depth."""
    found: list[str] = []
    for row in rows:
        inside = row if isinstance(row, str) else next(iter(row.values()))
        found += _pages(inside) if isinstance(inside, list) else [inside]
    return found


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add a page for each file or folder outside ``docs`` that a page links to."""
    for target in sorted({each for page in files.documentation_pages() for each in _outside(page)}):
        files.append(File.generated(config, _page_of(target), content=_shown(target)))
    return files


def _outside(page: File) -> list[str]:
    """Paths from the project's folder that a page links to outside ``docs``."""
    text = page.content_string
    return [path for found in LINK.finditer(text) if (path := _path(page.src_uri, found[1]))]


def _path(page: str, target: str) -> str:
    """Where a link of a page leads, from the project's folder; empty if inside ``docs`` or elsewhere."""
    if re.match(r"[a-z]+:", target) or target.startswith("/"):
        return ""
    path = posixpath.normpath(posixpath.join("docs", posixpath.dirname(page), target))
    is_outside = not path.startswith(("docs/", "..")) and path != "docs"
    return path if is_outside and (ROOT / path).exists() else ""


def _page_of(target: str) -> str:
    return f"{SOURCE}/{target}.md"


def _shown(target: str) -> str:
    """A page that shows a file, or what a folder holds."""
    path = ROOT / target
    head = f"---\ntitle: {target}\nsearch: {{ exclude: true }}\n---\n\n# `{target}`\n\n"
    if path.is_dir():
        names = sorted(each.name + "/" * each.is_dir() for each in path.iterdir() if each.name[0] not in "._")
        return head + "".join(f"- `{name}`\n" for name in names)
    text = path.read_text(encoding="utf-8").rstrip("\n")
    return f"{head}````{LANGUAGES.get(path.suffix, 'text')}\n{text}\n````\n"


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Lead links out of ``docs`` to their pages, and begin lists where GitHub would."""
    del config, files
    here = page.file.src_uri
    if here.startswith(f"{SOURCE}/"):
        return markdown

    def led(found: re.Match[str]) -> str:
        path = _path(here, found[1])
        if not path:
            return found[0]
        return posixpath.relpath(_page_of(path), posixpath.dirname(here) or ".")

    lines, is_code = [], False
    for line in markdown.splitlines():
        is_code ^= bool(FENCE.match(line))
        before = lines[-1] if lines else ""
        if not is_code and ITEM.match(line) and before and not ITEM.match(before) and before[0] != " ":
            lines.append("")
        lines.append(line if is_code else LINK.sub(led, line))
    return "\n".join(lines)


def _equation(
    source: str, language: str, css_class: str, options: object, md: object, **kwargs: object
) -> str:
    """TeX as a drawing inside the page: nothing is loaded, and it takes the colour of the text."""
    del language, css_class, options, md, kwargs
    return f'<div class="math">{"".join(map(_drawn, filter(None, source.split(chr(92) * 2))))}</div>'


def _drawn(tex: str) -> str:
    """One line of TeX as a single outline; units of the drawing are hundredths of the text's size."""
    line = " ".join(tex.split())
    with rc_context({"mathtext.fontset": "stix"}):
        outline = TextPath((0, 0), f"${line}$", size=100)
    steps = []
    for points, code in outline.iter_segments(simplify=False):
        steps.append(
            LETTERS[code] + " ".join(f"{x:.0f} {-y:.0f}" for x, y in points.reshape(-1, 2) if code != Z)
        )
    box = outline.get_extents()
    width, height = box.width + 10, box.height + 10
    return (
        f'<svg role="img" aria-label="{html.escape(line)}" fill="currentColor"'
        f' style="height: {height / 100:.2f}em" viewBox="{box.x0 - 5:.0f} {-box.y1 - 5:.0f} {width:.0f}'
        f' {height:.0f}"><path d="{"".join(steps)}"/></svg>'
    )
