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
