"""``rig measure``: the features of a target in image files."""

from rig.measure import measure

__all__ = ["measure"]
