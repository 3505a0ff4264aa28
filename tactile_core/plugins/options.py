"""Makes a component's options from a profile."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ValidationError

from tactile_core.errors import ProfileError
from tactile_core.interfaces.component import Component
from tactile_core.plugins.blame import blame


def options_of(cls: Any, component: Component) -> BaseModel:
    """Return the options of a component's class.

    Raises
    ------
    ProfileError
        The profile's options do not match the class's declaration.
    PluginFault
        The class's own validators fail.
    """
    with blame(f"the options of {component.use}", cls):
        try:
            options: BaseModel = cls.Options.model_validate(component.options)
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(str(part) for part in first["loc"])
            raise ProfileError(f"{component.use}: {where}: {first['msg']}") from error
    return options
