"""The public names, from where each is defined; ``__init__.py`` reads them here."""

from .optics.faults import Faults as Faults
from .stage import VirtualStage as VirtualStage
