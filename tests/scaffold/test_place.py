"""Protection of existing files."""

from __future__ import annotations

from pathlib import Path

import pytest

from tactile_core.errors import InputError
from tactile_core.scaffold.profile import refuse_existing


@pytest.mark.parametrize("folder", [False, True])
@pytest.mark.parametrize("force", [False, True])
def test_a_broken_link_is_not_overwritten(tmp_path: Path, folder: bool, force: bool) -> None:
    link = tmp_path / "link"
    link.symlink_to("nowhere")
    with pytest.raises(InputError, match="link"):
        refuse_existing(link, force=force, folder=folder)


@pytest.mark.parametrize("folder", [False, True])
@pytest.mark.parametrize("force", [False, True])
def test_a_path_through_a_missing_folder_is_refused(
    tmp_path: Path, folder: bool, force: bool
) -> None:
    (tmp_path / "mine").mkdir()
    with pytest.raises(InputError, match="through a folder that is not there"):
        refuse_existing(tmp_path / "absent" / ".." / "mine", force=force, folder=folder)
