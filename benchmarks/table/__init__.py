"""The parts of the table that ``python -m benchmarks`` prints."""
