"""The light of a virtual rig: from the state of the skin to the frame that its camera sends."""

from tactile_core.sim.optics.faults import Faults as Faults
from tactile_core.sim.optics.rig import RigOptics as RigOptics
