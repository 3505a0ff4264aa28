"""Where something new may be written."""

from __future__ import annotations

from pathlib import Path

import pytest

from tactile_core.errors import InputError
from tactile_core.scaffold.place import refuse_existing


@pytest.mark.parametrize("folder", [False, True])
@pytest.mark.parametrize("force", [False, True])
def test_a_link_that_leads_nowhere_is_not_written_over(
    tmp_path: Path, folder: bool, force: bool
) -> None:
    link = tmp_path / "link"
    link.symlink_to("nowhere")
    with pytest.raises(InputError, match="link"):
        refuse_existing(link, force=force, folder=folder)


def test_a_folder_is_known_however_its_path_is_written(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    with pytest.raises(InputError, match="is no file"):
        refuse_existing(tmp_path / "absent" / ".." / "mine", force=True)
