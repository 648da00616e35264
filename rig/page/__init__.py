"""The live page: a run watched, and stopped, from any browser.

``LivePage`` (live.py) is the control loop's end: it writes into shared memory and waits for
nobody. The page itself is served by a process of its own (child.py) with viser, which only that
process imports. ``rig view`` shows a past run on the same page (recorded.py).
"""
