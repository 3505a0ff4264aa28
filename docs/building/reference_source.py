"""Signature, docstring and members of public names, from the source and without imports."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = "tactile_core"

_WIDTH = 88


@dataclass(frozen=True)
class Entry:
    """A public function, class, method, property or constant.

    Attributes
    ----------
    name : str
        Short name; a method has its class in front.
    signature : str
        Python code.
    docstring : str
        Without indentation; empty if there is none.
    members : list of Entry
        Public methods and properties of a class, in the order of the source.
    """

    name: str
    signature: str
    docstring: str
    members: list[Entry] = field(default_factory=list)


@cache
def module_of(name: str) -> ast.Module:
    """Parse a module of the package by its full name."""
    return ast.parse(_text(name))


def _text(name: str) -> str:
    path = _path(name)
    path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return path.read_text(encoding="utf-8")


def modules_below(name: str) -> list[str]:
    """Return the full names of a package and its modules, or of a module, in order."""
    folder = _path(name)
    if not folder.is_dir():
        return [name]
    below = sorted(path.stem for path in folder.glob("*.py") if path.stem != "__init__")
    return [name, *(f"{name}.{module}" for module in below)]


def _code(node: ast.AST) -> str:
    """Return source code, with double quotes where that is possible."""
    code = ast.unparse(node)
    return code if '"' in code else code.replace("'", '"')


def _path(name: str) -> Path:
    """Return the folder of a package, or the path of a module without its ending."""
    package, *rest = name.split(".")
    distribution = ROOT / "plugins" / package.replace("_", "-")
    return (ROOT if package == PACKAGE else distribution) / Path(package, *rest)


def _stub(package: str) -> list[ast.stmt]:
    """Return the statements of a package's stub, which says where its names are; [] without one."""
    path = _path(package) / "__init__.pyi"
    return ast.parse(path.read_text(encoding="utf-8")).body if path.is_file() else []


def public_names() -> list[str]:
    """Return the full names of everything that the package offers at its top."""
    return [
        f"{PACKAGE}.{node.module}.{alias.name}"
        for node in _stub(PACKAGE)
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    ]


def entry(full_name: str) -> Entry:
    """Return the entry of one name; imports are followed to the definition."""
    module, _, name = full_name.rpartition(".")
    for node in module_of(module).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == name:
            return _entry(node)
    for constant in _constants(module):
        if constant.name == name:
            return constant
    for node in [*ast.walk(module_of(module)), *_stub(module)]:
        if isinstance(node, ast.ImportFrom) and any(alias.name == name for alias in node.names):
            return entry(f"{f'{module}.' * node.level}{node.module}.{name}")
    raise LookupError(f"{module} defines no {name}")


def entries(module: str) -> list[Entry]:
    """Return the public functions, classes and documented constants of a module."""
    constants = (one for one in _constants(module) if _is_public(one.name))
    return [*constants, *_public(module_of(module).body)]


def docstring(module: str) -> str:
    """Return a module's docstring."""
    return ast.get_docstring(module_of(module)) or ""


def _public(body: list[ast.stmt], prefix: str = "") -> Iterator[Entry]:
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and (
            not node.name.startswith("_") or _abstract(node)
        ):
            yield _entry(node, prefix)


def _entry(node: ast.FunctionDef | ast.ClassDef, prefix: str = "") -> Entry:
    text = ast.get_docstring(node) or ""
    if isinstance(node, ast.FunctionDef):
        if "property" in _decorators(node) or "cached_property" in _decorators(node):
            kind = f": {_code(node.returns)}" if node.returns else ""
            return Entry(prefix + node.name, prefix + node.name + kind, text)
        return Entry(prefix + node.name, _call(prefix + node.name, node), text)
    functions = [member for member in node.body if isinstance(member, ast.FunctionDef)]
    members = [m for m in _public(list(functions), f"{node.name}.") if m.docstring]
    return Entry(node.name, _class(node), text, members)


