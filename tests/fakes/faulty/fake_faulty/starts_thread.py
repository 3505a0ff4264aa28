"""Hooks whose import has an effect of its own."""

import threading
import time

from fake_faulty.hooks import Hooks

threading.Thread(target=time.sleep, args=(5,), name="poller", daemon=True).start()
plugin = Hooks(estimators="Sound")
