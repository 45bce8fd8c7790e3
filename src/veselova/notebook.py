"""A motion in a notebook: the page of ``motion_page`` as a widget, whose time Python can set."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

from veselova.mechanics.core.errors import BackendMissing, InvalidInput, install_extra, show
from veselova.mechanics.core.exact_input import exact_number, plain
from veselova.mechanics.results.trajectory import Trajectory
from veselova.motion_page import page

__all__ = ["FRONT", "view"]

#: The heights of a widget, in pixels, that show something.
_HEIGHTS = (100, 10_000)

#: The part in the browser: the page in a frame, and both ways between its time and the widget's.
#: The frame has no origin, so that it shares no style, script or storage with the notebook.
FRONT = Path(__file__).with_suffix(".js").read_text("utf-8")


def view(trajectory: Trajectory, height: int) -> Any:
    """Return the widget that shows a motion; raises BackendMissing without anywidget or the bundle
    of the explorer, and InvalidInput for a height that shows nothing.
    """
    low, high = _HEIGHTS
    if isinstance(height, bool) or not isinstance(height, int) or not low <= height <= high:
        raise InvalidInput(("height",), f"a whole number from {low} to {high}", show(height))
    widget = _widget()
    first = repr(float(trajectory.times.min()))
    return widget(page=page(trajectory), title=trajectory.problem.title, height=height, t=first)


@lru_cache(maxsize=1)
def _widget() -> Any:
    """Return the class of the widget."""
    try:
        import anywidget
        import traitlets
    except ImportError:
        install = install_extra("notebook")
        raise BackendMissing("anywidget", "a motion in a notebook", install) from None

    class Time(traitlets.Unicode[Any, Any]):
        def validate(self, widget: Any, value: Any) -> str:
            """Return the text of a time, which may be given as a number."""
            exact_number(value, ("t",))
            return str(super().validate(widget, str(plain(value)).strip()))

    class Speed(traitlets.Float[Any, Any]):
        def validate(self, widget: Any, value: Any) -> float:
            """Return a finite speed."""
            return float(exact_number(value, ("speed",)))

    class MotionWidget(anywidget.AnyWidget):
        """A motion that plays; ``t``, ``speed`` and ``playing`` follow the page, and it them."""

        _esm = FRONT
        page = traitlets.Unicode().tag(sync=True)
        title = traitlets.Unicode().tag(sync=True)
        height = traitlets.Int().tag(sync=True)
        t = Time("0").tag(sync=True)
        speed = Speed(1.0).tag(sync=True)
        playing = traitlets.Bool(True).tag(sync=True)

    return MotionWidget
