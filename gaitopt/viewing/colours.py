"""Colours that figures and replays share."""

LEG_COLOURS: dict[str, str] = {
    "RH": "#18b877",
    "RF": "#2f60d9",
    "LH": "#e8be1b",
    "LF": "#b81c16",
}
"""RH green, RF blue, LH yellow, LF red, as the columns in Fig. 3 of [Wang2020].

Their lightness differs, so that colour-blind readers can tell them apart, too: whether all cones
are there or one kind of them is missing [Machado2009], any two of them, and each of them and the
background, differ by more than 30 in CIELAB (Delta E of 1976; 2.3 is just noticed)."""

LEG_WORDS: dict[str, str] = {
    "RH": "right hind leg",
    "RF": "right front leg",
    "LH": "left hind leg",
    "LF": "left front leg",
}
"""The legs in words."""

BACKGROUND = "#ecf0f4"
"""Background of replays."""

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
