"""The mathematics: image -> features -> state -> motion; arrays in, arrays out.

Belongs here: pure functions and small classes on arrays. Does not belong here: files, clocks,
devices, configuration, threads. Imports none of the other three packages, nor ``time``.
"""
