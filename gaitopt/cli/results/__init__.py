"""What commands write and say: the folder of a run, its report and its verdict."""
