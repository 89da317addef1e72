"""A walk that is planned one phase after the other, as in [Wang2020]."""
