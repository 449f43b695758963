"""What a mutant of a Python file is: one small change of its syntax tree, and all that there are.

Left alone are words for people (docstrings, texts), annotations and declarations of enum members.
"""

import ast
import copy
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
ARITHMETIC: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.LShift: ast.RShift,
}
LARGE = 1000
"""Whole numbers from here on are nanoseconds or sizes: one more is nothing, a tenth more is not."""
Shown = ast.stmt | ast.expr
Change = Callable[[ast.AST], ast.AST]


@dataclass(frozen=True)
class Mutant:
    """One change of one file.

    Attributes:
        file: Path from the root of the checkout.
        line: Of the change.
        before, after: The statement, or its first line, as it was and as it is.
        index, change: Which node of the tree, in the order of ``ast.walk``, becomes what.
    """

    file: str
    line: int
    before: str
    after: str
    source: str
    index: int
    change: Change

    @property
    def key(self) -> tuple[str, str, str]:
        """What it is known by in the list of those that change nothing."""
        return self.file, self.before, self.after

    def tree(self) -> ast.Module:
        """The whole file, changed."""
        return _changed(self.source, self.index, self.change)

    def __str__(self) -> str:
        return f"{self.file}:{self.line}\n-   {self.before}\n+   {self.after}"


def mutants_of(root: Path, file: str) -> Iterator[Mutant]:
    """All mutants of a file."""
    source = (root / file).read_text(encoding="utf-8")
    tree = ast.parse(source)
    whole = list(ast.walk(tree))
    statement = _statements(tree)
    skipped = _left_alone(tree)
    for index, node in enumerate(whole):
        if node in skipped or node not in statement:
            continue
        for change in _changes(node):
            line = getattr(node, "lineno", 0)
            before = _first_lines(statement[node])
            changed = _changed(source, index, change)
            after = _difference(before, statement[node], tree, changed)
            yield Mutant(file, line, before, after, source, index, change)


def _changed(source: str, index: int, change: Change) -> ast.Module:
    tree = ast.parse(source)
    target = list(ast.walk(tree))[index]

    class Swap(ast.NodeTransformer):
        def visit(self, node: ast.AST) -> ast.AST:
            if node is target:
                return ast.copy_location(change(copy.deepcopy(node)), node)
            return self.generic_visit(node)

    swapped: ast.Module = Swap().visit(tree)
    return ast.fix_missing_locations(swapped)


def _statements(tree: ast.Module) -> dict[ast.AST, Shown]:
    """The innermost statement of each node; in a table, the row."""
    found: dict[ast.AST, Shown] = {}

    def go(node: ast.AST, inside: Shown | None) -> None:
        is_row = isinstance(node, ast.Call) and isinstance(inside, ast.Assign | ast.AnnAssign)
        inside = node if isinstance(node, ast.stmt) or is_row else inside
        if inside is not None:
            found[node] = inside
        for child in ast.iter_child_nodes(node):
            go(child, inside)

    go(tree, None)
    return found


def _first_lines(node: Shown) -> str:
    """A statement in one line, of a compound one its head."""
    text = ast.unparse(node)
    lines = text.splitlines()
    return next((line for line in lines if not line.startswith("@")), text)


def _difference(before: str, statement: Shown, tree: ast.Module, changed: ast.Module) -> str:
    """The head of the changed statement; where it is the same, the line inside that differs."""
    path = _path_of(tree, statement)
    node: ast.AST = changed
    for field, at in path:
        value = getattr(node, field)
        node = value if at is None else value[at]
    assert isinstance(node, ast.stmt | ast.expr)
    after = _first_lines(node)
    if after != before:
        return after
    old, new = ast.unparse(statement).splitlines(), ast.unparse(node).splitlines()
    return next((line.strip() for a, line in zip(old, new, strict=False) if a != line), "(dropped)")


def _path_of(tree: ast.AST, target: ast.AST) -> list[tuple[str, int | None]]:
    for field, value in ast.iter_fields(tree):
        children = value if isinstance(value, list) else [value]
        for at, child in enumerate(children):
            if not isinstance(child, ast.AST):
                continue
            step = field, at if isinstance(value, list) else None
            if child is target:
                return [step]
            inner = _path_of(child, target)
            if inner:
                return [step, *inner]
    return []


