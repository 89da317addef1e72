"""What gaitopt's speed and memory are, measured by one command: ``python -m benchmarks``.

Importing this package holds the linear algebra libraries to one thread: they read these variables
when NumPy loads, and everything here is measured on one core.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"
