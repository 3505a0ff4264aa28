"""The conformance kit: checks a plugin with five lines of pytest.

May import every room but cli; nothing but tests imports it.

::

    from tactile_core.testing import PluginConformance


    class TestMyLab(PluginConformance):
        plugin = "mylab"
        expected_failures = {}  # check name → reason: a strict xfail

It needs the extra ``testing`` and is never imported at run time.
"""

from __future__ import annotations

from tactile_core.errors import PluginError

try:
    import pytest  # noqa: F401
except ImportError:
    raise PluginError(
        "tactile_core.testing needs pytest, which is not installed; run "
        "\"pip install 'tactile-core[testing]'\""
    ) from None

from tactile_core.testing.conformance import PluginConformance as PluginConformance
from tactile_core.testing.differences import Fault as Fault
