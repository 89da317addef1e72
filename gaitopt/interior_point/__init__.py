"""An interior-point method for problems of inequalities with banded matrices; knows no robot.

``problem`` says what a problem must offer, ``solver`` has ``minimise`` and its
``Solution``, and ``status`` the ways in which it may end. Inside, an ``iterate`` is
moved by ``line_search`` along the steps of ``newton``. ``band`` helps problems to build their
banded matrices.
"""
