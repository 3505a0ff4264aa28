"""How fine the nodes must be for a contact to be solved accurately."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tactile_core.sim.contact_state import Move
from tactile_core.sim.contact_step import ContactModel, Precision
from tactile_core.sim.elastic_layer import ElasticLayer
from tactile_core.sim.gel import SoftGel
from tactile_core.sim.grid import Grid
from tactile_core.sim.indenters import Indenter

NODES_PER_CONTACT_RADIUS = 10

_SPARE = 1.1
"""The radius is measured on a grid that may be coarse, and friction changes it a little."""

_MOST_NODES_ACROSS = 1280
_ROUGH = Precision(normal=2e-3, friction=1.0, sweeps=1)


def accurate_spacing(
    gel: SoftGel,
    extent_mm: tuple[float, float],
    widest_mm: float,
    indenter: Indenter,
    move: Move,
) -> float:
    """Distance of nodes of which ten fit into the radius of a contact.

    The contact is solved without friction, on finer and finer grids.

    Parameters
    ----------
    gel : SoftGel
    extent_mm : (width, height)
        Of the area to solve on.
    widest_mm : float
        The result is no larger.
    indenter : Indenter
        Its details are resolved too.
    move : Move
        How it is going to be pressed.
    """
    slippery = replace(gel, friction=0.0, branches=())
    finest = min(max(extent_mm) / _MOST_NODES_ACROSS, widest_mm)
    spacing = widest_mm
    while True:
        grid = Grid.covering(*extent_mm, spacing)
        model = ContactModel(ElasticLayer(grid, gel.elastomer), slippery, _ROUGH)
        above = model.placed(model.at_rest(), indenter, move.pose)
        contact = model.step(above, indenter, move).contact
        radius = np.sqrt(np.count_nonzero(contact) * grid.cell_mm2 / np.pi)
        needed = float(radius) / (_SPARE * NODES_PER_CONTACT_RADIUS)
        if indenter.detail_mm is not None:
            needed = min(needed, indenter.detail_mm / 2)
        if spacing <= max(needed, finest):
            return spacing
        # a contact that is hardly hit by a node may turn out to be larger
        spacing = max(needed, finest, spacing / 3)
