"""A virtual camera, which gphoto2 brings."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest


@pytest.fixture
def card(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The memory card of a virtual camera, which "takes" the pictures on it."""
    gphoto = pytest.importorskip("gphoto2", reason="there is no gphoto2 for this system")
    drivers = Path(gphoto.__file__).parent / "libgphoto2" / "vusb"
    if not drivers.is_dir():
        pytest.skip("this gphoto2 has no virtual camera")
    folder = tmp_path / "DCIM" / "100NIKON"
    folder.mkdir(parents=True)
    cv2.imwrite(str(folder / "DSC_0001.JPG"), np.full((40, 60, 3), 90, np.uint8))
    monkeypatch.setenv("IOLIBS", str(drivers))
    monkeypatch.setenv("VCAMERADIR", str(tmp_path))
    return folder
