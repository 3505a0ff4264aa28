"""The sinks of a run: named by the user, with the options that the profile gives them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from contextlib import AbstractContextManager
from types import TracebackType
from typing import Self

from tactile_core.errors import InputError
from tactile_core.interfaces.component import Component
from tactile_core.interfaces.reading import Reading
from tactile_core.interfaces.sink import ResultFolder, Session, Sink
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.plugins.blame import blame, blame_of
from tactile_core.plugins.options import options_of
from tactile_core.plugins.registry import find_plugin, resolve
from tactile_core.profiles.model import Profile

CORE = "core"


class Sinks:
    """Several sinks that take the same readings; use it in a ``with`` block.

    Parameters
    ----------
    profile : Profile
        Whose ``sinks`` may be named, and give options.
    names : collection of str
        A name of the profile's ``sinks``, ``plugin.name``, or one of the core's: npz, tmd, png,
        ply.

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
        """Endings of the files that they write for each observation."""
        return tuple(ending for sink in self._sinks.values() for ending in sink.endings)

    def open(self, pipeline: Pipeline, folder: ResultFolder | None = None) -> Self:
        """Open each sink; on failure none stays open.

        Parameters
        ----------
        pipeline : Pipeline
            Whose readings they will take.
        folder : ResultFolder, optional
            Where files go.

        Raises
        ------
        InputError
            A sink writes files, and there is no folder for them.
        PluginFault
            A sink fails.
        """
        session = Session(
            pipeline.profile, pipeline.serial, pipeline.channels, pipeline.gives, folder, blame_of
        )
        for name, sink in self._sinks.items():
            if sink.endings and folder is None:
                raise InputError(f"the sink {name!r} writes files; name a folder for them")
        try:
            for name, sink in self._sinks.items():
                self._open.append(name)
                with self._blamed(name):
                    sink.open(session)
        except BaseException as error:
            try:
                self.close()
            except Exception as second:  # it must not hide why opening failed
                error.add_note(f"closing failed as well: {second}")
            raise
        return self

    def write(self, reading: Reading) -> None:
        """Give a reading to each sink.

        Raises
        ------
        PluginFault
            A sink fails; what was written before stays.
        OSError
            The disk is full or refuses.
        """
        for name, sink in self._sinks.items():
            with self._blamed(name):
                sink.write(reading)

    def close(self) -> None:
        """Close each sink, the last one first, also where another fails; may be called twice."""
        if self._open:
            name = self._open.pop()
            try:
                with self._blamed(name):
                    self._sinks[name].close()
            finally:
                self.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _blamed(self, name: str) -> AbstractContextManager[None]:
        return blame(f"the sink {name!r}", self._sinks[name])


def _component(profile: Profile, name: str) -> Component:
    """The component that a name means: the profile's, a plugin's, or one of the core's."""
    if name in profile.sinks:
        return profile.sinks[name]
    if "." in name:
        described = (sink for sink in profile.sinks.values() if sink.use == name)
        return next(described, Component(use=name))
    known: Mapping[str, str] = find_plugin(CORE).components("sink")
    if name not in known:
        choices: Iterable[str] = dict.fromkeys([*profile.sinks, *known])
        raise InputError(
            f"{name!r} is no sink; choose among {', '.join(choices)}, or name one of a plugin, as "
            f"plugin.name"
        )
    return Component(use=f"{CORE}.{name}")
