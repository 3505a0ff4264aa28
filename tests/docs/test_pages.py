"""The pages agree with the program: commands, messages, interfaces and public names."""

from __future__ import annotations

import ast
import inspect
import re
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest
from support.followed import ROOT
from support.pages import commands, known_commands

import tactile_core
from tactile_core.bundles.manifest import FORMAT
from tactile_core.interfaces.hookspecs import GROUP
from tactile_core.profiles.loader import list_rigs, load_profile

DOCS = ROOT / "docs"
KNOWN = known_commands()
GAP = "…"


def page(name: str) -> str:
    """Return the text of a page."""
    return (DOCS / f"{name}.md").read_text(encoding="utf-8")


def section(text: str, heading: str) -> str:
    """Return the text below a heading, up to the next one."""
    return text.split(f"\n## {heading}\n")[1].split("\n## ")[0]


@cache
def messages() -> tuple[str, ...]:
    """Return every string of the program, with ``…`` for inserted values."""
    sources = [*ROOT.glob("tactile_core/**/*.py"), *ROOT.glob("plugins/*/tactile_*/*.py")]
    return tuple(text for path in sources for text in strings(path))


def strings(path: Path) -> list[str]:
    """Return the strings of one file, without docstrings."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = list(ast.walk(tree))
    docstrings = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    found = []
    for node in nodes:
        if id(node) in docstrings:
            continue
        if isinstance(node, ast.JoinedStr):
            parts = [v.value if isinstance(v, ast.Constant) else GAP for v in node.values]
            found.append("".join(map(str, parts)))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            found.append(node.value)
    return found


def quoted(text: str) -> list[str]:
    """Return the messages that a page quotes."""
    return re.findall(r"^> (.*)$", text, re.MULTILINE)


@pytest.mark.parametrize("message", quoted(page("how-to/troubleshooting")))
def test_a_quoted_message_exists_in_the_program(message: str) -> None:
    assert any(message in text for text in messages())


def test_troubleshooting_explains_every_symptom_or_its_remedy() -> None:
    symptoms = page("how-to/troubleshooting").split("\n### ")[1:]
    assert len(symptoms) >= 15
    assert [s.splitlines()[0] for s in symptoms if not re.search(r"\*\*(Means|Do):", s)] == []


def test_every_command_has_a_section() -> None:
    headings = re.findall(r"^## tactile ([\w-]+)$", page("reference/commands"), re.MULTILINE)
    assert sorted(headings) == sorted(KNOWN)


@pytest.mark.parametrize("name", sorted(KNOWN))
def test_the_section_of_a_command_names_its_options_and_has_an_example(name: str) -> None:
    text = section(page("reference/commands"), f"tactile {name}")
    options = {option for parameter in KNOWN[name].params for option in parameter.opts}
    options = {option for option in options if option.startswith("--")}
    assert options <= set(re.findall(r"`(--[\w-]+)`", text))
    assert {words[0] for words in commands(text)} == {name}


@pytest.mark.parametrize("path", sorted(DOCS.rglob("*.md")), ids=lambda path: path.stem)
def test_commands_and_options_on_every_page_exist(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    for name, *words in commands(text):
        if f'return {{"{name}": "' in text:
            continue  # the page itself adds the command
        options = {option for parameter in KNOWN[name].params for option in parameter.opts}
        assert {word for word in words if word.startswith("--")} <= options


@pytest.mark.parametrize(
    "name",
    ["reference/interfaces", "explanation/virtual-gel", "explanation/real-and-virtual-images"],
)
def test_the_examples_of_a_page_run(name: str) -> None:
    for code in re.findall(r"```python\n(.*?)```", page(name), re.DOTALL):
        exec(compile(code, f"docs/{name}.md", "exec", dont_inherit=True), {})


@pytest.mark.parametrize(
    "name", ["Camera", "Illumination", "Calibrator", "Calibration", "Artefact", "Estimator"]
)
def test_the_interfaces_page_names_every_method_to_implement(name: str) -> None:
    text = section(page("reference/interfaces"), name)
    interface = getattr(tactile_core, name)
    for method in interface.__dict__.get("__abstractmethods__", ()):
        assert f"`{method}" in text
    own = [m for m, _ in inspect.getmembers(interface, inspect.isfunction) if m in vars(interface)]
    hooks = [m for m in own if not m.startswith("_") and m not in {"read", "set"}]
    assert [m for m in hooks if f"`{m}" not in text] == []


def test_every_shipped_sensor_is_described_as_in_its_profile() -> None:
    text = page("reference/rigs")
    for entry in list_rigs():
        profile = load_profile(entry.name)
        assert f"`{entry.name}`" in text
        assert f"{profile.image.mm_per_px:g}" in text
        assert f"`{profile.calibration.use}`" in text


def promised(pattern: str) -> set[str]:
    """Return the names in backticks in the list of the public API."""
    return set(
        re.findall(pattern, section(page("reference/compatibility"), "Public").split("- **The")[0])
    )


def test_the_promised_names_are_the_public_names() -> None:
    short = promised(r"`(\w+)`") - {"tactile_core"}
    assert short == set(tactile_core.__all__)
    for full_name in promised(r"`(tactile_core\.[\w.]+)`"):
        module, _, name = full_name.rpartition(".")
        if not hasattr(import_module(module), name):
            import_module(full_name)  # a module, which nothing has imported yet


def test_the_promised_versions_match_the_program() -> None:
    text = page("reference/compatibility")
    assert f"| plugin interface | `{GROUP}` |" in text
    assert f"| bundle | `{FORMAT}` |" in text
    assert "| profile | `schema: 1` |" in text
