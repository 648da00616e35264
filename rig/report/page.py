"""``report.html``: one page that needs no other file and no network."""

import json
from collections.abc import Sequence
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from string import Template

from rig.report.figures import figures
from rig.report.sections import cards, details, images, summary_table
from rig.report.shown import Shown
from rig.report.texts import escape
from rig.report.title import title


def page(runs: Sequence[Shown]) -> str:
    """The whole page."""
    template = Template((files("rig.report") / "page.html").read_text(encoding="utf-8"))
    return template.substitute(
        title=escape(title(runs)),
        cards=cards(runs),
        stills=images(runs),
        summary=summary_table(runs),
        details=details(runs),
        figures=_script_json(figures(runs)),
        plotly=_plotly_js(),
    )


def _script_json(value: object) -> str:
    """JSON that may stand inside a script element."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    return text.replace("<", "\\u003c")


def _plotly_js() -> str:
    """plotly.js as the plotly package brings it, 4.8 MB.

    The package has no smaller bundle, and 3D needs most of it. It is found without importing
    plotly, which would take longer than everything else here.
    """
    spec = find_spec("plotly")
    assert spec is not None and spec.origin is not None  # a dependency of this package
    bundle = Path(spec.origin).parent / "package_data" / "plotly.min.js"
    return bundle.read_text(encoding="utf-8")
