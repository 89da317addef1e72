"""Walks phase by phase whose order of legs is searched for.

:mod:`.steps` plans single steps, :mod:`.search` finds an order, and :mod:`.planner` plans the walk.
"""
