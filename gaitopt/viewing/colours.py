"""The colours of the legs, shared by the figures and the replay."""

# RH green, RF blue, LH yellow, LF red, as the columns in Fig. 3 of the paper
# ([Wang2020]). The green is bluish and lighter than the red, which keeps the two
# apart for most colour-blind readers; figures name the legs beside the colour all the same.
LEG_COLOURS: dict[str, str] = {
    "RH": "#2e9e5b",
    "RF": "#2f6fde",
    "LH": "#e3b505",
    "LF": "#d1383d",
}
