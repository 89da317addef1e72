"""The fastest statically stable walk over given footholds, all steps in one optimisation problem.

The problem
===========

The robot, its footholds, the order of its legs and the stability margin are given. Each step has a
stance phase, in which four feet stand, and a swing, in which one of them flies. Each phase is
divided into a few intervals of time.

Unknowns
    At each *knot*, where two intervals meet, the robot has a pose of nine numbers: the body centre,
    roll, pitch and yaw of the body, and the place of the flying foot. Between two knots there is a
    time. Standing feet stay on their footholds, so a pose determines all joint angles. The unknowns
    are the times, and those entries of the poses that the settings set free (``settings.free``).
Objective
    The sum of all times; and a small quadratic term, by which neighbouring times are alike.
Inequalities
    Joint velocities between two knots, joint positions and reach at a knot; the body centre (or
    the true centre of mass, or the zero moment point) keeps its margin inside the support polygon;
    flying feet keep their clearance, and their swing height in the middle; legs keep apart.

The interior-point method of :mod:`gaitopt.interior_point` solves it; derivatives are those of
:mod:`gaitopt.optimize.route`. What a problem cannot see are the instants between its knots. So the
motion through a solution is measured there, inequalities become stricter where something is
missing, and the problem is solved again.

Two kinds of walks
==================

A *straight walk* (``straight/``) moves its body along straight lines between knots. It has no
acceleration limits; or it flies box swings, and stops at each of their corners. A *smooth walk*
(``smooth/``) has bounded joint accelerations. Its poses at knots are control points of quadratic
B-splines. In a *dynamic* walk, the fastest kind of smooth walks, the zero moment point keeps the
margin in place of the body centre.

Words
=====

route
    A whole walk that is planned as one problem; :class:`~gaitopt.planners.time_optimal.walk.Route`
    also stands for a part of its steps.
stance phase, swing
    The two phases of a step: all feet stand; one foot flies.
lift-off, touchdown
    Begin and end of a swing: the knots at which the foot stands for the last time and again for
    the first time. At the knots between them it is in the air.
knot
    An instant for which the problem has a pose. In a smooth walk the pose is a control point.
interval
    The time between two neighbouring knots. Interval ``k`` lies between the knots ``k`` and
    ``k + 1``.
span
    In smooth walks: the time on which the motion of one knot is a single parabola. It lies about
    the knot: half of it before, half of it after. An interval goes from the middle of one span to
    the middle of the next.
row
    One inequality of the problem. Most look at one knot, those of joint velocities at two.
side
    One side of a support polygon, as a half-plane with a normal that points inward.
round
    Solving the problem, measuring the motion between knots, and making rows stricter.
reserve
    A small amount that rows ask for beyond what is promised, so that the motion between knots
    keeps the promise.
window
    Some neighbouring steps that are planned as one problem of their own.
dense path
    A straight walk on so dense a grid of knots that standing feet hardly slip in between.
stretch
    A factor by which a finished motion takes longer, so that its joints keep their limits.

In shapes ``K`` is the number of knots, ``S`` of steps, ``M`` of rows, and ``N`` of anything else.

The files, in the order in which to read them
=============================================

1. ``walk`` (what is known before: steps, and the body's targets phase by phase), ``knots``,
   ``support`` (sides of support polygons), ``flights``;
2. ``guess``, ``balance`` (the true centre of mass), ``build`` (unknowns and rows), ``collision``
   (rows that keep legs apart), ``failure``;
3. ``straight/``: ``dense``, ``densify`` (from poses to a dense path), ``clearance``, ``solve`` (its
   rounds and windows), ``phases``, ``planner``; then ``foothold_motion`` and ``stops``;
4. ``smooth/``: ``motion`` (the spline), ``build``, ``window``, ``between`` (limits in rows),
   ``clearance``, ``rounds``, ``guess``, ``windows``, ``phases``, ``planner``;
5. ``planner`` (:func:`gaitopt.plan_route`), ``bound`` (how fast any such walk could be).

How a plan comes about
======================

:func:`gaitopt.plan_route` checks its settings and, for each order of legs to be tried, makes a
``Route``, with the targets of the body centre of the walk planned phase by phase. ``build_route``
turns it into knots and a problem. A straight walk is solved in rounds, as a whole or in windows.
The poses of the last solution become a dense path, each piece of which takes exactly the time that
its joints need. A smooth walk begins from a rough straight one. Its rounds end with a motion whose
joints keep their limits at every instant. Both end with a :class:`gaitopt.Plan`.
"""
