"""A plugin adds commands, and a command whose distribution is absent says how to install it."""

from __future__ import annotations

from collections.abc import Mapping

import pytest
from support.command_line import refused, tactile
from support.own_plugins import Install

import tactile_core.cli.app as app
from tactile_core.errors import PluginError
from tactile_core.plugins import registry

GREETING = """\
from typing import Annotated

import typer

from tactile_core.cli.output import print_data
from tactile_core.errors import InputError


def greet(name: str, loud: Annotated[bool, typer.Option("--loud")] = False) -> None:
    \"\"\"Greet somebody.\"\"\"
    if not name.isalpha():
        raise InputError(f"{name} is no name; write letters")
    print_data(name.upper() if loud else name)
"""


@pytest.fixture
def lab(install: Install) -> None:
    install(
        "lab", {"greeting.py": GREETING}, tactile_commands={"greet-one": "own_lab.greeting:greet"}
    )


@pytest.mark.usefixtures("lab")
def test_an_added_command_takes_its_arguments_and_options() -> None:
    assert tactile("greet-one", "anna").stdout == "anna\n"
    assert tactile("greet-one", "anna", "--loud").stdout == "ANNA\n"
    assert "Greet somebody." in tactile("greet-one", "--help").stdout


@pytest.mark.usefixtures("lab")
def test_an_added_command_is_listed_after_those_of_the_core() -> None:
    listed = tactile("--help").stdout
    assert listed.index("devices") < listed.index("greet-one")
    assert "Greet somebody." in listed


@pytest.mark.usefixtures("lab")
def test_an_added_command_refuses_its_input_like_any_other() -> None:
    assert refused("greet-one", "4") == "tactile: 4 is no name; write letters\n"
    assert "greet-one" in refused("greet-two")


@pytest.mark.parametrize("command", app.ADDED_BY)
def test_an_absent_distribution_is_named_with_its_pip_command(
    monkeypatch: pytest.MonkeyPatch, command: str
) -> None:
    monkeypatch.setattr(app, "ADDED_BY", dict.fromkeys(app.ADDED_BY, "elsewhere"))
    monkeypatch.setattr(registry, "added_commands", dict)
    said = refused(command, "x")
    assert f"the command {command!r} needs the plugin 'elsewhere'" in said
    assert "pip install tactile-elsewhere" in said


@pytest.mark.parametrize(
    ("commands", "said"),
    [
        ({"greet": "own_lab.nothing:greet"}, "the command greet (own_lab.nothing:greet)"),
        ({"greet": "own_lab.greeting:__name__"}, "is not a function"),
        ({"Greet it": "own_lab.greeting:greet"}, "names of small letters, digits and '-'"),
    ],
)
def test_a_command_that_cannot_be_used_is_a_problem_of_its_plugin(
    install: Install, commands: Mapping[str, str], said: str
) -> None:
    install("lab", {"greeting.py": GREETING}, tactile_commands=commands)
    assert said in tactile("doctor").stdout


@pytest.mark.parametrize(
    ("module", "said"),
    [
        ("raise RuntimeError('no licence')", "no licence"),
        ("greet = 3", "is not a function"),
        ("from __future__ import annotations\ndef greet(name: Nothing): ...", "'Nothing'"),
        ("def greet(*names: str): ...", "to which nothing can be passed by name"),
        ("async def greet(name: str): ...", "does nothing when it is called"),
        ("def greet(name: str): yield name", "does nothing when it is called"),
    ],
)
def test_a_command_that_cannot_be_used_hides_no_other(
    install: Install, module: str, said: str
) -> None:
    install("lab", {"greeting.py": module}, tactile_commands={"greet": "own_lab.greeting:greet"})
    done = tactile("--help")
    assert done.returncode == 0
    assert "calibrate" in done.stdout
    assert said in done.stderr
    assert said in refused("greet", "anna")


@pytest.mark.parametrize(
    ("raised", "cause"),
    [
        ("ValueError('no licence')", "ValueError: no licence"),
        ("BrokenPipeError", "BrokenPipeError: no reason given"),
        ("ConnectionResetError(104, 'reset')", "ConnectionResetError: [Errno 104] reset"),
        ("EOFError", "EOFError: no reason given"),
        ("SystemExit(0)", "SystemExit: 0"),
        ("KeyboardInterrupt", "KeyboardInterrupt: no reason given"),
    ],
)
def test_a_failure_of_an_added_command_names_its_plugin(
    install: Install, raised: str, cause: str
) -> None:
    failing = f'def greet() -> None:\n    """Fail."""\n    raise {raised}\n'
    install("lab", {"greeting.py": failing}, tactile_commands={"greet": "own_lab.greeting:greet"})
    done = tactile("greet")
    assert done.returncode == 1
    assert done.stderr == (
        f"tactile: the command (lab.greet, from tactile-lab 1.0) failed: {cause}; "
        f"this is a fault of that plugin\n"
    )


@pytest.mark.parametrize(
    ("raised", "said"),
    [
        ("OSError(28, 'No space left on device')", "tactile: No space left on device\n"),
        ("PermissionError(13, 'Permission denied', 'x')", "tactile: Permission denied (x)\n"),
        ("typer.Abort", "tactile: ended at a question\n"),
    ],
)
def test_a_full_disk_a_file_and_an_answer_of_the_user_are_no_fault_of_a_command(
    install: Install, raised: str, said: str
) -> None:
    failing = f'import typer\ndef greet() -> None:\n    """Fail."""\n    raise {raised}\n'
    install("lab", {"greeting.py": failing}, tactile_commands={"greet": "own_lab.greeting:greet"})
    assert tactile("greet").stderr == said


@pytest.mark.parametrize(
    "words", [("--help",), ("greet", "anna"), ("greet", "--help"), ("plugins", "--json")]
)
def test_what_a_plugin_prints_while_it_is_imported_stays_out_of_stdout(
    install: Install, words: tuple[str, ...]
) -> None:
    hooks = {"tactile_commands": {"greet": "own_lab.greeting:greet"}}
    package = install("lab", {"greeting.py": GREETING + "print('from the command')\n"}, **hooks)
    with (package / "__init__.py").open("a", encoding="utf-8") as module:
        module.write("print('from the hooks')\n")
    done = tactile(*words)
    assert done.returncode == 0
    assert "from the hooks" in done.stderr
    assert "from the" not in done.stdout


def test_a_command_that_the_core_has_stays_the_core_s(install: Install) -> None:
    install("lab", {"greeting.py": GREETING}, tactile_commands={"run": "own_lab.greeting:greet"})
    assert "'run' of a plugin is hidden by the core's own" in tactile("--help").stderr


def test_two_plugins_with_one_command_are_both_named(install: Install) -> None:
    install("lab", {"greeting.py": GREETING}, tactile_commands={"view": "own_lab.greeting:greet"})
    assert "adds the command 'view', as another plugin does" in tactile("doctor").stdout
    with pytest.raises(PluginError, match=r"tactile-lab 1\.0.*uninstall all but one"):
        registry.import_command("view", registry.added_commands()["view"])


def test_installed_plugins_are_looked_through_once_a_call(monkeypatch: pytest.MonkeyPatch) -> None:
    look, looked = registry.added_commands, []

    def added_commands() -> object:
        looked.append(True)
        return look()

    monkeypatch.setattr(registry, "added_commands", added_commands)
    assert "simulate" in tactile("--help").stdout
    assert looked == [True]


@pytest.mark.usefixtures("lab")
def test_the_list_of_plugins_names_their_commands() -> None:
    assert "command       tactile greet-one" in tactile("plugins").stdout
