"""Motions of an n-dimensional rigid body under the Veselova constraint: in theta functions, and by
integration.

    import veselova as vs

    problem = vs.Veselova(
        A=[3, 2, 1.5, 1], q=[0.5, 0.5, 0.5, 0.5], q_dot=[0.5, -0.5, 0.3, -0.3]
    )
    trajectory = vs.solve(problem, times=[0, 1, 1000])
    trajectory.frame  # (3, 4, 4), columns e_i
    trajectory.error  # (3,) bounds every component of q and frame

Names are loaded when first used, ``vs.theta``, ``vs.curves`` and
``vs.geodesics`` too.
"""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

from veselova.version import __version__ as __version__

#: Public name → the module that defines it, as the stub beside this file has them for type
#: checkers.
_STUB = Path(__file__).with_suffix(".pyi").read_text("utf-8")
_HOMES = {name: home for home, name in re.findall(r"^from (\S+) import (\w+)", _STUB, re.MULTILINE)}

__all__ = ["__version__", *sorted(_HOMES)]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        hint = ""
        if not name.startswith("_"):
            from veselova.mechanics.core.errors import did_you_mean

            hint = did_you_mean(name, __all__)
        raise AttributeError(f"module 'veselova' has no attribute {name!r}{hint}")
    if _HOMES[name] == __name__:
        return import_module(f"veselova.{name}")
    import_module("veselova.methods").register_methods()
    try:
        value = getattr(import_module(_HOMES[name]), name)
    except ModuleNotFoundError as error:
        raise _missing(name, error) from None
    globals()[name] = value
    return value


#: Public names that need more than the core, and the extra that installs it.
_EXTRAS = {"AsyncClient": "client", "Client": "client", "sweep": "sweeps"}


def _missing(name: str, error: ModuleNotFoundError) -> ImportError:
    """Return the exception for a public name that cannot be loaded because a library is missing."""
    library = (error.name or "").split(".")[0]
    # a fault of this package, or of the core
    if name not in _EXTRAS or library in ("", "veselova"):
        return error
    from veselova.mechanics.core.errors import BackendMissing, install_extra

    return BackendMissing(library, f"veselova.{name}", install_extra(_EXTRAS[name]))


def __dir__() -> list[str]:
    return list(__all__)
