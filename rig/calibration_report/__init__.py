"""The report of a calibration: pictures of what was seen and fitted, and one page around them.

Belongs here: figures and words about a finished calibration. Does not belong here: anything that
calculates a result, or that talks to a device.
"""
