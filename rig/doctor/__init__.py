"""``rig doctor``: what this machine and a rig's devices can do, measured; nothing moves.

A check is a function from a ``Subject`` and a clock to one ``Finding``. Checks run in a process of
their own (``worker``), watched by ``runner``: one that hangs or crashes becomes a row. What a
check reads (files, limits) and how it is judged are separate functions, so that the judgement
can be tried on machines that are not at hand.
"""
