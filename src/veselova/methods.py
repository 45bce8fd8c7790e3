"""The methods of problems and trajectories that need the parts above them, registered with the
first public name. Each part is loaded when it is needed.
"""

from __future__ import annotations

from typing import Any

from veselova.mechanics.core.upper import register

__all__ = ["register_methods"]


def _area_torus(body: Any) -> Any:
    from veselova.analytic.closed.area_veselova import area_torus

    return area_torus(body)


def _drift(ball: Any) -> Any:
    from veselova.analytic.closed.torus import drift

    return drift(ball)


def _view(motion: Any, height: int) -> Any:
    from veselova.notebook import view

    return view(motion, height)


def _write_page(motion: Any, target: Any) -> None:
    from veselova.motion_page import write_page

    write_page(motion, target)


def _read_problem(document: Any) -> Any:
    from veselova.mechanics.systems.catalogue import read_problem

    return read_problem(document)


def register_methods() -> None:
    """Register them."""
    register(area_torus=_area_torus, drift=_drift, read_problem=_read_problem)
    register(view=_view, write_page=_write_page)
