"""What every section of a profile has in common."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, field_validator


class Section(BaseModel):
    """A mapping whose unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _no_switch(cls, value: Any) -> Any:
        # No key of a section is a switch, and the validator would take true for 1.
        if isinstance(value, bool):
            raise ValueError(f"should not be {str(value).lower()}; there is nothing to switch here")
        return value
