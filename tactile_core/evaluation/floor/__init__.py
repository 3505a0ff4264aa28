"""The least force that a sensor distinguishes from none."""

from tactile_core.evaluation.floor.virtual import Floor as Floor
from tactile_core.evaluation.floor.virtual import floor_of as floor_of
from tactile_core.evaluation.floor.virtual import floor_table as floor_table
from tactile_core.evaluation.floor.virtual import recorded_floors as recorded_floors
from tactile_core.evaluation.floor.virtual import virtual_floors as virtual_floors
