"""Each row of the table of faults is brought about in closed loop by a test that says so.

A test says it by ``@pytest.mark.provokes("row")``; a new row without one, or a mark without its row, fails.
"""

import ast
from pathlib import Path

import pytest

from groundstation.supervision.faults import FAULTS

CLOSED_LOOP = Path(__file__).parents[1] / "closed_loop"


def names_of(mark: ast.Call, constants: dict[str, tuple[str, ...]]) -> list[str]:
    """The rows that a mark names, one by one or as a tuple of the module."""
    names: list[str] = []
    for argument in mark.args:
        if isinstance(argument, ast.Starred):
            assert isinstance(argument.value, ast.Name)
            names += constants[argument.value.id]
        else:
            names.append(ast.literal_eval(argument))
    return names


def provoked() -> list[tuple[str, str, str]]:
    """Rows with the file and the test that say to bring them about."""
    found = []
    for path in sorted(CLOSED_LOOP.rglob("test_*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        constants = {
            node.targets[0].id: ast.literal_eval(node.value)
            for node in tree.body
            if isinstance(node, ast.Assign)
            and isinstance(node.targets[0], ast.Name)
            and isinstance(node.value, ast.Tuple)
            and all(isinstance(element, ast.Constant) for element in node.value.elts)
        }
        for node in ast.walk(tree):
            for mark in getattr(node, "decorator_list", ()):
                if isinstance(mark, ast.Call) and ast.unparse(mark.func) == "pytest.mark.provokes":
                    found += [(row, path.name, node.name) for row in names_of(mark, constants)]
    return found


PROVOKED = provoked()


@pytest.mark.parametrize("fault", FAULTS)
def test_a_row_is_provoked_by_a_test_of_the_closed_loop(fault):
    assert fault in {row for row, _, _ in PROVOKED}, (
        f"no test in tests/closed_loop is marked @pytest.mark.provokes({fault!r})"
    )


@pytest.mark.parametrize(("fault", "file", "test"), PROVOKED)
def test_a_mark_names_a_row_and_its_test_looks_for_it(fault, file, test):
    assert fault in FAULTS, f"{file}: {test} provokes {fault!r}, which is no row of the table"
    (path,) = CLOSED_LOOP.rglob(file)
    tree = ast.parse(path.read_text(encoding="utf-8"))
    (body,) = [node.body for node in ast.walk(tree) if getattr(node, "name", "") == test]
    text = "\n".join(map(ast.unparse, body))
    helpers = [node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name in text]
    looked_at = text + "".join(map(ast.unparse, helpers))
    assert fault in looked_at or "FOUND" in looked_at, f"{file}: {test} never speaks of {fault}"
