"""From images to measurements: in the control loop's thread, another thread, or another process.

``Sighting`` and ``Vision`` (sighting.py) are what the rest of the application knows. Which of the
three does the work is chosen by ``rig/build.py``.
"""

from rig.vision.sighting import Sighting, Vision

__all__ = ["Sighting", "Vision"]
