"""Optics of a virtual sensor: from the state of the gel surface to camera frames."""

from tactile_sim.optics.faults import Faults as Faults
from tactile_sim.optics.rig import RigOptics as RigOptics
