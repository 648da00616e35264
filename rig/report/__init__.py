"""What a past run looks like: one HTML page that needs nothing else, and a PNG of its panels."""

from rig.report.write import write_reports

__all__ = ["write_reports"]
