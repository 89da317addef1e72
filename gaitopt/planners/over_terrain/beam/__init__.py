"""Parts of the beam search: which footholds it tries, and how it ended."""
