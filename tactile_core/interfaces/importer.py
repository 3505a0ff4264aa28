"""The importer interface: a calibration of another program becomes one of ours."""

from __future__ import annotations

from abc import ABC, abstractmethod
from pathlib import Path

from tactile_core.interfaces.calibration import Calibration
from tactile_core.interfaces.component import SensorBuild


class Importer(ABC):
    """Reads one kind of file in which another program keeps a calibration."""

    @abstractmethod
    def read(self, path: Path, build: SensorBuild) -> Calibration:
        """Return the light model in a file.

        Parameters
        ----------
        path : Path
            An existing file, or a folder if the program writes several files.
        build : SensorBuild
            The sensor as its profile describes it: the model measures the image of ``build.image``
            with the channels of ``build.illumination``, in their order.

        Returns
        -------
        Calibration
            Of a class that the hook ``tactile_artefacts`` registers, so that a bundle can hold it.

        Raises
        ------
        InputError
            The file is of another kind or damaged, or it is of another sensor.
        """
