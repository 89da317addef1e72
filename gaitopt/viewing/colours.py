"""The colours of the legs, shared by the figures and the replay."""

# RH green, RF blue, LH yellow, LF red, as the columns in Fig. 3 of the paper
# (000_6dacb41600db6a3c.txt), in shades of clearly different lightness so that red and green
# stay apart for colour-blind readers.
LEG_COLOURS: dict[str, str] = {
    "RH": "#2e9e5b",
    "RF": "#2f6fde",
    "LH": "#e3b505",
    "LF": "#d1383d",
}
