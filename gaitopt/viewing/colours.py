"""Colours that figures and replays share."""

LEG_COLOURS: dict[str, str] = {
    "RH": "#2e9e5b",
    "RF": "#2f6fde",
    "LH": "#e3b505",
    "LF": "#d1383d",
}
"""RH green, RF blue, LH yellow, LF red, as the columns in Fig. 3 of [Wang2020]. The green is bluish
and lighter than the red, so that most colour-blind readers can tell them apart; figures also write
the names of the legs."""

HELD = "#7b3294"
"""Colour of where contact forces hold the robot."""

FOOTING_COLOURS: dict[str, str] = {
    "steppable": "#7fb89a",
    "off the map": "#b9bec5",
    "unknown": "#5d6875",
    "in a pit": "#7a5195",
    "too near an edge": "#e8a33d",
    "too steep": "#d45d79",
    "too rough": "#8c6d46",
}
"""Colours of places where a foot may stand, and of those where it may not, by
:class:`gaitopt.Footing`."""
