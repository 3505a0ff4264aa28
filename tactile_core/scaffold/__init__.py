"""A start for a lab's own sensor: a commented profile from one picture, and a plugin package.

May import calibration, pipeline and what these may import.

:func:`new_profile` finds what differs from a known build; :func:`new_package` puts such a profile
into an installable plugin with a first estimator and its conformance test.
"""

from tactile_core.scaffold.discovery import Ask, new_profile
from tactile_core.scaffold.known_size import KnownSize
from tactile_core.scaffold.package import NewPackage, new_package
from tactile_core.scaffold.profile import NewProfile

__all__ = ["Ask", "KnownSize", "NewPackage", "NewProfile", "new_package", "new_profile"]
