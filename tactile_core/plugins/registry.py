"""Finds components by name: ``resolve("camera", "core.replay")`` imports only their module.

Installed plugins are found in metadata alone (:mod:`tactile_core.plugins.entry_points`). A broken
plugin is an error only if it is used; otherwise :func:`list_plugins` reports it.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import FunctionType
from typing import TYPE_CHECKING, Literal, overload
from weakref import WeakKeyDictionary

import tactile_core
from tactile_core import __version__
from tactile_core.errors import PluginError
from tactile_core.interfaces.hookspecs import GROUP
from tactile_core.plugins.entry_points import Offer, installed_offers, normalize_name
from tactile_core.plugins.plugin import KINDS, Plugin, kind_in_words
from tactile_core.plugins.plugin import ComponentKind as ComponentKind

if TYPE_CHECKING:
    from tactile_core.interfaces.artefact import Artefact
    from tactile_core.interfaces.calibration import Calibrator
    from tactile_core.interfaces.camera import Camera
    from tactile_core.interfaces.cluster import Cluster
    from tactile_core.interfaces.estimator import Estimator
    from tactile_core.interfaces.illumination import Illumination
    from tactile_core.interfaces.importer import Importer
    from tactile_core.interfaces.light_driver import LightDriver
    from tactile_core.interfaces.recording_format import RecordingFormat
    from tactile_core.interfaces.simulator import Simulator
    from tactile_core.interfaces.sink import Sink

# defined without metadata, so that the core works from a source tree, and looked up first, so that
# no other distribution can replace it
_CORE = Offer("core", "tactile_core.builtin", GROUP, "tactile-core", __version__)

# Name under which each class or command was resolved, and the plugin that offers it.
_RESOLVED: WeakKeyDictionary[object, tuple[str, Offer]] = WeakKeyDictionary()


@dataclass(frozen=True)
class Origin:
    """The plugin that a component belongs to.

    Attributes
    ----------
    name : str
        ``plugin.name`` of a component or command, else the module and name of its code.
    offer : Offer or None
        The plugin; None if the component belongs to none.
    """

    name: str
    offer: Offer | None

    @property
    def is_core(self) -> bool:
        """Whether the component belongs to the core."""
        return self.offer is _CORE

    def __str__(self) -> str:
        if self.offer is None or self.is_core:
            return self.name
        return f"{self.name}, from {self.offer.origin}"


@dataclass(frozen=True)
class PluginInfo:
    """One installed plugin and its problems.

    Attributes
    ----------
    name, distribution, version, group : str
        From its metadata.
    status : {"ok", "broken", "other API"}
        "other API": the plugin is for another entry-point group and was not imported.
    problems : tuple of str
        One sentence each; empty if ``status`` is "ok".
    components : mapping of kind to names
        ``{"camera": ("replay",), …}``: what the plugin registers, without the plugin's name.
    commands : tuple of str
        Commands of ``tactile`` that it adds.
    profiles : Path or None
        The folder of the profiles that it ships.
    """

    name: str
    distribution: str
    version: str
    group: str = GROUP
    status: Literal["ok", "broken", "other API"] = "ok"
    problems: tuple[str, ...] = ()
    components: Mapping[ComponentKind, tuple[str, ...]] = field(default_factory=dict)
    commands: tuple[str, ...] = ()
    profiles: Path | None = None


@overload
def resolve(kind: Literal["camera"], name: str) -> type[Camera]: ...
@overload
def resolve(kind: Literal["illumination"], name: str) -> type[Illumination]: ...
@overload
def resolve(kind: Literal["light_driver"], name: str) -> type[LightDriver]: ...
@overload
def resolve(kind: Literal["calibrator"], name: str) -> type[Calibrator]: ...
@overload
def resolve(kind: Literal["artefact"], name: str) -> type[Artefact]: ...
@overload
def resolve(kind: Literal["estimator"], name: str) -> type[Estimator]: ...
@overload
def resolve(kind: Literal["sink"], name: str) -> type[Sink]: ...
@overload
def resolve(kind: Literal["recording_format"], name: str) -> type[RecordingFormat]: ...
@overload
def resolve(kind: Literal["simulator"], name: str) -> type[Simulator]: ...
@overload
def resolve(kind: Literal["importer"], name: str) -> type[Importer]: ...
@overload
def resolve(kind: Literal["cluster"], name: str) -> type[Cluster]: ...
def resolve(kind: ComponentKind, name: str) -> type:
    """Return the class of the component ``plugin.name``.

    Imports only the named plugin and the module of the component.

    Parameters
    ----------
    kind : ComponentKind
        The interface that the class must implement.
    name : str
        For example ``"core.replay"``.

    Raises
    ------
    PluginError
        The plugin is missing, broken, for another API or claimed by two distributions, or has no
        such component of this kind; or the name is of an earlier version.
    """
    plugin_name, dot, component = name.partition(".")
    wanted = f"{kind_in_words(kind)} {name!r}"
    if not dot or not component:
        raise PluginError(f"{wanted}: write plugin.name, as 'tactile plugins' lists it")
    try:
        offer = _offer(plugin_name, wanted)
        found = Plugin.load(offer).component(kind, component)
    except PluginError:
        earlier = _earlier(name, wanted)
        if earlier:
            raise PluginError(earlier) from None
        raise
    _RESOLVED[found] = name, offer
    return found


def registered_name(kind: ComponentKind, cls: type) -> str | None:
    """Return the name ``plugin.name`` under which a class is registered; None if it is not.

    Searches the core, then plugins in use, then plugins of the class's package; imports no other.
    """
    package = _package(cls.__module__)
    in_use = [offer for _, offer in _RESOLVED.values()]
    of_package = [offer for offer in _foreign_offers() if _package(offer.value) == package]
    for offer in dict.fromkeys((_CORE, *in_use, *of_package)):
        if _objection(offer):
            continue
        with suppress(PluginError):
            plugin = Plugin.load(offer)
            for name, value in plugin.components(kind).items():
                # components of another package cannot match and need not be imported
                if _package(value) == package and plugin.component(kind, name) is cls:
                    return f"{offer.name}.{name}"
    return None


def origin_of(component: object) -> Origin:
    """Return the plugin of a component, its class, or a command.

    It is the one that it was resolved from, or that of its package: a class that was unpickled or
    fitted by a component was never resolved by name.
    """
    code = component if isinstance(component, type | FunctionType) else type(component)
    if code in _RESOLVED:
        return Origin(*_RESOLVED[code])
    written = f"{code.__module__}:{code.__qualname__}"
    package = _package(code.__module__)
    offers = (_CORE, *_foreign_offers())
    offer = next((o for o in offers if _package(o.value) == package), None)
    return Origin(_name_of(written, offer) or written.replace(":", "."), offer)


def _name_of(written: str, offer: Offer | None) -> str:
    """Return the name of the component registered as ``module:Class``; empty if there is none."""
    if offer is None or _objection(offer):
        return ""
    with suppress(PluginError):
        plugin = Plugin.load(offer)
        for kind in KINDS:
            for name, value in plugin.components(kind).items():
                if value == written:
                    return f"{offer.name}.{name}"
    return ""


def find_plugin(name: str, wanted_by: str = "this") -> Plugin:
    """Import a plugin by its name.

    Parameters
    ----------
    name : str
    wanted_by : str
        What needs it, for the message.

    Raises
    ------
    PluginError
        The plugin is missing, broken, for another API or claimed by two distributions.
    """
    return Plugin.load(_offer(name, wanted_by))


def list_plugins(*, import_components: bool = False) -> list[PluginInfo]:
    """Import every installed plugin and list what each registers, the core first.

    Parameters
    ----------
    import_components : bool
        Also import each registered component and report those that cannot be used.
    """
    offers = sorted(_foreign_offers(), key=lambda offer: (offer.name, offer.distribution))
    found = [_inspect(offer, import_components) for offer in (_CORE, *offers)]
    adding = Counter(name for info in found for name in info.commands)
    return [_with_clashes(info, adding) for info in found]


def _with_clashes(info: PluginInfo, adding: Mapping[str, int]) -> PluginInfo:
    """Add a problem for each command that another plugin adds, too."""
    problems = tuple(
        f"plugin {info.name!r} ({info.distribution} {info.version}) adds the command {name!r}, as "
        f"another plugin does; uninstall one of them"
        for name in info.commands
        if adding[name] > 1
    )
    if not problems:
        return info
    return replace(info, status="broken", problems=(*info.problems, *problems))


def added_commands() -> Mapping[str, Sequence[Plugin]]:
    """Import every installed plugin but the core; return who adds each command.

    Plugins whose commands cannot be read are left out.
    """
    found: dict[str, list[Plugin]] = {}
    for offer in _foreign_offers():
        with suppress(PluginError):
            if not _objection(offer):
                plugin = Plugin.load(offer)
                for name in plugin.commands():
                    found.setdefault(name, []).append(plugin)
    return found


def import_command(name: str, adding: Sequence[Plugin]) -> Callable[..., None]:
    """Return the function of a command that plugins add.

    Raises
    ------
    PluginError
        Two plugins add it, or it cannot be imported.
    """
    if len(adding) > 1:
        raise PluginError(
            f"the command {name!r} is added by {' and by '.join(p.offer.origin for p in adding)}; "
            f"uninstall all but one of them"
        )
    offer, found = adding[0].offer, adding[0].command(name)
    _RESOLVED[found] = f"{offer.name}.{name}", offer
    return found


def profile_directories() -> Mapping[str, Path]:
    """Return the profile folder of each plugin that has one, by the plugin's name.

    Imports every installed plugin, so look among the shipped profiles first. Broken plugins are
    left out; :func:`list_plugins` reports their problems.
    """
    return {info.name: info.profiles for info in list_plugins() if info.profiles is not None}


def _package(value: str) -> str:
    """Return the top-level package of a module or of ``module:name``."""
    return re.split("[.:]", value.strip())[0]


def _foreign_offers() -> list[Offer]:
    return [
        offer
        for offer in installed_offers()
        if (offer.name, normalize_name(offer.distribution)) != (_CORE.name, _CORE.distribution)
    ]


def _offer(plugin_name: str, wanted_by: str) -> Offer:
    if plugin_name == _CORE.name:
        return _CORE
    package = _package_of(plugin_name)
    offers = _foreign_offers()
    named = [
        offer
        for offer in offers
        if offer.name == plugin_name or (offer.problem and offer.distribution == package)
    ]
    if not named:
        raise PluginError(_missing(plugin_name, package, wanted_by, [o.name for o in offers]))
    chosen = next((offer for offer in named if offer.group == GROUP), named[0])
    objection = _objection(chosen)
    if objection:
        raise PluginError(objection)
    return chosen


def _inspect(offer: Offer, import_components: bool) -> PluginInfo:
    info = PluginInfo(offer.name, offer.distribution, offer.version, offer.group)
    objection = _objection(offer)
    if objection:
        other = bool(offer.group) and offer.group != GROUP
        return replace(info, status="other API" if other else "broken", problems=(objection,))
    try:
        report = Plugin.load(offer).report(import_components=import_components)
    except PluginError as error:
        return replace(info, status="broken", problems=(str(error),))
    return replace(
        info,
        status="broken" if report.problems else "ok",
        problems=report.problems,
        components=report.components,
        commands=report.commands,
        profiles=report.profiles,
    )


def _objection(offer: Offer) -> str:
    """Return why a plugin must not be imported; empty if it can be."""
    if offer is _CORE:
        return ""
    if offer.problem:
        return f"{offer}: {offer.problem}"
    if offer.group != GROUP:
        return _other_api(offer)
    rivals = [
        rival
        for rival in (_CORE, *_foreign_offers())
        if (rival.name, rival.group) == (offer.name, offer.group)
    ]
    return _collision(rivals) if len(rivals) > 1 else ""


def _collision(offers: list[Offer]) -> str:
    claimants = " and ".join(offer.origin for offer in offers)
    return f"plugin {offers[0].name!r} is claimed by {claimants}; uninstall all but one of them"


def _other_api(offer: Offer) -> str:
    newer = int(offer.group.rpartition("v")[2]) > int(GROUP.rpartition("v")[2])
    upgrade = _CORE.distribution if newer else offer.distribution
    return (
        f"{offer} is written for {offer.group}, but {_CORE.origin} supports {GROUP}; "
        f"run 'pip install --upgrade {upgrade}'"
    )


def _earlier(name: str, wanted: str) -> str:
    """Return what to write instead of a component of an earlier version; empty for others."""
    from tactile_core.plugins.earlier_names import COMPONENTS, MOVED

    if name in COMPONENTS:
        return f"{wanted} is of an earlier version; {COMPONENTS[name]}"
    if name not in MOVED:
        return ""
    package = _package_of(MOVED[name].partition(".")[0])
    return (
        f"{wanted} is {MOVED[name]!r} now, which 'pip install {_source_of(package)}' installs; "
        f"write the new name"
    )


def _missing(plugin_name: str, package: str, wanted_by: str, installed: list[str]) -> str:
    from difflib import get_close_matches

    near = get_close_matches(plugin_name, [_CORE.name, *installed], n=1)
    meant = f"did you mean {near[0]!r}? Otherwise " if near else ""
    return (
        f"{wanted_by} needs the plugin {plugin_name!r}, which is not installed; "
        f"{meant}run 'pip install {_source_of(package)}'"
    )


def _package_of(plugin_name: str) -> str:
    """Return the distribution of a plugin, if it is named as this project's are."""
    return "tactile-" + plugin_name.replace("_", "-")


def _source_of(package: str) -> str:
    """Return what pip installs a distribution from: its folder in a clone, or its name."""
    beside = Path(tactile_core.__file__).parents[1] / "plugins" / package
    return str(beside if beside.is_dir() else package)
