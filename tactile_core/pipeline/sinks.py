"""The sinks of a run: selected by name, with options from the profile."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from contextlib import AbstractContextManager
from typing import Self

from tactile_core.errors import InputError
from tactile_core.interfaces.component import Component, is_component_name
from tactile_core.interfaces.device import Closing
from tactile_core.interfaces.sink import Reading, Recorder, ResultFolder, Session, Sink
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.plugins.blame import blame, blame_of
from tactile_core.plugins.earlier_names import COMPONENTS, MOVED
from tactile_core.plugins.options import options_of
from tactile_core.plugins.registry import find_plugin, resolve
from tactile_core.profiles.model import Profile

CORE = "core"


class Sinks(Closing):
    """Several sinks that receive the same readings; use it in a ``with`` block.

    Parameters
    ----------
    profile : Profile
        Its ``sinks`` can be named here, and supply options.
    names : collection of str
        Each is a name in the profile's ``sinks``, ``plugin.name``, or one of the core's: npz, tmd,
        png, ply.

    Raises
    ------
    InputError
        A name is none of these.
    PluginError
        A plugin is missing or broken.
    """

    def __init__(self, profile: Profile, names: Collection[str]) -> None:
        self._sinks: dict[str, Sink] = {}
        for name in dict.fromkeys(names):
            component = _component(profile, name)
            kind: type[Sink] = resolve("sink", component.use)
            with blame(f"the sink {name!r}", kind):
                self._sinks[name] = kind(options_of(kind, component))
        self._open: list[str] = []

    @property
    def endings(self) -> tuple[str, ...]:
        """Endings of the files that the sinks write for each observation."""
        return tuple(ending for sink in self._sinks.values() for ending in sink.endings)

    @property
    def keeps_raw(self) -> bool:
        """Whether a sink writes the images as the camera sent them."""
        return any(sink.keeps_raw for sink in self._sinks.values())

    def open(
        self,
        pipeline: Pipeline,
        folder: ResultFolder | None = None,
        record: Recorder | None = None,
    ) -> Self:
        """Open each sink; if one fails, none stays open.

        Parameters
        ----------
        pipeline : Pipeline
            The source of the readings.
        folder : ResultFolder, optional
            Destination of files.
        record : Recorder, optional
            :meth:`Sensor.record <tactile_core.pipeline.sensor.Sensor.record>` of the sensor that
            the readings come from.

        Raises
        ------
        InputError
            A sink writes files and no folder is given.
        PluginFault
            A sink fails.
        """
        session = Session(
            pipeline.profile,
            pipeline.serial,
            pipeline.channels,
            pipeline.gives,
            folder,
            blame_of,
            record,
        )
        for name, sink in self._sinks.items():
            if sink.endings and folder is None:
                raise InputError(f"the sink {name!r} writes files; name a folder for them")
        try:
            for name, sink in self._sinks.items():
                self._open.append(name)
                with self._blame_sink(name):
                    sink.open(session)
        except BaseException as error:
            try:
                self.close()
            except Exception as second:  # it must not hide why opening failed
                error.add_note(f"closing failed as well: {second}")
            raise
        return self

    def write(self, reading: Reading) -> None:
        """Pass a reading to each sink.

        Raises
        ------
        PluginFault
            A sink fails; files that were written stay.
        OSError
            The disk is full or not writable.
        """
        for name, sink in self._sinks.items():
            with self._blame_sink(name):
                sink.write(reading)

    def close(self) -> None:
        """Close each sink, the last one first, even if one fails; may be called twice."""
        if self._open:
            name = self._open.pop()
            try:
                with self._blame_sink(name):
                    self._sinks[name].close()
            finally:
                self.close()

    def _blame_sink(self, name: str) -> AbstractContextManager[None]:
        return blame(f"the sink {name!r}", self._sinks[name])


def _component(profile: Profile, name: str) -> Component:
    """Return the component of a name: the profile's, a plugin's, or one of the core's."""
    if name in profile.sinks:
        return profile.sinks[name]
    if is_component_name(name):
        described = (sink for sink in profile.sinks.values() if sink.use == name)
        return next(described, Component(use=name))
    known: Mapping[str, str] = find_plugin(CORE).components("sink")
    of_core = f"{CORE}.{name}"
    if name not in known and of_core not in (
        *COMPONENTS,
        *MOVED,
    ):  # resolving says what to write instead
        choices: Iterable[str] = dict.fromkeys([*profile.sinks, *known])
        raise InputError(
            f"there is no sink {name!r}; choose from {', '.join(choices)}, or name a plugin's "
            f"sink as plugin.name"
        )
    return Component(use=of_core)
