"""An interior-point method for problems of inequalities with banded matrices; knows no robot."""
