"""The conformance kit: a lab proves its plugin with five lines of pytest.

May import every room but cli; nothing but tests imports it.

::

    from tactile_core.testing import PluginConformance


    class TestMyLab(PluginConformance):
        plugin = "mylab"
        expected_failures = {}  # check name → reason: a strict xfail

Nothing at run time imports this package; it needs the extra ``testing``.
"""

from __future__ import annotations

from tactile_core.errors import PluginError

try:
    import pytest  # noqa: F401
except ImportError:
    raise PluginError(
        "tactile_core.testing runs its checks with pytest, which is not installed; run "
        "\"pip install 'tactile-core[testing]'\""
    ) from None

from tactile_core.testing.conformance import PluginConformance as PluginConformance
from tactile_core.testing.faults import Fault as Fault
