"""What work costs that is not in the table: processor times, and frames of a replay."""
