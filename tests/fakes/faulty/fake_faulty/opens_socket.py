"""Hooks whose import has an effect of its own."""

import socket

from fake_faulty.hooks import Hooks

listener = socket.socket().detach()
plugin = Hooks(estimators="Sound")