def _left_alone(tree: ast.Module) -> set[ast.AST]:
    """Annotations, decorators, texts that stand alone, bases, enum members, ``__all__``."""
    found: set[ast.AST] = set()
    for node in ast.walk(tree):
        given: list[ast.AST | None] = []
        match node:
            case ast.FunctionDef():
                given = [node.returns, *node.decorator_list]
            case ast.arg() | ast.AnnAssign():
                given = [node.annotation]
            case ast.ClassDef():
                given = [*node.bases, *node.decorator_list]
                if any("Enum" in ast.unparse(base) for base in node.bases):
                    given += [line for line in node.body if isinstance(line, ast.Assign)]
            case ast.Expr(value=ast.Constant()):
                given = [node]
            case ast.Assert():
                given = [node]
        for part in given:
            if part is not None:
                found.update(ast.walk(part))
    return found


def _changes(node: ast.AST) -> Iterator[Change]:
    match node:
        case ast.Compare():
            for at, operator in enumerate(node.ops):
                for other in COMPARISONS[type(operator)]:
                    yield _comparing(at, other)
        case ast.BinOp() if type(node.op) in ARITHMETIC and not _is_text(node):
            yield _calculating(ARITHMETIC[type(node.op)])
        case ast.AugAssign() if type(node.op) in ARITHMETIC:
            yield _calculating(ARITHMETIC[type(node.op)])
        case ast.BoolOp():
            yield _joining(ast.Or if isinstance(node.op, ast.And) else ast.And)
        case ast.UnaryOp(op=ast.Not() | ast.USub()):
            yield lambda found: found.operand  # type: ignore[attr-defined,no-any-return]
        case ast.Constant(value=bool()):
            yield _constant(not node.value)
        case ast.Constant(value=int()) if abs(node.value) < LARGE:
            yield _constant(node.value + 1)
            yield _constant(node.value - 1)
        case ast.Constant(value=int()):
            yield _constant(node.value + node.value // 10)
            yield _constant(node.value - node.value // 10)
        case ast.Constant(value=float()):
            yield _constant(node.value * 1.1 if node.value else 1.0)
            yield _constant(node.value * 0.9 if node.value else -1.0)
        case ast.If() | ast.IfExp() | ast.While():
            yield _negated
        case ast.Return(value=ast.expr()) if not _is_plain(node.value):
            empty = isinstance(node.value, ast.Constant) and node.value.value == ""
            yield _returned("changed" if empty else None)  # as good as "" would be None
        case ast.Expr(value=ast.Yield() | ast.YieldFrom() | ast.Call()):
            yield lambda _: ast.Pass()
        case ast.Continue():
            yield lambda _: ast.Break()
        case ast.Break():
            yield lambda _: ast.Continue()


def _is_text(node: ast.BinOp) -> bool:
    return any(isinstance(side, ast.JoinedStr) for side in (node.left, node.right))


def _is_plain(node: ast.expr | None) -> bool:
    """None already; or true or false, which are changed by themselves."""
    return isinstance(node, ast.Constant) and (node.value is None or isinstance(node.value, bool))


def _comparing(at: int, other: type[ast.cmpop]) -> Change:
    def change(node: ast.AST) -> ast.AST:
        assert isinstance(node, ast.Compare)
        node.ops[at] = other()
        return node

    return change


def _calculating(other: type[ast.operator]) -> Change:
    def change(node: ast.AST) -> ast.AST:
        assert isinstance(node, ast.BinOp | ast.AugAssign)
        node.op = other()
        return node

    return change


def _joining(other: type[ast.boolop]) -> Change:
    def change(node: ast.AST) -> ast.AST:
        assert isinstance(node, ast.BoolOp)
        node.op = other()
        return node

    return change


def _constant(value: float) -> Change:
    return lambda _: ast.Constant(value)


def _returned(value: str | None) -> Change:
    return lambda _: ast.Return(ast.Constant(value))


def _negated(node: ast.AST) -> ast.AST:
    assert isinstance(node, ast.If | ast.IfExp | ast.While)
    node.test = ast.UnaryOp(ast.Not(), node.test)
    return node
