"""Templates for your own sensor: a commented profile from one image, and a plugin package.

May import calibration, pipeline and what these may import.

:func:`new_profile` determines how a sensor differs from an existing profile. :func:`new_package`
puts such a profile into an installable plugin with an estimator and its conformance test.
"""

from tactile_core.scaffold.discovery import Ask, new_profile
from tactile_core.scaffold.package import NewPackage, new_package
from tactile_core.scaffold.profile import NewProfile

__all__ = ["Ask", "NewPackage", "NewProfile", "new_package", "new_profile"]
