"""A plugin adds commands, and a command whose distribution is absent says how to install it."""

from __future__ import annotations

from collections.abc import Mapping

import pytest
from support.command_line import refused, tactile
from support.own_plugins import Install

import tactile_core.cli.app as app

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
    monkeypatch.setattr("tactile_core.plugins.registry.find_command", lambda name: None)
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


def test_a_command_that_the_core_has_stays_the_core_s(install: Install) -> None:
    install("lab", {"greeting.py": GREETING}, tactile_commands={"run": "own_lab.greeting:greet"})
    assert "'run' of a plugin is hidden by the core's own" in tactile("--help").stderr


def test_two_plugins_with_one_command_are_both_named(install: Install) -> None:
    install("lab", {"greeting.py": GREETING}, tactile_commands={"view": "own_lab.greeting:greet"})
    assert "adds the command 'view', as another plugin does" in tactile("doctor").stdout
    from tactile_core.errors import PluginError
    from tactile_core.plugins.registry import find_command

    with pytest.raises(PluginError, match=r"tactile-lab 1\.0.*uninstall all but one"):
        find_command("view")


@pytest.mark.usefixtures("lab")
def test_the_list_of_plugins_names_their_commands() -> None:
    assert "command       tactile greet-one" in tactile("plugins").stdout
