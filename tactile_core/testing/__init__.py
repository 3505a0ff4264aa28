"""The conformance kit: a lab proves its plugin with five lines of pytest.

::

    from tactile_core.testing import PluginConformance


    class TestMyLab(PluginConformance):
        plugin = "mylab"
        expected_failures = {}  # check name → reason: a strict xfail

Nothing at run time imports this package; it needs the extra ``testing``.
"""

from __future__ import annotations

from importlib.util import find_spec

from tactile_core.errors import PluginError

if find_spec("pytest") is None:
    raise PluginError(
        "tactile_core.testing runs its checks with pytest, which is not installed; run "
        "\"pip install 'tactile-core[testing]'\""
    )

from tactile_core.testing.conformance import PluginConformance as PluginConformance
from tactile_core.testing.faults import Fault as Fault