def _constants(module: str) -> Iterator[Entry]:
    """Yield the names that a module assigns to, each with the comment beside or above it."""
    lines = _text(module).split("\n")
    for node in module_of(module).body:
        targets = node.targets if isinstance(node, ast.Assign) else []
        if len(targets) != 1 or not isinstance(targets[0], ast.Name):
            continue
        name, first = targets[0].id, node.lineno - 1
        above = first
        while above and lines[above - 1].startswith("#"):
            above -= 1
        beside = lines[(node.end_lineno or node.lineno) - 1].partition("  # ")[2]
        said = [line.removeprefix("# ") for line in lines[above:first]]
        if said or beside:
            code = _code(node)
            short = code if len(code) <= _WIDTH else f"{name} = …"
            yield Entry(name, short, " ".join([*said, beside]).strip())


def _is_public(constant: str) -> bool:
    return constant.isupper() and not constant.startswith("_")


def _class(node: ast.ClassDef) -> str:
    """Return a class's header and how it is made."""
    bases = ", ".join(_code(base) for base in node.bases)
    header = f"class {node.name}({bases})" if bases else f"class {node.name}"
    for member in node.body:
        if isinstance(member, ast.FunctionDef) and member.name == "__init__":
            return f"{header}\n{_call(node.name, member)}"
    lines = [f"    {line}" for line in map(_field, node.body) if line]
    return "\n".join([header + (":" if lines else ""), *lines])


def _field(node: ast.stmt) -> str | None:
    """Return the declaration of a public field or of a member of an enumeration."""
    if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant):
        name = _code(node.targets[0])
        return None if name.startswith("_") else f"{name} = {_code(node.value)}"
    if not isinstance(node, ast.AnnAssign):
        return None
    name = _code(node.target)
    if name.startswith("_"):
        return None
    value = _default(node.value) if node.value is not None else ""
    return f"{name}: {_code(_plain(node.annotation))}{value and f' = {value}'}"


def _plain(annotation: ast.expr) -> ast.expr:
    """Drop what ``Annotated`` adds to a type."""
    if isinstance(annotation, ast.Subscript) and _code(annotation.value) == "Annotated":
        assert isinstance(annotation.slice, ast.Tuple)
        return annotation.slice.elts[0]
    return annotation


def _default(value: ast.expr) -> str:
    """Return a field's default; of ``Field(…)`` and ``field(…)`` the default within."""
    if not isinstance(value, ast.Call) or _code(value.func) not in {"Field", "field"}:
        return _code(value)
    if value.args:
        return "" if _code(value.args[0]) == "..." else _code(value.args[0])
    named = {word.arg: _code(word.value) for word in value.keywords}
    return named.get("default") or ("…" if "default_factory" in named else "")


def _call(name: str, node: ast.FunctionDef) -> str:
    """Return ``name(arguments) -> result``, over several lines where it is long."""
    arguments = [a for a in _arguments(node) if a not in {"self", "cls"}]
    result = f" -> {_code(node.returns)}" if node.returns and "__" not in node.name else ""
    line = f"{name}({', '.join(arguments)}){result}"
    if len(line) <= _WIDTH:
        return line
    return "\n".join([f"{name}(", *(f"    {argument}," for argument in arguments), f"){result}"])


def _arguments(node: ast.FunctionDef) -> list[str]:
    given = node.args
    positional = [*given.posonlyargs, *given.args]
    defaults = [None] * (len(positional) - len(given.defaults)) + list(given.defaults)
    done = [_argument(a, d) for a, d in zip(positional, defaults, strict=True)]
    if given.posonlyargs:
        done.insert(len(given.posonlyargs), "/")
    if given.vararg:
        done.append("*" + _argument(given.vararg, None))
    elif given.kwonlyargs:
        done.append("*")
    done += [_argument(a, d) for a, d in zip(given.kwonlyargs, given.kw_defaults, strict=True)]
    return done + (["**" + _argument(given.kwarg, None)] if given.kwarg else [])


def _argument(argument: ast.arg, default: ast.expr | None) -> str:
    kind = f": {_code(argument.annotation)}" if argument.annotation else ""
    equals = " = " if kind else "="
    return argument.arg + kind + (f"{equals}{_code(default)}" if default else "")


def _decorators(node: ast.FunctionDef) -> set[str]:
    return {_code(decorator).rpartition(".")[2] for decorator in node.decorator_list}


def _abstract(node: ast.stmt) -> bool:
    return isinstance(node, ast.FunctionDef) and "abstractmethod" in _decorators(node)
