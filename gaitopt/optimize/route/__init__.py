"""The time-optimal walk as a problem of inequalities, for :mod:`gaitopt.interior_point`.

``legs`` and ``centre_of_mass`` have the kinematics with derivatives. ``layout``, ``derivatives``
and ``problem`` are the walk without acceleration limits: its data and numbering, the derivatives of
its rows, and the problem itself. ``dynamic_layout``, ``dynamic_derivatives`` and
``dynamic_problem`` are the same for the walk with acceleration limits; ``place_blocks`` has their
second-order matrices. The words that all of them use stand at the top of ``layout``.
"""
